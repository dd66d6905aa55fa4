"""The loops of a servo cascade: position, speed, current, and what is fed forward."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from .. import _core
from ..inputs.part import Part
from ..inputs.quantities import (
    Angle,
    Frequency,
    Inertia,
    IntegralPositionGain,
    Limit,
    NotNegative,
    Number,
    PositionGain,
    Positive,
    Speed,
    Stiffness,
    Time,
    Torque,
    ViscousFriction,
    Whole,
)
from ..reproducible import expm1
from .filters import Filter

Share = Limit(ge=0.0, le=1.0)
INFINITE = math.inf


class PositionLoop(Part):
    """``speed = sat(gain e + integral + feedforward * rate of the reference)``, in terms of the reference's shaft."""

    gain: Annotated[PositionGain, Positive]
    """K_v"""
    integral_gain: Annotated[IntegralPositionGain, NotNegative] = 0.0
    feedforward: Annotated[Number, NotNegative] = 0.0
    """share of the reference's speed that is fed forward"""
    speed_limit: Annotated[Speed, Positive] | None = None
    reference_delay: Annotated[Time, NotNegative] = 0.0
    """by which the reference of this loop comes later than what is fed forward: the equivalent time of the speed loop"""
    dead_zone: tuple[Annotated[Angle, NotNegative], Annotated[Angle, NotNegative]] | None = None
    """inner and outer error: below the inner one the integrator holds while the reference stands, until the outer one is passed"""
    sample_time: Annotated[Time, Positive] | None = None
    """left out, that of the controller"""

    @model_validator(mode="after")
    def _dead_zone_has_a_use(self) -> Self:
        if self.dead_zone is not None:
            if self.integral_gain == 0.0:
                raise ValueError(
                    "has a dead_zone, which holds the integrator, but no integral_gain; give one, or leave dead_zone out"
                )
            if self.dead_zone[1] < self.dead_zone[0]:
                raise ValueError(
                    f"has dead_zone = {list(self.dead_zone)} rad; the outer error, which comes second, must not be smaller"
                )
        return self

    def core(self) -> _core.PositionLoop:
        loop = _core.PositionLoop()
        loop.gain = self.gain
        loop.integral_gain = self.integral_gain
        loop.speed_feedforward = self.feedforward
        loop.speed_limit = INFINITE if self.speed_limit is None else self.speed_limit
        loop.inner, loop.outer = self.dead_zone or (0.0, 0.0)
        return loop


class Difference(Part):
    """Difference of the angles read, over `span` sample times, with a first-order filter."""

    kind: Literal["difference"] = "difference"
    span: Annotated[Whole, Field(ge=1, le=1000)] = 1
    time_constant: Annotated[Time, NotNegative] = 0.0
    """of the filter: y += (1 - exp(-T/tau)) (x - y)"""


class Observer(Part):
    """x_1 += T (x_2 + 2 zeta w_o e) + T^2 M/(2 J),  x_2 += T (w_o^2 e + M/J),  e = angle read - x_1."""

    kind: Literal["observer"]
    bandwidth: Annotated[Frequency, Positive]
    """w_o/(2 pi)"""
    damping: Annotated[Number, Positive] = 1.0
    inertia: Annotated[Inertia, Positive] | None = None
    """J at the motor that the torque accelerates; left out, the observer does not know of the torque"""


class ExactSpeed(Part):
    """The speed as it is, as of an ideal tachometer: for theory."""

    kind: Literal["exact"]


