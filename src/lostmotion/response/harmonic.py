"""Frequency response from periodic motions: harmonics, distortion, efficiency, stability."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..inputs.argument_checks import checked
from ..inputs.memory_limits import check_free
from ..inputs.quantities import Count, Number, Torque, arguments
from ..model.drive import Drive
from ..simulation.scenario.scenario import Scenario
from .closed_response import respond_closed, windows_for
from .linearisation import python_control
from .plant import Plant, known_output, plant_or_loop
from .shooting import MAX_PERIODS, SAMPLES_PER_PERIOD, floquet_multipliers, is_stable, reason_of, respond
from .windows import SAMPLES

if TYPE_CHECKING:
    import control
    import xarray

HARMONIC = 200.0  # bytes for each harmonic of a point, of a few outputs


@checked
def frequency_response(
    drive: Drive | Scenario,
    frequencies: Sequence[float] | float,
    amplitudes: Sequence[float] | float,
    *,
    source: str | None = None,
    mean_command: Number | None = None,
    mean_load_torque: Torque | None = None,
    harmonics: Count = 8,
    refine: Number | None = None,
    threads: Count | None = None,
    max_periods: Count = MAX_PERIODS,
    law: Any = None,
    progress: Callable[[], None] | None = None,
) -> xarray.Dataset:
    """Compute the response to a sine over frequency and amplitude, by harmonic linearisation (describing functions).

    Each point is a periodic motion, found by shooting. Points are independent of each other; the result is the same for any number
    of threads.

    In a scenario with controllers the sine belongs to a reference or a load torque. Its period must fit the sample times: if ten
    periods do not, the nearest frequency that fits is taken. Encoders with steps may keep the motion from repeating. Then the
    harmonics are means over many periods, and ``spread`` states how far they vary. Variables of controllers are taken
    at their samples. Variables of the drive are taken between two sample instants, at least 256 times a period.

    Parameters
    ----------
    drive : Drive or Scenario
        A drive, or a scenario. A scenario provides the drive or train, the controllers and the constant parts of the inputs.
    frequencies : float or sequence of float
        Frequencies [Hz].
    amplitudes : float or sequence of float
        Amplitudes of the input: E_CA [-], load torque [N·m], or a reference in its unit (rad, rad/s, N·m).
    source : str, optional
        The input that is a sine: ``"command"``, with a controller ``"reference"``, or ``"load_torque"``; in a train
        ``"<motor>_command"``, ``"<motor>_reference"``, ``"<shaft>_load_torque"`` and so on. The others are constant. Default:
        command or reference of the only motor.
    mean_command, mean_load_torque : float, optional
        Constant parts of E_C [-] and M_Z [N·m] of a drive. Default: the values in the scenario, or 0.
    harmonics : int
        Number of harmonics to keep.
    refine : float, optional
        Adds frequencies at bends of a curve. The result has gain and phase of the load speed (in a train: of its last shaft)
        within this many decibels, and ten times as many degrees, of the straight line through the neighbours. At most the grid
        becomes sixteen times as fine.
    threads : int, optional
        Number of threads. Default: all cores; one with your own law, since it may keep a state.
    max_periods : int
        Largest number of periods that a point may take.
    law : callable, optional
        The law of a controller with ``law = true``, as in `simulate`.
    progress : callable, optional
        Called after each point.

    Returns
    -------
    xarray.Dataset
        Over ``amplitude`` and ``frequency`` [Hz], with ``output`` and ``harmonic``: complex ``response`` (first harmonic of
        each output divided by that of the input), ``harmonics`` (complex amplitudes, 0 is the mean), ``distortion`` (rms of
        all above the first, divided by the first), ``efficiency`` (mean power out of the last gears divided by mean power of
        the motors), ``motor_power``, ``load_power``, ``gear_loss`` [W], ``angle_advance`` [rad] of the load or last shaft in
        a period, ``residual`` of periodicity, ``periods``, ``newton_steps``, ``multiplier`` (largest Floquet multiplier),
        ``stable``, and ``reason`` (empty if a motion was found; otherwise the values are NaN). With controllers, ``output``
        is by default the measured value of the outermost loop, ``newton_steps`` are extrapolations, and ``multiplier`` is
        NaN, since the map has no derivative. ``spread`` is the variation of the first harmonic of ``output`` divided by its
        mean, 0 if the motion repeats; ``asked_frequency`` [Hz] is the requested one.

    Raises
    ------
    InputError
        An argument cannot be used.

    Examples
    --------
    >>> import lostmotion as lm
    >>> response = lm.frequency_response(lm.load("paper-2dof-nl-small"), [2.0, 8.0], 0.5)
    >>> abs(response["response"].sel(output="load_speed", amplitude=0.5)).values.round(2)
    array([3.13, 1.31])
    """
    plant = plant_or_loop(drive)
    source = plant.known_source(source)
    frequencies, amplitudes = _checked(frequencies, amplitudes, plant.unit(source))
    points = len(frequencies) * len(amplitudes)
    check_free(
        points * HARMONIC * (harmonics + 1.0),
        f"{points:.3g} points of the response",
        "give fewer of them, or fewer harmonics",
    )
    plant = plant.with_means(mean_command, mean_load_torque)
    if law is not None and not plant.closed:
        raise InputError("law: the scenario has no controller with law = true; set it, or leave law out")
    options: dict[str, Any] = {"harmonics": harmonics, "max_periods": max_periods, "progress": progress}
    respond: Callable[..., xarray.Dataset] = _of_closed_loop if plant.closed else _of_open_loop
    own = {"law": law, "threads": threads or os.cpu_count() or 1} if plant.closed else {"threads": threads}
    compute = partial(respond, plant, amplitudes, source, **options, **own)
    result = compute(frequencies)
    for _ in range(4 if refine is not None else 0):
        assert refine is not None
        new = _bends(result, refine)
        if not new:
            break
        import xarray as xr

        more = compute(new)
        more = more.isel(frequency=~np.isin(more["frequency"].values, result["frequency"].values))
        result = xr.concat([result, more], dim="frequency", combine_attrs="override").sortby("frequency")
    return result


def _of_open_loop(
    plant: Plant,
    amplitudes: Sequence[float],
    source: str,
    frequencies: Sequence[float],
    *,
    progress: Callable[[], None] | None,
    **options: Any,
) -> xarray.Dataset:
    seen = 0

    def report(done: int) -> None:
        nonlocal seen
        for _ in range(done - seen):
            if progress is not None:
                progress()
        seen = done

    points = [(plant.sine(source, a, f), 1.0 / f, plant.rest) for a in amplitudes for f in frequencies]
    r = respond(plant, points, keep_table=False, progress=report, **options)
    return _labelled(r, plant, amplitudes, frequencies, source)


def _of_closed_loop(
    plant: Plant, amplitudes: Sequence[float], source: str, frequencies: Sequence[float], **options: Any
) -> xarray.Dataset:
    windows = windows_for(plant, frequencies)
    r = respond_closed(plant, source, amplitudes, windows, **options)
    shape = (len(amplitudes), len(windows))
    meaning = "deviation of the output's first harmonic from period to period / its mean"
    out = _labelled(r, plant, amplitudes, [w.frequency for w in windows], source)
    asked = ("frequency", [w.asked for w in windows], {"units": "Hz", "long_name": "frequency that was asked for"})
    out = out.assign_coords(asked_frequency=asked)
    out.attrs["samples_per_period"] = SAMPLES
    return out.assign(
        spread=(("amplitude", "frequency"), r["spread"].reshape(shape), {"units": "1", "long_name": meaning})
    )


def _checked(
    frequencies: Sequence[float] | float, amplitudes: Sequence[float] | float, unit: str
) -> tuple[list[float], list[float]]:
    """Frequencies [Hz], rising, and amplitudes."""
    frequencies = sorted(set(arguments("frequencies", frequencies, "Hz")))
    amplitudes = arguments("amplitudes", amplitudes, "" if unit == "1" else unit)
    if not frequencies or frequencies[0] <= 0.0:
        raise InputError("frequencies must be positive; give at least one")
    if not amplitudes or min(amplitudes) <= 0.0:
        raise InputError("amplitudes must be positive; give at least one")
    return frequencies, amplitudes


def _bends(result: xarray.Dataset, tolerance: float) -> list[float]:
    """Frequencies halfway to the neighbours of each one off the straight line between them."""
    values = of_output(result).values  # amplitude x frequency
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


# What a response says of each point, over amplitude and frequency: name -> unit and meaning.
OF_EACH_POINT = {
    "efficiency": ("1", "mean power out of the gear / mean motor power"),
    "motor_power": ("W", "mean mechanical power of the motor"),
    "load_power": ("W", "mean power on the load's side of the gear"),
    "gear_loss": ("W", "mean power lost in the gear, torsion included"),
    "angle_advance": ("rad", "advance of the load angle over one period"),
    "residual": ("1", "change of a state over one period"),
    "periods": ("1", "periods followed"),
    "newton_steps": ("1", "steps of Newton's method"),
    "multiplier": ("1", "largest Floquet multiplier"),
}

# Those that are NaN where no motion was found.
OF_A_MOTION = ("motor_power", "load_power", "gear_loss", "angle_advance")


def _labelled(
    r: dict[str, Any], plant: Plant, amplitudes: Sequence[float], frequencies: Sequence[float], source: str
) -> xarray.Dataset:
    import xarray as xr

    shape = (len(amplitudes), len(frequencies))
    reasons = np.array([reason_of(r, k) for k in range(shape[0] * shape[1])], dtype=object).reshape(shape)
    found = reasons == ""
    c, response, distortion = _harmonics(r, found, plant.channels.index(source))
    points, stable = _of_each_point(r, found)
    grid, each = ("amplitude", "frequency"), ("output", "amplitude", "frequency")
    units = {v.name: v.unit for v in plant.variables}
    of_points = {**OF_EACH_POINT, "angle_advance": (units.get(plant.angle, "rad"), OF_EACH_POINT["angle_advance"][1])}
    return xr.Dataset(
        {
            "response": (each, np.moveaxis(response, -1, 0), {"long_name": f"first harmonic / that of the {source}"}),
            "harmonics": ((*each, "harmonic"), np.moveaxis(c, 2, 0), {"long_name": "complex amplitude"}),
            "distortion": (
                each,
                np.moveaxis(distortion, -1, 0),
                {"units": "1", "long_name": "harmonics above the first / first"},
            ),
            **{
                name: (grid, points[name], {"units": unit_, "long_name": meaning})
                for name, (unit_, meaning) in of_points.items()
            },
            "stable": (grid, stable),
            "reason": (grid, reasons, {"long_name": "why there is no periodic motion"}),
        },
        coords={
            "amplitude": (
                "amplitude",
                list(amplitudes),
                {"units": plant.unit(source), "long_name": f"amplitude of the {source}"},
            ),
            "frequency": ("frequency", list(frequencies), {"units": "Hz", "long_name": "frequency"}),
            "output": ("output", list(plant.channels)),
            "unit": ("output", [units[name] for name in plant.channels], {"long_name": "of the outputs"}),
            "harmonic": ("harmonic", np.arange(c.shape[-1])),
        },
        attrs={"source": source, "output": plant.output, "samples_per_period": SAMPLES_PER_PERIOD},
    )


def _harmonics(r: dict[str, Any], found: np.ndarray, source: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Complex amplitudes of all outputs, the first harmonic over the source's, and the distortion."""
    c = r["harmonics"][..., 0] + 1j * r["harmonics"][..., 1]
    c = c.reshape(*found.shape, *c.shape[1:])
    c = np.where(found[..., None, None], c, np.nan)
    first = c[..., 1]
    above = r["mean_square"].reshape(*found.shape, -1) - np.abs(c[..., 0]) ** 2 - 0.5 * np.abs(first) ** 2
    drive_in = first[..., source]
    with np.errstate(divide="ignore", invalid="ignore"):
        distortion = np.sqrt(np.maximum(above, 0.0)) / (np.abs(first) / math.sqrt(2.0))
        return c, first / drive_in[..., None], distortion


