"""Bandwidth and phase crossover: where a gain falls by 3 dB, and a phase through -180 degrees."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError, need
from ..inputs.argument_checks import checked
from ..inputs.quantities import Frequency, Number, Torque
from ..model.drive import Drive
from ..simulation.runs.stuck_contacts import smallest_commands
from ..simulation.scenario.scenario import Scenario
from .harmonic import of_output
from .plant import plant_of
from .shooting import MAX_PERIODS, reason_of, respond

if TYPE_CHECKING:
    import xarray

THREE_DECIBELS = math.sqrt(2.0)  # the bandwidth ends where the gain has fallen by this factor


@checked
def characteristics(response: xarray.Dataset, drive: Drive | Scenario, output: str | None = None) -> xarray.Dataset:
    """Return bandwidth and phase crossover over amplitude, with the dead zone of the drive.

    Parameters
    ----------
    response : xarray.Dataset
        Result of `frequency_response`.
    drive : Drive or Scenario
        The drive, or its scenario.
    output : str, optional
        The result variable. Default: the load's speed, in a train the speed of the last shaft.

    Returns
    -------
    xarray.Dataset
        Over ``amplitude``: ``bandwidth`` [Hz], at which the gain first falls 3 dB below that at the lowest frequency;
        ``phase_crossover`` [Hz], at which the phase first falls through -180 degrees. They are NaN outside the frequencies. A drive
        without a controller has the attributes ``dead_zone_forward`` and ``dead_zone_backward``: constant commands beyond which the
        load moves from rest.

    Raises
    ------
    InputError
        The dataset is no frequency response, or has no such output.

    Examples
    --------
    >>> import lostmotion as lm
    >>> drive = lm.load("paper-2dof-nl-small")
    >>> response = lm.frequency_response(drive, [1.0, 4.0, 16.0], 0.5)
    >>> bool(lm.response.characteristics(response, drive)["bandwidth"].item() > 1.0)
    True
    """
    import xarray as xr

    values, frequencies = of_output(response, output).values, response["frequency"].values
    bandwidth = [three_decibels_down(frequencies, np.abs(curve)) for curve in values]
    crossover = [_falls_through(frequencies, np.degrees(np.unwrap(np.angle(curve))), -180.0) for curve in values]
    dead_zone = {}
    scenario = Scenario.of_any(drive)
    if not scenario.controllers and not scenario.given() and len(scenario.motors) == 1:
        forward, backward = smallest_commands(scenario)
        if not (math.isnan(forward) or math.isnan(backward)):  # the command of a stepper is an angle
            dead_zone = {"dead_zone_forward": forward, "dead_zone_backward": backward}
    return xr.Dataset(
        {
            "bandwidth": ("amplitude", bandwidth, {"units": "Hz", "long_name": "-3 dB against the lowest frequency"}),
            "phase_crossover": ("amplitude", crossover, {"units": "Hz", "long_name": "phase of -180 degrees"}),
        },
        coords={"amplitude": response["amplitude"]},
        attrs=dead_zone,
    )


def three_decibels_down(frequencies: np.ndarray, gain: np.ndarray) -> float:
    """Frequency [Hz] at which a gain first falls 3 dB below its first value, in log-log interpolation; NaN if it never does."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return _falls_through(frequencies, np.log(gain / gain[0]), -math.log(THREE_DECIBELS))


def _falls_through(frequencies: np.ndarray, y: np.ndarray, level: float) -> float:
    """First fall of a curve over the logarithm of the frequency through a level."""
    x = np.log(frequencies)
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
    output: str | None = None,
    source: str | None = None,
    mean_command: Number | None = None,
    mean_load_torque: Torque | None = None,
    lowest: Frequency = 0.1,
    highest: Frequency = 1000.0,
) -> float:
    """Return the frequency at which the gain from the command first falls 3 dB below that at the lowest frequency.

    Gains come from periodic motions, as in `frequency_response`. They are computed half an octave apart, and the fall is then
    located between two of them.

    Parameters
    ----------
    drive : Drive or Scenario
        A drive, or a scenario. A scenario provides the drive or train and the constant parts of its inputs.
    amplitude : float
        Amplitude of the command, E_CA [-], or of another input.
    output : str, optional
        The result variable. Default: the load's speed, in a train the speed of the last shaft.
    source : str, optional
        The input, as in `frequency_response`. Default: the command of the only motor.
    mean_command, mean_load_torque : float, optional
        Constant parts of E_C [-] and M_Z [N·m] of a drive. Default: the values in the scenario, or 0.
    lowest, highest : float
        Range of frequencies [Hz].

    Returns
    -------
    float
        Bandwidth [Hz]; NaN if the gain has not fallen at the highest frequency.

    Raises
    ------
    InputError
        The amplitude is not positive, the output is unknown, or the frequencies do not rise.
    RuntimeError
        No periodic motion was found, or the output does not move at the lowest frequency.

    Examples
    --------
    >>> import lostmotion as lm
    >>> round(lm.response.bandwidth(lm.load("paper-1dof-l-large"), 1.0, lowest=1.0, highest=50.0), 2)
    2.85
    """
    need("scipy", "The bandwidth", "control")
    from scipy.optimize import brentq

    if not amplitude > 0.0:
        raise InputError(f"no bandwidth: the amplitude {amplitude:g} of the command must be positive")
    if not 0.0 < lowest < highest:
        raise InputError(f"no bandwidth: lowest {lowest:g} Hz must be above 0 and below highest, {highest:g} Hz")
    plant = plant_of(drive).with_means(mean_command, mean_load_torque)
    output, source = plant.known_output(output), plant.known_source(source)
    channel = plant.channels.index(output)

    def gain(frequency: float) -> float:
        point = (plant.sine(source, amplitude, frequency), 1.0 / frequency, plant.rest)
        r = respond(plant, [point], harmonics=1, keep_table=False, max_periods=MAX_PERIODS, threads=1, progress=None)
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
