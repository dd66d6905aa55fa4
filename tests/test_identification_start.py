"""Where a search begins: start values by regression of inverse dynamics, and windows that become longer."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identification_logs import SERVO, TRUTH, read_all, servo_plans, servo_task, write_servo_logs
from lostmotion.identification.fit.start_values import regressed
from lostmotion.identification.identify import identify_logs
from lostmotion.identification.preparation.prepare import prepared
from lostmotion.identification.prepared_log import Prepared
from lostmotion.identification.readers.log import Channel, Log
from lostmotion.identification.rig.measured_motion import windows
from lostmotion.identification.rig.residuals import Engine, ParameterPoint, start_point
from lostmotion.identification.rig.rig_scenario import Rig
from lostmotion.identification.task.identification_file import Identification, free_on
from lostmotion.identification.virtual_logs import virtual_log
from refusals import refused

AXIS = """
shafts = { rotor = { torque = { mean = 0.0 } }, arm = { inertia = 0.02 } }
motors.drive = { shaft = "rotor", kind = "torque_source", rated_torque = 1.0, rotor_inertia = 1e-4 }
gears.belt = { input = "rotor", output = "arm", ratio = 5 }
gravity.weight = { shaft = "arm", mass = 1.0, radius = 0.1 }
simulation = { duration = "1 s", sample_interval = "1 ms" }
"""
DC = {"shaft": "rotor", "kind": "dc", "rotor_inertia": 1e-4, "rated_torque": 1.0, "rated_speed": 300.0, "rated_voltage": 24.0}
DC |= {"electrical_time_constant": 1e-3, "armature_voltage_constant": 5.0}
NOISE = 1e-4  # rad
VALUES = {"inertia": 0.03, "viscous": 0.02, "coulomb": 0.15, "weight": 0.8, "offset": 0.02, "radius": 0.1}
SWING = VALUES | {"coulomb": 0.01, "viscous": 0.004, "offset": 0.0}


def axis_rig(directory: Path, starts: dict[str, float], **fit: Any) -> Rig:
    """An arm behind a belt, torque and arm angle recorded."""
    (directory / "axis.toml").write_text(AXIS)
    task = Identification(
        scenario="axis.toml",
        logs={"files": ["*.csv"]},
        inputs={"drive_command": {"channel": "torque", "interpolation": "linear"}},
        measured={"angle": {"channel": "angle", "variable": "arm_angle"}},
        set={"shafts.arm.inertia": "inertia", "shafts.arm.viscous_friction": "viscous", "shafts.arm.friction_torque": "coulomb"}
        | {"shafts.rotor.torque": "offset", "gravity.weight.mass": "weight", "gravity.weight.radius": "radius"}
        | {"initial.angles.arm": "first_angle"},
        parameters={
            name: {"start": start, "min": -1.0 if name == "offset" else 1e-4, "max": 20.0, "fixed": name == "radius"}
            | ({"scale": 0.05} if name == "offset" else {})
            for name, start in {"radius": 0.1, **starts}.items()
        },
        fit={"iterations": 20, **fit},
    )
    return Rig(task, directory)


def axis_logs(rig: Rig, values: dict[str, float]) -> list[Prepared]:
    """Two driven motions of 3 s."""
    time = np.arange(0.0, 3.0, 1e-3)
    torques = [0.4 * (np.sin((4.0 + k) * time) + 0.6 * np.sin(11.0 * time + k)) for k in range(2)]
    return [axis_log(rig, values, time, torque, 0.0, k) for k, torque in enumerate(torques)]


def free_swings(rig: Rig, values: dict[str, float]) -> list[Prepared]:
    """Two of 5 s, some seven periods, without a torque."""
    time = np.arange(0.0, 5.0, 2e-3)
    return [axis_log(rig, values, time, np.zeros(len(time)), 1.0 + 0.5 * k, k) for k in range(2)]


def axis_log(rig: Rig, values: dict[str, float], time: np.ndarray, torque: np.ndarray, begin: float, seed: int) -> Prepared:
    plan = Log(f"{seed}", time, {"torque": Channel(torque), "angle": Channel(np.full(len(time), begin))})
    return prepared(rig.task, virtual_log(rig, plan, values, noise={"angle": NOISE}, seed=seed), rig.units)


@pytest.mark.parametrize("factor", [10.0, 0.1])
def test_starts_ten_times_off_become_near_by_regression(tmp_path: Path, factor: float) -> None:
    starts = {name: factor * VALUES[name] for name in ("inertia", "viscous", "coulomb", "weight")} | {"offset": 0.0}
    rig = axis_rig(tmp_path, starts)
    result = identify_logs(rig, axis_logs(rig, VALUES), threads=1)
    assert set(result.start.found) == {*starts} and not result.start.kept
    for name in starts:
        # The filter takes some of the fastest motion; as starts, values within 5 % are near.
        assert result.start.found[name] == pytest.approx(VALUES[name], rel=0.05)
        assert result.values[name] == pytest.approx(VALUES[name], rel=0.01)
    assert result.error()[1] < 1.05 * NOISE
    assert "in place of" in str(result)


def test_parameters_of_which_the_torques_are_no_sum_keep_their_starts(tmp_path: Path) -> None:
    """Of mass and radius of the weight the first in the file enters linearly, and then the second does not."""
    starts = {name: 3.0 * VALUES[name] for name in ("weight", "radius")} | {"inertia": 0.03, "coulomb": 0.15, "viscous": 0.02}
    rig = axis_rig(tmp_path, {**starts, "offset": 0.02})
    data = rig.task.model_dump()
    data["set"]["gravity.weight.radius"] = "radius"
    data["parameters"]["radius"]["fixed"] = False
    data["parameters"]["inertia"] |= {"tolerance": 0.1}
    data["parameters"]["coulomb"] |= {"max": 0.151, "start": 0.149, "min": 0.148}
    rig = Rig(Identification(**data), tmp_path)
    logs = axis_logs(rig, VALUES | {"coulomb": 0.3})
    point, start = regressed(Engine(rig, threads=1), logs, start_point(rig.task, logs), free_on(rig.task, 0))
    assert "prior" in start.kept["inertia"]
    assert "their product with radius" in start.kept["weight"]  # `radius`, of the two the first in the file, is found
    assert "out of its bounds" in start.kept["coulomb"]
    assert point.values["inertia"] == starts["inertia"] and point.values["coulomb"] == 0.149
    assert set(start.found) == {"radius", "viscous", "offset"}
    assert start.found["radius"] == pytest.approx(VALUES["weight"] * VALUES["radius"] / starts["weight"], rel=0.05)


def test_a_weight_is_linear_however_many_straight_lines_its_torque_has(tmp_path: Path) -> None:
    """With a fixed error of the straight lines their number grows with the weight."""
    rig = axis_rig(tmp_path, {**{k: v for k, v in VALUES.items() if k != "radius"}, "weight": 2.0})
    data = rig.task.model_dump()
    data["set"]["gravity.weight.error"] = 0.005
    rig = Rig(Identification(**data), tmp_path)
    logs = axis_logs(rig, VALUES)
    _, start = regressed(Engine(rig, threads=1), logs, start_point(rig.task, logs), free_on(rig.task, 0))
    assert not start.kept and start.found["weight"] == pytest.approx(VALUES["weight"], rel=0.05)


@pytest.mark.parametrize(("change", "why"), [
    ({"gears.belt.losses": {"kind": "mesh_efficiency", "drive_efficiency": 0.9, "backdrive_efficiency": 0.8}}, "belt"),
    ({"motors.drive.kind": "dc"}, "voltage as its command"),
    ({"shafts.arm.drag": {"kind": "quadratic", "coefficient": 0.1, "max_speed": 9.0}}, "drag"),
    ({"command.drive": {"amplitude": 1.0, "frequency": 1.0}}, "changes with time"),
])  # fmt: skip
def test_where_the_torques_are_not_known_the_starts_stay(tmp_path: Path, change: dict[str, Any], why: str) -> None:
    starts = dict(VALUES)
    del starts["radius"]
    rig = axis_rig(tmp_path, starts)
    logs = axis_logs(rig, VALUES)
    data = rig.task.model_dump()
    if "command.drive" in change:
        data["inputs"] = {}
    if "motors.drive.kind" in change:
        change |= {"motors.drive": DC}
        del change["motors.drive.kind"]
    data["set"] |= change
    rig = Rig(Identification(**data), tmp_path)
    begin = start_point(rig.task, logs)
    point, start = regressed(Engine(rig, threads=1), logs, begin, free_on(rig.task, 0))
    assert point == begin and not start.found
    assert why in start.why_not
    assert "start values as given" in start.lines(rig.task.parameters)[0]


def test_a_closed_loop_without_a_channel_of_its_torque_keeps_the_starts(tmp_path: Path) -> None:
    rig = write_servo_logs(tmp_path, TRUTH, rung=0, count=1)
    logs = [prepared(rig.task, log, rig.units) for log in read_all(rig.task, tmp_path)]
    _, start = regressed(Engine(rig, threads=1), logs, start_point(rig.task, logs), free_on(rig.task, 0))
    assert "under its controller, and no channel shows its torque" in start.why_not


def test_a_measured_torque_serves_in_a_closed_loop(tmp_path: Path) -> None:
    """The reference moves in straight lines: held, it makes the torque a saw tooth, of which samples would show the tips alone."""
    rig = Rig(servo_task(tmp_path), SERVO)
    data = rig.task.model_dump()
    data["measured"]["position"]["deviation"] = 1e-3
    data["measured"]["torque"] = {"channel": "torque", "variable": "servo_torque", "deviation": 0.01}
    data["inputs"]["servo_reference"]["interpolation"] = "linear"
    rig = Rig(Identification(**data), SERVO)
    truth = TRUTH | {"load_friction": 0.0, "angle_offset": 0.0}
    logs = []
    for k, plan in enumerate(servo_plans(2, duration=4.0, rate=500.0)):
        noise = {"position": NOISE, "torque": 0.01}
        logs.append(prepared(rig.task, virtual_log(rig, plan, truth, rung=0, noise=noise, seed=k), rig.units))
    begin = start_point(rig.task, logs)
    known = ("torque_constant", "resistance", "dead_time")
    begin = ParameterPoint(begin.values | {name: truth[name] for name in known}, begin.nuisance)
    _, start = regressed(Engine(rig, threads=1), logs, begin, free_on(rig.task, 0))
    for name in ("armature", "coulomb_friction"):
        assert start.found[name] == pytest.approx(truth[name], rel=0.15)
    assert "delay" in start.kept["dead_time"]


def test_pauses_leave_too_few_samples(tmp_path: Path) -> None:
    rig = axis_rig(tmp_path, {k: v for k, v in VALUES.items() if k != "radius"})
    logs = []
    for log in axis_logs(rig, VALUES):
        gaps = 0.01 * np.floor(np.arange(len(log.time)) / 15)
        logs.append(replace(log, time=log.time + gaps, log=replace(log.log, time=log.time + gaps)))
    _, start = regressed(Engine(rig, threads=1), logs, start_point(rig.task, logs), free_on(rig.task, 0))
    assert "too short" in start.why_not or "without a pause" in start.why_not


def swing_rig(directory: Path, **fit: Any) -> Rig:
    """Of which weight and friction are sought, the weight from 0.4 of its value: its period is 1.6 times too long."""
    rig = axis_rig(directory, {**SWING, "weight": 0.4 * SWING["weight"]}, regression=False, **fit)
    data = rig.task.model_dump()
    for name in ("inertia", "offset"):
        data["parameters"][name]["fixed"] = True
    return Rig(Identification(**data), directory)


def test_windows_that_grow_find_what_whole_logs_miss(tmp_path: Path) -> None:
    whole, growing = swing_rig(tmp_path), swing_rig(tmp_path, horizon=["0.25 s"])
    missed = identify_logs(whole, free_swings(whole, SWING), threads=1)
    assert missed.error()[1] > 0.1  # rad: another minimum
    found = identify_logs(growing, free_swings(growing, SWING), threads=1)
    assert found.error()[1] < 1.05 * NOISE
    for name in ("weight", "viscous", "coulomb"):
        assert found.values[name] == pytest.approx(SWING[name], rel=0.01)


def test_runs_in_windows_begin_at_what_was_measured_and_have_exact_derivatives(tmp_path: Path) -> None:
    rig = swing_rig(tmp_path)
    logs = free_swings(rig, SWING)
    far, near = start_point(rig.task, logs), ParameterPoint(dict(SWING, radius=0.1), {})
    cut, engine = windows(rig, logs, far, 0, 0.25), Engine(rig, threads=1)
    assert [len(log.segments) for log in cut] == [20, 20]
    # The slope of a cubic through 2 m + 1 samples at a distance h has the variance 25/4 * 3/(m (m + 1) (2 m + 1)) (NOISE/h)^2; at
    # the end of a window it has become an error of the angle 0.25 s times as large.
    m, h = 16, 2e-3
    slope = NOISE / h * np.sqrt(25.0 / 4.0 * 3.0 / (m * (m + 1) * (2 * m + 1)))
    for r in engine.residuals(cut, near, 0):
        assert NOISE < np.std(r) < np.hypot(NOISE, 0.25 * slope)
    free = {"weight": rig.task.parameters["weight"]}
    h = 1e-5
    up, down = (engine.residuals(cut, ParameterPoint({**near.values, "weight": near.values["weight"] + s * h}, {}), 0) for s in (1, -1))
    for J, a, b in zip(engine.jacobians(cut, near, 0, free), up, down, strict=True):
        assert J[..., 0] == pytest.approx((a - b) / (2.0 * h), abs=1e-4 * np.abs(J).max())


def test_windows_are_refused_where_they_cannot_be(tmp_path: Path) -> None:
    refused(lambda: swing_rig(tmp_path, horizon=["1 s", "0.5 s"]), "fit")
    rig = swing_rig(tmp_path)
    logs = free_swings(rig, SWING)
    refused(lambda: windows(rig, logs, start_point(rig.task, logs), 0, 5e-3), "fit.horizon", match="fewer than 5 samples")
    data = rig.task.model_dump()
    data["measured"]["angle"]["filter_time"] = 0.01
    rig = Rig(Identification(**data), tmp_path)
    none = "no measured channel is the angle or the speed of a shaft"
    refused(lambda: windows(rig, logs, start_point(rig.task, logs), 0, 1.0), "fit.horizon", match=none)
    data["measured"] = {"speed": {"channel": "angle", "variable": "arm_speed"}}
    other = Rig(Identification(**data), tmp_path)
    refused(lambda: windows(other, logs, start_point(other.task, logs), 0, 1.0), "fit.horizon")


def test_values_of_multi_start_have_units_as_start_values_have(tmp_path: Path) -> None:
    data = swing_rig(tmp_path).task.model_dump()
    data["parameters"]["offset"] |= {"unit": "N*m", "fixed": False}
    data["parameters"]["weight"] |= {"unit": "kg"}
    rung = {"name": "all", "free": ["offset", "weight"]}
    tried = {"offset": ["5 mN*m", 0.01, "0.02 N*m"], "weight": ["500 g"]}
    data["ladder"] = [rung | {"multi_start": tried}]
    (read,) = Identification(**data).ladder
    assert dict(read.multi_start) == {"offset": (5e-3, 0.01, 0.02), "weight": (0.5,)}
    for wrong, text in (
        ({"offset": ["5 deg"]}, r"ladder\[0\]\.multi_start\.offset = '5 deg'"),
        ({"inertia": ["1 kg*m^2"]}, r"ladder\[0\]\.multi_start\.inertia with '1 kg\*m\^2', but parameters.inertia has no unit"),
        ({"offset": ["90 N*m"]}, r"multi_start\.offset with 90 outside of"),
    ):
        data["ladder"] = [rung | {"multi_start": wrong}]
        refused(lambda: Identification(**data), match=text)


SPINDLE = """
shafts.spindle = { viscous_friction = 0.01, friction_torque = 0.05 }
motors.drive = { shaft = "spindle", kind = "torque_source", rated_torque = 1.0, rotor_inertia = 2e-3 }
simulation = { duration = "1 s", sample_interval = "1 ms" }
"""
SPEED_NOISE = 0.05  # rad/s


def spindle_task(directory: Path, factor: float, **more: Any) -> Identification:
    """A spindle of which torque and speed are recorded, no angle."""
    (directory / "spindle.toml").write_text(SPINDLE)
    data: dict[str, Any] = {
        "scenario": "spindle.toml",
        "logs": {"files": ["*.csv"]},
        "inputs": {"drive_command": {"channel": "torque", "interpolation": "hold"}},
        "measured": {"speed": {"channel": "speed", "variable": "spindle_speed", "deviation": SPEED_NOISE}},
        "set": {
            "motors.drive.rotor_inertia": "inertia",
            "shafts.spindle.viscous_friction": "viscous",
            "shafts.spindle.friction_torque": "coulomb",
        },
        "parameters": {
            "inertia": {"start": factor * 2e-3, "min": 1e-5, "max": 1.0},
            "viscous": {"start": factor * 0.01, "max": 1.0},
            "coulomb": {"start": factor * 0.05, "max": 5.0},
        },
    }
    return Identification(**data | more)


def spindle_log(rig: Rig) -> Prepared:
    """Steps of the torque, all forward: J w' + b w = T - T_C, solved step by step."""
    time = 1e-3 * np.arange(2000)
    torque = np.repeat([0.4, 0.9, 0.15, 0.6], 500)
    speed, w = np.zeros(len(time)), 0.0
    for k in range(len(time)):
        speed[k] = w
        end = (torque[k] - 0.05) / 0.01
        w = end + (w - end) * np.exp(-0.01 / 2e-3 * 1e-3)
    speed += SPEED_NOISE * np.random.default_rng(4).normal(size=len(time))
    log = Log("0.csv", time, {"torque": Channel(torque), "speed": Channel(speed)})
    return prepared(rig.task, log, rig.units)


