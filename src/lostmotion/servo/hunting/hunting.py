"""Hunting: what a closed loop does by itself, exactly with continuous controllers, by a long run with sampled ones."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from ...errors import InputError
from ...inputs.argument_checks import checked
from ...inputs.quantities import Count
from ...inputs.refusal_messages import shown
from ...interruptible_threads import thread_pool
from ...response.plant import known_output, plant_of
from ...response.shooting import floquet_multipliers, is_stable, motion_of
from ...simulation.scenario.scenario import Scenario
from ...simulation.scenario.units_of_keys import unit_for
from ..linear_regimes import axis_of
from .hunting_decision import Verdict
from .limit_cycle_causes import PART, at_rest, without, without_backlash, without_friction
from .limit_cycles import CycleSearch, UndrivenLoop, find_limit_cycle

if TYPE_CHECKING:
    import xarray

NAN = float("nan")
MAX_POINTS = 1_000_000  # of a map


@dataclass(frozen=True)
class Hunting:
    """A limit cycle, or the reason why there is none."""

    verdict: Verdict
    """hunts; at rest, of a state that is shown to be an equilibrium; not decided"""
    reason: str
    """why there is no limit cycle, or what was watched in vain; empty if there is one"""
    exact: bool = False
    """by Newton's method with the period as an unknown; else by statistics of a long run, as of sampled controllers"""
    frequency: float = NAN
    """[Hz]; NaN without a limit cycle"""
    amplitudes: Mapping[str, float] = field(default_factory=dict)
    """half of what each variable swings by (SI)"""
    motion: xarray.Dataset | None = None
    """one period, with the Jacobian of the map over it, of an exact one"""
    multipliers: np.ndarray = field(default_factory=lambda: np.array([]))
    """Floquet multipliers of an exact one, without the multiplier of its phase, which is 1"""
    causes: tuple[str, ...] = ()
    """causes without which there is no limit cycle, or less than half of the amplitude: backlash, dry friction, static friction (in excess of the
    friction in motion), saturation, encoder resolution"""

    @property
    def cycles(self) -> bool:
        """Whether there is a limit cycle."""
        return self.verdict == "hunts"

    @property
    def period(self) -> float:
        """[s]"""
        return 1.0 / self.frequency

    @property
    def stable(self) -> bool:
        """Whether neighbouring motions approach it; a run has led to one that is not exact, so that it is."""
        return self.cycles and (not self.exact or is_stable(self.multipliers))

    def __repr__(self) -> str:
        if not self.cycles:
            return f"{'no limit cycle' if self.verdict == 'at rest' else self.verdict}: {self.reason}"
        by = f", by {' and '.join(self.causes)}" if self.causes else ""
        return f"{'stable' if self.stable else 'unstable'} limit cycle of {self.frequency:.6g} Hz{by}"


@checked
def limit_cycle(scenario: Scenario, *, motor: str | None = None, causes: bool = True) -> Hunting:
    """Find the limit cycle that a loop reaches from the initial state of its scenario.

    With continuous controllers, or without any, a run leads to its neighbourhood. Newton's method then finds state and period to
    rounding, with the exact Jacobian of the map over a period. Sampled controllers have no such map, since a quantised angle has no
    derivative: a long run after a small step is evaluated, as in `commission`.

    Parameters
    ----------
    scenario : Scenario
        Its inputs must come to rest. Its duration is the duration of the shortest run; longer ones follow if it does not suffice.
    motor : str, optional
        Name of the motor whose sampled controller is examined. Default: the only one.
    causes : bool
        Whether to find the causes, by leaving out one possible cause after the other.

    Returns
    -------
    Hunting
        The verdict, and the limit cycle if there is one.

    Raises
    ------
    InputError
        An input never comes to rest, or there are both sampled and continuous controllers.

    Examples
    --------
    >>> import lostmotion as lm
    >>> hunting = lm.servo.limit_cycle(lm.load("hunting-with-static-friction"), causes=False)
    >>> hunting.verdict, round(hunting.period, 3)
    ('hunts', 2.841)
    """
    train = scenario.long()
    if train.axes():
        if train.continuous():
            raise InputError(
                "limit_cycle: the scenario has sampled and continuous controllers; give all of them one kind"
            )
        return _sampled(train, motor, causes=causes)
    found = find_limit_cycle(train)
    if found.reason:
        return Hunting(found.verdict, found.reason, exact=True)
    plant = plant_of(train)
    motion = motion_of(found.result, plant, found.period)
    amplitudes = {v.name: 0.5 * float(np.ptp(motion[v.name].values)) for v in plant.variables}
    found_causes = _causes(train, found) if causes else ()
    return Hunting("hunts", "", True, 1.0 / found.period, amplitudes, motion, _multipliers(found), found_causes)


