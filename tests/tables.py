"""Tables of scenarios that many tests write: gears, motors, stiffnesses, losses."""

from typing import Any

MOTOR = """
[motor]
rotor_inertia = 8e-6
friction_torque = 0.016
rated_torque = 0.521
rated_speed = "3300 rpm"
rated_voltage = 24
electrical_time_constant = "0.1286 ms"
armature_voltage_constant = 3.1169
"""
"""The motor of the paper, as files write it."""


def linear(stiffness: Any, **more: Any) -> dict[str, Any]:
    return {"kind": "linear", "stiffness": stiffness, **more}


def gear_between(start: str, end: str, ratio: Any = 1.0, stiffness: Any = None, **more: Any) -> dict[str, Any]:
    """A gear; with a number as stiffness, a linear one."""
    given = {} if stiffness is None else {"stiffness": stiffness if isinstance(stiffness, dict) else linear(stiffness)}
    return {"input": start, "output": end, "ratio": ratio, **given, **more}


def linked(start: str, end: str, **more: Any) -> dict[str, Any]:
    """What joins two shafts, or a shaft and a slide."""
    return {"input": start, "output": end, **more}


def constant_efficiency(efficiency: float) -> dict[str, Any]:
    return {"kind": "constant_efficiency", "efficiency": efficiency}


def mesh_efficiency(drive: float, backdrive: float) -> dict[str, Any]:
    return {"kind": "mesh_efficiency", "drive_efficiency": drive, "backdrive_efficiency": backdrive}


def torque_source(rotor_inertia: Any, shaft: str | None = None, **more: Any) -> dict[str, Any]:
    return ({} if shaft is None else {"shaft": shaft}) | {"kind": "torque_source", "rotor_inertia": rotor_inertia, **more}


def run_of(duration: Any, sample_interval: Any, **more: Any) -> dict[str, Any]:
    return {"duration": duration, "sample_interval": sample_interval, **more}


def direct_current(
    rotor_inertia: Any, rated_torque: Any, rated_speed: Any, electrical: Any, armature: Any, shaft: str | None = None, **more: Any
) -> dict[str, Any]:
    """A direct-current motor by its electrical time constant and its armature voltage constant."""
    rated = {"rotor_inertia": rotor_inertia, "rated_torque": rated_torque, "rated_speed": rated_speed}
    circuit = {"electrical_time_constant": electrical, "armature_voltage_constant": armature}
    return ({} if shaft is None else {"shaft": shaft}) | {"kind": "dc", **rated, **circuit, **more}


def stepper(rotor_inertia: Any, steps: Any, holding_torque: Any, shaft: str | None = None, **more: Any) -> dict[str, Any]:
    given = {"rotor_inertia": rotor_inertia, "steps_per_revolution": steps, "holding_torque": holding_torque}
    return ({} if shaft is None else {"shaft": shaft}) | {"kind": "stepper", **given, **more}


def rated_gearbox(ratio: Any, speed: Any, torque: Any, stiffness: Any = None, efficiency: Any = None, **more: Any) -> dict[str, Any]:
    """A gearbox of the short form, by its rated input speed and its rated output torque; its efficiency is that of constant losses."""
    gear = gear_between("", "", ratio, stiffness, rated_input_speed=speed, rated_output_torque=torque)
    losses = {} if efficiency is None else {"losses": constant_efficiency(efficiency)}
    return {key: value for key, value in gear.items() if key not in ("input", "output")} | losses | more
