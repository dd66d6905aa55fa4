"""Present values against limits, and what too few logs leave undecided: logs by a closed form, and series of known level."""

import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import lostmotion as lm
from dry_friction import RIG, TASK, WEAR, angles, wear_logs, write_log
from lostmotion.cli.entry import app
from lostmotion.identification.monitor.change_detection import find_change

MONITOR = """
[parameters]
viscous = { start = 0.02, max = 1.0 }
coulomb = { start = 0.1, max = 2.0 }
[monitor]
baseline = 5
[monitor.watch.coulomb]
max = 0.15
"""
NOISE = 1e-3


def friction_logs(directory: Path, worn: int, *, baseline: int = 5, deviation: str = "", noise: float = NOISE, spoil: float = 1.0) -> Path:
    """Logs with a dry friction of 0.1 N·m, then of 0.2 N·m, each with a scatter of 0.002 N·m; returns the identification file.

    Parameters
    ----------
    spoil
        Factor on the angle of the worn logs, which no friction explains.
    """
    (directory / "rig.toml").write_text(RIG)
    time = np.arange(400) / 200
    for k in range(baseline + worn):
        draw = np.random.default_rng(k)
        coulomb = (0.1 if k < baseline else 0.2) + 0.002 * draw.standard_normal()
        torque = 0.5 * np.sin(7 * time + k) + 0.25 * np.sin(20 * time + 2 * k)
        angle = angles(torque, 5e-3, coulomb=coulomb) * (1.0 if k < baseline else spoil)
        write_log(directory / f"l{k:02d}.csv", time, torque, angle + noise * draw.standard_normal(len(time)))
    task = TASK.replace('variable = "c_angle"', f'variable = "c_angle"\n{deviation}')
    (directory / "m.toml").write_text(task + MONITOR.replace("baseline = 5", f"baseline = {baseline}"))
    return directory / "m.toml"


def test_without_a_deviation_the_noise_is_that_of_the_baseline(tmp_path: Path) -> None:
    found = lm.monitor(friction_logs(tmp_path, 3))
    value, unit = found.noise["position"]
    assert value == pytest.approx(NOISE, rel=0.05) and unit == "rad"
    assert all(e.residual == pytest.approx(1.0, abs=0.2) and not e.why for e in found.logs)
    assert any("estimated from the residuals of the baseline" in line for line in found.lines())
    given = lm.monitor(friction_logs(tmp_path, 3, deviation=f"deviation = {NOISE}"))
    assert not given.noise
    for a, b in zip(found.logs, given.logs, strict=True):
        assert a.values["coulomb"] == pytest.approx(b.values["coulomb"], rel=1e-3)


@pytest.mark.parametrize("baseline", [5, 8])
def test_a_doubled_friction_is_never_within_its_limit(tmp_path: Path, baseline: int) -> None:
    """The limit is 0.15 N·m, and the logs after the baseline have 0.2: one is no proof, two in a row are."""
    for worn in (1, 2, 4):
        found = lm.monitor(friction_logs(tmp_path, worn, baseline=baseline)).watched["coulomb"]
        assert found.level is not None
        assert found.now == pytest.approx(0.2, rel=0.05)
        assert 0.15 < found.level.low < 0.2 < found.level.high
        assert found.beyond is (None if worn == 1 else True)
        assert "within the largest" not in found.text


def test_a_watch_of_one_direction_says_which_change_it_has_not_seen(tmp_path: Path) -> None:
    """The friction doubles, which a watch of falls does not look for: it has changed, but not fallen."""
    task = friction_logs(tmp_path, 4, baseline=8)
    task.write_text(task.read_text().replace("max = 0.15", 'direction = "down"'))
    found = lm.monitor(task)
    assert found.verdict.state == "fits"
    assert "no fall" in found.watched["coulomb"].text and "no change" not in found.watched["coulomb"].text
    assert found.verdict.lines == ("no watched value has changed in a direction that is watched",)


def test_few_logs_do_not_decide_on_a_change_and_say_how_many_would(tmp_path: Path) -> None:
    found = lm.monitor(friction_logs(tmp_path, 3)).watched["coulomb"]
    assert found.change is not None
    assert found.change.alarm is None and math.isinf(found.change.detectable)
    assert "not decided whether changed: 3 logs after the baseline determine it, 5 are needed" in found.text
    seen = lm.monitor(friction_logs(tmp_path, 5)).watched["coulomb"]
    assert seen.change is not None and seen.change.alarm is not None


@pytest.mark.parametrize(("worn", "spoil", "code", "words"), [
    (0, 1.0, 3, "not decided: coulomb: there is no log after the baseline"),
    (3, 1.7, 3, "not decided: coulomb: none of the 3 logs after the baseline determines it; l05.csv: resid"),
    (4, 1.0, 1, "does not fit: coulomb: changed since l05.csv"),
])  # fmt: skip
def test_the_command_ends_with_the_code_of_its_verdict(tmp_path: Path, worn: int, spoil: float, code: int, words: str) -> None:
    path = friction_logs(tmp_path, worn, spoil=spoil)
    run = CliRunner().invoke(app, ["monitor", str(path)])
    assert run.exit_code == code, run.output
    assert words in run.output
    assert "no change" not in run.output
    assert lm.monitor(path).verdict.exit_code == code


def test_the_interval_of_the_present_value_holds_the_level(draws: int = 150) -> None:
    """Series that stay, step or drift, at any place: 95 % intervals miss 7.5 of 150, and 18 is four standard deviations above."""
    draw = np.random.default_rng(7)
    missed = 0
    for _ in range(draws):
        n, kind = int(draw.integers(8, 30)), draw.integers(3)
        level = np.zeros(n)
        begin = int(draw.integers(6, n - 1))
        size = 8.0 * draw.standard_normal()
        level[begin:] = (0.0, size, size)[kind]
        if kind == 2:
            level[begin:] *= np.minimum(np.arange(1, n - begin + 1) / 30, 1.0)
        found = find_change(level + draw.standard_normal(n), np.ones(n), np.zeros((n, 0)), 6)
        missed += not found.present[0].low <= level[-1] <= found.present[0].high
    assert missed <= 18


@pytest.mark.parametrize(("baseline", "more"), [(5, 6), (20, 10)])
def test_the_step_that_would_have_been_found_is_found(baseline: int, more: int, draws: int = 100) -> None:
    """With 90 % at least: of 100 series 82 or more (2.7 standard deviations)."""
    draw, n = np.random.default_rng(3), baseline + more

    def change(x: np.ndarray) -> lm.identification.Change:
        return find_change(x, np.ones(n), np.zeros((n, 0)), baseline)

    quiet = change(1e-6 * draw.standard_normal(n))
    step = np.where(np.arange(n) >= baseline, quiet.detectable / quiet.deviation, 0.0)
    assert sum(change(step + draw.standard_normal(n)).alarm is not None for _ in range(draws)) >= 82


def test_the_example_finds_the_wear_that_its_logs_have(tmp_path: Path) -> None:
    wear_logs(tmp_path)
    for path in tmp_path.iterdir():
        assert path.read_bytes() == (WEAR / path.name).read_bytes(), path.name
    found = lm.monitor(WEAR.parent / "monitor.toml")
    friction = found.watched["friction"]
    assert [w.name for w in found.alarms] == ["friction"]
    assert friction.begins == 12
    assert friction.level is not None and friction.level.low < 0.125 < friction.level.high
    assert friction.before == pytest.approx(0.1, rel=0.02)
    healthy = lm.monitor(WEAR.parent / "monitor.toml", sorted(WEAR.glob("*.csv"))[:12])
    assert healthy.verdict.state == "fits"