def _multipliers(found: CycleSearch) -> np.ndarray:
    """The multipliers without the one of the phase, nearest to 1."""
    all_of_them = floquet_multipliers(found.result, 0)
    return np.delete(all_of_them, int(np.argmin(np.abs(all_of_them - 1.0))))


def _swing(found: CycleSearch, name: str) -> float:
    return 0.0 if found.reason else float(np.ptp(found.values(name)))


def _causes(train: Scenario, found: CycleSearch) -> tuple[str, ...]:
    watched = UndrivenLoop.of(train).watched
    low = PART * _swing(found, watched)
    left_out = {
        "backlash": without_backlash(train),
        "dry friction": without_friction(train),
        "static friction": without_static_friction(train),
        "saturation": without_saturation(train),
    }
    return tuple(
        name for name, other in left_out.items() if other is not None and _swing(find_limit_cycle(other), watched) < low
    )


def without_static_friction(train: Scenario) -> Scenario | None:
    """The scenario with the friction in motion at rest, too; None where that changes nothing."""

    def even(element: Any) -> dict[str, Any]:
        keys = ("breakaway_torque", "breakaway_force") if getattr(element, "stribeck_speed", None) is None else ()
        return {key: None for key in keys if getattr(element, key, None) is not None}

    return without(train, even)


def without_saturation(train: Scenario) -> Scenario | None:
    """The scenario without the limits of continuous controllers and of their motors; None where that changes nothing."""
    controllers = {
        name: c.model_copy(update={"limit": None, "anti_windup_time": None}) for name, c in train.continuous().items()
    }
    motors = {
        name: m.without_torque_limits() if math.isfinite(m.largest_torque) and name in controllers else m
        for name, m in train.motors.items()
    }
    if controllers == train.continuous() and motors == dict(train.motors):
        return None
    return train.model_copy(update={"controllers": {**train.controllers, **controllers}, "motors": motors})


def _sampled(train: Scenario, motor: str | None, *, causes: bool) -> Hunting:
    """The result of a long run, as the servo report has it."""
    from .limit_cycle_causes import limit_cycle as watched

    axis = axis_of(train, motor)
    if axis.controller.position is None:
        raise InputError(
            f"limit_cycle: the controller of {axis.motor} has no position loop, whose rest is watched; add one, or take a "
            "continuous controller"
        )
    cycle = watched(axis) if causes else None
    rest = cycle.whole if cycle is not None else at_rest(axis)
    if not rest.cycles:
        return Hunting(rest.verdict, rest.described())
    angles = (axis.train.variable(axis.motor_shaft, "angle"), axis.train.variable(axis.shaft, "angle"))
    amplitudes = dict(zip(angles, (rest.motor_amplitude, rest.amplitude), strict=True))
    found = tuple(cycle.causes) if cycle is not None else ()
    return Hunting("hunts", "", False, rest.frequency, amplitudes, None, np.array([]), found)