@pytest.mark.parametrize("factor", [20.0, 0.05])
def test_logs_with_a_speed_alone_get_start_values(tmp_path: Path, factor: float) -> None:
    rig = Rig(spindle_task(tmp_path, factor), tmp_path)
    log = spindle_log(rig)
    start = start_point(rig.task, [log])
    point, report = regressed(Engine(rig, threads=1), [log], start, rig.task.parameters)
    assert set(report.found) == {"inertia", "viscous", "coulomb"}
    assert point.values["inertia"] == pytest.approx(2e-3, rel=0.1)
    assert point.values["viscous"] == pytest.approx(0.01, rel=0.1)
    assert point.values["coulomb"] == pytest.approx(0.05, abs=0.02)  # 2 % of the largest torque


def test_logs_with_a_speed_alone_are_fitted_in_windows(tmp_path: Path) -> None:
    rig = Rig(spindle_task(tmp_path, 1.0), tmp_path)
    log = spindle_log(rig)
    (cut,) = windows(rig, [log], start_point(rig.task, [log]), 0, 0.08)  # no window begins near a step of the torque
    assert len(cut.segments) == 25
    (r,) = Engine(rig, threads=1).residuals([cut], start_point(rig.task, [log]), 0)
    # A window begins at the value of a cubic, whose own error is below that of a sample; over a window it falls by exp(-b t/J).
    assert SPEED_NOISE < np.std(r) < 1.2 * SPEED_NOISE
    growing = Rig(spindle_task(tmp_path, 3.0, fit={"regression": False, "horizon": [0.08]}), tmp_path)
    result = identify_logs(growing, [log], threads=1)
    for name, value in {"inertia": 2e-3, "viscous": 0.01, "coulomb": 0.05}.items():
        i = result.intervals[name]
        assert result.values[name] == pytest.approx(value, abs=4.0 * (i.high - i.low) / (2.0 * 1.96)), name
    assert result.error()[1] == pytest.approx(SPEED_NOISE, rel=0.06)
