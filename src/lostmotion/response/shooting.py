"""Periodic motions by shooting: coexisting and sub-harmonic ones, with their Floquet multipliers."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..control.command import CommandSignal
from ..errors import InputError
from ..inputs.argument_checks import checked
from ..inputs.quantities import Count, Number, Torque
from ..model.drive import Drive
from ..model.signals import Signal, TorqueSignal, constant_or
from ..simulation.forms.drive_tables import Initial
from ..simulation.forms.train_tables import TrainInitial
from ..simulation.scenario.scenario import Scenario
from ..simulation.variables_of_trains import only_input
from ..units.practical import counted
from .plant import Plant, plant_of

if TYPE_CHECKING:
    import xarray

SAMPLES_PER_PERIOD = 2048
MAX_PERIODS = 20_000
PERIODICITY = 1e-10  # largest change of a state over one period / its magnitude, for a motion to count as periodic
NEUTRAL = 1e-6  # a Floquet multiplier this near 1 belongs to a direction in which a sticking drive may rest anywhere
SAME = 1e-5  # solutions that differ by less, relative to their magnitude, are one


def reason_of(result: dict[str, Any], k: int) -> str:
    """Why a point has no periodic motion; empty if it has one."""
    if error := str(result["error"][k]):
        return error
    if not result["converged"][k]:
        return f"not periodic after {counted(int(result['periods'][k]), 'period')}: the states still change by {result['residual'][k]:.1e}"
    return ""


def floquet_multipliers(result: Mapping[str, Any], k: int) -> np.ndarray:
    """Floquet multipliers of a point, largest first; without the angles that nothing depends on, which are neutral."""
    active = np.flatnonzero(np.logical_not(result["neutral"]))
    values = np.linalg.eigvals(result["jacobian"][k][np.ix_(active, active)])
    return values[np.argsort(-np.abs(values))]


def respond(
    plant: Plant,
    points: Sequence[tuple[Sequence[_core.Signal], float, Mapping[str, float]]],
    *,
    harmonics: int,
    keep_table: bool,
    limit_cycle: bool = False,
    max_periods: int,
    threads: int | None,
    progress: Callable[[int], None] | None,
) -> dict[str, Any]:
    """Periodic motions, one for each (inputs, period [s], components at the start): arrays of the core, a row a point.

    Of a limit cycle, under constant inputs, the periods are first estimates.
    """
    result = _core.respond(
        plant.scenario.core(sampled=False),
        points,
        samples=SAMPLES_PER_PERIOD,
        harmonics=harmonics,
        max_periods=max_periods,
        tolerance=PERIODICITY,
        keep_table=keep_table,
        limit_cycle=limit_cycle,
        threads=threads or os.cpu_count() or 1,
        progress=progress,
    )
    result["angle_advance"] = result["advance"][:, result["components"].index(plant.angle)]
    return result


def _period(signals: Iterable[Signal[Any]]) -> float:
    """The common period [s] of signals that are sums of sines and constants. Raises InputError: they have none."""
    frequencies = []
    for s in signals:
        if s.steps or s.ramps or s.chirp is not None or s.samples is not None or getattr(s, "wind", None) is not None:
            raise InputError(
                "a periodic motion needs signals of mean and sines only; leave out steps, ramps, chirp, samples, wind"
            )
        frequencies += [f for _, f, _ in s.sine_list()]
    if not frequencies:
        raise InputError("a periodic motion needs at least one sine in command or load torque, or a period")
    base = min(frequencies)
    for parts in range(1, 101):
        shares = [parts * f / base for f in frequencies]
        if all(abs(q - round(q)) <= 1e-9 * q for q in shares):
            return parts / base
    raise InputError(f"the frequencies {sorted(set(frequencies))} Hz have no common period within 100 of the slowest")


@checked
def periodic_motion(
    drive: Drive | Scenario,
    command: CommandSignal | Number | None = None,
    load_torque: TorqueSignal | Torque | None = None,
    *,
    multiple: Count = 1,
    start: Initial | TrainInitial | None = None,
    max_periods: Count = MAX_PERIODS,
) -> xarray.Dataset:
    """Find a periodic motion under periodic inputs, by shooting.

    Newton's method solves for a fixed point of the map over one period, with its exact Jacobian. It starts after a few periods from
    `start`; if it does not converge, the transient is followed further. The load angle is neutral: it may advance from period to
    period. An angle on which torques depend may advance by whole periods of these.

    Parameters
    ----------
    drive : Drive or Scenario
        The drive or the scenario.
    command, load_torque : CommandSignal, TorqueSignal or float, optional
        The one command E_C [-] and the one load torque M_Z [N·m]: constants, or signals of mean and sines with a common period.
        Default: the values in the scenario, or 0.
    multiple : int
        Number of periods of the inputs after which the motion repeats (sub-harmonics).
    start : Initial or TrainInitial, optional
        Initial state. Default: the state in the scenario, or rest. Coexisting motions are reached from different ones.
    max_periods : int
        Largest number of periods to follow.

    Returns
    -------
    xarray.Dataset
        The result variables over one period, and the ``jacobian`` of the map. Attributes: ``residual`` (largest change of a
        state over the period divided by its largest magnitude), ``angle_advance`` of the load or last shaft [rad],
        ``multipliers_real`` and ``multipliers_imag`` (Floquet), ``stable``, ``smooth`` (true if the multipliers are exact: no
        switching grazes), ``periods`` followed, ``newton_steps``, ``start_<component>``, ``period`` [s] and ``scenario``.

    Raises
    ------
    RuntimeError
        No periodic motion was found. The message states the reason.

    Examples
    --------
    >>> import lostmotion as lm
    >>> motion = lm.periodic_motion(lm.load("paper-2dof-nl-small"))
    >>> motion.attrs["stable"], round(motion.attrs["period"], 6)
    (1, 1.0)
    """
    plant = plant_of(drive)
    signals = _replaced(plant, {"command": command, "load_torque": load_torque})
    period = multiple * _period(signals.values())
    point = ([s.core() for s in signals.values()], period, plant.start if start is None else plant.start_of(start))
    r = respond(plant, [point], harmonics=1, keep_table=True, max_periods=max_periods, threads=1, progress=None)
    if reason := reason_of(r, 0):
        raise RuntimeError(f"no periodic motion was found: {reason}")
    return motion_of(r, plant, period)


def _replaced(plant: Plant, given: Mapping[str, Any]) -> dict[str, Signal[Any]]:
    """The inputs of a plant, with the given ones in place of its own."""
    out = dict(plant.signals)
    for word, value in given.items():
        if value is not None:
            name = only_input(plant.scenario.train(), word, out)
            out[name] = constant_or(value, type(out[name]))
    return out


def motion_of(r: dict[str, Any], plant: Plant, period: float) -> xarray.Dataset:
    """The dataset of the one motion that `respond` has found."""
    import xarray as xr

    data = dict(zip(plant.channels, r["table"][0], strict=True))
    time = np.arange(SAMPLES_PER_PERIOD) * (period / SAMPLES_PER_PERIOD)
    plant.scenario.derive(data, time)
    multipliers = floquet_multipliers(r, 0)
    variables: dict[str, Any] = {
        v.name: ("time", data[v.name], {"units": v.unit, "long_name": v.meaning, "symbol": v.symbol})
        for v in plant.variables
    }
    meaning = "derivative of each component after the period by each at its start (SI)"
    return xr.Dataset(
        variables | {"jacobian": (("to", "by"), r["jacobian"][0], {"long_name": meaning})},
        coords={
            "time": ("time", time, {"units": "s", "long_name": "time within the period"}),
            "to": ("to", r["components"]),
            "by": ("by", r["components"]),
        },
        attrs={
            "period": period,
            "scenario": plant.scenario.to_json(),
            "residual": float(r["residual"][0]),
            "angle_advance": float(r["advance"][0][r["components"].index(plant.angle)]),
            "multipliers_real": multipliers.real.tolist(),
            "multipliers_imag": multipliers.imag.tolist(),
            "stable": int(is_stable(multipliers)),
            "smooth": int(r["smooth"][0]),
            "periods": int(r["periods"][0]),
            "newton_steps": int(r["newton_steps"][0]),
            **{
                f"start_{name}": float(v)
                for name, v in zip(r["components"], r["start"][0], strict=True)
                if not name.endswith("locked_torque")
            },
        },
    )


def is_stable(multipliers: np.ndarray) -> bool:
    """Whether neighbouring motions approach this one, or stay as near."""
    return bool(np.all(np.abs(multipliers) < 1.0 + NEUTRAL))


@checked
def periodic_motions(
    drive: Drive | Scenario,
    command: CommandSignal | Number | None = None,
    load_torque: TorqueSignal | Torque | None = None,
    *,
    starts: Iterable[Any],
    multiples: Iterable[Count] = (1,),
) -> list[xarray.Dataset]:
    """Find the different periodic motions that several starts lead to, each once.

    Motions that differ by a whole period of the inputs only, or by the load angle, count as one.

    Parameters
    ----------
    drive, command, load_torque
        As in `periodic_motion`.
    starts : iterable of Initial or TrainInitial
        Initial states.
    multiples : iterable of int
        Numbers of periods of the inputs after which a motion may repeat.

    Returns
    -------
    list of xarray.Dataset
        The motions, as `periodic_motion` returns them.

    Raises
    ------
    InputError
        An argument cannot be used.

    Examples
    --------
    >>> import lostmotion as lm
    >>> starts = [lm.Initial(), lm.Initial(twist=1e-4)]
    >>> len(lm.response.periodic_motions(lm.load("paper-2dof-nl-small"), starts=starts))
    1
    """
    floors = plant_of(drive).floors()
    found: list[xarray.Dataset] = []
    starts = list(starts)
    for multiple in multiples:
        for start in starts:
            try:
                motion = periodic_motion(drive, command, load_torque, multiple=multiple, start=start)
            except RuntimeError:
                continue
            if not any(_same(floors, motion, other) for other in found):
                found.append(motion)
    return found


def _same(floors: Mapping[str, float], a: xarray.Dataset, b: xarray.Dataset) -> bool:
    """Whether two motions are one; the state of the longer period is compared at each shift by the shorter one.

    floors: rated magnitudes: what is smaller than `SAME` of them is no difference between motions.
    """
    if a.attrs["period"] < b.attrs["period"]:
        a, b = b, a
    times = round(a.attrs["period"] / b.attrs["period"])
    t = a["time"].values
    allowed = SAME if times == 1 else 1e-3  # between samples there is a straight line
    for shift in range(times):
        at = (t + shift * b.attrs["period"]) % b.attrs["period"]
        gaps = []
        for name, floor in floors.items():
            x, y = a[name].values, b[name].values
            other = y if times == 1 else np.interp(at, b["time"].values, y, period=b.attrs["period"])
            gaps.append(np.max(np.abs(x - other)) / max(np.max(np.abs(x)), np.max(np.abs(y)), SAME * floor, 1e-300))
        if max(gaps) < allowed:
            return True
    return False
