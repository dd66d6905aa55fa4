"""Parts and inputs of a simulation that is advanced step by step, with the lines that refuse them."""

from collections.abc import Mapping, Sequence
from typing import Any

from ... import _core
from ...errors import InputError, prefixed
from ...inputs.quantities import argument
from ...inputs.refusal_messages import did_you_mean, shown
from ...model.drive import Drive
from ...model.mass_matrix import MassMatrix
from ...model.train import DriveTrain
from ..scenario.scenario import Scenario
from ..variables_of_trains import check_names

GIVE: Any = object()  # in place of what has no default

StepInput = float | str | tuple[float | str, float | str]

MIN_INTERVAL, MAX_INTERVAL = 1e-12, 1e12
"""limits of a step [s]: a shorter one is lost in the rounding of the time, a longer one in the rounding of a motion's phase"""


def parts(
    what: Drive | Scenario | DriveTrain, loaded: Sequence[str] | None, given: Sequence[str] | None
) -> tuple[Scenario, _core.Train, tuple[str, ...], tuple[str, ...]]:
    """Parts of a simulation: its scenario, the solver's train, the loadable shafts, and those whose motion is given.

    A load torque may act on all shafts of a train alone.

    Raises InputError: one of them is no shaft, or names of variables coincide.
    """
    scenario = Scenario.of_any(what)
    if isinstance(what, DriveTrain) and loaded is None:
        loaded = list(what.shafts)
    if loaded is None and given is None:
        return scenario, scenario.core(), tuple(scenario.loaded()), tuple(scenario.given())
    scenario = scenario.long()
    train = scenario.train()
    for key, names in (("loaded", loaded), ("given", given)):
        for name in names or ():
            if name not in train.shafts:
                meant = did_you_mean(name, train.shafts, f"the shafts are {', '.join(train.shafts)}")
                raise InputError(f"{key}: {shown(name)} is no shaft of this train; {meant}")
    core = scenario.core(loaded=loaded, given=given)
    train.check(core)
    check_names(train, core)
    shafts = scenario.loaded() if loaded is None else loaded
    return scenario, core, tuple(shafts), tuple(scenario.given() if given is None else given)


def masses_given(masses: Mapping[str, MassMatrix], given: Any) -> dict[str, MassMatrix]:
    """The mass matrices that `advance` is given, by name."""
    if not isinstance(given, Mapping):
        raise InputError(f"mass_matrix: {shown(given)} is no dictionary; give the rows by the name of the matrix")
    found = {}
    for name, matrix in given.items():
        if name not in masses:
            known = f"the mass matrices are {', '.join(masses) or 'none'}"
            raise InputError(f"mass_matrix.{shown(name)}: is none of this train; {did_you_mean(name, masses, known)}")
        with prefixed(f"mass_matrix.{name}"):
            found[name] = MassMatrix(shafts=masses[name].shafts, matrix=matrix)
    return found


def no_interval(time: float, interval: float) -> InputError:
    """Refusal of an interval that `advance` is given."""
    if not MIN_INTERVAL <= interval <= MAX_INTERVAL:
        return InputError(f"interval {shown(interval)} s must lie between {MIN_INTERVAL:g} s and {MAX_INTERVAL:g} s")
    return InputError(
        f"interval {interval} s is below the resolution of the time, {time} s; take a longer one, or reset"
    )


def no_input(train: DriveTrain, inputs: Sequence[str], name: str) -> InputError:
    """Refusal of an input that `advance` is given."""
    if shaft := train.shaft_of(name, "load_torque"):
        word = train.torque_word(shaft)
        kind = "slide" if word == "force" else "shaft"
        return InputError(f'{name}: no load {word} acts on this {kind}; make the simulation with loaded=["{shaft}"]')
    meant = did_you_mean(name, inputs, f"the inputs are {', '.join(inputs)}")
    return InputError(f"{name}: is no input of this train; {meant}")


def ends_of(name: str, value: Any, unit: str) -> tuple[float, float]:
    """The values of an input at both ends of an interval.

    Raises InputError: it is neither a number nor a pair of numbers.
    """
    if type(value) is float and value - value == 0.0:  # nearly always
        return value, value
    if not isinstance(value, tuple):
        number = argument(name, value, unit)
        return number, number
    if len(value) != 2:
        raise InputError(f"{name}: {shown(value)} must be a number, or a pair of numbers (begin, end)")
    return argument(name, value[0], unit), argument(name, value[1], unit)
