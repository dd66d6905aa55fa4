"""Task of an axis, and the scenario of one motor and gearbox for it: tuned by rule, its cycle repeated."""

import itertools
import math
from functools import lru_cache
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from ...control.command import MOST_MICROSTEPS
from ...control.controller import AnyCurrent
from ...control.references import Move, PositionReference
from ...control.sample_times import whole_multiple
from ...errors import InputError
from ...inputs.implausible_values import doubt_window
from ...inputs.part import Part
from ...inputs.quantities import (
    Acceleration,
    Angle,
    Force,
    Length,
    Limit,
    Mass,
    NotNegative,
    Number,
    Positive,
    Switch,
    Time,
    Whole,
)
from ...inputs.refusal_messages import unknown_key
from ...model.angle_torques import STANDARD_GRAVITY
from ...model.motor import STEPPER_KEYS, Motor, MotorLimits
from ...model.process_loads import Amplifier, Duty, HoldingBrake, Supply
from ...model.signals import TimeFunction, TorqueSignal
from ...model.task import Task
from ...simulation.forms.drive_tables import LoadTable
from ...simulation.scenario.scenario import Scenario
from ..finding import SOURCES
from .column_bounds import Bound

REPEATS = 0.01  # relative difference of two cycles, within which the motion repeats
FEWEST = 2  # cycles
ONE_WAY = "is the difference between moves in both directions, and all moves of controller.reference go one way"
WHOLE = 1e-9  # relative, within which periods fit into a cycle

# What a task asks for, and the column that it limits.
REQUIREMENTS = {
    "max_tracking_error": "tracking_error_peak",
    "max_reversal_error": "reversal_error",
    "max_settling_time": "settling_time",
}


class LinearAxis(Part):
    """Last stage of a linear axis and the slope of its slide."""

    kind: Literal["screw", "rack", "belt"] | None = None  #: left out where linear motors alone are candidates
    stage: dict[str, Any] = Field(default={})  #: the table `[screw]`, `[rack]` or `[belt]`, of which a record may vary
    guide_friction: Annotated[Number, NotNegative] | None = None
    """friction coefficient of the guide, on which the attraction of a linear motor acts"""
    rise: Annotated[Number, Limit(ge=-1.0, le=1.0)] = 0.0  #: sine of the slide's inclination

    def carrying(self, load: LoadTable, mass: float) -> LoadTable:
        """The load with the weight of a mass [kg] that rides on the slide: along the slope, and on the guide with its friction."""
        weight = mass * STANDARD_GRAVITY
        friction = (self.guide_friction or 0.0) * weight * math.sqrt(1.0 - self.rise * self.rise)
        torque = load.torque.model_copy(update={"mean": load.torque.mean + weight * self.rise})
        return load.model_copy(update={"torque": torque, "friction_torque": load.friction_torque + friction})


class InnerLoop(Part):
    """The current loop of a task, apart from its controller."""

    current: AnyCurrent


