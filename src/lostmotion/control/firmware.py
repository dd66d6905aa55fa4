"""The position control of a hobby servo's firmware: from the position error by a duty cycle to a torque."""

import itertools
from collections.abc import Iterator
from typing import Annotated

from pydantic import Field

from ..errors import InputError
from ..inputs.core_parameters import FirmwareFields
from ..inputs.part import Part, rule
from ..inputs.quantities import Angle, NotNegative, Number, Share
from ..reproducible import interpolate


class DutyCurve(Part):
    """Duty cycle of the bridge over the position error, in straight lines from point to point; odd, and constant beyond the last
    point.
    """

    errors: tuple[Annotated[Angle, NotNegative], ...]
    """position errors, rising from 0"""
    values: tuple[Annotated[Number, Share], ...]
    """duty cycle at each of them, from 0 on"""

    @rule
    def _fits(self) -> Iterator[str]:
        if len(self.errors) < 2 or len(self.values) != len(self.errors):
            yield f"has {len(self.errors)} errors and {len(self.values)} values; give as many of both, two at least"
        if self.errors[0] != 0.0 or self.values[0] != 0.0:
            yield "does not begin at 0; make the first error and the first value 0"
        if any(b <= a for a, b in itertools.pairwise(self.errors)):
            yield "has errors that do not rise; put each one above that before it"


class Firmware(FirmwareFields):
    """Position loop of a hobby servo, from the position error to the duty cycle of its bridge.

    The duty cycle is ``d = duty(e)`` of the error beyond the dead band. The current is ``I = (d U_0 - k w)/(R + d^2 R_s)`` within
    ``max_current``, and the torque ``k I``.

    Examples
    --------
    Half of the supply voltage at standstill, and the current that the winding takes:

    >>> import lostmotion as lm
    >>> servo = lm.control.Firmware(
    ...     supply_voltage=12.0, resistance=6.0, torque_constant=0.01, duty={"errors": [0.0, 0.2], "values": [0.0, 1.0]})
    >>> round(servo.torque(error=0.1, speed=0.0), 9)
    0.01
    """

    duty: Annotated[DutyCurve, Field(description="table of the duty cycle over the position error")]

    def core_fields(self) -> dict[str, object]:
        """Fields for the core, in SI units."""
        return {**super().core_fields(), "errors": list(self.duty.errors), "duties": list(self.duty.values)}

    def torque(self, error: float, speed: float) -> float:
        """Torque of the motor for a position error and a speed, without the filter.

        Parameters
        ----------
        error
            Reference less the angle that is read [rad].
        speed
            Speed of the motor [rad/s].

        Returns
        -------
        float
            Torque [N·m].
        """
        beyond = max(abs(error) - self.dead_band, 0.0)
        duty = interpolate(beyond, self.duty.errors, self.duty.values)
        duty = duty if error >= 0.0 else -duty
        k = self.torque_constant
        current = (duty * self.supply_voltage - k * speed) / (self.resistance + duty * duty * self.supply_resistance)
        most = float("inf") if self.max_current is None else self.max_current
        return k * min(max(current, -most), most)

    def curve(self) -> tuple[list[float], list[float], float]:
        """(errors [rad], torques at standstill [N·m], fall of the torque with the speed of the motor [N·m·s/rad]).

        Raises
        ------
        InputError
            The supply has a resistance, with which the torque is no piecewise linear function of error and speed; or the goal is
            filtered or limited from sample to sample.
        """
        for key in ("goal_filter_time", "goal_rate_limit", "goal_acceleration_limit"):
            if getattr(self, key):
                raise InputError(
                    "acts from sample to sample; leave it out, give a reference that keeps to it, or take a sampled controller",
                    key,
                )
        if self.supply_resistance > 0.0:
            raise InputError(
                "makes the torque depend on error and speed together; leave it out, or take a sampled controller",
                "supply_resistance",
            )
        per_volt = self.torque_constant / self.resistance
        errors, torques = [0.0], [0.0]
        if self.dead_band > 0.0:
            errors.append(self.dead_band)
            torques.append(0.0)
        errors += [self.dead_band + e for e in self.duty.errors[1:]]
        torques += [per_volt * self.supply_voltage * d for d in self.duty.values[1:]]
        return errors, torques, per_volt * self.torque_constant