@checked
def hunting_map(
    scenario: Scenario,
    grid: Mapping[str, Any],
    *,
    variable: str | None = None,
    threads: Count | None = None,
    progress: Callable[[int], None] | None = None,
) -> xarray.Dataset:
    """Compute amplitude and frequency of the limit cycle over one or two keys of a scenario.

    Parameters
    ----------
    scenario : Scenario
        As in `limit_cycle`.
    grid : mapping of str to array_like
        One or two dotted keys with their values, such as ``{"controllers.servo.position.gain": np.linspace(1, 10, 40),
        "gears.belt.stiffness.backlash": np.linspace(0, 1e-2, 40)}``.
    variable : str, optional
        Variable of the amplitude. Default: the angle of the last shaft.
    threads : int, optional
        Number of threads. Default: the number of processors.
    progress : callable, optional
        Called with the number of finished points.

    Returns
    -------
    xarray.Dataset
        Over the values of the keys: ``amplitude`` (SI; 0 at rest, NaN if not decided), ``frequency`` [Hz] (NaN without a limit
        cycle), ``stable``, ``verdict`` as in `Hunting`, and ``reason`` why there is no limit cycle.

    Raises
    ------
    InputError
        A key is unknown, or a value cannot be used.

    Examples
    --------
    >>> import lostmotion as lm
    >>> grid = {"controllers.servo.position.integral_gain": [16.0, 32.0]}
    >>> lm.servo.hunting_map(lm.load("hunting-with-static-friction"), grid)["verdict"].values.tolist()
    ['hunts', 'hunts']
    """
    import xarray as xr

    train = scenario.long()
    keys = {key: np.atleast_1d(np.asarray(values)) for key, values in grid.items()}
    if not 1 <= len(keys) <= 2 or not all(v.ndim == 1 and len(v) for v in keys.values()):
        raise InputError(f"grid: {shown(dict(grid))} must give values for one or two keys")
    shape = tuple(len(v) for v in keys.values())
    if math.prod(shape) > MAX_POINTS:
        raise InputError(f"grid: {math.prod(shape)} points are more than {MAX_POINTS}; give fewer values")
    plain = train.train()
    variable = (
        plain.variable(list(plain.shafts)[-1], "angle")
        if variable is None
        else known_output(variable, UndrivenLoop.of(train).channels)
    )
    done = 0

    def point(index: tuple[int, ...]) -> tuple[float, float, bool, str, str]:
        nonlocal done
        changes = {key: values[k].item() for (key, values), k in zip(keys.items(), index, strict=True)}
        result = _point(scenario.replace(**changes).long(), variable)
        done += 1
        if progress is not None:
            progress(done)
        return result

    with thread_pool(threads or os.cpu_count() or 1) as pool:
        rows = list(pool.map(point, np.ndindex(shape)))
    columns = [np.array(column).reshape(shape) for column in zip(*rows, strict=True)]
    names = tuple(key.replace(".", "_") for key in keys)
    last = list(plain.shafts)[-1]
    unit = {"units": plain.angle_unit(last)} if variable == plain.variable(last, "angle") else {}
    about = [
        ("amplitude", {"long_name": f"amplitude of {variable}", **unit}),
        ("frequency", {"long_name": "frequency of the limit cycle", "units": "Hz"}),
        ("stable", {"long_name": "whether neighbouring motions approach it"}),
        ("verdict", {"long_name": "hunts, at rest, or not decided"}),
        ("reason", {"long_name": "reason for a missing limit cycle"}),
    ]
    data = {name: (names, column, attrs) for (name, attrs), column in zip(about, columns, strict=True)}
    coords = {n: (n, values, _named(train, key)) for n, (key, values) in zip(names, keys.items(), strict=True)}
    return xr.Dataset(data, coords=coords, attrs={"variable": variable})


def _named(train: Scenario, key: str) -> dict[str, str]:
    """Attributes of the values of a key."""
    unit = unit_for(train, key)
    return {"long_name": key} | ({} if unit is None else {"units": unit or "1"})


def _point(train: Scenario, variable: str) -> tuple[float, float, bool, str, str]:
    """Amplitude, frequency, stable, verdict, reason."""
    h = limit_cycle(train, causes=False)
    amplitude = NAN if h.verdict == "not decided" else h.amplitudes.get(variable, 0.0)
    return amplitude, h.frequency, h.stable, h.verdict, h.reason
