"""Why a drive is stuck: what holds each contact, and what would free it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from .. import _core
from ..errors import InputError
from ..inputs.arguments import checked
from ..inputs.quantities import Time
from ..model.drive import Drive
from ..model.self_locking import SelfLocking, self_locking
from .run import core_inputs
from .scenario import Scenario
from .stepping import Simulation
from .variables import CHANNEL_NAMES


@dataclass(frozen=True)
class ContactState:
    """One dry contact at one instant. Torques [N·m] at the contact: input shaft at the input, the others at the output."""

    name: str
    mode: int  # -1 slips in reverse, 0 stuck, +1 slips forward
    speed: float  # [rad/s]
    torque: float  # held, or while slipping taken
    capacity_forward: float  # it holds torques up to this before it slips forward
    capacity_backward: float  # and down to minus this before it slips in reverse

    @property
    def to_free_forward(self) -> float:
        """Torque [N·m] that is missing until it slips forward."""
        return self.capacity_forward - self.torque

    @property
    def to_free_backward(self) -> float:
        """Torque [N·m], backward, that is missing until it slips in reverse."""
        return self.capacity_backward + self.torque

    def __str__(self) -> str:
        if self.mode != 0:
            way = "forward" if self.mode > 0 else "backward"
            return f"{self.name}: slips {way} at {self.speed:.4g} rad/s, taking {abs(self.torque):.4g} N·m"
        if math.isinf(self.capacity_forward):
            return f"{self.name}: rigid, holds {self.torque:.4g} N·m"
        return (
            f"{self.name}: stuck, holds {self.torque:.4g} N·m of +{self.capacity_forward:.4g} / "
            f"-{self.capacity_backward:.4g} N·m; {self.to_free_forward:.4g} N·m more frees it forward, "
            f"{self.to_free_backward:.4g} N·m in reverse"
        )


@dataclass(frozen=True)
class Explanation:
    """The contacts of a drive at one instant, and the commands that would move its load."""

    time: float  # [s]
    values: dict[str, float]  # result variables at this instant
    contacts: tuple[ContactState, ...]
    command_forward: float  # E_C above which the load moves forward
    command_backward: float  # E_C below which it moves backward
    command_limit: float  # |E_C| that the amplifier can follow
    self_locking: SelfLocking  # of the gearbox under the present load torque, or where there is none, the rated one

    def __str__(self) -> str:
        v = self.values
        lines = [
            f"t = {self.time:.6g} s: command {v['command']:.4g}, motor {v['motor_torque']:.4g} N·m at "
            f"{v['motor_speed']:.4g} rad/s, output {v['output_torque']:.4g} N·m, load {v['load_speed']:.4g} rad/s",
            *(f"  {contact}" for contact in self.contacts),
            "  from rest at this output torque the load moves forward with a constant command above "
            f"{self.command_forward:.4g}, backward below {self.command_backward:.4g}",
        ]
        beyond = [c for c in (self.command_forward, self.command_backward) if abs(c) > self.command_limit]
        if beyond:
            lines.append(f"  but the amplifier ends at {self.command_limit:.4g}: it cannot reach {beyond[0]:.4g}")
        if self.self_locking.notable:
            lines.append(f"  {self.self_locking}")
        return "\n".join(lines)


@checked
def explain(what: Scenario | Simulation, time: Time | None = None) -> Explanation:
    """The state of the contacts of a drive at one instant.

    Parameters
    ----------
    what
        A scenario, which is run to `time`, or a simulation, which is explained as it stands.
    time
        [s], for a scenario.

    Returns
    -------
    Explanation
        Print it, or read its numbers. The commands that would move the load leave inertia out: the motor is thought
        to wind up the gear slowly from its present output torque until the load is free.

    Raises
    ------
    InputError
        The time is missing, or outside the scenario's duration.
    """
    if isinstance(what, Simulation):
        if time is not None:
            raise InputError("a simulation is explained at its present time; leave time out")
        values, contacts = what._core.explain()
        return _explanation(what.drive, what.time, values, contacts)
    if time is None:
        raise InputError(f"time is missing; give one between 0 and the duration, {what.simulation.duration} s")
    if not 0.0 <= time <= what.simulation.duration:
        raise InputError(f"time {time} s must lie between 0 and the duration, {what.simulation.duration} s")
    values, contacts = _core.explain_at(*core_inputs(what), time)
    return _explanation(what.drive(), time, values, contacts)


def _explanation(drive: Drive, time: float, values: list[float], contacts: list[tuple[Any, ...]]) -> Explanation:
    named = dict(zip(CHANNEL_NAMES, values, strict=True))
    forward, backward = (
        drive.core().smallest_command(named["output_torque"], named["load_torque"], s) for s in (+1, -1)
    )
    limit = drive.motor.command_limit
    states = tuple(ContactState(*contact) for contact in contacts)
    verdict = self_locking(drive.train(), "gearbox", named["load_torque"] or drive.gearbox.rated_output_torque)
    return Explanation(time, named, states, forward, backward, math.inf if limit is None else limit, verdict)
