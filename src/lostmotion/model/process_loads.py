"""Gravity, payloads and process forces on the load of an axis over its cycle; its supply and its holding brake."""

from collections.abc import Iterator
from typing import Annotated

import numpy as np
from pydantic import Field

from ..inputs.part import Part, rule
from ..inputs.quantities import (
    Angle,
    Current,
    Force,
    Inertia,
    Length,
    Mass,
    NotNegative,
    Positive,
    Power,
    Resistance,
    Switch,
    Time,
    Torque,
    Voltage,
)
from ..reproducible import interpolate, sin
from ..units.conversion import Unit
from .angle_torques import STANDARD_GRAVITY


class ArmGravity(Part):
    """Weight of a body on an arm: against the motion acts m g r sin(position - hanging).

    Examples
    --------
    >>> round(float(ArmGravity(mass="4 kg", radius="0.3 m").torque(0.5 * 3.141592653589793)), 4)
    11.768
    """

    mass: Annotated[Mass, Positive]  #: mass of the body
    radius: Annotated[Length, Positive]  #: distance of its centre of gravity from the axis
    hanging: Angle = 0.0  #: position at which it hangs straight down; a quarter of a turn on, the arm is level

    def torque(
        self, position: np.ndarray | float, mass: float | None = None, radius: float | None = None
    ) -> np.ndarray:
        """Torque [N·m] that holds it, or another mass [kg] at another radius [m]."""
        m, r = self.mass if mass is None else mass, self.radius if radius is None else radius
        return np.asarray(m * STANDARD_GRAVITY * r * sin(np.asarray(position) - self.hanging))


class Payload(Part):
    """A body that the load carries during a part of the cycle."""

    begin: Annotated[Time, NotNegative]  #: instant from which it is carried
    end: Annotated[Time, Positive]  #: instant at which it is set down
    mass: Annotated[Mass, NotNegative] = 0.0  #: mass of the body
    radius: Annotated[Length, Positive] | None = None
    """distance of its centre of gravity from the axis of a rotary load"""
    inertia: Annotated[Inertia, NotNegative] = 0.0  #: about its own centre of gravity, of a rotary load

    @rule
    def _lasts(self) -> Iterator[str]:
        if self.end <= self.begin:
            yield f"has end = {self.end:g} s, which is not after begin = {self.begin:g} s; exchange them"
        if self.mass == 0.0 and self.inertia == 0.0:
            yield "has neither mass nor inertia; add one"

    def carried(self, time: np.ndarray) -> np.ndarray:
        """Whether it is carried, over time [s]."""
        return np.asarray((time >= self.begin) & (time < self.end))

    def added_inertia(self, *, slides: bool) -> float:
        """Inertia [kg·m²], of a slide mass [kg], that the load has more."""
        return self.mass if slides else self.inertia + self.mass * (self.radius or 0.0) * (self.radius or 0.0)


