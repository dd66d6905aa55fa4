"""Plant of a response: a drive or a drive train, with its inputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from .. import _core
from ..control.command import CommandSignal, CurrentLevel, FieldAngle
from ..control.controller import AnyReference
from ..errors import InputError
from ..inputs.refusal_messages import listed, shown
from ..model.drive import Drive
from ..model.signals import Signal
from ..simulation.scenario.requirements import need_free_motion, need_open_loop
from ..simulation.scenario.scenario import Scenario
from ..simulation.variables import Variable
from ..simulation.variables_of_trains import REFERENCE_UNITS, axis_variables, only_input


@dataclass(frozen=True)
class Plant:
    """A drive or a train as the search for periodic motions takes it: with commands, or with controllers and their references."""

    scenario: Scenario
    signals: Mapping[str, Signal[Any]]  # by the name of their variable; of open loops in the order of the core
    source: str | None  # the input that is meant if none is named: command or reference of the only motor
    channels: tuple[str, ...]
    variables: tuple[Variable, ...]  # the channels, and what is derived from them
    output: str  # the variable that is looked at if none is named: the speed of the load
    references: Mapping[str, AnyReference] = field(default_factory=dict)
    """references of its controllers, by the name of the input"""

    @property
    def closed(self) -> bool:
        """Whether controllers turn its motors."""
        return bool(self.references)

    @cached_property
    def start(self) -> dict[str, float]:
        """Initial state of the scenario, by component; missing values are 0."""
        return self.start_of(self.scenario.initial)

    @cached_property
    def rest(self) -> dict[str, float]:
        """Initial state of responses: at rest, with the angles and twists of the scenario, on which gravity may depend."""
        return self.start_of(self.scenario.tables.initial.at_rest())

    def start_of(self, initial: Any) -> dict[str, float]:
        """The same of another initial state."""
        scenario, train = self.scenario, self.scenario.train()
        capacities = scenario.capacities(initial).items()
        return scenario.start(initial) | {train.variable(name, "hysteresis_capacity"): h for name, h in capacities}

    @property
    def angle(self) -> str:
        """Angle whose advance over a period is reported: the angle of the load."""
        train = self.scenario.train()
        return train.variable(list(train.shafts)[-1], "angle")

    def floors(self) -> dict[str, float]:
        """Rated magnitudes of the variables by which motions are compared."""
        train = self.scenario.train()
        found = {train.variable(name, "speed"): 0.0 for name in train.shafts}
        for name, gear in train.gears.items():
            found |= {train.variable(name, "output_torque"): gear.rated_output_torque or 0.0}
            found |= {train.variable(name, "twist"): 0.0}
            if (rated := gear.rated_input_speed) is not None:
                found |= {train.variable(gear.input, "speed"): rated}
                found |= {train.variable(gear.output, "speed"): rated / abs(gear.ratio)}
        return found

    def known_source(self, source: str | None) -> str:
        """The name of an input, if it is one, or of the only motor's command or reference."""
        names = [*self.references, *self.signals]
        listed = " or ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
        if source is None and self.source is None:
            raise InputError(f"source is missing, and there is not one motor alone; name an input: {listed}")
        if source is not None and source not in names:
            raise InputError(f"source {shown(source)} is not known; it must be {listed}")
        return source or self.source or ""

    def known_output(self, output: str | None) -> str:
        """The name of an output, if it is one, or of the speed of the load."""
        return self.output if output is None else known_output(output, self.channels)

    def unit(self, source: str) -> str:
        """Unit of an input."""
        if source in self.references:
            return REFERENCE_UNITS[self.references[source].kind]
        return next(v.unit for v in self.variables if v.name == source)

    def with_means(self, command: float | None, load_torque: float | None) -> Plant:
        """The same with another constant part of the one command and the one load torque.

        Raises InputError: there is none, or there are several.
        """
        wanted = {}
        for word, mean in (("command", command), ("load_torque", load_torque)):
            if mean is None:
                continue
            if word == "command" and self.closed:
                raise InputError(
                    "mean_command: a controller turns the motor; the constant part of its reference is that of the scenario"
                )
            wanted[only_input(self.scenario.train(), word, self.signals, f"mean_{word}")] = mean
        means = {name: type(s)(mean=wanted.get(name, s.mean)) for name, s in self.signals.items()}
        return replace(self, signals=means)

    def sine(self, source: str, amplitude: float, frequency: float) -> list[_core.Signal]:
        """The inputs of one point: their constant parts, and a sine on the source."""
        waves = {source: {"amplitude": amplitude, "frequency": frequency}}
        return [
            type(s).model_validate({"mean": s.mean, **waves.get(name, {})}).core() for name, s in self.signals.items()
        ]


def plant_of(what: Drive | Scenario) -> Plant:
    """The plant of a drive without inputs, or of a scenario with its own commands."""
    scenario = Scenario.of_any(what)
    need_open_loop(scenario, "response")
    return _plant_of(scenario)


def plant_or_loop(drive: Drive | Scenario) -> Plant:
    """The same, or of a scenario with controllers what these and the plant are together."""
    what = Scenario.of_any(drive)
    plant = _plant_of(what)
    if not what.axes():
        return plant
    axes = what.axes()
    train = what.train()
    references = {train.variable(motor, "reference"): c.reference for motor, c in axes.items()}
    commands = [train.variable(motor, "command") for motor in axes]
    shown_by = [v for v in axis_variables(what.by_prefix(), what.sliding()) if v.unit != "J"]  # which add up
    first, controller = next(iter(axes.items()))
    measured = {"position": "measured_position", "speed": "measured_speed", "torque": "torque"}[
        controller.reference.kind
    ]
    own = (
        *(
            Variable(name, "", REFERENCE_UNITS[r.kind], f"{r.kind} that the controller follows")
            for name, r in references.items()
        ),
        *shown_by,
    )
    return replace(
        plant,
        signals={name: s for name, s in plant.signals.items() if name not in commands},
        references=references,
        source=next(iter(references)) if len(references) == 1 else None,
        channels=(*plant.channels, *(v.name for v in own)),
        variables=(*plant.variables, *own),
        output=train.variable(first, measured),
    )


def _plant_of(scenario: Scenario) -> Plant:
    need_free_motion(scenario, "response")
    train = scenario.train()
    core = scenario.core(sampled=False)
    signals, source = scenario.signals(), None
    if len(train.motors) == 1:
        motor = next(iter(train.motors))
        source = train.variable(motor, "reference" if motor in scenario.continuous() else "command")
    return Plant(
        scenario=scenario,
        signals={name: _without_steps(signals[name]) for name in core.input_names()},
        source=source,
        channels=tuple(name for name, *_ in core.channels()),
        variables=scenario.variables(),
        output=train.variable(list(train.shafts)[-1], "speed"),
    )


def _without_steps(signal: Signal[Any]) -> Signal[Any]:
    """The angle of a stepper's field where it starts, at the current of its motion; any other signal as it is."""
    if isinstance(signal, FieldAngle):
        return CommandSignal(mean=signal.start)
    return CommandSignal(mean=1.0) if isinstance(signal, CurrentLevel) else signal


def known_output(output: str, known: Sequence[str]) -> str:
    """The name of an output, if it is a known one."""
    if output not in known:
        raise InputError(f"output {shown(output)} is not known; it must be one of {listed(known)}")
    return output
