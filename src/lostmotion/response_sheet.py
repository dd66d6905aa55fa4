"""What `lostmotion response` leaves behind: Bode figures, maps over amplitude and frequency, tables."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np

from . import plots
from .errors import InputError
from .harmonic_response import characteristics
from .pages import panels_csv, save_figure, table_csv, write_text
from .parts import Drive
from .plots import Curve, Panel
from .results import write_bytes

if TYPE_CHECKING:
    import xarray

LINES: tuple[Any, ...] = ("-", "--", "-.", ":")
MAP_DEPTH = 60.0  # [dB] of the gain that maps show
UNITS = {"command": "-", "load_torque": "N·m"}


def parse_grid(text: str, option: str) -> list[float]:
    """Values from ``0.1,1,10`` or, with equal ratios, ``0.1..100:60`` (first, last, how many).

    Raises
    ------
    InputError
        The text is neither, or not positive.
    """
    problem = f"--{option} {text}: must be numbers such as 0.1,1,10 or a range such as 0.1..100:60"
    try:
        if ".." not in text:
            values = [float(x) for x in text.split(",")]
        else:
            bounds, _, count = text.partition(":")
            low, high = (float(x) for x in bounds.split(".."))
            values = np.geomspace(low, high, int(count)).tolist() if int(count) > 1 else [low]
    except ValueError:
        raise InputError(problem) from None
    if not all(np.isfinite(values)) or min(values) <= 0.0:
        raise InputError(f"{problem}, all of them above 0")
    return values


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
    source = first.attrs["source"]
    unit = plots.LABELS[output].unit.replace("*", "·")
    title = f"{output.replace('_', ' ')} / {source.replace('_', ' ')} by amplitude [{UNITS[source]}]"
    return [
        Panel(title, "frequency [Hz]", f"gain [{unit} / {UNITS[source]}]", tuple(gain), log_x=True, log_y=True),
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


def for_file(response: xarray.Dataset) -> xarray.Dataset:
    """The response in types that every NetCDF reader knows: complex numbers as two variables."""
    out = response
    for name in ("response", "harmonics"):
        parts = {f"{name}_real": response[name].real, f"{name}_imag": response[name].imag}
        out = out.drop_vars(name).assign(parts)
    out = out.assign(stable=response["stable"].astype("int8"), reason=response["reason"].astype(str))
    return out.assign_coords(output=response["output"].astype(str))


def points_csv(response: xarray.Dataset, output: str) -> str:
    """One row a point."""
    rows = []
    for a in response["amplitude"].values:
        for f in response["frequency"].values:
            p = response.sel(amplitude=a, frequency=f)
            value = complex(p["response"].sel(output=output))
            numbers = [abs(value), np.degrees(np.angle(value)), float(p["distortion"].sel(output=output))]
            numbers += [
                float(p[k]) for k in ("efficiency", "motor_power", "gear_loss", "drift", "residual", "multiplier")
            ]
            rows.append([a, f, *numbers, str(p["reason"].item())])
    header = ["amplitude", "frequency [Hz]", "gain", "phase [degrees]", "distortion", "efficiency", "motor_power [W]"]
    return table_csv([*header, "gear_loss [W]", "drift [rad]", "residual", "multiplier", "reason"], rows)


def write_response(
    directory: Path, responses: Mapping[str, xarray.Dataset], drive: Drive, output: str
) -> tuple[Path, xarray.Dataset]:
    """Figures and tables of the first response, overlaid with the others, in a directory that is made if missing.

    Returns
    -------
    (Path, xarray.Dataset)
        Of the Bode figure; the characteristics by amplitude.
    """
    directory.mkdir(parents=True, exist_ok=True)
    response = next(iter(responses.values()))
    drawn = bode(responses, output)
    save_figure(plots.draw(drawn, 1, (9.0, 7.5)), directory, "bode")
    write_text(directory / "bode.csv", panels_csv(drawn))
    if response.sizes["amplitude"] > 1 and response.sizes["frequency"] > 1:
        source = response.attrs["source"]
        label = f"amplitude of the {source.replace('_', ' ')} [{UNITS[source]}]"
        figure = plots.amplitude_maps(
            response["frequency"].values, response["amplitude"].values, maps(response, output), label
        )
        save_figure(figure, directory, "maps")
    write_text(directory / "response.csv", points_csv(response, output))
    write_bytes(directory / "response.nc", bytes(for_file(response).to_netcdf(engine="h5netcdf")))
    found = characteristics(response, drive, output)
    rows = zip(
        found["amplitude"].values.tolist(),
        found["bandwidth"].values.tolist(),
        found["phase_crossover"].values.tolist(),
        strict=True,
    )
    write_text(
        directory / "characteristics.csv", table_csv(["amplitude", "bandwidth [Hz]", "phase_crossover [Hz]"], rows)
    )
    return directory / "bode.png", found
