"""Rigs in the short form and as an axis: keys, inputs and variables as their files have them, values of the closed form of the motion."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from dry_friction import angles, write_log
from lostmotion.inputs.toml_text import toml_text
from refusals import refused
from tables import rated_gearbox

COULOMB, VISCOUS, INERTIA = 0.06, 3e-3, 3e-4  # at the motor
TASK: dict[str, Any] = {"logs": {"files": ["l*.csv"]}, "fit": {"regression": False}}
MOTOR = {"kind": "torque_source", "rated_torque": 1.0}
TIMES = {"duration": 1.0, "sample_interval": 5e-3}
FORMS: dict[str, dict[str, Any]] = {
    "short": {
        "rig": {
            "command": {},
            "motor": {**MOTOR, "rotor_inertia": INERTIA - 0.01 / 100.0},
            "gearbox": rated_gearbox(10.0, 300.0, 20.0, {"kind": "rigid"}, 1.0),
            "load": {"inertia": 0.01},
        },
        "input": "command",
        "variable": "load_angle",
        "keys": ("load.friction_torque", "load.viscous_friction"),
        "per_turn": 0.1,
        "deviation": "0.1 mrad",
    },
    "axis": {
        "rig": {
            "axis": {
                "motor": {**MOTOR, "rotor_inertia": INERTIA - 20.0 * 1e-6},
                "screw": {"lead": 2e-3 * math.pi, "stiffness": 1e12, "damping": 1e7},
                "slide": {"mass": 20.0},
            }
        },
        "input": "motor_command",
        "variable": "slide_position",
        "keys": ("axis.slide.friction_force", "axis.slide.viscous_friction"),
        "per_turn": 1e-3,
        "deviation": "1 um",
    },
}


def found(
    form: str, directory: Path, more: tuple[dict[str, str], dict[str, Any]] = ({}, {}), **measured: Any
) -> lm.identification.IdentificationResult:
    f = FORMS[form]
    (directory / "rig.toml").write_text(toml_text({**f["rig"], "simulation": TIMES}))
    time = np.arange(400) / 200.0
    for k in range(2):
        torque = 0.2 * np.sin(7.0 * time + k) + 0.12 * np.sin(20.0 * time + 2 * k)
        angle = angles(torque, 5e-3, coulomb=COULOMB, viscous=VISCOUS, inertia=INERTIA)
        unit = "m" if form == "axis" else "rad"
        write_log(directory / f"l{k}.csv", time, torque, f["per_turn"] * angle)
        path = directory / f"l{k}.csv"
        path.write_text(path.read_text().replace("[rad]", f"[{unit}]"))
    channel = {"channel": "position", "variable": f["variable"], "deviation": f["deviation"], **measured}
    task = {
        **TASK,
        "scenario": "rig.toml",
        "inputs": {f["input"]: {"channel": "torque", "interpolation": "hold"}},
        "measured": {"position": channel},
        "set": dict(zip(f["keys"], ("coulomb", "viscous"), strict=True)) | more[0],
        "parameters": {"coulomb": {"start": 0.5 * COULOMB / f["per_turn"]}, "viscous": {"start": 1e-3 / f["per_turn"] ** 2}, **more[1]},
    }
    (directory / "identify.toml").write_text(toml_text(task))
    return lm.identify(directory / "identify.toml")


@pytest.mark.parametrize("form", FORMS)
def test_a_rig_is_written_in_any_form(form: str, tmp_path: Path) -> None:
    """Friction behind the gear is that at the motor over the travel of a radian, viscous friction over its square."""
    values, per_turn = found(form, tmp_path).values, FORMS[form]["per_turn"]
    assert values["coulomb"] == pytest.approx(COULOMB / per_turn, rel=1e-3)
    assert values["viscous"] == pytest.approx(VISCOUS / per_turn**2, rel=1e-3)


@pytest.mark.parametrize("deviation", ["1 mrad", -1e-6, 0.0])
def test_a_deviation_is_one_of_its_variable(deviation: Any, tmp_path: Path) -> None:
    refused(lambda: found("axis", tmp_path, deviation=deviation), "measured.position.deviation")


def test_inertias_before_and_behind_a_rigid_gear_are_told_apart_by_no_log(tmp_path: Path) -> None:
    """Whatever the acceleration: only J_M + J_L/i^2 acts, so that the remedy is a data sheet."""
    rotor, load = {"start": INERTIA - 1e-4, "max": 0.01}, {"start": 0.01, "max": 1.0}
    keys = {"motor.rotor_inertia": "rotor", "load.inertia": "load"}
    result = found("short", tmp_path, more=(keys, {"rotor": rotor, "load": load}))
    [left] = [u for u in result.rungs[result.chosen].undetermined if {"rotor", "load"} <= u.changes.keys()]
    assert "data sheet" in left.text and "acceleration" not in left.text
