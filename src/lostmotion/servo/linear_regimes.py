"""The linear regimes of an axis that decide on its loops: pieces of the torsion curve, and what sticks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from .. import _core
from ..control.axis import core_control
from ..control.controller import Controller
from ..errors import InputError, need
from ..inputs.refusal_messages import chosen_motor
from ..model.gear import Gear
from ..model.shaft_ratio import tied, turns
from ..model.signals import ForceSignal, TorqueSignal, core_signal
from ..model.torsion import Elastic, Rigid
from ..response.linearisation import LinearModel, train_model
from ..simulation.forms.train_tables import TrainInitial
from ..simulation.scenario.requirements import need_free_motion
from ..simulation.scenario.scenario import Scenario
from ..units.practical import charted, printed
from .winding import OrientedWinding

if TYPE_CHECKING:
    from ..model.train import DriveTrain

SLIP = (
    1e-6  # relative difference of the speeds at both ends of a gear with hysteresis, so that its twist does not stick
)
HELD = 0.45  # share of the friction of a stuck load that the damping of the mesh may take
LOAD_STUCK = "load stuck"  # regime in which friction holds the load and the motor turns against the main gear
BEYOND = 1.5  # times the last breakpoint: a twist in the last piece of a torsion curve


@dataclass(frozen=True)
class Axis:
    """One motor under a controller, in a scenario of the long form."""

    scenario: Scenario
    motor: str

    @cached_property
    def train(self) -> DriveTrain:
        return self.scenario.train()

    @property
    def controller(self) -> Controller:
        return self.scenario.axes()[self.motor]

    @property
    def motor_shaft(self) -> str:
        return self.train.motors[self.motor].shaft

    @property
    def shaft(self) -> str:
        """Shaft of the position and the speed of the reference."""
        return self.controller.shaft or list(self.train.shafts)[-1]

    @cached_property
    def measured(self) -> dict[str, tuple[str, str]]:
        """Result variable and unit of what its loops control: torque and speed of the motor, position at the reference's shaft."""
        train = self.train
        return {
            "torque": (train.variable(self.motor, "torque"), printed(train.torque_unit(self.motor_shaft))),
            "speed": (train.variable(self.motor_shaft, "speed"), train.speed_unit(self.motor_shaft)),
            "position": (train.variable(self.shaft, "angle"), train.angle_unit(self.shaft)),
        }

    @cached_property
    def ratio(self) -> float:
        """Turns of the motor for one of that shaft."""
        return turns(self.train, self.motor_shaft, self.shaft) or 1.0

    @cached_property
    def law(self) -> tuple[_core.Axis, str, str]:
        """The controller as the solver has it, and the shafts whose angles its position and its speed are read from."""
        (law,) = core_control(self.train, {self.motor: self.controller})[1]
        shafts = list(self.train.shafts)
        return law, shafts[law.position_shaft], shafts[law.speed_shaft]

    @cached_property
    def position_encoder(self) -> tuple[str, float]:
        """Shaft at which the position is read, and the step of its encoder at the shaft of the reference [rad], of a slide [m]."""
        c, (_, position, speed) = self.controller, self.law
        shaft, encoder = (speed, c.encoder) if c.position_encoder is None else (position, c.position_encoder)
        step = 0.0 if encoder is None else encoder.step
        return shaft, step / abs(turns(self.train, shaft, self.shaft) or 1.0)

    @property
    def loops(self) -> tuple[str, ...]:
        """Names of the loops that are closed, the innermost first."""
        c = self.controller
        oriented = c.current.kind == "field_oriented"
        present = {
            "direct current": oriented,
            "current": oriented or c.current.kind == "pi",
            "speed": c.speed is not None,
            "position": c.position is not None,
        }
        return tuple(name for name, there in present.items() if there)

    def main_gear(self) -> str | None:
        """The gear with the least stiffness, seen from the motor; None if all are rigid."""
        train, found = self.train, {}
        for name, gear in train.gears.items():
            i = turns(train, self.motor_shaft, gear.output)
            if i is not None and not isinstance(gear.stiffness, Rigid):
                found[name] = _last_slope(gear.stiffness) / i**2
        return min(found, key=lambda name: found[name]) if found else None


