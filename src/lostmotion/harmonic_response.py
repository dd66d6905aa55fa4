"""Periodic motions by shooting, and the frequency response that they give: harmonics, distortion, efficiency, stability."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from . import _core
from .linear_analysis import _control
from .parts import Drive
from .results import add_derived
from .run import start_state
from .scenario import Initial
from .signals import CommandSignal, TorqueSignal
from .variables import CHANNEL_NAMES, STATES, VARIABLES

if TYPE_CHECKING:
    import control
    import xarray

SAMPLES_PER_PERIOD = 2048
MAX_PERIODS = 20_000
PERIODICITY = 1e-10  # largest change of a state over one period / its magnitude, for a motion to count as periodic
NEUTRAL = 1e-6  # a Floquet multiplier this near 1 belongs to a direction in which a sticking drive may rest anywhere
SAME = 1e-5  # solutions that differ by less, in parts of their size, are one

# Of the components that the core's Jacobian goes over: all but the load angle, which is neutral.
COMPONENTS = (*STATES, "hysteresis_capacity", "held_torque")
_ACTIVE = [k for k, name in enumerate(COMPONENTS) if name != "load_angle"]

Source = Literal["command", "load_torque"]


def _reason(result: dict[str, Any], k: int) -> str:
    """Why a point has no periodic motion; empty if it has one."""
    status = int(result["status"][k])
    if status != 0:
        return _core.status_text(status, result["time"][k], int(result["contact"][k]))
    if not result["converged"][k]:
        return f"not periodic after {int(result['periods'][k])} periods: the states still change by {result['residual'][k]:.1e}"
    return ""


def _multipliers(jacobian: np.ndarray) -> np.ndarray:
    """Floquet multipliers, largest first."""
    values = np.linalg.eigvals(jacobian[np.ix_(_ACTIVE, _ACTIVE)])
    return values[np.argsort(-np.abs(values))]


def _respond(
    drive: Drive,
    points: Sequence[tuple[CommandSignal, TorqueSignal, float, Initial]],
    *,
    harmonics: int,
    keep_table: bool,
    max_periods: int,
    threads: int | None,
    progress: Callable[[int], None] | None,
) -> dict[str, Any]:
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
    ValueError
        They have none.
    """
    frequencies = []
    for s in signals:
        if s.steps or s.ramps or s.chirp is not None or s.samples is not None:
            raise ValueError(
                "a periodic motion needs signals of mean and sines only; leave out steps, ramps, chirp, samples"
            )
        frequencies += [f for _, f, _ in s.sine_list()]
    if not frequencies:
        raise ValueError("a periodic motion needs at least one sine in command or load torque, or a period")
    base = min(frequencies)
    for parts in range(1, 101):
        shares = [parts * f / base for f in frequencies]
        if all(abs(q - round(q)) <= 1e-9 * q for q in shares):
            return parts / base
    raise ValueError(f"the frequencies {sorted(set(frequencies))} Hz have no common period within 100 of the slowest")


def periodic_motion(
    drive: Drive,
    command: CommandSignal | float = 0.0,
    load_torque: TorqueSignal | float = 0.0,
    *,
    multiple: int = 1,
    start: Initial | None = None,
    max_periods: int = MAX_PERIODS,
) -> xarray.Dataset:
    """A motion that repeats with the inputs, by shooting.

    Newton's method on the map over one period, with its exact Jacobian; it is entered after a few periods from `start`,
    and where it does not converge, the transient is followed further. The load angle is neutral: it may drift.

    Parameters
    ----------
    command, load_torque
        Constants, or signals of mean and sines with a common period.
    multiple
        The motion may repeat after this many periods of the inputs (sub-harmonics).
    start
        From where; at rest if left out. Coexisting motions are reached from different ones.

    Returns
    -------
    xarray.Dataset
        The result variables over one period, and the ``jacobian`` of the map over it. Attributes: ``residual`` (largest change of a state over the period / its
        largest magnitude), ``drift`` of the load angle [rad], ``multipliers_real`` and ``multipliers_imag`` (Floquet),
        ``stable``, ``smooth`` (the multipliers are exact: no switching grazes), ``periods`` followed, ``newton_steps``,
        ``start_<state>``, ``period`` [s].

    Raises
    ------
    RuntimeError
        None was found; the message says why.
    """
    import xarray as xr

    command = command if isinstance(command, CommandSignal) else CommandSignal(mean=command)
    load_torque = load_torque if isinstance(load_torque, TorqueSignal) else TorqueSignal(mean=load_torque)
    if multiple < 1:
        raise ValueError(f"multiple {multiple} must be 1 or more")
    period = multiple * _period(command, load_torque)
    r = _respond(
        drive,
        [(command, load_torque, period, start or Initial())],
        harmonics=1,
        keep_table=True,
        max_periods=max_periods,
        threads=1,
        progress=None,
    )
    if reason := _reason(r, 0):
        raise RuntimeError(f"no periodic motion was found: {reason}")
    data = dict(zip(CHANNEL_NAMES, r["table"][0], strict=True))
    add_derived(data, drive.gearbox.ratio)
    multipliers = _multipliers(r["jacobian"][0])
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
            "residual": float(r["residual"][0]),
            "drift": float(r["drift"][0]),
            "multipliers_real": multipliers.real.tolist(),
            "multipliers_imag": multipliers.imag.tolist(),
            "stable": int(_stable(multipliers)),
            "smooth": int(r["smooth"][0]),
            "periods": int(r["periods"][0]),
            "newton_steps": int(r["newton_steps"][0]),
            "start_hysteresis_capacity": float(r["hysteresis_capacity"][0]),
            **{f"start_{name}": float(v) for name, v in zip(STATES, r["start"][0], strict=True)},
        },
    )


