"""Periodic motions by shooting: coexisting and sub-harmonic ones, with their Floquet multipliers."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..errors import InputError
from ..inputs.arguments import checked
from ..inputs.quantities import Count, Number, Torque
from ..model.drive import Drive
from ..model.signals import CommandSignal, TorqueSignal
from ..simulation.results import add_derived
from ..simulation.run import start_state
from ..simulation.scenario import Initial, Scenario, drive_of
from ..simulation.variables import CHANNEL_NAMES, STATES, VARIABLES

if TYPE_CHECKING:
    import xarray

SAMPLES_PER_PERIOD = 2048
MAX_PERIODS = 20_000
PERIODICITY = 1e-10  # largest change of a state over one period / its magnitude, for a motion to count as periodic
NEUTRAL = 1e-6  # a Floquet multiplier this near 1 belongs to a direction in which a sticking drive may rest anywhere
SAME = 1e-5  # solutions that differ by less, relative to their magnitude, are one

# Of the components that the core's Jacobian goes over: all but the load angle, which is neutral.
COMPONENTS = tuple(_core.components())
_ACTIVE = [k for k, name in enumerate(COMPONENTS) if name != "load_angle"]


def reason_of(result: dict[str, Any], k: int) -> str:
    """Why a point has no periodic motion; empty if it has one."""
    if error := str(result["error"][k]):
        return error
    if not result["converged"][k]:
        return f"not periodic after {int(result['periods'][k])} periods: the states still change by {result['residual'][k]:.1e}"
    return ""


def floquet_multipliers(jacobian: np.ndarray) -> np.ndarray:
    """Floquet multipliers, largest first."""
    values = np.linalg.eigvals(jacobian[np.ix_(_ACTIVE, _ACTIVE)])
    return values[np.argsort(-np.abs(values))]


def respond(
    drive: Drive,
    points: Sequence[tuple[CommandSignal, TorqueSignal, float, Initial]],
    *,
    harmonics: int,
    keep_table: bool,
    max_periods: int,
    threads: int | None,
    progress: Callable[[int], None] | None,
) -> dict[str, Any]:
    """Periodic motions, one for each (command, load torque, period [s], start): arrays of the core, a row a point."""
    core = [(c.core(), t.core(), period, start_state(s), s.hysteresis_capacity) for c, t, period, s in points]
    return _core.respond(
        drive.core(),
        core,
        SAMPLES_PER_PERIOD,
        harmonics,
        max_periods,
        PERIODICITY,
        keep_table,
        threads or os.cpu_count() or 1,
        progress,
    )


def _period(*signals: CommandSignal | TorqueSignal) -> float:
    """The common period [s] of signals that are sums of sines and constants.

    Raises
    ------
    InputError
        They have none.
    """
    frequencies = []
    for s in signals:
        if s.steps or s.ramps or s.chirp is not None or s.samples is not None:
            raise InputError(
                "a periodic motion needs signals of mean and sines only; leave out steps, ramps, chirp, samples"
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
    start: Initial | None = None,
    max_periods: Count = MAX_PERIODS,
) -> xarray.Dataset:
    """A periodic motion under periodic inputs, by shooting.

    Newton's method on the map over one period, with its exact Jacobian; it is entered after a few periods from `start`,
    and where it does not converge, the transient is followed further. The load angle is neutral: it may advance from period to period.

    Parameters
    ----------
    drive
        A drive, or a scenario.
    command, load_torque
        E_C [-] and M_Z [N·m]: constants, or signals of mean and sines with a common period; left out, those of the
        scenario, or 0.
    multiple
        The motion may repeat after this many periods of the inputs (sub-harmonics).
    start
        From where; the initial state of the scenario, or rest, if left out. Coexisting motions are reached from different ones.

    Returns
    -------
    xarray.Dataset
        The result variables over one period, and the ``jacobian`` of the map over it. Attributes: ``residual`` (largest change of a state over the period / its
        largest magnitude), ``angle_advance`` of the load [rad], ``multipliers_real`` and ``multipliers_imag`` (Floquet),
        ``stable``, ``smooth`` (the multipliers are exact: no switching grazes), ``periods`` followed, ``newton_steps``,
        ``start_<state>``, ``period`` [s], ``gear_ratio``.

    Raises
    ------
    RuntimeError
        None was found; the message says why.
    """
    if isinstance(drive, Scenario):
        command = drive.command if command is None else command
        load_torque = drive.load.torque if load_torque is None else load_torque
        start = start or drive.initial
    drive = drive_of(drive)
    command = command if isinstance(command, CommandSignal) else CommandSignal(mean=command or 0.0)
    load_torque = load_torque if isinstance(load_torque, TorqueSignal) else TorqueSignal(mean=load_torque or 0.0)
    period = multiple * _period(command, load_torque)
    r = respond(
        drive,
        [(command, load_torque, period, start or Initial())],
        harmonics=1,
        keep_table=True,
        max_periods=max_periods,
        threads=1,
        progress=None,
    )
    if reason := reason_of(r, 0):
        raise RuntimeError(f"no periodic motion was found: {reason}")
    return _motion(r, drive, period)


def _motion(r: dict[str, Any], drive: Drive, period: float) -> xarray.Dataset:
    """The dataset of the one motion that `respond` has found."""
    import xarray as xr

    data = dict(zip(CHANNEL_NAMES, r["table"][0], strict=True))
    add_derived(data, drive.gearbox.ratio)
    multipliers = floquet_multipliers(r["jacobian"][0])
    time = np.arange(SAMPLES_PER_PERIOD) * (period / SAMPLES_PER_PERIOD)
    variables: dict[str, Any] = {
        v.name: ("time", data[v.name], {"units": v.unit, "long_name": v.meaning, "symbol": v.symbol}) for v in VARIABLES
    }
    meaning = "derivative of each component after the period by each at its start (SI)"
    return xr.Dataset(
        variables | {"jacobian": (("to", "by"), r["jacobian"][0], {"long_name": meaning})},
        coords={
            "time": ("time", time, {"units": "s", "long_name": "time within the period"}),
            "to": ("to", list(COMPONENTS)),
            "by": ("by", list(COMPONENTS)),
        },
        attrs={
            "period": period,
            "gear_ratio": drive.gearbox.ratio,
            "residual": float(r["residual"][0]),
            "angle_advance": float(r["angle_advance"][0]),
            "multipliers_real": multipliers.real.tolist(),
            "multipliers_imag": multipliers.imag.tolist(),
            "stable": int(is_stable(multipliers)),
            "smooth": int(r["smooth"][0]),
            "periods": int(r["periods"][0]),
            "newton_steps": int(r["newton_steps"][0]),
            "start_hysteresis_capacity": float(r["hysteresis_capacity"][0]),
            **{f"start_{name}": float(v) for name, v in zip(STATES, r["start"][0], strict=True)},
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
    starts: Iterable[Initial],
    multiples: Iterable[Count] = (1,),
) -> list[xarray.Dataset]:
    """The different periodic motions that several starts lead to, each once.

    Motions that differ by a whole period of the inputs only, or by the load angle, count as one.
    """
    found: list[xarray.Dataset] = []
    starts = list(starts)
    for multiple in multiples:
        for start in starts:
            try:
                motion = periodic_motion(drive, command, load_torque, multiple=multiple, start=start)
            except RuntimeError:
                continue
            if not any(_same(drive_of(drive), motion, other) for other in found):
                found.append(motion)
    return found


def _same(drive: Drive, a: xarray.Dataset, b: xarray.Dataset) -> bool:
    """Whether two motions are one; that of the longer period is compared at each shift by the shorter one."""
    if a.attrs["period"] < b.attrs["period"]:
        a, b = b, a
    g = drive.gearbox
    # What is smaller than this is no difference between motions.
    floors = {
        "motor_speed": SAME * g.rated_input_speed,
        "load_speed": SAME * g.rated_input_speed / g.ratio,
        "output_torque": SAME * g.rated_output_torque,
        "twist": 0.0,
    }
    times = round(a.attrs["period"] / b.attrs["period"])
    t = a["time"].values
    allowed = SAME if times == 1 else 1e-3  # between samples there is a straight line
    for shift in range(times):
        at = (t + shift * b.attrs["period"]) % b.attrs["period"]
        gaps = []
        for name, floor in floors.items():
            x, y = a[name].values, b[name].values
            other = y if times == 1 else np.interp(at, b["time"].values, y, period=b.attrs["period"])
            gaps.append(np.max(np.abs(x - other)) / max(np.max(np.abs(x)), np.max(np.abs(y)), floor, 1e-300))
        if max(gaps) < allowed:
            return True
    return False
