"""FMUs whose importer gives the motion of a shaft: position, speed and acceleration in, torque out, against closed forms."""

import math
import sys
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import lostmotion as lm
from lostmotion.cli import app
from refusals import refused
from test_fmu import Slave

fmpy: Any = pytest.importorskip("fmpy", reason="FMPy is missing: .venv/bin/pip install --group portable")
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="FMPy runs the library for this platform, tests know Linux alone")

J, K, W = 0.5, 200.0, 10.0  # crank, spring, resonance of a load of 2 kg m2
NAMES = ("crank_given_angle", "crank_given_speed", "crank_given_acceleration")


def crank() -> lm.Scenario:
    """A crank and a load of 2 kg m2 on a spring."""
    return lm.Scenario(
        shafts={"crank": {"inertia": J}, "load": {"inertia": 2.0}},
        gears={"g": {"input": "crank", "output": "load", "ratio": 1.0, "stiffness": {"kind": "linear", "stiffness": K}}},
        simulation={"duration": 2.0, "sample_interval": 0.01},
    )


def validate_fmu(path: str) -> list[str]:
    from fmpy.validation import validate_fmu as found

    return list(found(path))


def slave(tmp_path: Path, scenario: lm.Scenario, *shafts: str, fmi: int = 2) -> Slave:
    lm.export_fmu(scenario, tmp_path / "drive.fmu", motion_inputs=shafts, fmi=fmi)
    assert validate_fmu(str(tmp_path / "drive.fmu")) == []
    return Slave(tmp_path / "drive.fmu", tmp_path / "unzipped")


def cubic(t: float) -> tuple[float, float, float]:
    """Angle t^3, and its derivatives."""
    return t**3, 3.0 * t**2, 6.0 * t


def check(fmu: Slave, t: float, accuracy: float) -> None:
    """The load is at x'' = W^2 (t^3 - x); the torque is J 6 t + K (t^3 - x)."""
    load = t**3 - 6.0 * t / W**2 + 6.0 * math.sin(W * t) / W**3
    values = fmu.read()
    assert values["crank_speed"] == pytest.approx(3.0 * t**2, abs=accuracy)
    assert values["load_angle"] == pytest.approx(load, abs=accuracy)
    assert values["load_angle"] + values["g_twist"] == pytest.approx(t**3, abs=accuracy)
    assert values["crank_drive_torque"] == pytest.approx(J * 6.0 * t + K * (t**3 - load), abs=300.0 * accuracy)


def test_a_motion_with_its_derivatives_is_met_at_every_communication_point(tmp_path: Path) -> None:
    fmu = slave(tmp_path, crank(), "crank")
    for k in range(40):
        a, b = cubic(0.05 * k), cubic(0.05 * (k + 1))
        fmu.step(0.05, **{name: (a[n], b[n]) for n, name in enumerate(NAMES)})
        check(fmu, 0.05 * (k + 1), 2e-13)


def test_inputs_that_are_held_lag_by_what_they_leave_open(tmp_path: Path) -> None:
    """Speed and acceleration tell the end of a step up to the third derivative, 6 rad/s^3: h^3 of angle, 3 h^2 of speed. The next
    step corrects that, so that it does not add up."""
    fmu, h = slave(tmp_path, crank(), "crank"), 1e-3
    for k in range(1000):
        fmu.step(h, **{name: (value, value) for name, value in zip(NAMES, cubic(h * k), strict=True)})
    values = fmu.read()
    assert values["load_angle"] + values["g_twist"] == pytest.approx(1.0 - h**3, abs=1e-12)
    assert values["crank_speed"] == pytest.approx(3.0 - 3.0 * h**2, abs=1e-12)
    assert values["crank_acceleration"] == pytest.approx(6.0 - 6.0 * h, abs=1e-8)


def test_a_position_that_disagrees_is_corrected_within_a_step_without_a_jump(tmp_path: Path) -> None:
    """The shaft stands at 0 and is given 1 mrad: it is there at the end of the step, and at rest; the twist has not jumped."""
    fmu, h = slave(tmp_path, crank(), "crank"), 0.01
    fmu.step(h, **dict.fromkeys(NAMES, (0.0, 0.0)))
    fmu.step(h, **dict(zip(NAMES, ((1e-3, 1e-3), (0.0, 0.0), (0.0, 0.0)), strict=True)))
    values = fmu.read()
    assert values["load_angle"] + values["g_twist"] == pytest.approx(1e-3, abs=1e-17)
    assert values["crank_speed"] == pytest.approx(0.0, abs=1e-15)
    # The load has been pulled by about K 1e-3 rad/2 for h: 0.2 N m/2 0.01 s/2 kg m2.
    assert 1e-4 < values["load_speed"] < 9e-4