class AxisTask(Task, Duty):
    """Requirements of an axis, beside the motion of its reference."""

    cycle: Annotated[Time, Positive]  #: after which the motion repeats, pause included
    max_cycles: Annotated[Whole, Field(ge=FEWEST, le=1000)] = 4
    """largest number of cycles to run, until two of them agree within 1 %"""
    max_inertia_ratio: Annotated[Number, Positive] | None = None
    """largest inertia of load, stage and gearbox at the motor relative to the rotor; left out, the limit of the motor's manufacturer, or else 10"""
    max_tracking_error: Annotated[Angle, Positive] | None = None  #: largest tracking error of the load over the cycle
    max_reversal_error: Annotated[Angle, Positive] | None = None
    """largest reversal error of the load: mean position at rest after motion in one direction, minus that after the other"""
    settling_window: Annotated[Angle, Positive] | None = None
    """plus and minus this: how near the load must stay to where a move ends"""
    max_settling_time: Annotated[Time, Positive] | None = None
    """from the end of the reference's move until the load stays in the window"""
    altitude: Annotated[Length, NotNegative] = 0.0
    """above the sea; the continuous torque of the motor falls by 1 % to each 100 m above 1000 m"""
    life: Annotated[Time, Positive] | None = None  #: wanted L10h of gearbox and screw
    max_mass: Annotated[Mass, Positive] | None = None
    """largest mass of the parts that are records, by their total_mass"""
    max_length: Annotated[Length, Positive] | None = None
    """largest length of motor and gearbox in line, by the overall_length of their records"""
    max_price: Annotated[Number, Positive] | None = None  #: largest price of the parts that are records
    max_lead_time: Annotated[Time, Positive] | None = None  #: latest delivery of a part that is a record
    emergency_stop: Annotated[Acceleration, Positive] | None = None
    """at which the load is stopped from any speed of the cycle"""
    radial_force: Annotated[Force, NotNegative] | None = None  #: on the output bearing of the gearbox
    axial_force: Annotated[Force, NotNegative] | None = None  #: on the output bearing of the gearbox
    supply: Supply | None = None
    safety_factors: dict[str, Annotated[Number, Positive]] = Field(default={})  #: by rule
    microsteps: Annotated[Whole, Field(ge=1, le=MOST_MICROSTEPS)] = 16
    """parts of a full step that the driver of a stepper resolves"""
    steppers: dict[str, Any] = Field(default={})  #: table `[motor]` where steppers are candidates
    current: AnyCurrent | None = None  #: current loop of `[controller]`; of a torque source a lag in its place
    linear: LinearAxis | None = None
    """tables `[slide]` and `[screw]`, `[rack]` or `[belt]`; all values of the load are then in units of translation"""

    whole: dict[str, dict[str, Any]] = Field(default={})  #: table `[linear_motor]`: values beside its records
    pairs: Switch = True  #: whether pairs of motor and gearbox are candidates

    @model_validator(mode="after")
    def _rules_are_known(self) -> Self:
        for rule in self.safety_factors:
            if rule not in SOURCES:
                raise InputError(unknown_key(rule, list(SOURCES)), f"safety_factors.{rule}")
        if self.gravity is not None and self.linear is not None:
            raise InputError("is of a rotary load; give slide.inclination in its place", "gravity")
        for k, payload in enumerate(self.payload):
            if payload.end > self.cycle * (1.0 + WHOLE):
                raise InputError(
                    f"{payload.end:g} s is after its cycle of {self.cycle:g} s; shorten it", f"payload[{k}].end"
                )
            if self.linear is not None and payload.inertia > 0.0:
                raise InputError("a slide has no use for it; give the mass of the payload", f"payload[{k}].inertia")
            if self.linear is not None and payload.radius is not None:
                raise InputError("a slide has no use for it; leave it out", f"payload[{k}].radius")
            if self.linear is None and payload.mass > 0.0 and payload.radius is None:
                raise InputError("is missing; give the radius of the payload from the axis", f"payload[{k}].radius")
        if self.amplifier is not None and self.supply is not None and self.supply.continuous_current is not None:
            raise InputError("says the same as amplifier; leave it out", "supply.continuous_current")
        wanted = "torques" if self.linear is None else "forces"
        for k, process in enumerate(self.process):
            if getattr(process, wanted) is None:
                what = "a rotary load" if self.linear is None else "a slide"
                raise InputError(f"is missing; {what} needs it", f"process[{k}].{wanted}")
            if process.times is not None and process.times[-1] > self.cycle * (1.0 + WHOLE):
                raise InputError(
                    f"the last one is after its cycle of {self.cycle:g} s; shorten them", f"process[{k}].times"
                )
        return self

    @property
    def stage_kind(self) -> str | None:
        """Kind of the last stage of a linear axis; None where there is none."""
        return None if self.linear is None else self.linear.kind

    @property
    def rise(self) -> float | None:
        """Sine of the slope of a slide; None of a rotary load."""
        return None if self.linear is None else self.linear.rise

    def doubt_window(self, reference: PositionReference, unit: str, where: str) -> None:
        """Warn of a settling window in which all of the motion lies."""
        if self.settling_window is not None:
            positions = reference.at(np.linspace(0.0, self.cycle, 1001))[0]
            doubt_window(self.settling_window, float(np.ptp(positions)), unit, where)

    def of_stepper(self, key: str) -> bool:
        """Whether it is a key of a motor that the base, in which no stepper is, may not have."""
        return bool(self.steppers) and key.removeprefix("motor.") in STEPPER_KEYS

    def amplifier_of_task(self) -> Amplifier | None:
        """The amplifier, also where `supply` alone says its continuous current."""
        current = None if self.supply is None else self.supply.continuous_current
        return self.amplifier if current is None else Amplifier(continuous_current=current)

    def fed(self, motor: Motor, brake: HoldingBrake | None) -> Motor:
        """A motor with the inertia of its brake, at the least voltage of the supply and the peak current of the amplifier.

        Raises InputError: the motor has a voltage that contradicts it.
        """
        changes: dict[str, Any] = {}
        if brake is not None and brake.inertia > 0.0:
            changes["rotor_inertia"] = motor.rotor_inertia + brake.inertia
        voltage = None if self.supply is None else self.supply.min_voltage
        if voltage is not None:
            if motor.kind == "stepper":
                changes["supply_voltage"] = voltage
            elif motor.kind == "dc":
                changes["voltage_limit"] = voltage if motor.voltage_limit is None else min(voltage, motor.voltage_limit)
            elif motor.winding is not None:
                changes["dc_voltage"] = voltage
            elif motor.limits is not None:
                changes["limits"] = motor.limits.model_copy(update={"max_voltage": voltage})
        motor = motor.model_copy(update=changes) if changes else motor
        return (
            motor
            if self.amplifier is None or self.amplifier.peak_current is None or motor.kind == "stepper"
            else _up_to(motor, self.amplifier.peak_current)
        )

    @model_validator(mode="after")
    def _window_and_time(self) -> Self:
        if self.max_settling_time is not None and self.settling_window is None:
            raise InputError("needs settling_window: how near the load must stay; add it", "max_settling_time")
        return self

    def limits(self) -> dict[str, Bound]:
        """Columns and their permissible values."""
        asked = {column: getattr(self, key) for key, column in REQUIREMENTS.items()}
        return {column: Bound(max=value) for column, value in asked.items() if value is not None}

    def check(self, scenario: Scenario) -> None:
        """Sees that the motion of a scenario can be repeated, and that it has what the task asks for.

        Raises InputError: it cannot, or has not.
        """
        reference = reference_of(scenario)
        assert scenario.controller is not None
        whole_multiple(self.cycle, scenario.controller.sample_time, "task.cycle")
        repeated(reference, self.cycle, FEWEST)
        repeated_torque(scenario.load.torque, self.cycle, FEWEST)
        for key in ("max_reversal_error", "settling_window"):
            if getattr(self, key) is not None and not reference.moves:
                raise InputError(
                    "is of the rest between moves, and controller.reference has no moves; leave it out", f"task.{key}"
                )
        if self.max_reversal_error is not None and not turns_back(reference):
            raise InputError(f"{ONE_WAY}; leave it out", "task.max_reversal_error")