def axis_of(scenario: Scenario, motor: str | None = None) -> Axis:
    """The axis of a scenario.

    motor: whose controller is looked at; may be left out where there is one.

    Raises InputError: there is no controller, there are several, or its loops are a function (law = true).
    """
    need_free_motion(scenario, "servo")
    without = "the scenario has no sampled controller; add a [controller] table with reference, speed loop and encoder"
    name = chosen_motor(motor, scenario.axes(), "controllers", without)
    if scenario.axes()[name].law:
        raise InputError(
            f"the controller of {name} has law = true, a function whose loops are not known; give it loops"
        )
    if scenario.axes()[name].firmware is not None:
        raise InputError(
            f"the controller of {name} has a firmware, whose duty cycle is not linear in the error; see its answers with response"
        )
    axis = _loaded(Axis(scenario.long(), name))
    if not axis.loops:
        raise InputError(
            f'the controller of {name} closes no loop; give it a speed loop, or current.kind = "pi" or "field_oriented"'
        )
    return axis


def _loaded(axis: Axis) -> Axis:
    """The axis with its reference's shaft open to a load torque, against which it has a stiffness."""
    scenario = axis.scenario
    if axis.shaft in scenario.loads():
        return axis
    table, key, none = (
        ("slides", "force", ForceSignal()) if axis.train.is_slide(axis.shaft) else ("shafts", "torque", TorqueSignal())
    )
    elements = getattr(scenario, table)
    open_to_load = elements[axis.shaft].model_copy(update={key: none})
    return Axis(scenario.model_copy(update={table: {**elements, axis.shaft: open_to_load}}), axis.motor)


@dataclass(frozen=True)
class Regime:
    """A linear regime of the plant, with the name of what decides on it."""

    name: str
    meaning: str
    model: LinearModel
    over_tick: np.ndarray
    """Phi and Gamma of x[k+1] = Phi x[k] + Gamma u[k], u the command of the motor held over a base tick: (n, n + 1)"""
    winding: OrientedWinding | None = None
    """winding of a motor under field-oriented control, whose command is the torque of its currents"""

    @property
    def load_moves(self) -> bool:
        """Whether the load can follow a reference: bandwidths belong to such regimes alone."""
        return self.name != LOAD_STUCK

    @classmethod
    def of(cls, axis: Axis, name: str, meaning: str, model: LinearModel) -> Regime:
        """The regime with its transition over a base tick of the axis, by the matrix exponential."""
        need("scipy", "The analysis of a loop", "control")
        from scipy.linalg import expm

        n = len(model.states)
        block = np.zeros((n + 1, n + 1))
        block[:n, :n], block[:n, n] = (
            model.A,
            model.B[:, model.inputs.index(axis.train.variable(axis.motor, "command"))],
        )
        over_tick = expm(block * axis.controller.sample_time)[:n]
        winding, law = None, axis.law[0]
        if law.is_oriented:
            winding = OrientedWinding.of(axis.train, axis.motor, axis.controller, law, model)
        return cls(name, meaning, model, over_tick, winding)


def regimes(axis: Axis) -> list[Regime]:
    """The regimes that an axis is commissioned in: each characteristic piece of its main gear, and what may stick in it."""
    found: list[Regime] = []
    for name, meaning, state, wanted in _points(axis):
        model = model_at(axis.scenario, state)
        if all(model.contacts.get(contact) == mode for contact, mode in wanted.items()):
            found.append(Regime.of(axis, name, meaning, model))
    return found


def case_at(scenario: Scenario, state: TrainInitial | None = None) -> _core.Case:
    """A scenario without commands and loads, in a state or at its start, as the core takes it."""
    core = scenario.core()
    zeros = [core_signal([(0.0, 0.0, 0.0)]) for _ in core.input_names()]
    capacities = scenario.capacities(state)
    return _core.Case(core, inputs=zeros, start=scenario.start(state), hysteresis_capacities=capacities)


def model_at(scenario: Scenario, state: TrainInitial) -> LinearModel:
    """The linear model of the regime of a state."""
    return train_model(scenario.train(), scenario.core(), **_core.linearize_at(case_at(scenario, state), 0.0))