class SpeedLoop(Part):
    """Proportional and integral, with anti-windup by back-calculation; in terms of the motor.

    ``v = I - (k_p - k_t) w + feedforward``, ``M = sat(k_t (w* - w) + v)``, ``I += T (k_i/k_t) (M - v)``
    """

    gain: Annotated[ViscousFriction, Positive]
    """k_p, torque of the motor per speed of the motor"""
    integral_gain: Annotated[Stiffness, NotNegative] | None = None
    """k_i; left out, as integral_time says"""
    integral_time: Annotated[Time, Positive] | None = None
    """k_p/k_i; left out with integral_gain, there is no integrator"""
    reference_weight: Annotated[Number, Limit(gt=0.0, le=1.0)] = 1.0
    """k_t/k_p: below 1 steps of the reference overshoot less"""
    torque_limit: Annotated[Torque, Positive] | None = None
    estimate: Annotated[Difference | Observer | ExactSpeed, Field(discriminator="kind")] = Difference()
    """how the speed is made of the angles read"""
    reference_filters: tuple[Filter, ...] = ()
    torque_filters: tuple[Filter, ...] = ()
    sample_time: Annotated[Time, Positive] | None = None
    """left out, that of the controller"""

    @model_validator(mode="after")
    def _one_integral(self) -> Self:
        if self.integral_gain is not None and self.integral_time is not None:
            raise ValueError("has integral_gain and integral_time, which say the same; give one of them")
        return self

    @property
    def k_i(self) -> float:
        """Integral gain [N·m/rad]."""
        if self.integral_time is not None:
            return self.gain / self.integral_time
        return self.integral_gain or 0.0

    def core(self) -> _core.SpeedLoop:
        loop = _core.SpeedLoop()
        loop.gain = self.gain
        loop.reference_gain = self.reference_weight * self.gain
        loop.integral_gain = self.k_i
        loop.torque_limit = INFINITE if self.torque_limit is None else self.torque_limit
        return loop

    def core_estimate(self, sample_time: float) -> _core.SpeedEstimate:
        out = _core.SpeedEstimate()
        e = self.estimate
        out.kind = getattr(_core.SpeedEstimate.Kind, e.kind)
        if isinstance(e, Difference):
            out.span = e.span
            out.smoothing = -expm1(-sample_time / e.time_constant) if e.time_constant > 0.0 else 1.0
        elif isinstance(e, Observer):
            out.bandwidth = 2.0 * math.pi * e.bandwidth
            out.damping = e.damping
            out.inertia = e.inertia or 0.0
        return out


class IdealCurrent(Part):
    """The torque follows at once, within the torque-speed line of the motor at its largest voltage."""

    kind: Literal["ideal"] = "ideal"


class VoltageCommand(Part):
    """No current loop: a law of your own commands the voltage."""

    kind: Literal["voltage"]


class FirstOrderCurrent(Part):
    """The torque follows with a time constant, as a tuned current loop does, within the torque-speed line of the motor."""

    kind: Literal["first_order"]
    time_constant: Annotated[Time, Positive]


class SampledCurrent(Part):
    """A sampled PI controller of the voltage, its zero on the pole of the winding, so that the loop is g/(z (z - 1))."""

    gain: Annotated[Number, Limit(gt=0.0, le=1.0)] = 1.0 / 3.0
    """g: with 1/3 and one sample time of delay it overshoots by 1/27, with a phase margin of 61 degrees"""
    back_emf: Annotated[Number, Share] = 1.0
    """share of the back-e.m.f. that is compensated"""
    sample_time: Annotated[Time, Positive] | None = None
    """left out, that of the controller"""


class CurrentLoop(SampledCurrent):
    """Sampled control of the current that makes the torque."""

    kind: Literal["pi"]


class FieldOriented(SampledCurrent):
    """Sampled control of both currents of a synchronous motor, i_d and i_q, each as the loop of kind "pi".

    Voltage circle dc_voltage/sqrt(3), current circle `motor.winding.max_current_rms` with priority for i_d, maximum torque per
    ampere, field weakening ``i_d* += k (u_f^2 - |u|^2)``; the inverter holds its voltage in coordinates of the stator.
    """

    kind: Literal["field_oriented"]
    decoupling: Annotated[Number, Share] = 1.0
    """share of what the current of one axis induces in the other that is compensated"""
    field_weakening: Annotated[Number, Share] = 0.02
    """share of the excess of the voltage that i_d makes up for in one sample time; 0: none"""
    weakening_voltage: Annotated[Number, Limit(gt=0.0, le=1.0)] = 0.95
    """share of the largest voltage above which the field is weakened; the rest is a reserve to control the currents with"""


class Feedforward(Part):
    """Torque of the motor that the reference is known to need: J a + b w + T_c sgn w + T_L, in terms of the motor."""

    inertia: Annotated[Inertia, NotNegative] = 0.0
    """total, at the motor"""
    viscous_friction: Annotated[ViscousFriction, NotNegative] = 0.0
    friction_torque: Annotated[Torque, NotNegative] = 0.0
    load_torque: Torque = 0.0
    backlash: Annotated[Angle, NotNegative] = 0.0
    """total gap at the reference's shaft; with the encoder on the motor the reference is moved by half of it, by the way it goes"""
    backlash_rate: Annotated[Speed, Positive] | None = None
    """at which it is passed; needed with backlash"""

    @model_validator(mode="after")
    def _rate_with_backlash(self) -> Self:
        if self.backlash > 0.0 and self.backlash_rate is None:
            raise ValueError("has backlash but no backlash_rate; add the speed at which the reference crosses the gap")
        return self

    def core(self) -> _core.TorqueFeedforward:
        out = _core.TorqueFeedforward()
        out.inertia = self.inertia
        out.viscous_friction = self.viscous_friction
        out.friction_torque = self.friction_torque
        out.load_torque = self.load_torque
        return out
