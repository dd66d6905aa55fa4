"""The result variables of a drive train: the channels of the core, named after the elements, and what follows from them."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from ..errors import InputError
from ..model.train import DriveTrain, TrainElements
from .variables import Variable


def train_variables(train: DriveTrain, loaded: Collection[str]) -> tuple[Variable, ...]:
    """All variables that a result of this train has.

    Parameters
    ----------
    loaded
        Names of the shafts that a load torque acts on.
    """
    channels = [Variable(name, "", unit or "1", meaning) for name, unit, meaning in train.core(loaded).channels()]
    known = {channel.name for channel in channels}
    return (*channels, *(variable for variable in _derived(train) if variable.name not in known))


def _derived(train: DriveTrain) -> Iterator[Variable]:
    for name in train.shafts:
        yield Variable(f"{name}_angle", "", "rad", "angle of the shaft", derived=True)
    for name in train.gears:
        yield Variable(f"{name}_twist", "", "rad", "angle of input/ratio less that of output", derived=True)


def check_names(train: DriveTrain, loaded: Collection[str]) -> None:
    """Refuse two elements whose result variables have the same name.

    Raises
    ------
    InputError
    """
    seen = {"time"}
    for variable in train_variables(train, loaded):
        if variable.name in seen:
            tables = ("shafts", *TrainElements.model_fields)
            keys = [f"{table}.{name}" for table in tables for name in getattr(train, table)]
            both = [key for key in keys if variable.name.startswith(f"{key.partition('.')[2]}_")]
            raise InputError(
                f"keys {', '.join(both)}: have a result variable of the same name, {variable.name}; rename one of them"
            )
        seen.add(variable.name)
