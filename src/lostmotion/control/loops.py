"""The loops of a servo cascade: position, speed, current, and what is fed forward."""

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from ..inputs.core_parameters import (
    CurrentLoopFields,
    DifferenceFields,
    FeedforwardFields,
    FieldOrientedFields,
    ObserverFields,
    PositionLoopFields,
    SpeedLoopFields,
)
from ..inputs.part import Part, rule
from ..inputs.quantities import Positive, Time
from .filters import Filter


class SampledLoop(Part):
    """A loop with a sample time of its own."""

    sample_time: Annotated[Time, Positive] | None = None  #: default: the value of the controller


class PositionLoop(SampledLoop, PositionLoopFields):
    """``speed = sat(gain e + integral + feedforward * rate of the reference)``, in terms of the reference's shaft."""

    @rule
    def _dead_zone_has_a_use(self) -> Iterator[str]:
        if self.dead_zone is not None:
            if self.integral_gain == 0.0:
                yield "has a dead_zone, which holds the integrator, but no integral_gain; give one, or leave dead_zone out"
            if self.dead_zone[1] < self.dead_zone[0]:
                yield f"has dead_zone = {list(self.dead_zone)} rad; the outer error, which comes second, must not be smaller"


class Difference(DifferenceFields):
    """Difference of the angles read, over `span` sample times, with a first-order filter."""

    kind: Literal["difference"] = "difference"


class Observer(ObserverFields):
    """x_1 += T (x_2 + 2 zeta w_o e) + T^2 M/(2 J),  x_2 += T (w_o^2 e + M/J),  e = angle read - x_1."""

    kind: Literal["observer"]


class ExactSpeed(Part):
    """The speed as it is, as of an ideal tachometer: for theory."""

    kind: Literal["exact"]


class SpeedLoop(SampledLoop, SpeedLoopFields):
    """Proportional and integral, with anti-windup by back-calculation; in terms of the motor.

    ``v = I - (k_p - k_t) w + feedforward``, ``M = sat(k_t (w* - w) + v)``, ``I += T (k_i/k_t) (M - v)``
    """

    estimate: Annotated[Difference | Observer | ExactSpeed, Field(discriminator="kind")] = Difference()
    """method that makes the speed from the angles read"""
    reference_filters: tuple[Filter, ...] = ()
    torque_filters: tuple[Filter, ...] = ()

    @rule
    def _one_integral(self) -> Iterator[str]:
        if self.integral_gain is not None and self.integral_time is not None:
            yield "has integral_gain and integral_time, which say the same; give one of them"

    @property
    def k_i(self) -> float:
        """Integral gain [N·m/rad]."""
        if self.integral_time is not None:
            return self.gain / self.integral_time
        return self.integral_gain or 0.0


class IdealCurrent(Part):
    """The torque follows at once, within the torque-speed line of the motor at its largest voltage."""

    kind: Literal["ideal"] = "ideal"


class VoltageCommand(Part):
    """No current loop: a law of your own commands the voltage."""

    kind: Literal["voltage"]


class FirstOrderCurrent(Part):
    """The torque follows with a time constant, as a tuned current loop does, within the torque-speed line of the motor."""

    time_constant: Annotated[Time, Positive]  #: with which the torque follows
    kind: Literal["first_order"]


class SampledCurrent(SampledLoop):
    """A sampled PI controller of the voltage, its zero on the pole of the winding, so that the loop is g/(z (z - 1))."""


class CurrentLoop(CurrentLoopFields, SampledCurrent):
    """Sampled control of the current that makes the torque."""

    kind: Literal["pi"]


class FieldOriented(FieldOrientedFields, SampledCurrent):
    """Sampled control of both currents of a synchronous motor, i_d and i_q, each as the loop of kind "pi".

    Voltage circle dc_voltage/sqrt(3), current circle `motor.winding.max_current_rms` with priority for i_d, maximum
    torque per ampere, field weakening ``i_d* += k (u_f^2 - |u|^2)``. The inverter holds its voltage in coordinates of
    the stator.
    """

    kind: Literal["field_oriented"]


class Feedforward(FeedforwardFields):
    """Torque of the motor that the reference is known to need: J a + b w + T_c sgn w + T_L, in terms of the motor."""

    @rule
    def _rate_with_backlash(self) -> Iterator[str]:
        if self.backlash > 0.0 and self.backlash_rate is None:
            yield "has backlash but no backlash_rate; add the speed at which the reference crosses the gap"
