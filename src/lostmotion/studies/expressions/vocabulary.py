"""Names in the expressions of a study: the result variables and energies of its base scenario, and further values of a run."""

from collections.abc import Iterator
from typing import NamedTuple

from ...model.shaft_ratio import turns
from ...simulation.runs.pointing_error import pointing_names
from ...simulation.scenario.field_oriented_motors import bound_names
from ...simulation.scenario.scenario import Scenario
from ...simulation.variables_of_trains import axis_variables

OF_TRAINS = ("energy", "time")
OF_THE_RUN = (*OF_TRAINS, "ideal_speed", "bandwidth")
"""further names: the ledger; the instants; the load speed of a rigid drive without inertia, friction and load under the same
command; the bandwidth [Hz] of the load speed, a function of the command's amplitude (left out: the run's own)"""


class Vocabulary(NamedTuple):
    """Vocabulary of one drive, or of one drive train."""

    variables: tuple[tuple[str, str], ...]  # result variables, each with its unit
    channels: tuple[str, ...]  # variables that the core returns; the others follow from these
    energies: tuple[tuple[str, str], ...]  # entries of the ledger, each as expressions call it and as the ledger does
    of_the_run: tuple[str, ...]
    command: str = ""  # the command of the one motor


def _controlled(scenario: Scenario) -> Iterator[tuple[str, str]]:
    """Names that controllers add: their signals, the pointing errors of the axes, and the error bounds of windings."""
    for variable in axis_variables(scenario.by_prefix(), scenario.sliding()):
        yield variable.name, variable.unit
    for motor, name in pointing_names(scenario):
        sliding = scenario.sliding().get(scenario.prefix(motor), (False, False))
        yield name, "m" if sliding[1] else "rad"
    for name, _, unit in bound_names(scenario):
        yield name, unit


def vocabulary_of(scenario: Scenario) -> Vocabulary:
    """Names that expressions may use for a run of this scenario.

    An entry of a train's ledger, such as ``first_gear: mesh``, is called ``first_gear_mesh``.
    """
    variables, own = scenario.variables(), _commands(scenario)
    return Vocabulary(
        (*((v.name, v.unit) for v in variables), *_controlled(scenario)),
        tuple(v.name for v in variables if not v.derived),
        tuple((entry.replace(": ", "_").replace(" ", "_"), entry) for entry in scenario.core().ledger_names()),
        OF_THE_RUN if own else OF_TRAINS,
        *own,
    )


def _commands(scenario: Scenario) -> list[str]:
    """The command of the one motor that turns the last shaft through gears; of other trains none."""
    train = scenario.train()
    last, motors = list(train.shafts)[-1], scenario.train().motors
    if len(motors) != 1 or scenario.tables.controllers or scenario.given():
        return []
    return [
        train.variable(name, "command") for name, motor in motors.items() if turns(train, motor.shaft, last) is not None
    ]
