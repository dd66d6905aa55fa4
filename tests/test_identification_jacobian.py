"""Derivatives of the residuals of logs: exact where they exist, by differences where not, and said so."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identification_logs import SERVO, TRUTH, servo_plans, servo_task
from lostmotion.identification.preparation.prepare import prepared
from lostmotion.identification.prepared_log import Prepared
from lostmotion.identification.readers.log import Channel, Log
from lostmotion.identification.rig.residuals import Engine, ParameterPoint
from lostmotion.identification.rig.rig_scenario import Rig
from lostmotion.identification.task.free_parameters import FreeParameter
from lostmotion.identification.task.identification_file import Identification, free_on
from lostmotion.identification.virtual_logs import virtual_log


def small_differences(engine: Engine, log: Prepared, values: dict[str, float], rung: int, name: str, h: float) -> np.ndarray:
    up, down = (engine.residuals([log], ParameterPoint({**values, name: values[name] + s * h}, {}), rung)[0] for s in (1, -1))
    return (up - down) / (2.0 * h)


def check(engine: Engine, log: Prepared, values: dict[str, float], rung: int, free: dict[str, FreeParameter]) -> None:
    """Differences over 1e-5 of a value err by its square, by 1e-14 over 1e-7 in rounding, and more where a switching lies between
    the runs beside and the sample: at the worst samples.
    """
    (J,) = engine.jacobians([log], ParameterPoint(values, {}), rung, free)
    assert not engine.by_differences and not engine.touching
    for k, (name, p) in enumerate(free.items()):
        D = small_differences(engine, log, values, rung, name, 1e-5 * max(abs(values[name]), p.step))
        for own, wanted in zip(J[..., k], D, strict=True):
            size = float(np.max(np.abs(own)))
            assert np.quantile(np.abs(own - wanted), 0.9) <= 1e-5 * size, name
            assert np.max(np.abs(own - wanted)) <= 1e-3 * size, name


@pytest.mark.parametrize("kind", [0, 1, 2])
def test_the_jacobian_is_that_of_small_differences(kind: int) -> None:
    """Of the servo with dead time on all rungs; in the third log its motor is switched off on the way."""
    task = servo_task(Path())
    rig = Rig(task, SERVO)
    plan = servo_plans(kind + 1, duration=1.5)[kind]
    log = prepared(task, virtual_log(rig, plan, TRUTH, rung=1, seed=kind), rig.units)
    values = {n: p.start for n, p in task.parameters.items()} | {"direction": 0.15, "angle_offset": 0.01}
    for rung in (1, 3):
        free = free_on(task, rung) | {"direction": task.parameters["direction"]}
        check(Engine(rig, threads=1), log, values, rung, free)


def test_scale_offset_delay_and_filter_of_channels_are_parameters_too() -> None:
    data = servo_task(Path()).model_dump()
    data["measured"]["position"] |= {"scale": "gain", "offset": "zero", "delay": "late", "resolution": 0.0, "deviation": 1e-3}
    data["measured"]["speed"] = {
        "channel": "speed",
        "variable": "arm_speed",
        "scale": "gain",
        "delay": "late",
        "filter_time": "tau",
        "deviation": 1e-2,
    }
    data["parameters"] |= {
        "gain": {"start": 1.1, "max": 2.0},
        "zero": {"start": 0.02, "max": 1.0},
        "late": {"start": 4.3e-3, "max": 0.1},
        "tau": {"start": 0.02, "min": 1e-3, "max": 0.1},
    }
    data["ladder"] = [{"name": "all", "free": ["gain", "zero", "late", "tau", "viscous_friction"]}]
    rig = Rig(Identification(**data), SERVO)
    plan = servo_plans(1, duration=1.5)[0]
    log = prepared(rig.task, virtual_log(rig, plan, TRUTH | {"direction": 0.0}, rung=0), rig.units)
    values = {n: p.start for n, p in rig.task.parameters.items()}
    (J,) = Engine(rig, 1).jacobians([log], ParameterPoint(values, {}), 0, free_on(rig.task, 0))
    for k, (name, p) in enumerate(free_on(rig.task, 0).items()):
        D = small_differences(Engine(rig, 1), log, values, 0, name, 1e-5 * max(abs(values[name]), p.step))
        for own, wanted in zip(J[..., k], D, strict=True):
            assert np.quantile(np.abs(own - wanted), 0.9) <= 1e-5 * max(float(np.max(np.abs(own))), 1e-12), name


AXIS = """
shafts.motor = { friction_torque = "0.02 N*m" }
shafts.table = { inertia = "0.5 kg*m^2", friction_torque = "0.5 N*m" }
motors.drive = { shaft = "motor", kind = "torque_source", rotor_inertia = "1e-4 kg*m^2", rated_torque = "5 N*m" }
simulation = { duration = "1 s", sample_interval = "10 ms" }
[gears.gear]
input = "motor"
output = "table"
ratio = 50
rated_input_speed = "3000 rpm"
rated_output_torque = "100 N*m"
stiffness = { kind = "rigid" }
losses = { kind = "mesh_efficiency", drive_efficiency = 0.8, backdrive_efficiency = 0.7 }
[controllers.drive]
sample_time = "10 ms"
encoder = { ideal = true }
reference = { kind = "position" }
position = { gain = "8 1/s" }
speed = { gain = "0.02 N*m*s/rad", torque_limit = "4 N*m" }
"""


def axis(directory: Path, interpolation: str) -> tuple[Rig, Prepared]:
    """A log of an axis under a sampled position loop."""
    (directory / "axis.toml").write_text(AXIS)
    task = Identification(
        scenario="axis.toml",
        logs={"files": ["none"]},
        inputs={"drive_reference": {"channel": "goal", "delay": "late", "interpolation": interpolation}},
        measured={"angle": {"channel": "angle", "variable": "table_angle"}},
        set={
            "shafts.table.inertia": "inertia",
            "shafts.table.friction_torque": "friction",
            "controllers.drive.position.gain": "gain",
            "gears.gear.losses.drive_efficiency": "efficiency",
        },
        parameters={
            "inertia": {"start": 0.5, "min": 0.05, "max": 5.0},
            "friction": {"start": 0.5, "max": 5.0},
            "gain": {"start": 8.0, "max": 50.0},
            "efficiency": {"start": 0.8, "min": 0.3, "max": 1.0},
            "late": {"start": 0.013, "max": 0.1, "scale": 0.01},
        },
    )
    rig = Rig(task, directory)
    time = np.arange(0.0, 1.0, 0.005)
    plan = Log("axis", time, {"goal": Channel(0.6 * np.sin(5.0 * time)), "angle": Channel(np.zeros(len(time)))})
    values = {n: p.start for n, p in task.parameters.items()}
    return rig, prepared(task, virtual_log(rig, plan, values), rig.units)


def test_the_jacobian_of_an_axis_under_a_sampled_controller(tmp_path: Path) -> None:
    """With dead time of a reference that runs in straight lines."""
    rig, log = axis(tmp_path, "linear")
    values = {n: p.start for n, p in rig.task.parameters.items()}
    check(Engine(rig, threads=1), log, values, 0, free_on(rig.task, 0))


def test_a_delay_of_steps_that_a_sampled_controller_reads_is_by_differences(tmp_path: Path) -> None:
    rig, log = axis(tmp_path, "hold")
    values = {n: p.start for n, p in rig.task.parameters.items()}
    engine, free = Engine(rig, threads=1), free_on(rig.task, 0)
    (J,) = engine.jacobians([log], ParameterPoint(values, {}), 0, free)
    assert list(engine.by_differences) == ["late"] and "held between samples" in engine.by_differences["late"]
    # The parts of the delay that count are whole samples of the log.
    D = small_differences(engine, log, values, 0, "late", 1e-2 * free["late"].step)
    assert J[..., -1] == pytest.approx(D, abs=1e-12)


def test_a_rig_with_other_numbers_is_the_one_that_is_made_anew() -> None:
    task = servo_task(Path())
    rig = Rig(task, SERVO)
    values = {n: p.start for n, p in task.parameters.items()}
    facts = {"mass": 0.5, "arm_mass": 0.1, "length": 0.1, "kp": 8.0, "vin": 15.0, "first_position": 0.0}
    rig.built(rig.changes({**facts, **values}, 3, -1))
    quickly = rig.built(rig.changes({**facts, **values, "armature": 0.013, "stribeck_speed": 0.7}, 3, -1)).scenario
    anew = quickly.replace()
    assert quickly == anew and quickly.train() == anew.train()


def test_logs_of_one_rig_at_once_are_the_logs_one_by_one() -> None:
    """To the last bit, on any number of threads."""
    task = servo_task(Path())
    rig = Rig(task, SERVO)
    plan = servo_plans(1, duration=0.5)[0]
    logs = [
        prepared(task, virtual_log(rig, replace(plan, name=str(k)), TRUTH, rung=1, noise={"position": 1e-3}, seed=k), rig.units)
        for k in range(12)
    ]
    values = {n: p.start for n, p in task.parameters.items()}
    free = free_on(task, 2)
    together = Engine(rig, 2).jacobians(logs, ParameterPoint(values, {}), 2, free)
    for log, J in zip(logs, together, strict=True):
        assert np.array_equal(Engine(rig, 1).jacobians([log], ParameterPoint(values, {}), 2, free)[0], J)
