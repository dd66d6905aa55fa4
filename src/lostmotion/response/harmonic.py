"""Frequency response from periodic motions: harmonics, distortion, efficiency, stability, bandwidth."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ..errors import InputError, need
from ..inputs.arguments import checked
from ..inputs.quantities import Count, Frequency, Number, Torque, arguments
from ..inputs.validation import shown
from ..model.parts import Drive
from ..model.signals import CommandSignal, TorqueSignal
from ..simulation.scenario import Initial, Scenario, drive_of, mean_inputs
from ..simulation.variables import CHANNEL_NAMES
from .linear import _control
from .shooting import MAX_PERIODS, SAMPLES_PER_PERIOD, floquet_multipliers, is_stable, reason_of, respond

if TYPE_CHECKING:
    import control
    import xarray

THREE_DECIBELS = math.sqrt(2.0)  # the bandwidth ends where the gain has fallen by this factor

Source = Literal["command", "load_torque"]


@checked
def frequency_response(
    drive: Drive | Scenario,
    frequencies: Sequence[float] | float,
    amplitudes: Sequence[float] | float,
    *,
    source: Source = "command",
    mean_command: Number | None = None,
    mean_load_torque: Torque | None = None,
    harmonics: Count = 8,
    refine: Number | None = None,
    threads: Count | None = None,
    max_periods: Count = MAX_PERIODS,
    progress: Callable[[], None] | None = None,
) -> xarray.Dataset:
    """Response by harmonic linearisation (describing functions): harmonics of all outputs over one sinusoidal input.

    Each point is a periodic motion, found by shooting. Points are independent of each other; the result is the same
    for any number of threads.

    Parameters
    ----------
    drive
        A drive, or a scenario, of which the drive and the constant parts of command and load torque are taken.
    frequencies
        [Hz].
    amplitudes
        Of the input: E_CA [-], or [N·m] for a load torque.
    source
        ``"command"`` or ``"load_torque"``; the other one is constant.
    mean_command, mean_load_torque
        Constant parts of E_C [-] and M_Z [N·m]; left out, those of the scenario, or 0.
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

    Raises
    ------
    InputError
        An argument cannot be used.
    """
    frequencies = sorted(set(arguments("frequencies", frequencies, "Hz")))
    amplitudes = arguments("amplitudes", amplitudes, "" if source == "command" else "N*m")
    if not frequencies or frequencies[0] <= 0.0:
        raise InputError("frequencies must be positive; give at least one")
    if not amplitudes or min(amplitudes) <= 0.0:
        raise InputError("amplitudes must be positive; give at least one")
    if source not in ("command", "load_torque"):
        raise InputError(f"source {source!r} is not known; it must be command or load_torque")
    means = mean_inputs(drive, mean_command, mean_load_torque)
    drive = drive_of(drive)

    def compute(new: Sequence[float]) -> xarray.Dataset:
        seen = 0

        def report(done: int) -> None:
            nonlocal seen
            for _ in range(done - seen):
                if progress is not None:
                    progress()
            seen = done

        points = [(*_signals(source, a, f, *means), 1.0 / f, Initial()) for a in amplitudes for f in new]
        r = respond(
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
    reasons = np.array([reason_of(r, k) for k in range(shape[0] * shape[1])], dtype=object).reshape(shape)
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
    multipliers = [floquet_multipliers(j) for j in r["jacobian"]]
    largest = np.array([abs(m[0]) for m in multipliers]).reshape(shape)
    stable = np.array([is_stable(m) for m in multipliers]).reshape(shape)
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


def of_output(response: xarray.Dataset, output: str) -> xarray.DataArray:
    """The response of one output over amplitude and frequency.

    Raises
    ------
    InputError
        The dataset is no frequency response, or has no such output.
    """
    if "response" not in response:
        raise InputError("this dataset is no frequency response; lm.frequency_response makes one")
    known = [str(name) for name in response["output"].values]
    return response["response"].sel(output=_known_output(output, known))


def _known_output(output: str, known: Sequence[str]) -> str:
    if output not in known:
        raise InputError(f"output {shown(output)} is not known; it must be one of {', '.join(known)}")
    return output


@checked
def characteristics(response: xarray.Dataset, drive: Drive | Scenario, output: str = "load_speed") -> xarray.Dataset:
    """Bandwidth and phase crossover as functions of amplitude, with the dead zone of the drive.

    Parameters
    ----------
    response
        From `frequency_response`.
    drive
        The drive, or its scenario.
    output
        The result variable that is looked at.

    Returns
    -------
    xarray.Dataset
        Over ``amplitude``: ``bandwidth`` [Hz], where the gain first falls 3 dB below that at the lowest frequency;
        ``phase_crossover`` [Hz], where the phase first falls through -180 degrees; NaN where that lies outside the
        frequencies. Attributes ``dead_zone_forward``, ``dead_zone_backward``: constant commands beyond which the load
        moves from rest.
    """
    import xarray as xr

    values = of_output(response, output).values
    x = np.log(response["frequency"].values)
    bandwidth, crossover = [], []
    for curve in values:
        size = np.abs(curve)
        with np.errstate(divide="ignore", invalid="ignore"):
            gain = 20.0 * np.log10(size / size[0])
            phase = np.degrees(np.unwrap(np.angle(curve)))
        bandwidth.append(_falls_through(x, gain, -20.0 * math.log10(THREE_DECIBELS)))
        crossover.append(_falls_through(x, phase, -180.0))
    core = drive_of(drive).core()
    forward, backward = (core.smallest_command(0.0, 0.0, s) for s in (+1, -1))
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


@checked
def bandwidth(
    drive: Drive | Scenario,
    amplitude: Number,
    *,
    output: str = "load_speed",
    mean_command: Number | None = None,
    mean_load_torque: Torque | None = None,
    lowest: Frequency = 0.1,
    highest: Frequency = 1000.0,
) -> float:
    """Frequency [Hz] at which the gain from the command first falls 3 dB below that at the lowest frequency.

    Gains come from periodic motions, as in `frequency_response`. They are computed half an octave apart, and the fall is
    then located between two of them.

    Parameters
    ----------
    drive
        A drive, or a scenario, of which the drive and the constant parts of command and load torque are taken.
    amplitude
        Of the command, E_CA [-].
    mean_command, mean_load_torque
        Constant parts of E_C [-] and M_Z [N·m]; left out, those of the scenario, or 0.
    lowest, highest
        [Hz]. Where the gain has not fallen at the highest, the bandwidth is NaN.

    Raises
    ------
    InputError
        The amplitude is not positive, the output is not known, or the frequencies do not rise.
    RuntimeError
        No periodic motion was found, or the output does not move at the lowest frequency.
    """
    need("scipy", "The bandwidth", "control")
    from scipy.optimize import brentq

    if not amplitude > 0.0:
        raise InputError(f"no bandwidth: the amplitude {amplitude:g} of the command must be positive")
    if not 0.0 < lowest < highest:
        raise InputError(f"no bandwidth: lowest {lowest:g} Hz must be above 0 and below highest, {highest:g} Hz")
    channel = CHANNEL_NAMES.index(_known_output(output, CHANNEL_NAMES))
    means = mean_inputs(drive, mean_command, mean_load_torque)
    drive = drive_of(drive)

    def gain(frequency: float) -> float:
        point = (*_signals("command", amplitude, frequency, *means), 1.0 / frequency, Initial())
        r = respond(drive, [point], harmonics=1, keep_table=False, max_periods=MAX_PERIODS, threads=1, progress=None)
        if reason := reason_of(r, 0):
            raise RuntimeError(f"no bandwidth: at {frequency:.4g} Hz {reason}")
        return math.hypot(*r["harmonics"][0, channel, 1]) / amplitude

    level = gain(lowest) / THREE_DECIBELS
    if level == 0.0:
        raise RuntimeError(f"no bandwidth: {output} does not move at an amplitude of {amplitude:g}")
    below = lowest
    while below < highest:
        above = min(below * math.sqrt(2.0), highest)
        if gain(above) < level:
            found = brentq(lambda x: gain(math.exp(x)) - level, math.log(below), math.log(above), xtol=1e-9)
            return math.exp(found)
        below = above
    return math.nan


@checked
def to_control(
    response: xarray.Dataset, amplitude: Number, output: str = "load_speed"
) -> control.FrequencyResponseData:
    """One curve of a response for python-control, as data over frequency.

    Raises
    ------
    MissingLibraryError
        python-control is not installed.
    InputError
        The dataset is no frequency response, or has no such amplitude or output.
    """
    curves = of_output(response, output)
    known = response["amplitude"].values.tolist()
    if amplitude not in known:
        raise InputError(f"amplitude {amplitude:g}: the response has {', '.join(f'{a:g}' for a in known)}")
    curve = curves.sel(amplitude=amplitude)
    return _control().frd(curve.values, 2.0 * np.pi * curve["frequency"].values)
