"""A drive advanced step by step: for control loops, co-simulation and learning."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, overload

import numpy as np

from .. import _core
from ..errors import InputError
from ..inputs.arguments import checked
from ..inputs.quantities import Time
from ..inputs.validation import shown
from ..model.drive import Drive
from .run import start_state
from .scenario import Initial, Scenario, drive_of
from .variables import CHANNEL_NAMES, VARIABLES

MIN_INTERVAL, MAX_INTERVAL = 1e-12, 1e12
"""Of a step [s]: below, it is lost in the rounding of the time; above, in that of a motion's phase."""

_CHANNEL = {name: k for k, name in enumerate(CHANNEL_NAMES)}


@dataclass(frozen=True)
class SimulationState:
    """Everything that a simulation needs to continue bit for bit, contact modes and hysteresis memory included."""

    time: float
    """[s]"""
    values: tuple[Any, ...] = field(repr=False)


class Simulation:
    """A drive that is advanced interval by interval.

    Parameters
    ----------
    drive
        A drive, or a scenario, which also gives the state at t = 0; its command and load torque are not used.
    step
        The usual interval [s]; any other is possible, this one is fastest.
    initial
        State at t = 0; default that of the scenario, or rest.

    Examples
    --------
    >>> sim = Simulation(drive)                                       # doctest: +SKIP
    >>> sim.advance(1e-3, command=0.1)                                # doctest: +SKIP
    >>> sim["load_speed"]                                             # doctest: +SKIP
    >>> sim["load_speed", "twist"]                                    # doctest: +SKIP
    """

    @checked
    def __init__(self, drive: Drive | Scenario, *, step: Time = 1e-3, initial: Initial | None = None) -> None:
        if not MIN_INTERVAL <= step <= MAX_INTERVAL:
            raise InputError(f"step {step} s must lie between {MIN_INTERVAL:g} s and {MAX_INTERVAL:g} s")
        if initial is None:
            initial = drive.initial if isinstance(drive, Scenario) else Initial()
        self._drive = drive_of(drive)
        self._core = _core.Simulation(self._drive.core(), step)
        self._initial = initial
        self._derived: dict[str, Callable[[list[float]], float]] = {
            "efficiency": self._efficiency,
            "motor_power": self._motor_power,
        }
        self.reset()

    def __repr__(self) -> str:
        return f"Simulation({self._drive!r}, at {self.time:.6g} s)"

    @checked
    def reset(self, initial: Initial | None = None) -> None:
        """Go back to t = 0.

        Parameters
        ----------
        initial
            A new state at t = 0; left out, that of the last start.
        """
        if initial is not None:
            self._initial = initial
        start = self._initial
        self._core.reset(start_state(start), start.hysteresis_capacity)

    @property
    def drive(self) -> Drive:
        """The drive that is simulated."""
        return self._drive

    @property
    def time(self) -> float:
        """[s]"""
        return self._core.time()

    def advance(
        self,
        interval: float,
        command: float | tuple[float, float],
        load_torque: float | tuple[float, float] = 0.0,
    ) -> None:
        """Advance by an interval [s].

        Parameters
        ----------
        command, load_torque
            E_C [-] and M_Z [N·m]: one value, held over the interval, or two, between which it runs in a straight line.

        Raises
        ------
        InputError
            The interval is shorter than 1e-12 s or longer than 1e12 s, or a value is not finite.
        SolverError
            The motion has no continuation. The state stays as it was.
        """
        try:
            c0, c1 = command if isinstance(command, tuple) else (command, command)
            m0, m1 = load_torque if isinstance(load_torque, tuple) else (load_torque, load_torque)
            within = MIN_INTERVAL <= interval <= MAX_INTERVAL
            finite = c0 - c0 == 0.0 and c1 - c1 == 0.0 and m0 - m0 == 0.0 and m1 - m1 == 0.0
        except (TypeError, ValueError):
            raise InputError(
                f"interval {shown(interval)}, command {shown(command)} and load_torque {shown(load_torque)} must be numbers (SI), the last two "
                "also pairs of numbers"
            ) from None
        if not within:
            raise InputError(f"interval {shown(interval)} s must lie between {MIN_INTERVAL:g} s and {MAX_INTERVAL:g} s")
        if not finite:
            raise InputError(
                f"command {shown(command)} and load_torque {shown(load_torque)} must be finite numbers (SI)"
            )
        if self.time + interval == self.time:
            raise InputError(
                f"interval {interval} s is below the resolution of the time, {self.time} s; take a longer one, or reset"
            )
        self._core.advance(interval, c0, c1, m0, m1)

    @overload
    def __getitem__(self, name: str) -> float: ...
    @overload
    def __getitem__(self, name: tuple[str, ...] | list[str]) -> np.ndarray: ...
    def __getitem__(self, name: str | tuple[str, ...] | list[str]) -> float | np.ndarray:
        """Value of a result variable now (SI), with the inputs at their last values; of several, as an array.

        Raises
        ------
        InputError
            There is no such variable.
        """
        values = self._core.read()
        if isinstance(name, tuple | list):
            return np.array([self._value(one, values) for one in name])
        return self._value(name, values)

    def _value(self, name: str, values: list[float]) -> float:
        try:
            channel = _CHANNEL.get(name)
            return values[channel] if channel is not None else self._derived[name](values)
        except (KeyError, TypeError):  # unknown, or nothing that could be a name
            known = ", ".join(v.name for v in VARIABLES)
            raise InputError(f"{shown(name)} is no variable; the variables are {known}") from None

    def read(self) -> dict[str, float]:
        """All result variables (SI), by name."""
        values = self._core.read()
        return {v.name: self._value(v.name, values) for v in VARIABLES}

    # The array functions of `results` take ten times as long for a single number.

    def _motor_power(self, values: list[float]) -> float:
        return values[_CHANNEL["motor_torque"]] * values[_CHANNEL["motor_speed"]]

    def _efficiency(self, values: list[float]) -> float:
        speed = values[_CHANNEL["motor_speed"]]
        if speed == 0.0:
            return math.nan
        driving = math.copysign(1.0, speed) * values[_CHANNEL["output_torque"]]
        fed_in = math.copysign(1.0, speed) * values[_CHANNEL["input_torque"]] * self._drive.gearbox.ratio
        if driving >= 0.0:
            return driving / fed_in if fed_in != 0.0 else math.nan if driving == 0.0 else math.inf
        return fed_in / driving if fed_in < 0.0 else 0.0

    @property
    def state(self) -> SimulationState:
        """The whole state; set it to return to it, or to continue it in another simulation of the same drive."""
        time, *rest = self._core.get_state()
        return SimulationState(time, tuple(rest))

    @state.setter
    def state(self, state: SimulationState) -> None:
        try:
            self._core.set_state(state.time, *state.values)
        except (AttributeError, TypeError):
            raise InputError(f"{shown(state)} is no state of a simulation; give what `state` returned") from None
