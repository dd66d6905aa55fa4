"""The rig: the scenario that a log and values of the parameters make."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from ... import _core
from ...errors import InputError
from ...inputs.refusal_messages import did_you_mean
from ...simulation.forms.set_by_dotted_key import set_values
from ...simulation.forms.slide_units import of_slides
from ...simulation.forms.train_tables import TrainInitial
from ...simulation.runs.sensitivities import channels_of
from ...simulation.scenario.requirements import need_no_impacts
from ...simulation.scenario.scenario import Scenario
from ...simulation.scenario.scenario_files import find_scenario, load
from ...simulation.variables_of_trains import angle_terms
from ..prepared_log import Prepared
from ..task.file_formulas import Formula, names_in
from ..task.free_parameters import in_unit
from ..task.identification_file import CHANNEL_FORMULAS, Identification, MeasuredChannel, Rung
from .scenario_variants import Variants

KEPT = 800  # scenarios that are kept ready, a tenth of a megabyte each; few serve again once the search has moved on


@dataclass(frozen=True)
class Built:
    """A scenario as the solver takes it."""

    scenario: Scenario
    core: _core.Train

    @cached_property
    def names(self) -> list[str]:
        """Names of the channels of a run."""
        return [str(channel) for channel, *_ in self.core.channels()]

    @cached_property
    def smooth(self) -> list[str]:
        """Channels that have derivatives."""
        return channels_of(self.core)

    def terms(self, variable: str) -> dict[str, float]:
        """A variable of a run, or the angle of a shaft through the gears behind it, as a sum of channels; empty: it is not there."""
        if variable in self.names:
            return {variable: 1.0}
        train = self.scenario.train()
        return angle_terms(train, train.shaft_of(variable, "angle"), self.names)

    @cached_property
    def inputs(self) -> list[str]:
        """Names of the signals that act on it."""
        return self.core.input_names()

    @cached_property
    def ratios(self) -> tuple[Any, ...]:
        """Ratios of its gears, by which angles follow from each other, and other relations between angles."""
        return tuple((g.ratio, repr(g.transmission_error)) for g in self.scenario.train().gears.values())

    @cached_property
    def remembers(self) -> bool:
        """Whether a continuous controller has states of its own."""
        return any(c.system().states for c in self.scenario.continuous().values())

    @cached_property
    def start(self) -> tuple[dict[str, float], dict[str, float]]:
        """State and hysteresis capacities at the start, by name."""
        return self.scenario.start(), self.scenario.capacities()


class Rig:
    """The rig of a task, with the formulas by which logs and parameters change it.

    task: the identification.
    directory: that file names are relative to.
    """

    def __init__(self, task: Identification, directory: Path) -> None:
        loaded = load(find_scenario(task.scenario, directory))
        self.task = task = _in_long_form(task, loaded)
        self.scenario = loaded.long()
        need_no_impacts(self.scenario, "identify")
        self._variants = Variants(self.scenario)
        self._built: dict[Any, Built] = {}
        self._with_given: dict[Any, dict[str, float]] = {}
        self.units = units_of(self.scenario)
        train = self.scenario.train()
        rates = {train.variable(shaft, "angle"): train.variable(shaft, "speed") for shaft in train.shafts}
        self.rates = {angle: speed for angle, speed in rates.items() if speed in self.units}
        for name, channel in task.inputs.items():
            if name.endswith("_given_acceleration") and name in self._signals():
                raise InputError("follows from the given speed; give that alone", f"inputs.{name}")
            if channel.interpolation == "hold" and name.endswith("_given_speed"):
                raise InputError('"hold" would make the speed jump; leave it out', f"inputs.{name}.interpolation")
            if channel.smoothing > 0.0 and not name.endswith("_given_speed"):
                raise InputError("is of a given speed alone; give filter_time", f"inputs.{name}.smoothing")
            if name not in self._signals():
                meant = did_you_mean(name, self._signals(), f"what acts on the rig is {', '.join(self._signals())}")
                raise InputError(f"is nothing that acts on {task.scenario}; {meant}", f"inputs.{name}")
        for name, m in task.measured.items():
            if m.variable not in self.units:
                meant = did_you_mean(m.variable, self.units, f"its variables are {', '.join(self.units)}")
                raise InputError(
                    f"{m.variable!r} is no variable of {task.scenario}; {meant}", f"measured.{name}.variable"
                )
            if isinstance(m.resolution, float) and m.resolution < 0.0:
                raise InputError(f"{m.resolution:g} must be at least 0", f"measured.{name}.resolution")
        self.deviations = {name: self._deviation(name, m) for name, m in task.measured.items()}
        table, _, gear = task.record.partition(".")
        if task.record and (table != "gear" or gear not in self.scenario.gears):
            raise InputError(
                f"{task.record!r} must be gear.NAME with one of {', '.join(self.scenario.gears) or 'no gear'}", "record"
            )
        self._formulas: dict[tuple[int, int], dict[str, Any]] = {}
        self._keys: dict[tuple[str, int, int], list[str]] = {}
        self._set = {key: _read(value, f"set.{key}") for key, value in task.set.items()}
        self._phases = [
            {key: _read(v, f"phases[{k}].set.{key}") for key, v in p.set.items()} for k, p in enumerate(task.phases)
        ]
        self._rungs: list[dict[str, Any]] = []
        for k, rung in enumerate(task.rungs()):
            own = {key: _read(v, f"ladder[{k}].set.{key}") for key, v in rung.set.items()}
            self._rungs.append({**(self._rungs[-1] if self._rungs else {}), **own})
        self._refuse_idle()

    def _deviation(self, name: str, channel: MeasuredChannel) -> float | None:
        """Standard deviation of the errors of a measured channel [SI]; None: the task gives none."""
        key = f"measured.{name}.deviation"
        try:
            found = in_unit(channel.deviation, self.units[channel.variable])
        except ValueError as problem:
            raise InputError(str(problem), key) from None
        if found is not None and not 0.0 < found < math.inf:
            raise InputError(f"{found:g} must be above 0", key)
        return found

    def _refuse_idle(self) -> None:
        """A parameter that is sought and enters nothing."""
        task = self.task
        entered = names_in([self._set, *self._phases, *self._rungs])
        for channel in (*task.inputs.values(), *task.measured.values()):
            entered |= names_in([getattr(channel, key, None) for key in CHANNEL_FORMULAS])
        sought = [("parameters", name) for rung in task.rungs() for name in rung.free]
        for table, name in [*sought, *(("nuisance", name) for name in task.nuisance)]:
            if name not in entered:
                raise InputError(
                    "enters no formula of set, phases, ladder, inputs or measured; name it there, or leave it out",
                    f"{table}.{name}",
                )

    def rungs(self) -> tuple[Rung, ...]:
        """Models of the task."""
        return self.task.rungs()

    def _signals(self) -> list[str]:
        train = self.scenario.train()
        return [*self.scenario.signals(), *(train.variable(name, "reference") for name in self.scenario.axes())]

    def formulas(self, rung: int, phase: int) -> dict[str, Any]:
        """Formulas of the values of the scenario, by dotted key."""
        if (rung, phase) not in self._formulas:
            of_phase = self._phases[phase] if phase >= 0 else {}
            self._formulas[rung, phase] = {**self._set, **self._rungs[rung], **of_phase}
        return self._formulas[rung, phase]

    def keys_of(self, name: str, rung: int, phase: int) -> list[str]:
        """Keys of the scenario that depend on a parameter."""
        where = (name, rung, phase)
        if where not in self._keys:
            self._keys[where] = [key for key, f in self.formulas(rung, phase).items() if name in names_in(f)]
        return self._keys[where]

    def leaves_of(self, name: str, rung: int, phase: int) -> list[str]:
        """Keys as in `keys_of`, down to the keys within tables."""
        formulas = self.formulas(rung, phase)
        return [leaf for key in self.keys_of(name, rung, phase) for leaf in _leaves(formulas[key], key, name)]

    def changes(
        self, values: Mapping[str, Any], rung: int, phase: int, keys: list[str] | None = None
    ) -> dict[str, Any]:
        """Values of the scenario by dotted key.

        keys: these alone; left out, all.
        """
        formulas = self.formulas(rung, phase)
        return {key: _value(formulas[key], values, key) for key in (formulas if keys is None else keys)}

    def built(self, changes: Mapping[str, Any]) -> Built:
        """The scenario with values by dotted key; variables of the initial state are left out."""
        kept = {key: value for key, value in changes.items() if not key.startswith("initial.")}
        name = repr(kept)
        found = self._built.get(name)
        if found is None:
            scenario = self._variants(kept)
            core = scenario.core()
            found = Built(scenario, core)
            if len(self._built) >= KEPT:
                self._built.clear()
            self._built[name] = found
        return found

    def start(
        self, log: Prepared, built: Built, changes: Mapping[str, Any]
    ) -> tuple[dict[str, float], dict[str, float]]:
        """State and hysteresis capacities at the start of a log, by name."""
        given = {key: value for key, value in changes.items() if key.startswith("initial.")}
        if not given:
            return built.start
        key = ("start", built.ratios, repr(given))
        if key not in log.cache or built.remembers:
            data = {"initial": built.scenario.initial.model_dump()}
            set_values(data, given.items())
            initial = TrainInitial(**data["initial"])
            log.cache[key] = built.scenario.start(initial), built.scenario.capacities(initial)
        return log.cache[key]  # type: ignore[no-any-return]

    def driven(self, start: dict[str, float], built: Built, speeds: Mapping[str, float]) -> dict[str, float]:
        """A start with other given speeds of shafts, and of all that turns with them."""
        if not speeds:
            return start
        found = dict(start)
        for shaft, speed in speeds.items():
            change = speed - built.scenario.signals()[built.scenario.train().variable(shaft, "given_speed")].at_start()
            key = (shaft, built.ratios)
            if key not in self._with_given:
                table = built.scenario.given_key(shaft).rpartition(".")[0]
                at = [
                    built.scenario.replace(**{f"{table}.motion": None, f"{table}.speed": {"mean": v}}).start()
                    for v in (0.0, 1.0)
                ]
                self._with_given[key] = {name: b - at[0][name] for name, b in at[1].items() if b != at[0][name]}
            for name, ratio in self._with_given[key].items():
                found[name] += ratio * change
        return found

    @staticmethod
    def sets_start(built: Built, keys: Sequence[str]) -> bool:
        """Whether the state at the start follows from one of these keys: angles through gears, states of controllers."""
        return any(
            key.endswith((".ratio", ".transmission_error")) or (built.remembers and key.startswith("controllers"))
            for key in keys
        )

    def scenario_at(self, log: Prepared, values: Mapping[str, Any], rung: int) -> Scenario:
        """The scenario of the first phase of a log, without its signals, checked as any other."""
        found = self.built(self.changes({**log.facts, **values}, rung, log.segments[0].phase)).scenario
        return found.replace()


def _in_long_form(task: Identification, scenario: Scenario) -> Identification:
    """The task with the names that keys, inputs and variables of its scenario have in the long form."""
    long = {short: long for long, short in scenario.train().aliases.items()}

    def keys(values: Mapping[str, Any]) -> dict[str, Any]:
        return {scenario.form.in_long(key): value for key, value in values.items()}

    return task.model_copy(
        update={
            "inputs": {long.get(name, name): channel for name, channel in task.inputs.items()},
            "measured": {
                name: m.model_copy(update={"variable": long.get(m.variable, m.variable)})
                for name, m in task.measured.items()
            },
            "set": keys(task.set),
            "phases": tuple(p.model_copy(update={"set": keys(p.set)}) for p in task.phases),
            "ladder": tuple(r.model_copy(update={"set": keys(r.set)}) for r in task.ladder),
        }
    )


def units_of(scenario: Scenario) -> dict[str, str]:
    """SI units of its result variables, and of what acts on it."""
    units = {str(name): str(unit) for name, _, unit, _ in scenario.core().channels()}
    train, kinds = scenario.train(), {"position": "rad", "speed": "rad/s", "torque": "N*m"}
    units |= {
        train.variable(name, "angle"): train.angle_unit(name)
        for name in train.shafts
        if angle_terms(train, name, units)
    }
    units |= {train.variable(name, "given_speed"): train.speed_unit(name) for name in scenario.given()}
    for name, m in train.motors.items():
        command = train.variable(name, "command")
        units.setdefault(command, "1")
        if m.kind == "torque_source" and m.rated_torque == 1.0:  # a torque is its own multiple of 1 N m
            units[command] = units.get(train.variable(name, "torque"), "N*m")
    for name, c in scenario.axes().items():
        motor, position = scenario.sliding()[scenario.prefix(name)]
        slides = position and c.reference.kind != "torque"
        units[train.variable(name, "reference")] = of_slides(kinds[c.reference.kind], positions=slides, forces=motor)
    return units


def _leaves(node: Any, key: str, name: str) -> list[str]:
    """Keys within a value whose formulas name something."""
    if isinstance(node, dict):
        return [leaf for k, inner in node.items() for leaf in _leaves(inner, f"{key}.{k}", name)]
    return [key] if name in names_in(node) else []


def _read(value: Any, key: str) -> Any:
    """Formulas of a value of a scenario; texts that are none stay what they are, such as ``"3 N*m"`` or a name."""
    if isinstance(value, list | tuple):
        return [_read(x, key) for x in value]
    if isinstance(value, dict):
        return {k: _read(x, f"{key}.{k}") for k, x in value.items()}
    if not isinstance(value, str):
        return value
    try:
        return Formula(value)
    except ValueError:
        return value


def _value(node: Any, values: Mapping[str, Any], key: str) -> Any:
    if isinstance(node, list):
        return [_value(x, values, key) for x in node]
    if isinstance(node, dict):
        return {k: _value(x, values, f"{key}.{k}") for k, x in node.items()}
    if not isinstance(node, Formula):
        return node
    if node.names == {node.text} and node.text not in values:  # a word, such as the kind of a stiffness
        return node.text
    try:
        return node.value(values)
    except ValueError as problem:
        raise InputError(problem, f"set.{key}") from None
