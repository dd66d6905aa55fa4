"""The report of a frequency response: Bode charts, maps over amplitude and frequency, tables."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..atomic_writer import write_bytes
from ..response.crossovers import characteristics
from ..simulation.scenario.scenario import Scenario
from ..units.practical import counted, printed
from .figure_style import step
from .page import Prose, Report, Table
from .panels import Curve, Ground, Group, Panel
from .written_files import table_csv, write_report

if TYPE_CHECKING:
    import xarray

BLANK = (
    "The gain is then 3 dB below that at the lowest frequency, the phase at -180 degrees. "
    "A blank cell means that the curve does not reach this level within the frequencies."
)


def for_file(response: xarray.Dataset) -> xarray.Dataset:
    """The response in types that every NetCDF reader knows: complex numbers as two variables."""
    out = response
    for name in ("response", "harmonics"):
        parts = {f"{name}_real": response[name].real, f"{name}_imag": response[name].imag}
        out = out.drop_vars(name).assign(parts)
    out = out.assign(stable=response["stable"].astype("int8"), reason=response["reason"].astype(str))
    return out.assign_coords({name: response[name].astype(str) for name in ("output", "unit")})


NUMBERS = ("efficiency", "motor_power", "gear_loss", "angle_advance", "residual", "multiplier", "spread")


def points_csv(response: xarray.Dataset, output: str) -> str:
    """One row a point."""
    values = response["response"].sel(output=output).values
    columns = [np.abs(values), np.degrees(np.angle(values)), response["distortion"].sel(output=output).values]
    columns += [response[k].transpose("amplitude", "frequency").values for k in NUMBERS if k in response]
    points = [[a, f] for a in response["amplitude"].values.tolist() for f in response["frequency"].values.tolist()]
    numbers = zip(*(column.ravel().tolist() for column in columns), strict=True)
    reasons = map(str, response["reason"].transpose("amplitude", "frequency").values.ravel())
    rows = [[*point, *row, reason] for point, row, reason in zip(points, numbers, reasons, strict=True)]
    header = ["amplitude", "frequency [Hz]", "gain", "phase [degrees]", "distortion", "efficiency", "motor_power [W]"]
    header += ["gear_loss [W]", f"angle advance [{response['angle_advance'].attrs['units']}]", "residual", "multiplier"]
    return table_csv([*header, *(["spread"] if "spread" in response else []), "reason"], rows)


MAP_DEPTH = 60.0  # [dB] of the gain that maps show
MODELS: tuple[Any, ...] = ("-", "--", "-.", ":")


def unit_of_source(response: xarray.Dataset) -> str:
    """Unit of the input, for labels."""
    unit = str(response["amplitude"].attrs["units"])
    return "-" if unit == "1" else printed(unit)


def unit_of_gain(response: xarray.Dataset, output: str) -> str:
    """Unit of the output by the unit of the input, for labels."""
    unit, of_source = printed(str(response["unit"].sel(output=output).item())), unit_of_source(response)
    return unit if of_source == "-" else f"{unit} / {of_source}"


def bode(responses: Mapping[str, xarray.Dataset], output: str) -> list[Panel]:
    """Gain and phase over frequency: a colour for each amplitude, a line style for each model."""
    first = next(iter(responses.values()))
    amplitudes = first["amplitude"].values
    gain, phase = [], []
    for (name, response), line in zip(responses.items(), (MODELS * len(responses))[: len(responses)], strict=True):
        f = response["frequency"].values
        for k, amplitude in enumerate(amplitudes):
            values = response["response"].sel(output=output, amplitude=amplitude).values
            values = np.where(np.abs(values) > 0.0, values, np.nan)
            # In the legend each amplitude stands once, and each further model once.
            legend = f"{amplitude:.3g}" if response is first else name if amplitude == amplitudes[-1] else "_"
            style = step(k, len(amplitudes)) | {"linestyle": line}
            label = f"{name}, {amplitude:.6g}"
            gain.append(Curve(label, f, np.abs(values), style, legend))
            phase.append(Curve(label, f, np.degrees(np.unwrap(np.angle(values))), style, legend))
    source, of_source = first.attrs["source"], unit_of_source(first)
    by = f"by amplitude of the {source.replace('_', ' ')}" + ("" if of_source == "-" else f" [{of_source}]")
    title = f"{output.replace('_', ' ').capitalize()}, {by}"
    return [
        Panel(title, "frequency [Hz]", f"gain [{unit_of_gain(first, output)}]", tuple(gain), log_x=True, log_y=True),
        Panel("Phase", "frequency [Hz]", "phase [degrees]", tuple(phase), log_x=True),
    ]


def maps(response: xarray.Dataset, output: str) -> list[Panel]:
    """Gain, phase, efficiency and distortion over frequency and amplitude; none with fewer than two of either."""
    if min(response.sizes["amplitude"], response.sizes["frequency"]) < 2:
        return []
    values = response["response"].sel(output=output).values
    distortion = response["distortion"].sel(output=output).values
    with np.errstate(divide="ignore", invalid="ignore"):
        gain = 20.0 * np.log10(np.abs(values))
        shown = gain > np.nanmax(np.where(np.isfinite(gain), gain, -np.inf)) - MAP_DEPTH
        harmonics = np.where(shown, 100.0 * distortion, np.nan)
    phase = np.degrees(np.unwrap(np.angle(np.where(np.isfinite(values), values, 1.0)), axis=1))
    label = f"amplitude of the {response.attrs['source'].replace('_', ' ')} [{unit_of_source(response)}]"

    def panel(title: str, unit: str, z: np.ndarray) -> Panel:
        ground = Ground(response["frequency"].values, response["amplitude"].values, z, unit)
        return Panel(title, "frequency [Hz]", label, (), log_x=True, log_y=True, ground=ground)

    return [
        panel(
            f"Gain of {output.replace('_', ' ')}",
            f"gain [dB of 1 {unit_of_gain(response, output)}]",
            np.where(shown, gain, np.nan),
        ),
        panel("Phase", "phase [degrees]", np.where(shown, phase, np.nan)),
        panel("Mean efficiency", "efficiency [-]", response["efficiency"].values),
        panel("Total harmonic distortion", "THD [%]", harmonics),
    ]


# --- verdict ---


def amplitude_lines(found: xarray.Dataset) -> list[str]:
    """Bandwidth and phase crossover at each amplitude, and the dead zone."""
    lines = []
    for a in found["amplitude"].values:
        band, cross = (float(found[k].sel(amplitude=a)) for k in ("bandwidth", "phase_crossover"))
        text = [
            f"gain 3 dB below its first value at {band:.4g} Hz"
            if math.isfinite(band)
            else "gain 3 dB below its first value outside the frequencies, or no motion"
        ]
        text += [f"phase -180 degrees at {cross:.4g} Hz"] if math.isfinite(cross) else []
        lines.append(f"amplitude {a:g}: {', '.join(text)}")
    return [*lines, *dead_zone_line(found)]


def dead_zone_line(found: xarray.Dataset) -> list[str]:
    """The constant commands beyond which the load moves, of a drive without a controller."""
    if "dead_zone_forward" not in found.attrs:
        return []
    forward, backward = (found.attrs[f"dead_zone_{way}"] for way in ("forward", "backward"))
    return [f"dead zone: from rest the load moves above a constant command of {forward:.4g} and below {backward:.4g}"]


def motion_lines(result: xarray.Dataset) -> list[str]:
    """Number of motions found, their residuals, and the reasons for missing ones."""
    reasons = [r for r in result["reason"].values.ravel() if r]
    repeating = (result["reason"] == "") & ~(result["spread"] > 0.0 if "spread" in result else False)
    worst = float(result["residual"].where(repeating).max())
    within = (
        f", repeating {'to rounding' if worst < 1e-11 else f'within {worst:.1e} of their magnitude'}"
        if repeating.any()
        else ""
    )
    lines = [f"{result['reason'].size - len(reasons)} of {counted(result['reason'].size, 'motion')} found{within}"]
    lines += _closed_loop_lines(result) if "spread" in result else []
    return lines + [f"not found at {counted(reasons.count(r), 'point')}: {r}" for r in dict.fromkeys(reasons)]


def _closed_loop_lines(result: xarray.Dataset) -> list[str]:
    """Frequencies that were adapted to the sample times, and motions that do not repeat."""
    f, asked = result["frequency"].values, result["asked_frequency"].values
    off, lines = abs(f / asked - 1.0), []
    if off.max() > 1e-9:
        lines.append(
            f"{(off > 1e-9).sum()} of {len(f)} frequencies moved to the nearest that fits the sample times, by {off.max():.1%} at most"
        )
    spread = result["spread"].values
    if count := int((spread > 0.0).sum()):
        lines.append(
            f"{counted(count, 'response')} averaged over many periods, as the steps of the encoder do not repeat: "
            f"their first harmonics vary by {spread[spread > 0.0].max():.2g} of their mean at most"
        )
    return lines


def _verdict(response: xarray.Dataset, found: xarray.Dataset) -> tuple[str, ...]:
    lines = amplitude_lines(found)
    count = found.sizes["amplitude"]
    ends = [lines[0], *([lines[count - 1]] if count > 1 else [])]
    told = ["; ".join(ends), *dead_zone_line(found), motion_lines(response)[0]]
    return tuple(f"{line[0].upper()}{line[1:]}." for line in told)


# --- the page ---


def response_report(responses: Mapping[str, xarray.Dataset], scenario: Scenario, output: str) -> Report:
    """The page of the first response, overlaid with the others, and its characteristics by amplitude."""
    name, response = next(iter(responses.items()))
    found = characteristics(response, scenario, output)
    source, unit = response.attrs["source"].replace("_", " "), unit_of_source(response)
    names = ("amplitude", "bandwidth", "phase_crossover")
    columns = list(zip(*(found[name].values.tolist() for name in names), strict=True))
    rows = [[f"{a:g}", *("" if math.isnan(v) else f"{v:.4g}" for v in values)] for a, *values in columns]
    caption = f"First harmonic of the {output.replace('_', ' ')} over that of the {source}, of periodic motions."
    compared = f" Compared with {', '.join(list(responses)[1:])}." if len(responses) > 1 else ""
    note = f"Gain, phase and distortion are blank where the gain is {MAP_DEPTH:g} dB or more below its largest value."
    header = (f"amplitude [{unit}]", "gain -3 dB at [Hz]", "phase -180 degrees at [Hz]")
    return Report(
        title=scenario.title or name,
        lead=f"Frequency response of `{name}` from {source} to {output.replace('_', ' ')}.{compared}",
        verdict=_verdict(response, found),
        main=Group("bode", "Gain and phase", caption, tuple(bode(responses, output)), 1),
        parts=(
            Group("maps", "Over frequency and amplitude", note, tuple(maps(response, output))),
            Table("Characteristics", header, rows, BLANK),
            Prose("Motions", motion_lines(response), listed=True),
        ),
        file="response.html",
        tables={
            "response.csv": points_csv(response, output),
            "characteristics.csv": table_csv(["amplitude", "bandwidth [Hz]", "phase_crossover [Hz]"], columns),
        },
    )


def write_response(
    directory: Path,
    responses: Mapping[str, xarray.Dataset],
    scenario: Scenario,
    output: str,
    pictures: Sequence[str] = (),
) -> Path:
    """``response.html`` and tables in a directory, made if missing; on request pictures with these endings.

    Returns the path of the page.
    """
    page = write_report(directory, response_report(responses, scenario, output), pictures)
    if find_spec("h5netcdf") is not None:
        response = next(iter(responses.values()))
        write_bytes(directory / "response.nc", bytes(for_file(response).to_netcdf(engine="h5netcdf")))
    return page