def test_until_it_is_set_a_shaft_goes_on_with_its_speed_at_the_start(tmp_path: Path) -> None:
    start = crank().replace(**{"initial.speeds": {"crank": 2.0, "load": 2.0}, "initial.angles": {"load": 0.3}})
    fmu = slave(tmp_path, start, "crank")
    angle, speed, _ = fmu.fmu.getReal([fmu.reference[name] for name in NAMES])
    assert (angle, speed) == (0.3, 2.0)
    fmu.step(0.5)
    assert fmu.read()["crank_speed"] == 2.0
    assert fmu.read()["crank_drive_torque"] == pytest.approx(0.0, abs=1e-12)
    # The speed alone is set: the angle is what it is, and the acceleration 0.
    fmu.step(0.1, crank_given_speed=(2.0, 2.0))
    assert fmu.read()["crank_speed"] == pytest.approx(2.0, rel=1e-13)


def test_the_state_of_a_given_motion_goes_back(tmp_path: Path) -> None:
    fmu = slave(tmp_path, crank(), "crank")
    steps = [{name: (a, b) for name, a, b in zip(NAMES, cubic(0.1 * k), cubic(0.1 * k + 0.1), strict=True)} for k in range(6)]
    for inputs in steps[:3]:
        fmu.step(0.1, **inputs)
    kept, time = fmu.fmu.getFMUState(), fmu.time
    for inputs in steps[3:]:
        fmu.step(0.1, **inputs)
    values = fmu.read()
    fmu.fmu.setFMUState(kept)
    fmu.time = time
    for inputs in steps[3:]:
        fmu.step(0.1, **inputs)
    assert fmu.read() == values


def test_a_slide_takes_metres_and_gives_newtons(tmp_path: Path) -> None:
    s = lm.Scenario(
        shafts={},
        slides={"table": {"mass": "3 kg"}},
        simulation={"duration": 1.0, "sample_interval": 0.01},
        linear_motors={"motor": {"slide": "table", "rated_force": 10.0}},
    )
    lm.export_fmu(s, tmp_path / "drive.fmu", motion_inputs=["table"], fmi=3)
    assert validate_fmu(str(tmp_path / "drive.fmu")) == []
    described = fmpy.read_model_description(str(tmp_path / "drive.fmu"))
    units = {v.name: v.unit for v in described.modelVariables}
    assert units["table_given_position"] == "m"
    assert units["table_given_speed"] == "m/s"
    assert units["table_given_acceleration"] == "m/s^2"
    assert units["table_drive_force"] == "N"
    assert not any(unit and ("rad" in unit or "N*m" in unit) for unit in units.values())
    fmu = slave(tmp_path, s, "table")
    names = [name.replace("crank", "table").replace("angle", "position") for name in NAMES]
    fmu.step(0.1, **dict(zip(names, ((0.0, 1e-3), (0.0, 0.03), (0.0, 0.6)), strict=True)), motor_command=(0.0, 0.0))
    assert fmu.read()["table_drive_force"] == pytest.approx(1.8, rel=1e-12)
    assert fmu.read()["table_position"] == pytest.approx(1e-3, rel=1e-12)


def test_a_drive_in_the_short_form_is_moved_at_its_load(tmp_path: Path) -> None:
    fmu = slave(tmp_path, lm.load("paper-1dof-l-small"), "load")
    assert "load_drive_torque" in fmu.names
    assert not fmpy.read_model_description(str(tmp_path / "drive.fmu")).modelExchange


def test_the_command_line_exports_it_and_refuses_what_is_no_shaft(tmp_path: Path) -> None:
    run = CliRunner().invoke(app, ["fmu", "given-motion", "-o", str(tmp_path / "f.fmu"), "--motion-inputs", "crank"])
    assert run.exit_code == 0, run.output
    assert "Input crank_given_angle replaces shafts.crank.speed" in run.output
    assert 'motion_inputs: "cranc" is no shaft' in refused(lambda: lm.export_fmu(crank(), tmp_path / "f.fmu", motion_inputs=["cranc"]))
