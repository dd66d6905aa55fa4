"""Access of analyses to the solver of a simulation that is advanced step by step."""

from typing import Any

from ... import _core
from ...model.train import DriveTrain
from ..scenario.requirements import need_free_motion
from .simulation import Simulation


def solver_of(simulation: Simulation) -> tuple[_core.Simulation, Any]:
    """(solver of a simulation, its sampled controllers as the core takes them)."""
    return simulation._core, simulation._control


def solver_train(simulation: Simulation) -> _core.Train:
    """Train of a simulation as the core takes it."""
    core: _core.Train = simulation._core_train
    return core


def linear_regime(simulation: Simulation) -> tuple[DriveTrain, _core.Train, dict[str, Any]]:
    """(train, the same in the core, matrices of the linear regime that a simulation is in).

    Raises InputError: a motion is given, or an impact is possible.
    """
    need_free_motion(simulation._scenario, "linearize")
    with simulation._turn:
        return simulation._train, simulation._core_train, simulation._idle().linearize()
