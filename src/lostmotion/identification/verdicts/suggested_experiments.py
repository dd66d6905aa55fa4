"""Remedies for unidentifiable parameters: experiments that the rig can run, and channels that are missing."""

from collections.abc import Sequence

from ..rig.rig_scenario import Rig
from ..task.file_formulas import names_in
from ..task.identification_file import CHANNEL_FORMULAS, Identification

OTHERWISE = "give a value with a tolerance as a prior, or a log in which they act apart"


def remedy_for(rig: Rig, names: Sequence[str]) -> str:
    """Remedies for parameters, by the keys of the scenario and of channels that they enter."""
    keys = [keys_of(rig.task, name) for name in names]

    def enter(*parts: str) -> bool:
        return any(part in key for own in keys for key in own for part in parts)

    if len(names) > 1 and all(any("delay" in key for key in own) for own in keys):
        return "fix one of them, or give a channel whose delay is known"
    torque = torque_known(rig)
    if enter("drive_efficiency", "backdrive_efficiency", "losses"):
        both = "a log with output torque in both directions of power flow"
        return f"give {both}" if torque else f"give a stall torque, or {both}"
    if enter("stiffness", "backlash", "hysteresis"):
        return "give a slow torque ramp with the output locked"
    references = any(name.endswith("_reference") for name in rig.task.inputs)
    if enter("delay", "sample_time"):
        return f"give a log with steps of the {'reference' if references else 'command'}"
    if enter("breakaway_torque", "breakaway_force", "stribeck_speed", "friction_curve"):
        return "give slow reversals, and a log that creeps from rest"
    inertias = [any(part in key for key in own for part in ("inertia", "mass")) for own in keys]
    if len(names) > 1 and all(inertias):
        return "give one of them by its data sheet: inertias that are rigidly joined show as a sum alone"
    if enter("rotor_inertia", "inertia", "mass"):
        known = "" if torque else " and a known torque"
        return f"give a log with high acceleration{known}, or the inertia of the data sheet"
    if enter("gain", "limit", "rated_torque", "rated_force", "viscous_friction", "friction_torque", "friction_force"):
        if torque:
            return "give a log with other speeds, or one that coasts without torque"
        return "give a stall torque, a log of the motor's torque or current, or a log in which the motor is off"
    return "give a log at rest with the motor off" if enter("angle") else OTHERWISE


def torque_known(rig: Rig) -> bool:
    """Whether the torque of each motor is an input or in a channel."""
    variables, train = {m.variable for m in rig.task.measured.values()}, rig.scenario.train()
    return all(
        (motor.kind == "torque_source" and train.variable(name, "command") in rig.task.inputs)
        or variables & {train.variable(name, "torque"), train.variable(name, "current")}
        for name, motor in train.motors.items()
    )


def keys_of(task: Identification, name: str) -> list[str]:
    """Keys of the scenario, and of channels, that a parameter enters."""
    tables = [task.set, *(rung.set for rung in task.ladder), *(phase.set for phase in task.phases)]
    found = [key for table in tables for key, value in table.items() if name in names_in(value)]
    for entry in (*task.inputs.values(), *task.measured.values()):
        found += [key for key in CHANNEL_FORMULAS if name in names_in(getattr(entry, key, None))]
    return found
