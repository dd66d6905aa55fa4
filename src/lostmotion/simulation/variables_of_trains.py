"""The result variables of a drive train: the channels of the core, named after the elements, and what follows from them."""

from collections.abc import Collection, Container, Iterator, Mapping
from typing import Any

import numpy as np

from .. import _core
from ..control.controller import Controller
from ..errors import InputError
from ..model.gear import Gear
from ..model.linear_train import LinearElements
from ..model.torsion import Rigid
from ..model.train import DriveTrain
from ..recorded_numbers import may_be_left_out
from .variables import Variable, variables_of_core

ALL_SIGNALS = tuple(name for name, _, _ in _core.axis_signals())
REFERENCE_UNITS = {
    name.removesuffix("_reference"): unit for name, unit, _ in _core.axis_signals() if name.endswith("_reference")
}
"""units of references, by their kinds"""
# Those that its loops have, by the kind of the outermost: position, speed, torque.
_OF_LOOPS = ALL_SIGNALS[: ALL_SIGNALS.index("torque_reference") + 1]
LOOP_SIGNALS = {kind: _OF_LOOPS[_OF_LOOPS.index(f"{kind}_reference") :] for kind in REFERENCE_UNITS}
WINDING_SIGNALS = tuple(name for name, _, _ in _core.winding_signals())


def signals_of(controller: Controller) -> Iterator[str]:
    """Names of what a controller shows."""
    if controller.firmware is not None:
        yield from ("position_reference", "measured_position", "torque_reference")
    else:
        yield from LOOP_SIGNALS[controller.reference.kind]
    if controller.inverse_model is not None:
        yield from ("model_loss_factor", "model_friction_torque")
        if controller.inverse_model.load_observer is not None:
            yield "observed_load_torque"
    if controller.camera is not None:
        yield from ("target_direction", "target_seen")
    if controller.current.kind == "field_oriented":
        yield from WINDING_SIGNALS


def axis_variables(
    controllers: Mapping[str, Controller], sliding: Mapping[str, tuple[bool, bool]] = {}
) -> tuple[Variable, ...]:
    """Variables of the controllers of a run, by the prefix of their names.

    sliding: by the same key, whether the motor moves a slide, and whether the position is the position of a slide; left out, neither.
    """
    return tuple(
        Variable(f"{prefix}{name}", "", unit, meaning)
        for prefix, controller in controllers.items()
        for name, unit, meaning in (*_core.axis_signals(*sliding.get(prefix, (False, False))), *_core.winding_signals())
        if name in signals_of(controller)
    )


def named_signals(controllers: Mapping[str, Controller], values: Any) -> dict[str, np.ndarray]:
    """Signals of the controllers from the core, axis by axis and signal by signal, as `axis_variables` names them."""
    return {
        f"{prefix}{name}": row
        for (prefix, controller), rows in zip(controllers.items(), values, strict=True)
        for name, row in zip((*ALL_SIGNALS, *WINDING_SIGNALS), rows, strict=False)
        if name in signals_of(controller)
    }


def only_input(train: DriveTrain, word: str, names: Collection[str], argument: str = "") -> str:
    """Name of the one command, or the one load torque, among inputs.

    word: command or load_torque
    names: of the inputs; references count as commands.
    argument: what is given, for messages; default: the word.

    Raises InputError: there is none, or there are several.
    """
    loads = {train.variable(shaft, "load_torque") for shaft in train.shafts}
    found = [name for name in names if (name in loads) == (word == "load_torque")]
    if len(found) == 1:
        return found[0]
    why = f"there are several; give them by name: {', '.join(found)}" if found else "there is none; leave it out"
    raise InputError(f"{argument or word}: {why}")


def angle_terms(train: DriveTrain, shaft: str, recorded: Container[object]) -> dict[str, float]:
    """The angle of a shaft, such as a motor's, as a sum of recorded variables: factors by name, empty where gears do not give it.

    A gear without housing and transmission error has ``input angle = ratio * (output angle + twist)``.
    """
    if (own := train.variable(shaft, "angle")) in recorded:
        return {own: 1.0}
    for name, gear in train.gears.items():
        if gear.input != shaft or gear.housing is not None or gear.transmission_error is not None:
            continue
        if behind := angle_terms(train, gear.output, recorded):
            terms = {variable: gear.ratio * factor for variable, factor in behind.items()}
            return terms if isinstance(gear.stiffness, Rigid) else terms | {train.variable(name, "twist"): gear.ratio}
    return {}


def angle_of_run(train: DriveTrain, shaft: str, result: Any) -> np.ndarray:
    """The angle of a shaft over a run, from those that the run has.

    Raises InputError: it does not follow from them.
    """
    if not (terms := angle_terms(train, shaft, result)):
        raise InputError(
            f"the angle of {shaft} does not follow from those that the train keeps; make it the last of its shafts"
        )
    return np.asarray(sum(factor * np.asarray(result[name]) for name, factor in terms.items()))


def angle_through(gear: Gear, angle: Any, twist: Any, *, forward: bool) -> Any:
    """The angle at the other side of a gear, forward at its output: twist = input angle/ratio - output angle - transmission error.

    Numbers or arrays; of an error backward numbers alone, as the solver has that angle in runs.
    """
    error = gear.transmission_error
    if error is not None and may_be_left_out(getattr(error, "phase", 1.0)):
        # One of 0 leaves no trace in the angle.
        raise ValueError("the angle behind a transmission error is no formula of its phase")
    if forward:
        return angle / gear.ratio - twist - (0.0 if error is None else np.vectorize(error.core())(angle))
    found = wanted = gear.ratio * (angle + twist)
    if (
        error is not None
    ):  # angle_in - ratio e(angle_in) = ratio (angle + twist); e is small against the angle of a turn
        e = error.core()
        for _ in range(200):
            found, before = wanted + gear.ratio * e(found), found
            if found == before:
                break
    return found


def check_names(
    train: DriveTrain,
    core: _core.Train,
    controllers: Mapping[str, Controller] = {},
    written: LinearElements | None = None,
) -> None:
    """Refuse two elements whose result variables have the same name.

    written: the elements as they were written, for messages; default: the elements of the train.
    """
    seen = {"time"}
    for variable in (
        *variables_of_core(core.variables()),
        *axis_variables({f"{name}_": c for name, c in controllers.items()}),
    ):
        if variable.name in seen:
            tables = ("shafts", "slides", *LinearElements.model_fields)
            keys = [f"{table}.{name}" for table in tables for name in getattr(written or train, table, ())]
            both = [key for key in keys if variable.name.startswith(f"{key.partition('.')[2]}_")]
            raise InputError(f"have a result variable of the same name, {variable.name}; rename one of them", *both)
        seen.add(variable.name)