def turns_back(reference: PositionReference) -> bool:
    """Whether its moves go in both directions."""
    positions = [reference.start, *(move.to for move in reference.moves)]
    steps = [b - a for a, b in itertools.pairwise(positions)]
    return bool(steps) and min(steps) < 0.0 < max(steps)


def _up_to(motor: Motor, current: float) -> Motor:
    """A motor whose largest current is limited to the current of its amplifier [A], if its own is not less."""
    if motor.winding is not None:
        own = motor.winding.max_current or math.inf
        limit = {"max_current_rms": min(own, current), "max_current_peak": None}
        return motor.model_copy(update={"winding": motor.winding.model_copy(update=limit)})
    limits = motor.limits or MotorLimits()
    own = limits.max_current or math.inf
    return motor.model_copy(update={"limits": limits.model_copy(update={"max_current": min(own, current)})})


def reference_of(scenario: Scenario) -> PositionReference:
    """The positions that the axis follows. Raises ValueError: it follows something else."""
    reference = None if scenario.controller is None else scenario.controller.reference
    if not isinstance(reference, PositionReference):
        raise ValueError('lacks controller.reference of kind "position", the motion of one cycle; add it')
    return reference


def _periodic(signal: TimeFunction[Any], cycle: float, key: str) -> None:
    """Sees that a signal is made of what can be repeated."""
    for name in ("steps", "ramps", "chirp"):
        if getattr(signal, name, None):
            raise InputError(f"acts once and cannot be repeated; write the cycle as {key}.samples", f"{key}.{name}")
    for _, frequency, _ in signal.sine_list():
        turns = cycle * frequency
        if round(turns) < 1 or not math.isclose(turns, round(turns), rel_tol=WHOLE):
            raise InputError(
                f"a sine of {frequency:g} Hz has {turns:.6g} periods in the cycle of {cycle:g} s; take a whole number",
                key,
            )


