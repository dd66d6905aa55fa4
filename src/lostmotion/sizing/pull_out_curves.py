"""Curves of steppers over the step rate: pull-out and pull-in torque from data and from runs, and how far the rotor swings."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..control.command import CommandSignal, Stepping
from ..errors import InputError
from ..inputs.argument_checks import checked
from ..inputs.named_elements import Named
from ..inputs.refusal_messages import chosen_motor, shown
from ..model.motor import ShaftMotor
from ..model.shaft_ratio import turns
from ..model.signals import TorqueSignal
from ..model.stepper import ELECTRIC, pull_out_torque
from ..simulation.forms.initial_state import angles_at_start
from ..simulation.forms.train_tables import TrainInitial
from ..simulation.runs.lost_steps import LostSteps, found_in
from ..simulation.runs.run import run
from ..simulation.scenario.scenario import Scenario

if TYPE_CHECKING:
    import xarray

RATES = 10.0, 1e6  # [Hz], of full steps
HALVINGS = 8  # of the holding torque: a run decides each
SPEEDING, RAMP, HOLD = 60.0, 30.0, 15.0
"""periods of the rotor in its field over which the field speeds up, the load of the pull-out torque rises, and then stays"""
STARTED, SWUNG = 20.0, 60.0
"""periods after which a rotor has started or not, and in which it swings"""
STEPS = 40.0  # full steps of a run at least
STAIRS = 100  # speeds over which the field speeds up
POINTS = 40  # samples of a period
ABOVE = 1.05  # of the holding torque, which no stepper holds


@checked
def stepper_curves(scenario: Scenario, step_rates: Any, *, motor: str | None = None) -> xarray.Dataset:
    """Compute the torques of a stepper over its step rate, from its data and from runs.

    The runs keep all that the scenario has on the axis, and take the steps of its driver. An additional torque acts on the
    shaft of the motor. For the pull-out torque the rotor begins in step, or with a winding is sped up slowly, and the torque
    then rises slowly until it slips. For the pull-in torque the rotor is at rest when the field begins to turn at the whole
    rate, against dry friction. Both are found by halving to 0.4 % of the holding torque.

    Parameters
    ----------
    scenario : Scenario
        Its command is replaced but for the steps of the driver.
    step_rates : array_like
        Full steps a second [Hz], 10 to 1e6.
    motor : str, optional
        Name of the stepper. Default: the only one.

    Returns
    -------
    xarray.Dataset
        Over ``step_rate`` [Hz]: ``pull_out_torque`` and ``pull_in_torque`` [N·m] from the data, ``pull_out_torque_of_runs`` and
        ``pull_in_torque_of_runs`` [N·m], and ``swing``, by how many full steps the rotor swings to each side of its mean lag without
        additional torque; NaN where it slips. The pull-in torque from the data holds for a rotor with all inertia of
        the axis, ideal current and no damping.

    Raises
    ------
    InputError
        There is no such stepper, or a rate is not positive.

    Examples
    --------
    >>> import lostmotion as lm
    >>> curves = lm.sizing.stepper_curves(lm.load("stepper-belt-axis"), [500.0])
    >>> float(curves.pull_out_torque[0])
    0.44
    """
    import xarray

    steppers = [name for name, m in scenario.train().motors.items() if m.kind == "stepper"]
    name = chosen_motor(motor, steppers, "steppers", 'the scenario has no motor of kind "stepper"')
    rates = _rates(step_rates)
    axis = _Axis.of(scenario, name)
    rows = [
        (axis.pull_out(f), axis.pull_in(f), axis.largest(f, axis.keeps), axis.largest(f, axis.starts), axis.swing(f))
        for f in rates
    ]
    names = ("pull_out_torque", "pull_in_torque", "pull_out_torque_of_runs", "pull_in_torque_of_runs", "swing")
    units = dict.fromkeys(names, "N*m") | {"swing": "1"}
    data = {
        key: ("step_rate", np.array(values), {"units": units[key]})
        for key, values in zip(names, zip(*rows, strict=True), strict=True)
    }
    return xarray.Dataset(data, {"step_rate": ("step_rate", rates, {"units": "Hz"})}, {"motor": name})


def _rates(step_rates: Any) -> np.ndarray:
    try:
        if np.iscomplexobj(step_rates):
            raise TypeError
        rates = np.atleast_1d(np.asarray(step_rates, float))
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"step_rates: {shown(step_rates)} must be numbers [Hz]") from None
    low, high = RATES
    if rates.ndim != 1 or rates.size == 0 or not np.all((rates >= low) & (rates <= high)):
        raise InputError(
            f"step_rates: {shown(step_rates)} must lie between {low:g} and {high:g} Hz; below that a stepper gives its holding torque"
        )
    return rates


@dataclass(frozen=True)
class _Axis:
    """A stepper in its scenario."""

    scenario: Scenario  # in the long form
    name: str
    motor: ShaftMotor
    inertia: float  # of the whole axis at the rotor [kg·m²]

    @classmethod
    def of(cls, scenario: Scenario, name: str) -> _Axis:
        scenario = scenario.long()
        train = scenario.train()
        motor = train.motors[name]
        inertia = 0.0
        for shaft, part in train.shafts.items():
            if (ratio := turns(train, motor.shaft, shaft)) is not None:
                own = part.inertia + sum(m.rotor_inertia for m in train.motors.values() if m.shaft == shaft)
                inertia += (own + sum(g.inertia for g in train.gears.values() if g.input == shaft)) / ratio**2
        return cls(scenario, name, motor, inertia)

    @property
    def torque(self) -> float:
        """Holding torque [N·m]."""
        assert self.motor.holding_torque is not None
        return self.motor.holding_torque

    @property
    def pole_pairs(self) -> float:
        assert self.motor.steps_per_revolution is not None
        return 0.25 * self.motor.steps_per_revolution

    @property
    def speeding(self) -> float:
        """Time in which the field speeds up [s]: the current of a winding takes a while to be what it is at a speed."""
        return 0.0 if self.motor.supply_voltage is None else SPEEDING * self.period

    @property
    def period(self) -> float:
        """Period of small oscillations in the field [s]."""
        return 2.0 * math.pi / math.sqrt(self.pole_pairs * self.torque / self.inertia)

    def pull_out(self, rate: float) -> float:
        """Pull-out torque from the data; for an ideal current the holding torque."""
        if any(getattr(self.motor, key) is None for key in ELECTRIC):
            return self.torque
        return float(pull_out_torque(self.motor, rate * self.motor.full_step))

    def pull_in(self, rate: float) -> float:
        """Pull-in torque from the data: the largest torque T with which the rotor does not swing to where it slips.

        It begins to turn at the lag asin(T/T_H), and the field then leads by n w. Its energy relative to the field is enough
        to pass the unstable lag pi - asin(T/T_H) where n J w^2/2 > T_H (2 sqrt(1 - t^2) - t (pi - 2 asin t)) with t = T/T_H.
        """
        speed = rate * self.motor.full_step
        energy = 0.5 * self.pole_pairs * self.inertia * speed * speed / self.torque
        low, high = 0.0, 1.0
        if energy > 2.0:
            return 0.0
        for _ in range(50):
            t = 0.5 * (low + high)
            holds = energy <= 2.0 * math.sqrt(1.0 - t * t) - t * (math.pi - 2.0 * math.asin(t))
            low, high = (t, high) if holds else (low, t)
        return min(low * self.torque, self.pull_out(rate))

    def largest(self, rate: float, holds: Callable[[float, float], bool]) -> float:
        """Largest torque [N·m] at a rate with which a run keeps its steps; 0 where it does not without any."""
        if not holds(rate, 0.0):
            return 0.0
        low, high = 0.0, ABOVE * self.torque
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if holds(rate, middle) else (low, middle)
        return low

    def keeps(self, rate: float, torque: float) -> bool:
        """Whether a rotor in step stays so while a torque rises."""
        rise, until = RAMP * self.period, max((RAMP + HOLD) * self.period, STEPS / rate)
        load = {"begin": self.speeding, "duration": rise, "rise": torque}
        return not self._run(rate, until, in_step=True, load=load)[0].times

    def starts(self, rate: float, torque: float) -> bool:
        """Whether a rotor at rest follows a field that turns at once, against friction."""
        until = max(STARTED * self.period, STEPS / rate)
        return not self._run(rate, until, in_step=False, friction=torque)[0].times

    def swing(self, rate: float) -> float:
        """Amplitude of the lag [full steps] in the second half of a run."""
        lost, lag = self._run(rate, max(SWUNG * self.period, STEPS / rate), in_step=True)
        late = lag[lag.size // 2 :]
        return math.nan if lost.times else 0.5 * float(late.max() - late.min())

    def _run(
        self, rate: float, until: float, *, in_step: bool, load: Any = None, friction: float = 0.0
    ) -> tuple[LostSteps, np.ndarray]:
        """Lost steps of a run at a step rate, and the lag of the rotor at its samples [full steps]."""
        tables, train, speed = self.scenario.tables, self.scenario.train(), rate * self.motor.full_step
        shaft, first = self.motor.shaft, self.speeding if in_step else 0.0
        until += first
        in_step = in_step and first == 0.0
        moves = (
            [(first * k / STAIRS, first / STAIRS, speed * (k + 0.5) / STAIRS) for k in range(STAIRS)] if first else []
        )
        moves += [(first, until - first, speed)]
        ramp: dict[str, Any] = {
            "ramps": [{"begin": begin, "duration": long, "rise": v * long} for begin, long, v in moves]
        }
        written = tables.command.get(self.name, CommandSignal()).stepping
        if written is None:
            start = angles_at_start(train, {}, {}, tables.given())[shaft]
            command = CommandSignal(mean=start, **ramp)
        else:
            kept = {key: getattr(written, key) for key in ("microsteps", "table_error", "standstill_delay")}
            command = CommandSignal(stepping=Stepping.model_validate({"reference": ramp, "shaft": shaft, **kept}))
        speeds = {other: turns(train, shaft, other) for other in train.shafts} if in_step else {}
        moving = {other: speed / ratio for other, ratio in speeds.items() if ratio is not None}
        own = tables.motors[self.name]
        changes: dict[str, Any] = {
            "command": {**tables.command, self.name: command},
            "motors": {
                **tables.motors,
                self.name: own.model_copy(update={"friction_torque": own.friction_torque + friction}),
            },
            "initial": TrainInitial(
                speeds={name: v for name, v in moving.items() if not train.is_slide(name)},
                slide_speeds={name: v for name, v in moving.items() if train.is_slide(name)},
            ),
            "simulation": type(tables.simulation)(duration=until, sample_interval=min(self.period / POINTS, until)),
        }
        if load and load["rise"] > 0.0:
            before = tables.shafts[shaft].torque or TorqueSignal()
            ramps = (*before.ramps, *TorqueSignal.model_validate({"ramps": [load]}).ramps)
            torque = before.model_copy(update={"ramps": ramps})
            changes["shafts"] = {**tables.shafts, shaft: tables.shafts[shaft].model_copy(update={"torque": torque})}
        for table in ("command", "motors", "shafts"):
            if table in changes:
                changes[table] = Named(changes[table])
        made = Scenario.of(tables.model_copy(update=changes))
        result = run(made, energy=False)
        (lost,) = (found for found in found_in(made, result, as_sampled=True) if found.motor == self.name)
        late = np.asarray(result["time"]) >= first
        field = np.asarray(result["time"]) * speed
        lag = (np.asarray(result[train.variable(shaft, "angle")]) - field)[late] / self.motor.full_step
        return lost, lag
