"""The shafts of a train that a load torque acts on, and those whose motion is given."""

from __future__ import annotations

from collections.abc import Sequence

from ..errors import InputError
from ..inputs.validation import did_you_mean, shown
from ..model.train import DriveTrain
from .scenario import Scenario
from .train_variables import check_names


def loaded_train(what: DriveTrain | Scenario) -> tuple[DriveTrain, list[str]]:
    """A train, and the names of the shafts that a load torque may act on: those of the scenario, of a train alone all."""
    return given_train(what, None, None)[:2]


def given_train(
    what: DriveTrain | Scenario, loaded: Sequence[str] | None, given: Sequence[str] | None
) -> tuple[DriveTrain, list[str], list[str]]:
    """A train, the names of the shafts that a load torque may act on, and of those whose motion is given.

    Parameters
    ----------
    loaded
        Default: as in the scenario; all for a train alone.
    given
        Default: as in the scenario; none for a train alone.

    Raises
    ------
    InputError
        One of them is no shaft, or names of variables coincide.
    """
    train = what if isinstance(what, DriveTrain) else what.train()
    shafts = list(train.shafts) if isinstance(what, DriveTrain) else what.loaded()
    moved = [] if isinstance(what, DriveTrain) else what.given()
    for key, names in (("loaded", loaded), ("given", given)):
        for name in names or ():
            if name not in train.shafts:
                meant = did_you_mean(name, train.shafts, f"the shafts are {', '.join(train.shafts)}")
                raise InputError(f"{key}: {shown(name)} is no shaft of this train; {meant}")
    shafts = shafts if loaded is None else list(loaded)
    moved = moved if given is None else list(given)
    core = train.core(shafts, given=moved)
    if loaded is not None or given is not None:
        train.check(core)
    check_names(train, core)
    return train, shafts, moved
