"""Functional mock-up units: a scenario as a component of Simulink, Modelica tools and others (fmi-standard.org)."""

from __future__ import annotations

import hashlib
import math
import zipfile
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..atomic_writer import write_whole
from ..errors import InputError
from ..inputs.arguments import checked
from ..model.signals import CommandSignal, Signal
from ..simulation.run import run
from ..simulation.scenario import Scenario
from ..simulation.train_scenario import TrainScenario
from ..simulation.train_variables import axis_variables, train_variables
from ..simulation.variables import VARIABLES
from .description import numbers_of
from .fmu_model import Declared, Model, model_description, page
from .parameters import Parameter, parameters_of

# Directories of the libraries in an FMU, by the names that the builds have here.
PLATFORMS: Mapping[str, Mapping[str, str]] = {
    "2.0": {
        "x86_64-linux": "linux64/lostmotion.so",
        "x86_64-windows": "win64/lostmotion.dll",
        "x86_64-darwin": "darwin64/lostmotion.dylib",
    }
}
LIBRARIES = files("lostmotion") / "fmu_libraries"


@checked
def export_fmu(
    scenario: Scenario | TrainScenario,
    path: str | Path,
    *,
    controllers: bool = True,
    libraries: str | Path | None = None,
) -> None:
    """Write a scenario as an FMU of FMI 2.0 for Co-Simulation, which no compiler is needed for.

    Its inputs are the commands, load torques and references of continuous controllers; sampled controllers are inside, with
    their references. Its outputs are the result variables, its parameters the values of the scenario by their keys.

    Parameters
    ----------
    scenario
        Its signals give the inputs their values at t = 0 only; from then on the importer gives them.
    path
        Of the file, with the extension ``.fmu``.
    controllers
        False: without them, so that the commands of their motors are inputs.
    libraries
        Directory with the libraries of the platforms, as ``make fmu`` builds them; default those of this installation.

    Raises
    ------
    InputError
        The scenario cannot be used without Python, there is no library, or the file cannot be written.
    """
    path = Path(path)
    if path.suffix != ".fmu":
        raise InputError(f"{path}: must end in .fmu")
    if not controllers:
        scenario = without_controllers(scenario)
    binaries = _libraries(LIBRARIES if libraries is None else Path(libraries), PLATFORMS["2.0"])
    parameters = tuple(p for p in parameters_of(scenario, numbers_of).parameters if not _of_signals(scenario, p.key))
    values = [
        (p.key, p.unit, p.value, [(e.place, e.reciprocal, e.offset, e.slope) for e in p.effects]) for p in parameters
    ]
    resource = np.array(_core.write_description(numbers_of(scenario).tolist(), values)).astype("<f8").tobytes()
    model = _model(scenario, parameters, hashlib.sha256(resource).hexdigest()[:32])

    def write(to: Path) -> None:
        with zipfile.ZipFile(to, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("modelDescription.xml", model_description(model))
            archive.writestr("resources/scenario.bin", resource)
            archive.writestr("resources/names.txt", names_of(model))
            archive.writestr("documentation/index.html", page(model))
            for name, content in binaries.items():
                archive.writestr(f"binaries/{name}", content)

    write_whole(path, write)


def names_of(model: Model) -> str:
    """What the library reads to know which variable has which value reference."""
    inputs = [f"input {v.name}\n" for v in model.inputs]
    outputs = [f"output {v.name}\n" for v in model.outputs]
    return "".join([f"{model.guid}\n", *inputs, *outputs])


def without_controllers(scenario: Scenario | TrainScenario) -> Scenario | TrainScenario:
    """The scenario with its motors turned by commands of 0."""
    if isinstance(scenario, Scenario):
        return scenario.replace(controller=None)
    commands = {name: CommandSignal() for name in scenario.controllers}
    return scenario.replace(controllers={}, command={**scenario.command, **commands})


def _libraries(directory: Any, places: Mapping[str, str]) -> dict[str, bytes]:
    """The libraries that there are, by their places in an FMU."""
    found = {}
    for platform, place in places.items():
        file = directory / platform / place.rpartition("/")[2]
        if file.is_file():
            found[place] = file.read_bytes()
    if not found:
        raise InputError(
            f"{directory}: has no library of an FMU; build them by `make fmu`, or install a wheel that has them"
        )
    return found


def _of_signals(scenario: Scenario | TrainScenario, key: str) -> bool:
    """Whether a key is that of a signal, which in an FMU the importer gives."""
    parts = key.split(".")
    if isinstance(scenario, Scenario):
        return parts[0] == "command" or parts[:2] == ["load", "torque"]
    of_shaft = parts[0] == "shafts" and parts[2:3] == ["torque"]
    continuous = parts[0] == "controllers" and parts[1] in scenario.continuous() and parts[2] == "reference"
    return parts[0] == "command" or of_shaft or continuous


def _model(scenario: Scenario | TrainScenario, parameters: tuple[Parameter, ...], guid: str) -> Model:
    """What modelDescription.xml says."""
    signals: Mapping[str, Signal[Any]]
    if isinstance(scenario, TrainScenario):
        core = scenario.core()
        variables = (*train_variables(scenario.train(), core), *axis_variables(scenario.axes()))
        controlled = {f"{motor}_command" for motor in scenario.axes()}
        names, signals = core.input_names(), scenario.signals()
    else:
        variables = (
            VARIABLES if scenario.controller is None else (*VARIABLES, *axis_variables({"": scenario.controller}))
        )
        controlled = set() if scenario.controller is None else {"command"}
        names, signals = ["command", "load_torque"], {"command": scenario.command, "load_torque": scenario.load.torque}
    sizes = _sizes(scenario)
    inputs = [name for name in names if name not in controlled]
    by_name = {v.name: Declared(v.name, v.unit, v.meaning, sizes.get(v.name, 0.0)) for v in variables}
    return Model(
        title=scenario.title or "drive",
        guid=guid,
        duration=scenario.simulation.duration,
        step=scenario.simulation.sample_interval,
        inputs=[by_name[name] for name in inputs],
        starts=[_at_start(signals[name]) for name in inputs],
        # The quotient of two outputs is undefined while the drive stands, which no tool expects.
        outputs=[v for name, v in by_name.items() if name not in inputs and name != "efficiency"],
        parameters=list(parameters),
        note=scenario.gearbox.note if isinstance(scenario, Scenario) else "",
    )


def _at_start(signal: Signal[Any]) -> float:
    """Its value at t = 0."""
    sines = sum(amplitude * math.sin(phase) for amplitude, _, phase in signal.sine_list())
    return float(signal.breakpoint_list()[0][1]) + sines


def _sizes(scenario: Scenario | TrainScenario) -> dict[str, float]:
    """The largest magnitudes of the variables in a run of the scenario; nothing if it has none."""
    try:
        result = run(scenario, energy=False)
    except (_core.SolverError, InputError):
        return {}
    largest = {name: float(np.max(np.abs(values), initial=0.0)) for name, values in result.values.items()}
    return {name: size for name, size in largest.items() if np.isfinite(size)}
