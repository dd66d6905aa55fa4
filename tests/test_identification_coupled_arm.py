"""Two axes coupled by a mass matrix: their parameters from torques and motion, by closed-form logs."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

import lostmotion as lm
from conftest import ROOT

EXAMPLE = ROOT / "examples" / "coupled_arm"
TRUTH = {"a": 1.1, "b": 0.24, "c": 0.16, "shoulder_damping": 0.4, "shoulder_friction": 0.9, "elbow_damping": 0.12, "elbow_friction": 0.35}
NOISE = (0.02, 0.01)  # N m


def motion(time: np.ndarray, frequencies: tuple[float, ...], phases: tuple[float, ...]) -> np.ndarray:
    """Angle, speed and acceleration of a sum of sines."""
    w = 2.0 * np.pi * np.array(frequencies)[:, None]
    angle = w * time + np.array(phases)[:, None]
    A = np.array([0.06, 0.04, 0.02])[:, None]
    return np.array([np.sum(x, axis=0) for x in (A * np.sin(angle), A * w * np.cos(angle), -A * w**2 * np.sin(angle))])


def write_logs(directory: Path, *, couples: bool = True, poses: Sequence[float] = (0.0, 0.8, 1.6, 2.4)) -> None:
    """Torques of the equations of the arm, written down by themselves: M(pose) q'' + d q' + f sgn q'."""
    t = TRUTH
    draw = np.random.default_rng(3)
    time = np.arange(0.0, 3.0, 2e-3)
    directory.mkdir()
    for k, pose in enumerate(poses):
        shoulder = motion(time, (0.5, 1.1, 2.3), (0.1 * k, 1.0, 2.0))
        elbow = motion(time, (0.7, 1.3, 1.9), (1.0, 0.5 * k, 0.3))
        coupling = (t["c"] + t["b"] * np.cos(pose)) if couples else 0.0
        torques = ((t["a"] + 2.0 * t["b"] * np.cos(pose)) * shoulder[2] + coupling * elbow[2], t["c"] * elbow[2] + coupling * shoulder[2])
        rows = [time, shoulder[0], elbow[0]]
        for name, q, torque, noise in zip(("shoulder", "elbow"), (shoulder, elbow), torques, NOISE, strict=True):
            friction = t[f"{name}_damping"] * q[1] + t[f"{name}_friction"] * np.sign(q[1])
            rows.append(torque + friction + draw.normal(size=len(time)) * noise)
        heading = "t [s],shoulder [rad],elbow [rad],shoulder_torque [N*m],elbow_torque [N*m]"
        table = "\n".join(",".join(f"{x:.12g}" for x in row) for row in np.array(rows).T)
        (directory / f"pose{k}.csv").write_text(f"# pose = {pose}\n{heading}\n{table}\n", encoding="utf-8")


def task_in(directory: Path) -> Path:
    """The example, with a short smoothing: the angles of these logs have no noise."""
    for name in ("arm.toml", "identify.toml"):
        text = (EXAMPLE / name).read_text(encoding="utf-8").replace('"20 ms"', '"12 ms"')
        (directory / name).write_text(text, encoding="utf-8")
    return directory / "identify.toml"


def test_the_mass_matrix_of_two_coupled_axes_is_found(tmp_path: Path) -> None:
    write_logs(tmp_path / "logs")
    result = lm.identify(task_in(tmp_path))
    for name, value in TRUTH.items():
        interval = result.intervals[name]
        assert interval.low <= value <= interval.high, name
        assert result.values[name] == pytest.approx(value, rel=0.02), name
    assert result.values["a"] == pytest.approx(TRUTH["a"], rel=2e-3)
    matrix = result.scenario.mass_matrices["arm"].matrix
    assert matrix[0][1] == matrix[1][0]


def test_axes_that_are_not_coupled_have_residuals_that_say_so(tmp_path: Path) -> None:
    """Without the coupling in the logs the model of the example fits badly, and that is flagged."""
    write_logs(tmp_path / "logs", couples=False, poses=(0.0, 1.6))
    assert "structured residuals" in str(lm.identify(task_in(tmp_path)))