def _stable(multipliers: np.ndarray) -> bool:
    return bool(np.all(np.abs(multipliers) < 1.0 + NEUTRAL))


def periodic_motions(
    drive: Drive,
    command: CommandSignal | float = 0.0,
    load_torque: TorqueSignal | float = 0.0,
    *,
    starts: Iterable[Initial],
    multiples: Iterable[int] = (1,),
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
            if not any(_same(drive, motion, other) for other in found):
                found.append(motion)
    return found


def _same(drive: Drive, a: xarray.Dataset, b: xarray.Dataset) -> bool:
    """Whether two motions are one; that of the longer period is compared at each shift by the shorter one."""
    if a.attrs["period"] < b.attrs["period"]:
        a, b = b, a
    g = drive.gearbox
    # What is smaller than this does not tell motions apart.
    least = {
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
        for name, floor in least.items():
            x, y = a[name].values, b[name].values
            other = y if times == 1 else np.interp(at, b["time"].values, y, period=b.attrs["period"])
            gaps.append(np.max(np.abs(x - other)) / max(np.max(np.abs(x)), np.max(np.abs(y)), floor, 1e-300))
        if max(gaps) < allowed:
            return True
    return False


def frequency_response(
    drive: Drive,
    frequencies: Sequence[float],
    amplitudes: Sequence[float] | float,
    *,
    source: Source = "command",
    mean_command: float = 0.0,
    mean_load_torque: float = 0.0,
    harmonics: int = 8,
    refine: float | None = None,
    threads: int | None = None,
    max_periods: int = MAX_PERIODS,
    progress: Callable[[], None] | None = None,
) -> xarray.Dataset:
    """Response by harmonic linearisation (describing functions): harmonics of all outputs over one sinusoidal input.

    Each point comes from a motion that repeats, found by shooting. Points do not know of each other; the result is the
    same for any number of threads.

    Parameters
    ----------
    frequencies
        [Hz].
    amplitudes
        Of the input: E_CA [-], or [N·m] for a load torque.
    source
        ``"command"`` or ``"load_torque"``; the other one is constant.
    harmonics
        How many to keep.
    refine
        Adds frequencies where a curve bends: until, at each one, gain and phase of the load speed lie within this many
        decibels (and ten times as many degrees) of the straight line through its neighbours, or the grid is sixteen
        times as fine.
    threads
        All cores, if left out.
    progress
        Called after each point.

    Returns
    -------
    xarray.Dataset
        Over ``amplitude`` and ``frequency`` [Hz], with ``output`` and ``harmonic``: complex ``response`` (first harmonic
        of each output / that of the input), ``harmonics`` (complex amplitudes, 0 the mean), ``distortion`` (rms of all
        above the first / of the first), ``efficiency`` (mean power out of the gear / mean motor power), ``motor_power``,
        ``load_power``, ``gear_loss`` [W], ``drift`` [rad] a period, ``residual`` of periodicity, ``periods``,
        ``newton_steps``, ``multiplier`` (largest Floquet multiplier), ``stable``, ``reason`` (empty where a motion was
        found; elsewhere why not, and the values are NaN).
    """
    frequencies = sorted({float(f) for f in frequencies})
    amplitudes = [float(a) for a in ([amplitudes] if isinstance(amplitudes, int | float) else amplitudes)]
    if not frequencies or frequencies[0] <= 0.0:
        raise ValueError("frequencies must be positive; give at least one")
    if not amplitudes or min(amplitudes) <= 0.0:
        raise ValueError("amplitudes must be positive; give at least one")
    if source not in ("command", "load_torque"):
        raise ValueError(f"source {source!r} is not known; it must be command or load_torque")

    def compute(new: Sequence[float]) -> xarray.Dataset:
        seen = 0

        def report(done: int) -> None:
            nonlocal seen
            for _ in range(done - seen):
                if progress is not None:
                    progress()
            seen = done

        points = [
            (*_signals(source, a, f, mean_command, mean_load_torque), 1.0 / f, Initial())
            for a in amplitudes
            for f in new
        ]
        r = _respond(
            drive,
            points,
            harmonics=harmonics,
            keep_table=False,
            max_periods=max_periods,
            threads=threads,
            progress=report,
        )
        return _labelled(r, amplitudes, new, source, harmonics)

    result = compute(frequencies)
    for _ in range(4 if refine is not None else 0):
        assert refine is not None
        new = _bends(result, refine)
        if not new:
            break
        import xarray as xr

        more = compute(new)
        result = xr.concat([result, more], dim="frequency", combine_attrs="override").sortby("frequency")
    return result


def _signals(
    source: Source, amplitude: float, frequency: float, mean_command: float, mean_load_torque: float
) -> tuple[CommandSignal, TorqueSignal]:
    command, load_torque = {"mean": mean_command}, {"mean": mean_load_torque}
    (command if source == "command" else load_torque).update(amplitude=amplitude, frequency=frequency)
    return CommandSignal.model_validate(command), TorqueSignal.model_validate(load_torque)


def _bends(result: xarray.Dataset, tolerance: float) -> list[float]:
    """Frequencies halfway to the neighbours of each one off the straight line between them."""
    values = result["response"].sel(output="load_speed").values  # amplitude x frequency
    x = np.log(result["frequency"].values)
    with np.errstate(divide="ignore", invalid="ignore"):
        gain, phase = 20.0 * np.log10(np.abs(values)), np.degrees(np.unwrap(np.angle(values), axis=1))
    if len(x) < 3:
        return []
    share = (x[1:-1] - x[:-2]) / (x[2:] - x[:-2])
    new: set[float] = set()
    for curve, allowed in ((gain, tolerance), (phase, 10.0 * tolerance)):
        off = np.abs(curve[:, 1:-1] - (curve[:, :-2] + share * (curve[:, 2:] - curve[:, :-2])))
        # A grid sixteen times as fine as four points a decade is fine enough.
        for k in np.flatnonzero(np.nanmax(np.where(np.isfinite(off), off, 0.0), axis=0) > allowed):
            for a, b in ((x[k], x[k + 1]), (x[k + 1], x[k + 2])):
                if b - a > math.log(10.0) / 320.0:
                    new.add(float(np.exp(0.5 * (a + b))))
    return sorted(new)


def _labelled(
    r: dict[str, Any], amplitudes: Sequence[float], frequencies: Sequence[float], source: Source, harmonics: int
) -> xarray.Dataset:
    import xarray as xr

    shape = (len(amplitudes), len(frequencies))
    names = list(CHANNEL_NAMES)
    reasons = np.array([_reason(r, k) for k in range(shape[0] * shape[1])], dtype=object).reshape(shape)
    found = reasons == ""
    c = (r["harmonics"][..., 0] + 1j * r["harmonics"][..., 1]).reshape(*shape, len(names), harmonics + 1)
    c = np.where(found[..., None, None], c, np.nan)
    first = c[..., 1]
    above = r["mean_square"].reshape(*shape, -1) - np.abs(c[..., 0]) ** 2 - 0.5 * np.abs(first) ** 2
    drive_in = first[..., names.index(source)]
    power = {k: np.where(found, r[k].reshape(shape), np.nan) for k in ("motor_power", "load_power", "gear_loss")}
    with np.errstate(divide="ignore", invalid="ignore"):
        response = first / drive_in[..., None]
        distortion = np.sqrt(np.maximum(above, 0.0)) / (np.abs(first) / math.sqrt(2.0))
        efficiency = np.where(power["motor_power"] > 0.0, power["load_power"] / power["motor_power"], np.nan)
    multipliers = [_multipliers(j) for j in r["jacobian"]]
    largest = np.array([abs(m[0]) for m in multipliers]).reshape(shape)
    stable = np.array([_stable(m) for m in multipliers]).reshape(shape)
    grid, each = ("amplitude", "frequency"), ("output", "amplitude", "frequency")

    def plain(name: str) -> np.ndarray:
        return np.where(found, r[name].reshape(shape), np.nan)

    unit = "1" if source == "command" else "N*m"
    watt = {"units": "W"}
    return xr.Dataset(
        {
            "response": (each, np.moveaxis(response, -1, 0), {"long_name": f"first harmonic / that of the {source}"}),
            "harmonics": ((*each, "harmonic"), np.moveaxis(c, 2, 0), {"long_name": "complex amplitude"}),
            "distortion": (
                each,
                np.moveaxis(distortion, -1, 0),
                {"units": "1", "long_name": "harmonics above the first / first"},
            ),
            "efficiency": (
                grid,
                efficiency,
                {"units": "1", "long_name": "mean power out of the gear / mean motor power"},
            ),
            "motor_power": (grid, power["motor_power"], watt | {"long_name": "mean mechanical power of the motor"}),
            "load_power": (
                grid,
                power["load_power"],
                watt | {"long_name": "mean power on the load's side of the gear"},
            ),
            "gear_loss": (
                grid,
                power["gear_loss"],
                watt | {"long_name": "mean power lost in the gear, torsion included"},
            ),
            "drift": (grid, plain("drift"), {"units": "rad", "long_name": "of the load angle over one period"}),
            "residual": (
                grid,
                r["residual"].reshape(shape),
                {"units": "1", "long_name": "change of a state over one period"},
            ),
            "periods": (grid, r["periods"].reshape(shape), {"units": "1", "long_name": "periods followed"}),
            "newton_steps": (grid, r["newton_steps"].reshape(shape), {"units": "1"}),
            "multiplier": (
                grid,
                np.where(found, largest, np.nan),
                {"units": "1", "long_name": "largest Floquet multiplier"},
            ),
            "stable": (grid, found & stable),
            "reason": (grid, reasons, {"long_name": "why there is no periodic motion"}),
        },
        coords={
            "amplitude": ("amplitude", list(amplitudes), {"units": unit, "long_name": f"amplitude of the {source}"}),
            "frequency": ("frequency", list(frequencies), {"units": "Hz", "long_name": "frequency"}),
            "output": ("output", names),
            "harmonic": ("harmonic", np.arange(harmonics + 1)),
        },
        attrs={"source": source, "samples_per_period": SAMPLES_PER_PERIOD},
    )


def characteristics(response: xarray.Dataset, drive: Drive, output: str = "load_speed") -> xarray.Dataset:
    """Bandwidth and phase crossover as functions of amplitude, with the dead zone of the drive.

    Returns
    -------
    xarray.Dataset
        Over ``amplitude``: ``bandwidth`` [Hz], where the gain first falls 3 dB below that at the lowest frequency;
        ``phase_crossover`` [Hz], where the phase first falls through -180 degrees; NaN where that lies outside the
        frequencies. Attributes ``dead_zone_forward``, ``dead_zone_backward``: constant commands beyond which the load
        moves from rest.
    """
    import xarray as xr

    values = response["response"].sel(output=output).values
    x = np.log(response["frequency"].values)
    bandwidth, crossover = [], []
    for curve in values:
        size = np.abs(curve)
        with np.errstate(divide="ignore", invalid="ignore"):
            gain = 20.0 * np.log10(size / size[0])
            phase = np.degrees(np.unwrap(np.angle(curve)))
        bandwidth.append(_falls_through(x, gain, -20.0 * math.log10(math.sqrt(2.0))))
        crossover.append(_falls_through(x, phase, -180.0))
    forward, backward = (drive.core().smallest_command(0.0, 0.0, s) for s in (+1, -1))
    return xr.Dataset(
        {
            "bandwidth": ("amplitude", bandwidth, {"units": "Hz", "long_name": "-3 dB against the lowest frequency"}),
            "phase_crossover": ("amplitude", crossover, {"units": "Hz", "long_name": "phase of -180 degrees"}),
        },
        coords={"amplitude": response["amplitude"]},
        attrs={"dead_zone_forward": forward, "dead_zone_backward": backward},
    )


def _falls_through(x: np.ndarray, y: np.ndarray, level: float) -> float:
    below = np.flatnonzero((y[:-1] >= level) & (y[1:] < level))
    if len(below) == 0:
        return math.nan
    k = below[0]
    return float(np.exp(x[k] + (level - y[k]) / (y[k + 1] - y[k]) * (x[k + 1] - x[k])))


def to_control(response: xarray.Dataset, amplitude: float, output: str = "load_speed") -> control.FrequencyResponseData:
    """One curve of a response for python-control, as data over frequency.

    Raises
    ------
    ImportError
        python-control is not installed.
    KeyError
        The response has no such amplitude or output.
    """
    curve = response["response"].sel(output=output, amplitude=amplitude)
    return _control().frd(curve.values, 2.0 * np.pi * curve["frequency"].values)