def _points(axis: Axis) -> Iterator[tuple[str, str, TrainInitial, dict[str, int]]]:
    """Name, meaning, state, and the modes of contacts without which the regime is not there."""
    train, v = axis.train, speed_of(axis)
    main = axis.main_gear()
    moving = f"moving forward at {_text(v, train.speed_unit(axis.shaft))}"
    if main is None:
        yield "rigid", f"all gears rigid, {moving}", TrainInitial(speeds=_speeds(axis, v, SLIP)), {}
        return
    curve = train.gears[main].stiffness.core()  # type: ignore[union-attr]
    breaks, slopes = curve.side(forward=True)
    bends = train.variable(main, "twist").removeprefix(f"{main}_")
    twists = {name: _last(gear) for name, gear in train.gears.items() if not isinstance(gear.stiffness, Rigid)}
    first = 1 if slopes[0] == 0.0 and len(slopes) > 1 else 0
    edges = [0.0, *breaks, BEYOND * _last(train.gears[main])]
    if first:
        state = TrainInitial(speeds=_speeds(axis, v, SLIP), twists=twists | {main: 0.5 * (edges[0] + edges[1])})
        yield "gap", f"{main} within its gap, {moving}", state, {}
    for forward in (True,) if curve.odd else (True, False):
        ends, slopes = curve.side(forward)
        ends = [0.0, *ends, edges[-1]]
        pieces = (
            {"first stiffness": first, "last stiffness": len(slopes) - 1}
            if len(slopes) > first + 1
            else {"stiffness": first}
        )
        for name, k in pieces.items():
            twist = 0.5 * (ends[k] + ends[k + 1])
            state = TrainInitial(speeds=_speeds(axis, v, SLIP), twists=twists | {main: twist if forward else -twist})
            where = "" if forward else " backward"
            yield f"{name}{where}", f"{main} with {_stiffness(train, main, slopes[k])}{where}, {moving}", state, {}
    within = 0.5 * (edges[first] + edges[first + 1])
    at = twists | {main: within}
    hysteresis = train.gears[main].hysteresis
    if hysteresis is not None and hysteresis.efficiency < 1.0:
        holding = 1e3 * (train.gears[main].rated_output_torque or slopes[-1] * edges[-1])  # more than it ever has to
        state = TrainInitial(speeds=_speeds(axis, v, 0.0), twists=at, hysteresis_capacities={main: holding})
        yield (
            "twist stuck",
            f"hysteresis holds the {bends} of {main}, {moving}",
            state,
            {train.variable(main, "twist_contact"): 0},
        )
    output = train.gears[main].output
    if train.shafts[output].friction_torque > 0.0:
        turning = _speeds(axis, v, SLIP)
        # So slowly that the damping of the mesh takes less than the friction leaves beside the spring.
        gear = train.gears[main]
        damping = abs(gear.mesh_damping * turning.get(gear.input, 0.0) / gear.ratio)
        slowly = min(1.0, HELD * train.shafts[output].friction_torque / damping) if damping > 0.0 else 1.0
        held = {shaft: slowly * w for shaft, w in turning.items() if shaft not in (output, axis.shaft)}
        near = edges[first] + min(
            0.5 * (edges[first + 1] - edges[first]), 0.5 * train.shafts[output].friction_torque / slopes[first]
        )
        state = TrainInitial(speeds=held, twists=twists | {main: near})
        yield LOAD_STUCK, f"{output} sticks, the motor turns", state, {train.variable(output, "contact"): 0}


def _text(value: float, si: str) -> str:
    unit, factor = charted(si)
    return f"{factor * value:.4g} {unit}"


def _stiffness(train: DriveTrain, gear: str, value: float) -> str:
    """A slope of its curve at its output."""
    return f"{1e-6 * value:.5g} N/µm" if train.is_slide(train.gears[gear].output) else f"{value:.5g} N·m/rad"


def _last_slope(stiffness: Elastic) -> float:
    """Slope of the last piece [N·m/rad], of two directions that differ the smaller one."""
    return min(stiffness.core().side(forward)[1][-1] for forward in (True, False))


def _last(gear: Gear) -> float:
    """A twist at the beginning of the last piece of a gear [rad]; of a linear one, the twist under a small torque."""
    breaks, slopes = gear.stiffness.core().side(forward=True)  # type: ignore[union-attr]
    return breaks[-1] if breaks else 1e-3 * (gear.rated_output_torque or 1.0) / slopes[-1]


def speed_of(axis: Axis) -> float:
    """Half the largest speed of the reference [rad/s] at its shaft; without one, a tenth of the motor's rated speed."""
    reference = axis.controller.reference
    t = np.linspace(0.0, axis.scenario.simulation.duration, 2001)
    value, rate, *_ = reference.at(t)
    speeds = {"position": rate, "speed": value, "torque": 0.0 * value}[reference.kind]
    top = 0.5 * float(np.abs(speeds).max())
    if top > 0.0:
        return top
    motor = axis.train.motors[axis.motor].as_dc()
    return 0.1 * (motor.rated_speed or 100.0) / abs(axis.ratio)


def _speeds(axis: Axis, v: float, slip: float) -> dict[str, float]:
    """Speeds of all shafts that turn with the reference's shaft at speed v; across a gear with hysteresis they differ by `slip`."""
    train = axis.train
    joints = [
        (g.input, g.output, g.ratio * (1.0 + (0.0 if isinstance(g.stiffness, Rigid) else slip)))
        for g in train.fixed_gears().values()
    ]
    return tied({axis.shaft: v}, joints + train.held_together())
