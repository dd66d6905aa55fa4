"""What `lostmotion response` writes: Bode figures, maps over amplitude and frequency, tables."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..atomic_writer import write_bytes
from ..response.bandwidth import characteristics
from ..simulation.scenario import Scenario
from ..simulation.train_scenario import TrainScenario
from .pages import panels_csv, save_figure, table_csv, write_text
from .response_figures import bode, bode_figure, maps_figure

if TYPE_CHECKING:
    import xarray


def for_file(response: xarray.Dataset) -> xarray.Dataset:
    """The response in types that every NetCDF reader knows: complex numbers as two variables."""
    out = response
    for name in ("response", "harmonics"):
        parts = {f"{name}_real": response[name].real, f"{name}_imag": response[name].imag}
        out = out.drop_vars(name).assign(parts)
    out = out.assign(stable=response["stable"].astype("int8"), reason=response["reason"].astype(str))
    return out.assign_coords({name: response[name].astype(str) for name in ("output", "unit")})


def points_csv(response: xarray.Dataset, output: str) -> str:
    """One row a point."""
    rows = []
    for a in response["amplitude"].values:
        for f in response["frequency"].values:
            p = response.sel(amplitude=a, frequency=f)
            value = complex(p["response"].sel(output=output))
            numbers = [abs(value), np.degrees(np.angle(value)), float(p["distortion"].sel(output=output))]
            numbers += [
                float(p[k])
                for k in ("efficiency", "motor_power", "gear_loss", "angle_advance", "residual", "multiplier")
            ]
            numbers += [float(p["spread"])] if "spread" in p else []
            rows.append([a, f, *numbers, str(p["reason"].item())])
    header = ["amplitude", "frequency [Hz]", "gain", "phase [degrees]", "distortion", "efficiency", "motor_power [W]"]
    header += ["gear_loss [W]", "angle advance [rad]", "residual", "multiplier"]
    return table_csv([*header, *(["spread"] if "spread" in response else []), "reason"], rows)


def write_response(
    directory: Path, responses: Mapping[str, xarray.Dataset], scenario: Scenario | TrainScenario, output: str
) -> tuple[Path, xarray.Dataset]:
    """Figures and tables of the first response, overlaid with the others, in a directory that is made if missing.

    Returns
    -------
    (Path, xarray.Dataset)
        Of the Bode figure; the characteristics by amplitude.
    """
    directory.mkdir(parents=True, exist_ok=True)
    response = next(iter(responses.values()))
    save_figure(bode_figure(responses, output), directory, "bode")
    write_text(directory / "bode.csv", panels_csv(bode(responses, output)))
    if response.sizes["amplitude"] > 1 and response.sizes["frequency"] > 1:
        save_figure(maps_figure(response, output), directory, "maps")
    write_text(directory / "response.csv", points_csv(response, output))
    if find_spec("h5netcdf") is not None:
        write_bytes(directory / "response.nc", bytes(for_file(response).to_netcdf(engine="h5netcdf")))
    found = characteristics(response, scenario, output)
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
