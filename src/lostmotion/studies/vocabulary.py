"""What the expressions of a study may name: the result variables and energies of its base scenario, and what else a run has."""

from __future__ import annotations

from typing import NamedTuple

from ..simulation.results import ENERGY
from ..simulation.scenario import Scenario
from ..simulation.train_scenario import TrainScenario
from ..simulation.train_variables import train_variables
from ..simulation.variables import CHANNEL_NAMES, VARIABLES

OF_THE_RUN = ("energy", "time", "ideal_speed", "bandwidth")
"""further names: the ledger; the instants; the load speed of a rigid drive without inertia, friction and load under the same
command; the bandwidth [Hz] of the load speed, a function of the command's amplitude (left out: the run's own)"""


class Vocabulary(NamedTuple):
    """Of one drive, or of one drive train."""

    variables: tuple[tuple[str, str], ...]
    """result variables, each with its unit"""
    channels: tuple[str, ...]
    """those of them that the core gives; the others follow from these"""
    energies: tuple[tuple[str, str], ...]
    """entries of the ledger, each as expressions call it and as the ledger does"""
    of_the_run: tuple[str, ...]


OF_DRIVES = Vocabulary(
    tuple((v.name, v.unit) for v in VARIABLES),
    tuple(CHANNEL_NAMES),
    tuple((entry, entry) for entry in ENERGY),
    OF_THE_RUN,
)


def vocabulary_of(scenario: Scenario | TrainScenario) -> Vocabulary:
    """What expressions may name of a run of this scenario.

    An entry of a train's ledger, such as ``first_gear: mesh``, is called ``first_gear_mesh``.
    """
    if isinstance(scenario, Scenario):
        return OF_DRIVES
    core = scenario.core()
    variables = train_variables(scenario.train(), core)
    entries = core.ledger_names()
    return Vocabulary(
        tuple((v.name, v.unit) for v in variables),
        tuple(v.name for v in variables if not v.derived),
        tuple((entry.replace(": ", "_").replace(" ", "_"), entry) for entry in entries),
        ("energy", "time"),
    )