def _of_each_point(r: dict[str, Any], found: np.ndarray) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """The values of `OF_EACH_POINT`, and whether the motion is stable."""
    points = {name: r[name].reshape(found.shape) for name in ("residual", "periods", "newton_steps")}
    for name in OF_A_MOTION:
        points[name] = np.where(found, r[name].reshape(found.shape), np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        efficiency = points["load_power"] / points["motor_power"]
    points["efficiency"] = np.where(points["motor_power"] > 0.0, efficiency, np.nan)
    if "jacobian" not in r:  # the map of a closed loop has none
        points["multiplier"] = np.full(found.shape, np.nan)
        return points, found
    multipliers = [floquet_multipliers(r, k) for k in range(found.size)]
    largest_multiplier = np.array([abs(m[0]) for m in multipliers]).reshape(found.shape)
    points["multiplier"] = np.where(found, largest_multiplier, np.nan)
    return points, found & np.array([is_stable(m) for m in multipliers]).reshape(found.shape)


def of_output(response: xarray.Dataset, output: str | None = None) -> xarray.DataArray:
    """The response of one output over amplitude and frequency; default: the load's speed.

    Raises InputError: the dataset is no frequency response, or has no such output.
    """
    if "response" not in response:
        raise InputError("this dataset is no frequency response; lm.frequency_response makes one")
    known = [str(name) for name in response["output"].values]
    output = response.attrs["output"] if output is None else output
    return response["response"].sel(output=known_output(output, known))


@checked
def to_control(response: xarray.Dataset, amplitude: Number, output: str | None = None) -> control.FrequencyResponseData:
    """Return one curve of a frequency response for python-control.

    Parameters
    ----------
    response : xarray.Dataset
        Result of `frequency_response`.
    amplitude : float
        One of its amplitudes.
    output : str, optional
        The result variable. Default: the load's speed, in a train the speed of the last shaft.

    Returns
    -------
    control.FrequencyResponseData
        The curve over the angular frequency [rad/s].

    Raises
    ------
    MissingLibraryError
        python-control is not installed.
    InputError
        The dataset is no frequency response, or has no such amplitude or output.

    Examples
    --------
    >>> import lostmotion as lm
    >>> response = lm.frequency_response(lm.load("paper-2dof-nl-small"), [2.0, 8.0], 0.5)
    >>> lm.response.to_control(response, 0.5).omega.round(3)
    array([12.566, 50.265])
    """
    curves = of_output(response, output)
    known = response["amplitude"].values.tolist()
    if amplitude not in known:
        raise InputError(f"amplitude {amplitude:g}: the response has {', '.join(f'{a:g}' for a in known)}")
    curve = curves.sel(amplitude=amplitude)
    return python_control().frd(curve.values, 2.0 * np.pi * curve["frequency"].values)
