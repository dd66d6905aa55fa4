"""Why a drive or a train is stuck: what holds each contact, and what would free it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ... import _core
from ...errors import InputError
from ...inputs.argument_checks import checked
from ...inputs.quantities import Time
from ...model.end_stops import END_STOP
from ...model.self_locking import SelfLocking, self_locking
from ...model.signals import core_signal
from ...model.train import DriveTrain
from ...reproducible import sin
from ...units.practical import charted
from ..scenario.scenario import Scenario
from ..stepping.simulation import Simulation
from ..stepping.step_inputs import MAX_INTERVAL
from .core_runs import core_case

CHORDS = 1000  # of a period of an input


@dataclass(frozen=True)
class ContactState:
    """One dry contact at one instant. Torques [N·m] at the contact: input shaft at the input, the others at the output."""

    name: str
    mode: int  # -1 slips in reverse, 0 stuck, +1 slips forward
    speed: float  # [rad/s]
    torque: float  # held, or while slipping taken
    capacity_forward: float  # it holds torques up to this before it slips forward
    capacity_backward: float  # and down to minus this before it slips in reverse
    shares: dict[str, tuple[float, float]] = field(default_factory=dict)  # of a train: of the capacities, by element
    determined: bool = True
    """False: rest leaves open how much of a load it holds and how much others that are rigid do; `torque` is one such share"""
    slides: bool = False  # along a straight line: [m/s] and [N] in place of [rad/s] and [N·m]
    reach: float | None = None
    """half the gap of what strikes: the backlash of rigid flanks, at the output, or the travel between end stops; None of other contacts"""
    twist: float = 0.0
    """twist of these flanks, or place between the stops, from minus `reach` to `reach`"""

    @property
    def to_free_forward(self) -> float:
        """Torque [N·m] that is missing until it slips forward."""
        return self.capacity_forward - self.torque

    @property
    def to_free_backward(self) -> float:
        """Torque [N·m], backward, that is missing until it slips in reverse."""
        return self.capacity_backward + self.torque

    def __str__(self) -> str:
        if self.determined or self.mode != 0:
            return self._told()
        return f"{self._told()} (not determined: others hold with it; give what is rigid a stiffness)"

    def _told(self) -> str:
        unit = "N" if self.slides else "N·m"
        if self.reach is not None:
            if self.mode == 0:
                what = "pressed with" if END_STOP in self.name else "the flanks touch and press with"
                return f"{self.name}: {what} {abs(self.torque):.4g} {unit}"
            length_unit, per_second = ("m", "m/s") if self.slides else ("rad", "rad/s")
            return (
                f"{self.name}: in the gap, at {_shown(self.twist, length_unit)} of -{_shown(self.reach, length_unit)} to {_shown(self.reach, length_unit)}, "
                f"changing by {_shown(self.speed, per_second)}"
            )
        if self.mode != 0:
            way = "forward" if self.mode > 0 else "backward"
            speed = _shown(self.speed, "m/s" if self.slides else "rad/s")
            return f"{self.name}: slips {way} at {speed}, taking {abs(self.torque):.4g} {unit}"
        if math.isinf(self.capacity_forward):
            return f"{self.name}: rigid, holds {self.torque:.4g} {unit}"
        parts = [f"{name} +{forward:.4g} / -{backward:.4g}" for name, (forward, backward) in self.shares.items()]
        composition = f" ({', '.join(parts)})" if len(parts) > 1 else ""
        return (
            f"{self.name}: stuck, holds {self.torque:.4g} {unit} of +{self.capacity_forward:.4g} / "
            f"-{self.capacity_backward:.4g} {unit}{composition}; {self.to_free_forward:.4g} {unit} more frees it forward, "
            f"{self.to_free_backward:.4g} {unit} in reverse"
        )


def _shown(speed: float, si: str) -> str:
    unit, factor = charted(si)
    return f"{factor * speed:.4g} {unit}"


@dataclass(frozen=True)
class MotorState:
    """One motor of a train at one instant, and the constant commands from which on its shaft goes on turning.

    The motor is thought to wind up slowly all that it has to turn, from the present torques of the gears. It turns
    each shaft that gears and clutches join to its own, against its load, its friction and the other motors, whose
    commands stay. Clutches slip at their capacity. A damper acts on a shaft at rest with the present speed of its
    other shaft. Inertia is left out, and torques over angles belong to the present angles. Exact in trains without
    branches, and with them unless a self-locking gear overruns beside another (then an upper bound);
    docs/drive-trains.md says more.
    """

    name: str
    command: float
    torque: float  # [N·m]
    command_forward: float  # above it the shaft turns forward; infinite: never; NaN: not determined by statics
    command_backward: float  # below it, backward
    command_limit: float  # that the motor can follow
    slides: bool = False  # a linear motor: its torque is a force [N]
    steps: bool = False  # a stepper: its command is the angle of its field [rad]

    def __str__(self) -> str:
        if self.steps:
            return f"motor {self.name}: its shaft follows its field, which is at {self.command:.4g} rad, in steps"
        ways = (("forward", "above", self.command_forward), ("backward", "below", self.command_backward))
        turns = []
        moves = "slide moves" if self.slides else "shaft turns"
        for way, beyond, command in ways:
            if math.isnan(command):
                turns.append(
                    f"{way} at a command that statics do not determine (gears in a loop, or a housing that turns)"
                )
            elif math.isinf(command):
                turns.append(f"{way} at no command (a gear locks itself, or something holds without limit)")
            else:
                limit = (
                    f", but it ends at {self.command_limit:.4g} and cannot reach that"
                    if abs(command) > self.command_limit
                    else ""
                )
                turns.append(f"{way} with a constant command {beyond} {command + 0.0:.4g}{limit}")
        return f"motor {self.name}: its {moves} {', '.join(turns)}"


@dataclass(frozen=True)
class Explanation:
    """The contacts of a drive or a train at one instant, and the commands that would turn its motors."""

    time: float  # [s]
    values: dict[str, float]  # channels at this instant
    contacts: tuple[ContactState, ...]
    motors: tuple[MotorState, ...]
    shafts: tuple[str, ...]
    """shafts and slides"""
    self_locking: tuple[
        SelfLocking, ...
    ]  # of the gears that lock or chatter under their present torque, or the rated one
    slides: tuple[str, ...] = ()
    """shafts that move along a straight line"""

    @property
    def command_forward(self) -> float:
        """The command above which the only motor turns forward."""
        (motor,) = self.motors
        return motor.command_forward

    @property
    def command_limit(self) -> float:
        """The command that the only motor can follow."""
        (motor,) = self.motors
        return motor.command_limit

    @property
    def command_backward(self) -> float:
        """The command below which the only motor turns backward."""
        (motor,) = self.motors
        return motor.command_backward

    def __str__(self) -> str:
        motors = [
            f"{m.name} {m.torque:.4g} {'N' if m.slides else 'N·m'} at command {m.command:.4g}" for m in self.motors
        ]
        speeds = [
            f"{name} {_shown(self.values[f'{name}_speed'], 'm/s' if name in self.slides else 'rad/s')}"
            for name in self.shafts
        ]
        lines = [
            f"t = {self.time:.6g} s: {', '.join([*motors, *speeds])}",
            *(f"  {contact}" for contact in self.contacts),
        ]
        if self.motors:
            lines.append("  from rest, all else as it is:")
        lines += [f"    {motor}" for motor in self.motors]
        return "\n".join([*lines, *(f"  {verdict}" for verdict in self.self_locking)])


@checked
def explain(what: Scenario | Simulation, time: Time | None = None) -> Explanation:
    """Report the state of the contacts of a drive or a train at one instant.

    Parameters
    ----------
    what : Scenario or Simulation
        A scenario, which is run to `time`, or a simulation in its present state.
    time : float, optional
        Instant [s], for a scenario.

    Returns
    -------
    Explanation
        Print it, or read its numbers. The commands that would turn a motor leave inertia out; see `MotorState`.

    Raises
    ------
    InputError
        The time is missing, or outside the scenario's duration.

    Examples
    --------
    >>> import lostmotion as lm
    >>> explanation = lm.explain(lm.load("paper-2dof-nl-small"), time=0.1)
    >>> [contact.name for contact in explanation.contacts]
    ['input_contact', 'twist_contact']
    """
    if isinstance(what, Simulation):
        if time is not None:
            raise InputError("a simulation is explained at its present time; leave time out")
        with what._turn:
            now, found = what.time, what._idle().explain()
        return _explanation(what._train, what._core_train, now, **found)
    if time is None:
        raise InputError(f"time is missing; give one between 0 and the duration, {what.simulation.duration} s")
    if not 0.0 <= time <= what.simulation.duration:
        raise InputError(f"time {time} s must lie between 0 and the duration, {what.simulation.duration} s")
    if what.axes():
        return explain(_followed(what, time))
    return _explanation(what.train(), what.core(), time, **_core.explain_at(core_case(what), time))


def _followed(scenario: Scenario, time: float) -> Simulation:
    """A scenario with sampled controllers, stepped to a time.

    Its inputs run in straight lines from one of their breakpoints to the next, and along their sines in chords.
    """
    simulation = Simulation(scenario, step=min(MAX_INTERVAL, scenario.simulation.duration))
    signals = {name: scenario.signals()[name] for name in simulation.inputs}
    lists = {name: signal.breakpoint_list() for name, signal in signals.items()}
    instants = {0.0, time, *(point[0] for points in lists.values() for point in points)}
    for signal in signals.values():
        for _, frequency, _ in signal.sine_list():
            instants |= set(np.arange(0.0, time, 1.0 / (CHORDS * frequency)).tolist())
    for begin, end in itertools.pairwise(sorted(t for t in instants if t <= time)):
        given: dict[str, Any] = {}
        for name, points in lists.items():
            piece = [point for point in points if point[0] <= begin][-1]
            sines = [
                sum(a * sin(2.0 * math.pi * f * t + p) for a, f, p in signals[name].sine_list()) for t in (begin, end)
            ]
            given[name] = tuple(
                piece[1] + piece[2] * (t - piece[0]) + s for t, s in zip((begin, end), sines, strict=True)
            )
        simulation.advance(end - begin, **given)
    return simulation


def smallest_commands(scenario: Scenario, loads: Mapping[str, float] = {}) -> tuple[float, float]:
    """Constant commands of the one motor beyond which it turns its load from rest, forward and backward.

    Controllers are taken away. `loads` are load torques by the names of their variables [N·m, of slides N].
    """
    core = scenario.core(sampled=False)
    inputs = [core_signal([(0.0, loads.get(name, 0.0), 0.0)]) for name in core.input_names()]
    (motor,) = _core.explain_at(_core.Case(core, inputs=inputs), 0.0)["motors"]
    return motor["command_forward"], motor["command_backward"]


def _explanation(
    train: DriveTrain,
    core: _core.Train,
    time: float,
    values: list[float],
    contacts: list[dict[str, Any]],
    motors: list[dict[str, Any]],
) -> Explanation:
    named = dict(zip((name for name, *_ in core.channels()), values, strict=True))
    slides = tuple(name for name in train.shafts if train.is_slide(name))
    sliding = {train.variable(name, "contact") for name in slides}
    sliding |= {train.variable(n, "twist_contact") for n, gear in train.gears.items() if train.is_slide(gear.output)}
    sliding |= {train.variable(name + END_STOP, "contact") for name in slides}
    flanks, states = train.flanks(), []
    for contact in contacts:
        own: dict[str, Any] = {"slides": contact["name"] in sliding, "reach": None, "twist": 0.0}
        if contact["name"] in flanks:
            between, low, high = flanks[contact["name"]]
            own |= {"reach": 0.5 * (high - low), "twist": named[between] - 0.5 * (low + high)}
        states.append(ContactState(**contact, **own))
    turned = []
    for commands in motors:
        name, motor = commands["name"], train.motors[commands["name"]]
        limits = (motor.command_limit, None if motor.torque_limit is None else motor.torque_limit / motor.rated_torque)
        limit = min(limit for limit in (*limits, math.inf) if limit is not None)
        command, torque = named[train.variable(name, "command")], named[train.variable(name, "torque")]
        given: dict[str, Any] = {
            "command_limit": limit,
            "slides": train.is_slide(motor.shaft),
            "steps": motor.kind == "stepper",
        }
        turned.append(MotorState(**commands, **given, command=command, torque=torque))
    locking = tuple(_verdicts(train, named))
    return Explanation(time, named, tuple(states), tuple(turned), tuple(train.shafts), locking, slides)


def _verdicts(train: DriveTrain, named: dict[str, float]) -> Iterator[SelfLocking]:
    if train.fixed_gears() != train.gears:
        return
    for name, gear in train.gears.items():
        carried = abs(named[train.variable(name, "output_torque")])
        torque = named.get(train.variable(gear.output, "load_torque"), carried) or gear.rated_output_torque
        if torque and (verdict := self_locking(train, name, torque)).notable:
            yield verdict
