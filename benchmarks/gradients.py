"""The derivatives of a run with respect to ten parameters: exact, and by differences of runs."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from report import Report, best

import lostmotion as lm
from lostmotion import _core
from lostmotion.control.axis import BoundController
from lostmotion.simulation.runs.core_runs import core_case
from lostmotion.simulation.runs.sensitivities import core_variation, neighbours, run_cases, sensitive_case

KEYS = (
    "shafts.rotor.inertia",
    "shafts.arm.inertia",
    "shafts.arm.viscous_friction",
    "shafts.arm.friction_torque",
    "shafts.rotor.friction_torque",
    "motors.motor.rated_torque",
    "motors.motor.rated_speed",
    "gears.gear.losses.drive_efficiency",
    "gears.gear.losses.backdrive_efficiency",
    "controllers.motor.position.gain",
)
CHANNELS = ["arm_speed", "arm_angle", "motor_torque"]


def arm() -> lm.Scenario:
    """A hobby servo with an arm: 3.5 s under a position loop at 100 Hz."""
    return lm.Scenario(
        shafts={
            "rotor": {"inertia": 2e-7, "friction_torque": 2e-4},
            "arm": {"inertia": 4e-3, "viscous_friction": 0.02, "friction_torque": 0.05},
        },
        motors={
            "motor": {
                "shaft": "rotor",
                "kind": "dc",
                "rotor_inertia": 0.0,
                "rated_torque": 0.02,
                "rated_speed": 600.0,
                "rated_voltage": 12.0,
                "electrical_time_constant": 5e-4,
                "armature_voltage_constant": 5.0,
                "voltage_limit": 12.0,
            }
        },
        gears={
            "gear": {
                "input": "rotor",
                "output": "arm",
                "ratio": 250.0,
                "rated_input_speed": 600.0,
                "rated_output_torque": 3.0,
                "stiffness": {"kind": "rigid"},
                "losses": {"kind": "mesh_efficiency", "drive_efficiency": 0.7, "backdrive_efficiency": 0.5},
            }
        },
        gravity={"arm": {"shaft": "arm", "mass": 0.5, "radius": 0.1, "error": 5e-3}},
        controllers={
            "motor": {
                "sample_time": 1e-2,
                "encoder": {"ideal": True},
                "reference": {"kind": "position", "amplitude": 1.0, "frequency": 0.5},
                "position": {"gain": 8.0},
                "speed": {"gain": 2e-4, "torque_limit": 0.1},
                "current": {"kind": "pi"},
            }
        },
        simulation={"duration": 3.5, "sample_interval": 1e-2},
    )


def cases() -> tuple[list[Any], list[list[tuple[Any, ...]]], BoundController]:
    """The run with its derivatives, the runs of central differences, and the controllers."""
    s = arm()
    beside = {key: neighbours(s, key) for key in KEYS}
    control = s.control()
    exact = [sensitive_case(s, [core_variation(s, key, beside[key]) for key in KEYS], control)]
    runs = [[(core_case(n.scenario), n.scenario.control()) for n in beside[key]] for key in KEYS]
    return exact, runs, control


def section(report: Report) -> None:
    exact, runs, control = cases()
    s = arm()
    grid = s.simulation.grid()

    def differences() -> None:
        for of_key in runs:
            for case, bound in of_key:
                _core.run(case, **grid, control=bound)

    core = core_case(s)
    names = [name for name, *_ in s.core().channels()]
    one = best(5, lambda: _core.run(core, **grid, control=control), time.process_time)
    gradient = best(5, lambda: run_cases(exact, CHANNELS), time.process_time)
    by_differences = best(3, differences, time.process_time)
    (found,) = run_cases(exact, CHANNELS)
    rows = [names.index(name) for name in CHANNELS]
    gaps = []
    for p, (of_key, beside) in enumerate(zip(runs, [neighbours(s, key) for key in KEYS], strict=True)):
        base = _core.run(core, **grid, control=control)["values"][rows]
        got = sum(
            n.weight * (_core.run(case, **grid, control=bound)["values"][rows] - base)
            for n, (case, bound) in zip(beside, of_key, strict=True)
        )
        size = np.max(np.abs(found.derivatives[p]), axis=1, keepdims=True)  # 0 if the motion does not depend on it
        size = np.where(size > 0.0, size, np.inf)
        gaps.append(np.max(np.abs(got - found.derivatives[p]) / size))
    report.section(
        "Gradients",
        f"{len(KEYS)} parameters of a servo with an arm under a position loop at 100 Hz, 3.5 s, {len(CHANNELS)} variables at 100 Hz; "
        "from core\nobjects that stand, on one thread.",
    )
    report.table(
        ("", "processor time [ms]", "runs"),
        [
            ("one run", f"{one:.2f}", "1"),
            ("exact, with the run", f"{gradient:.2f}", f"{gradient / one:.1f}"),
            ("differences of fourth order", f"{by_differences:.2f}", f"{by_differences / one:.1f}"),
        ],
    )
    report.add(
        "",
        f"Difference of the two, relative to the largest derivative of each variable: median over the parameters {np.median(gaps):.1g}.",
    )


if __name__ == "__main__":
    r = Report()
    section(r)
    print(r.text())