def _tiled(samples: Any, cycle: float, count: int, step: float, key: str) -> dict[str, Any]:
    """Points of a cycle, again and again, each time further by `step`."""
    times, values = np.array(samples.times), np.array(samples.values)
    if times[-1] > cycle * (1.0 + WHOLE):
        raise InputError(
            f"the last one is at {times[-1]:g} s, after the cycle of {cycle:g} s; lengthen task.cycle", f"{key}.samples"
        )
    again = slice(1 if times[0] == 0.0 and math.isclose(times[-1], cycle, rel_tol=WHOLE) else 0, None)
    all_times = [*times, *(t + k * cycle for k in range(1, count) for t in times[again])]
    all_values = [*values, *(v + k * step for k in range(1, count) for v in values[again])]
    points: dict[str, Any] = samples.model_dump()
    return points | {"times": all_times, "values": all_values}


@lru_cache(maxsize=32)  # the same for every pair of a task
def repeated(reference: PositionReference, cycle: float, count: int) -> PositionReference:
    """The reference of so many cycles; one that ends elsewhere than it began goes on from there.

    Raises InputError: it cannot be repeated, or does not fit into the cycle.
    """
    key = "controller.reference"
    _periodic(reference, cycle, key)
    if reference.samples is not None:
        values = reference.samples.values
        tiled = _tiled(reference.samples, cycle, count, values[-1] - values[0], key)
        reference = reference.model_copy(update={"samples": tiled})
    if not reference.moves:
        return reference
    begin, end = reference.intervals()[0][0], reference.intervals()[-1][1]
    if end > cycle * (1.0 + WHOLE):
        raise InputError(
            f"the last one ends at {end:.6g} s, after the cycle of {cycle:g} s; lengthen task.cycle", f"{key}.moves"
        )
    dwells = [reference.dwell if move.dwell is None else move.dwell for move in reference.moves]
    dwells[-1] = max(cycle - end, 0.0) + begin
    step = reference.moves[-1].to - reference.start
    moves = [
        Move(**move.model_dump() | {"to": move.to + k * step, "dwell": dwell})
        for k in range(count)
        for move, dwell in zip(reference.moves, dwells, strict=True)
    ]
    return reference.model_copy(update={"moves": tuple(moves)})


@lru_cache(maxsize=32)
def repeated_torque(torque: TorqueSignal, cycle: float, count: int) -> TorqueSignal:
    """The load torque of so many cycles. Raises InputError: it cannot be repeated, or does not fit into the cycle."""
    _periodic(torque, cycle, "load.torque")
    if torque.samples is None:
        return torque
    return torque.model_copy(update={"samples": _tiled(torque.samples, cycle, count, 0.0, "load.torque")})