class Process(Part):
    """A torque or a force against the motion in the positive direction, over time or over the position. It follows
    straight lines through points, and is constant before the first and after the last."""

    times: Annotated[tuple[Annotated[Time, NotNegative], ...], Field(min_length=2)] | None = None  #: instants, rising
    positions: Annotated[tuple[Angle, ...], Field(min_length=2)] | None = None
    """positions of the load, in place of times"""
    torques: tuple[Torque, ...] | None = None  #: on a rotary load
    forces: tuple[Force, ...] | None = None  #: on a slide

    @rule
    def _is_a_curve(self) -> Iterator[str]:
        for one, other in (("times", "positions"), ("torques", "forces")):
            if (getattr(self, one) is None) == (getattr(self, other) is None):
                yield f"needs one of {one} and {other}"
        if len(self.points()) != len(self.values()):
            yield f"has {len(self.points())} points and {len(self.values())} values; give as many of each"
        if any(b <= a for a, b in zip(self.points(), self.points()[1:], strict=False)):
            yield f"has {'times' if self.positions is None else 'positions'} that do not rise; order them"

    def points(self) -> tuple[float, ...]:
        """Times [s] or positions."""
        found = self.times if self.positions is None else self.positions
        assert found is not None
        return found

    def values(self) -> tuple[float, ...]:
        """Torques [N·m] or forces [N]."""
        found = self.torques if self.forces is None else self.forces
        assert found is not None
        return found

    def at(self, time: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Torque [N·m] or force [N] over the motion."""
        return interpolate(time if self.positions is None else position, self.points(), self.values())


class Duty(Part):
    """Gravity, payloads and process forces on the load, beside the values of `[load]` or `[slide]`."""

    gravity: ArmGravity | None = None  #: weight of an arm, of a rotary load
    payload: tuple[Payload, ...] = ()
    process: tuple[Process, ...] = ()

    def edges(self) -> set[float]:
        """Instants at which something jumps or bends [s]."""
        return {t for p in self.payload for t in (p.begin, p.end)} | {t for p in self.process for t in p.times or ()}

    def inertia(self, time: np.ndarray, *, slides: bool) -> np.ndarray:
        """Inertia of the payloads over time [kg·m²], of a slide [kg]."""
        found = np.zeros_like(time)
        for payload in self.payload:
            found += payload.added_inertia(slides=slides) * payload.carried(time)
        return found

    def torque(self, time: np.ndarray, position: np.ndarray, rise: float | None) -> np.ndarray:
        """Torque to hold the load over its motion [N·m], of a slide force [N].

        rise: sine of the slope of a slide; None for a rotary load.
        """
        found = np.zeros_like(time)
        if self.gravity is not None:
            found += self.gravity.torque(position)
        for payload in self.payload:
            if rise is not None:
                found += payload.mass * STANDARD_GRAVITY * rise * payload.carried(time)
            elif self.gravity is not None and payload.mass > 0.0:
                found += self.gravity.torque(position, payload.mass, payload.radius) * payload.carried(time)
        for process in self.process:
            found += process.at(time, position)
        return found

    @property
    def anything(self) -> bool:
        """Whether there is any wind."""
        return self.gravity is not None or bool(self.payload or self.process)


class HoldingBrake(Part):
    """Brake on the shaft of the motor, or on a slide."""

    torque: Annotated[Torque, Positive] | None = None  #: static, that it holds
    inertia: Annotated[Inertia, NotNegative] = 0.0  #: inertia of the brake, on the shaft of the motor
    force: Annotated[Force, Positive] | None = None
    """static, of a brake on the slide of a linear axis, in place of torque"""
    of_the_motor: Switch = False  #: the brake that is built into the record of the motor

    @rule
    def _holds_something(self) -> Iterator[str]:
        if [self.torque is not None, self.force is not None, self.of_the_motor].count(True) != 1:
            yield 'needs torque, force of a brake on a slide, or the text "of the motor", one of them'
        if self.of_the_motor and self.inertia > 0.0:
            yield "has of_the_motor and inertia, which the record of the brake says; leave one of them out"
        if self.force is not None and self.inertia > 0.0:
            yield "has force and inertia; a brake on a slide does not turn, so leave the inertia out"


class Amplifier(Part):
    """Amplifier that feeds the motor. Currents of a motor with a winding are effective values of a phase."""

    continuous_current: Annotated[Current, Positive]  #: rms over the cycle, of a synchronous motor in a phase
    peak_current: Annotated[Current, Positive] | None = None
    """largest current, of a synchronous motor as effective value"""
    peak_time: Annotated[Time, Positive] | None = None  #: longest time above the continuous current
    max_dc_voltage: Annotated[Voltage, Positive] | None = None  #: largest voltage of the DC bus

    @rule
    def _peak_is_above(self) -> Iterator[str]:
        if self.peak_current is not None and self.peak_current < self.continuous_current:
            yield "has a peak_current below its continuous_current; exchange them"


class Bus(Part):
    """DC bus that feeds motors, and takes what they return."""

    max_voltage: Annotated[Voltage, Positive] | None = None  #: largest voltage of the bus before energy returns to it
    voltage_limit: Annotated[Voltage, Positive] | None = None
    """largest voltage that the bus may reach; with a brake resistor the voltage at which it is switched on"""
    capacitance: Annotated[float, Unit("A*s/V"), Positive] | None = None  #: capacitance of the bus
    brake_resistance: Annotated[Resistance, Positive] | None = None
    """resistance of the brake resistor, which is switched on at voltage_limit"""
    brake_power: Annotated[Power, Positive] | None = None  #: continuous power of the brake resistor
    returns_to_mains: Switch = False
    """the energy goes back to the mains, or a battery takes it: neither capacitors nor resistor are judged"""

    @rule
    def _in_order(self) -> Iterator[str]:
        start = self.start()
        if self.voltage_limit is not None and start is not None and self.voltage_limit <= start:
            yield f"has voltage_limit = {self.voltage_limit:g} V, which is not above {start:g} V, the voltage of the bus"

    def start(self) -> float | None:
        """Voltage of the bus before energy returns [V]."""
        return self.max_voltage


class Supply(Bus):
    """DC bus and amplifier that feed the motor."""

    min_voltage: Annotated[Voltage, Positive] | None = None
    """least voltage of the bus, at which the motor must reach its torque and speed"""
    continuous_current: Annotated[Current, Positive] | None = None
    """continuous current of the amplifier, rms over the cycle"""

    @rule
    def _voltages_in_order(self) -> Iterator[str]:
        if self.min_voltage is not None and self.max_voltage is not None and self.max_voltage < self.min_voltage:
            yield "has max_voltage below min_voltage; exchange them"

    def start(self) -> float | None:
        """Voltage of the bus before energy returns [V]."""
        return self.max_voltage or self.min_voltage
