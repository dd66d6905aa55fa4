"""Writes FMUs with their inputs and reference results as the FMI cross-check asks for them.

    python bindings/fmu/cross_check.py build/cross-check

FMI Cross-Check Rules, version 4: DIRECTORY/VERSION OF FMI/cs or me/PLATFORM/TOOL/VERSION/MODEL/ has MODEL.fmu, MODEL_in.csv,
MODEL_ref.csv, MODEL_ref.opt and README.md. The references are exact runs with the inputs of MODEL_in.csv, joined by straight lines.
"""

from __future__ import annotations

import argparse
import shutil
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

import numpy as np

import lostmotion as lm
from lostmotion.reports.written_files import table_csv

MODELS = {"PaperDrive": "paper-2dof-nl-small", "PositionAxis": "position-axis"}
PLATFORM = "linux64"
POINTS = 1000  # the most that the rules want in a file
README = """{title}: an FMU of lostmotion {version}.

The reference is the exact run; inputs are straight lines between the points of {model}_in.csv.
"""


def with_lines(scenario: lm.Scenario) -> tuple[lm.Scenario, dict[str, np.ndarray]]:
    """The scenario with straight lines for its command, in points that the rules allow, and its inputs in these points."""
    duration = scenario.simulation.duration
    interval = duration / (POINTS - 1)
    inputs = {"time": np.linspace(0.0, duration, POINTS)}
    changes: dict[str, object] = {"simulation.sample_interval": interval}
    if scenario.controller is None:
        inputs["command"] = lm.simulate(scenario.replace(**changes), energy=False).command.values
        changes["command"] = {"samples": {"times": inputs["time"].tolist(), "values": inputs["command"].tolist()}}
    inputs["load_torque"] = np.zeros(POINTS)
    return scenario.replace(**changes), inputs


def write_csv(path: Path, columns: Mapping[str, np.ndarray]) -> None:
    """The columns with a header of their names."""
    path.write_text(table_csv(columns, zip(*(c.tolist() for c in columns.values()), strict=True)))


def write_model(directory: Path, model: str, name: str) -> None:
    """All files of one model in its directory."""
    directory.mkdir(parents=True, exist_ok=True)
    scenario = lm.load(name)
    assert isinstance(scenario, lm.Scenario)
    drive, inputs = with_lines(scenario)
    found = lm.simulate(drive, energy=False)
    lm.export_fmu(drive, directory / f"{model}.fmu")
    write_csv(directory / f"{model}_in.csv", inputs)
    outputs = ("motor_speed", "load_speed", "load_angle", "twist", "output_torque")
    write_csv(directory / f"{model}_ref.csv", {"time": found.time.values} | {o: found[o].values for o in outputs})
    step = drive.simulation.sample_interval
    options = {"StartTime": 0.0, "StopTime": drive.simulation.duration, "StepSize": step, "RelTol": 1e-6}
    (directory / f"{model}_ref.opt").write_text("".join(f"{key}, {value}\n" for key, value in options.items()))
    words = {"title": scenario.title, "version": version("lostmotion"), "model": model}
    (directory / "README.md").write_text(README.format(**words))


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("directory", type=Path)
    directory = parser.parse_args().directory
    for model, name in MODELS.items():
        to, exchange = (
            directory / "2.0" / interface / PLATFORM / "lostmotion" / version("lostmotion") / model
            for interface in ("cs", "me")
        )
        write_model(to, model, name)
        shutil.copytree(to, exchange, dirs_exist_ok=True)
        print(to, exchange, sep="\n")


if __name__ == "__main__":
    main()
