"""A drive advanced step by step: for control loops, co-simulation and learning."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from . import _core
from .errors import InputError
from .parts import Drive
from .results import add_derived
from .run import start_state
from .scenario import Initial
from .variables import CHANNEL_NAMES


@dataclass(frozen=True)
class SimulationState:
    """Everything that a simulation needs to go on bit for bit, contact modes and hysteresis memory included."""

    time: float
    values: tuple[Any, ...] = field(repr=False)


class Simulation:
    """A drive that is advanced interval by interval.

    Parameters
    ----------
    drive
        The drive.
    step
        The usual interval [s]; any other works too, this one is fastest.
    initial
        State at t = 0; default rest.

    Examples
    --------
    >>> sim = Simulation(drive)                                       # doctest: +SKIP
    >>> sim.advance(1e-3, command=0.1)                                # doctest: +SKIP
    >>> sim["load_speed"]                                             # doctest: +SKIP
    """

    def __init__(self, drive: Drive, *, step: float = 1e-3, initial: Initial | None = None) -> None:
        if not step > 0.0:
            raise InputError(f"step {step} must be greater than 0 s")
        self._drive = drive
        self._core = _core.Simulation(drive.core(), step)
        if initial is not None:
            start = (start_state(initial), initial.hysteresis_capacity, 0.0, [0] * 7, [0.0, 0.0], False)
            self._core.set_state(0.0, *start)

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
            The interval is not positive, or a value is not finite.
        SolverError
            The motion has no continuation. The state stays as it was.
        """
        c0, c1 = command if isinstance(command, tuple) else (command, command)
        m0, m1 = load_torque if isinstance(load_torque, tuple) else (load_torque, load_torque)
        if not (interval > 0.0 and c0 - c0 == 0.0 and c1 - c1 == 0.0 and m0 - m0 == 0.0 and m1 - m1 == 0.0):
            raise InputError(
                f"interval {interval} s must be positive, command {command} and load_torque {load_torque} finite"
            )
        self._core.advance(interval, c0, c1, m0, m1)

    def __getitem__(self, name: str) -> float:
        """Value of a result variable now, with the inputs at their last values.

        Raises
        ------
        KeyError
            There is no such variable.
        """
        values = self.read()
        if name not in values:
            raise KeyError(f"{name!r} is no variable; the variables are {', '.join(values)}")
        return values[name]

    def read(self) -> dict[str, float]:
        """All result variables, by name."""
        values = dict(zip(CHANNEL_NAMES, self._core.read(), strict=True))
        add_derived(values, self._drive.gearbox.ratio)
        return {name: float(value) for name, value in values.items()}

    @property
    def state(self) -> SimulationState:
        """The whole state; set it to go back to it, or to continue it in another simulation of the same drive."""
        time, *rest = self._core.get_state()
        return SimulationState(time, tuple(rest))

    @state.setter
    def state(self, state: SimulationState) -> None:
        self._core.set_state(state.time, *state.values)
