"""Figures of a frequency response: Bode figures, maps over amplitude and frequency."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np

from ..errors import InputError
from . import plots
from .panels import Curve, Panel

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

LINES: tuple[Any, ...] = ("-", "--", "-.", ":")
MAP_DEPTH = 60.0  # [dB] of the gain that maps show


def unit_of_source(response: xarray.Dataset) -> str:
    """Of the input, for labels."""
    unit = str(response["amplitude"].attrs["units"])
    return "-" if unit == "1" else unit.replace("*", "·")


def bode(responses: Mapping[str, xarray.Dataset], output: str) -> list[Panel]:
    """Gain and phase over frequency: a colour for each amplitude, a line style for each model."""
    first = next(iter(responses.values()))
    amplitudes = first["amplitude"].values
    colours = mpl.colormaps["cividis"](np.linspace(0.0, 0.85, len(amplitudes)))
    gain, phase = [], []
    for (name, response), line in zip(responses.items(), (LINES * len(responses))[: len(responses)], strict=True):
        f = response["frequency"].values
        for amplitude, colour in zip(amplitudes, colours, strict=True):
            values = response["response"].sel(output=output, amplitude=amplitude).values
            values = np.where(np.abs(values) > 0.0, values, np.nan)
            # In the legend each amplitude stands once, and each further model once.
            legend = f"{amplitude:.3g}" if response is first else name if amplitude == amplitudes[-1] else "_"
            style = {"color": colour, "linestyle": line, "linewidth": 1.5}
            label = f"{name}, {amplitude:.6g}"
            gain.append(Curve(label, f, np.abs(values), style, legend))
            phase.append(Curve(label, f, np.degrees(np.unwrap(np.angle(values))), style, legend))
    source, of_source = first.attrs["source"], unit_of_source(first)
    unit = str(first["unit"].sel(output=output).item()).replace("*", "·")
    title = f"{output.replace('_', ' ')} / {source.replace('_', ' ')} by amplitude [{of_source}]"
    return [
        Panel(title, "frequency [Hz]", f"gain [{unit} / {of_source}]", tuple(gain), log_x=True, log_y=True),
        Panel("phase", "frequency [Hz]", "phase [degrees]", tuple(phase), log_x=True),
    ]


def maps(response: xarray.Dataset, output: str) -> dict[str, tuple[str, Any]]:
    """Gain, phase, efficiency and distortion over amplitude and frequency."""
    values = response["response"].sel(output=output).values
    distortion = response["distortion"].sel(output=output).values
    with np.errstate(divide="ignore", invalid="ignore"):
        gain = 20.0 * np.log10(np.abs(values))
        shown = gain > np.nanmax(np.where(np.isfinite(gain), gain, -np.inf)) - MAP_DEPTH
        harmonics = np.where(shown & (distortion > 0.0), np.log10(distortion), np.nan)
    phase = np.degrees(np.unwrap(np.angle(np.where(np.isfinite(values), values, 1.0)), axis=1))
    return {
        f"gain of {output.replace('_', ' ')}, down to {MAP_DEPTH:g} dB below the largest": (
            "[dB]",
            np.where(shown, gain, np.nan),
        ),
        "phase": ("[degrees]", np.where(shown, phase, np.nan)),
        "mean efficiency": ("[-]", response["efficiency"].values),
        "harmonics above the first / first": ("power of ten", harmonics),
    }


def bode_figure(responses: Mapping[str, xarray.Dataset], output: str) -> Figure:
    """Gain over phase; the panels are those of `bode`."""
    return plots.draw(bode(responses, output), 1, (9.0, 7.5))


def maps_figure(response: xarray.Dataset, output: str) -> Figure:
    """The maps of `maps` as contours.

    Raises
    ------
    ValueError
        There are fewer than two amplitudes or frequencies.
    """
    if min(response.sizes["amplitude"], response.sizes["frequency"]) < 2:
        raise InputError(
            "maps need at least two amplitudes and two frequencies; plot() draws the response over frequency"
        )
    source = response.attrs["source"]
    label = f"amplitude of the {source.replace('_', ' ')} [{unit_of_source(response)}]"
    return plots.amplitude_maps(
        response["frequency"].values, response["amplitude"].values, maps(response, output), label
    )
