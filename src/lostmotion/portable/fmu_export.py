"""Functional mock-up units: a scenario as a component of Simulink, Modelica tools and others (fmi-standard.org)."""

from __future__ import annotations

import hashlib
import json
import re
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..atomic_writer import write_whole
from ..errors import InputError
from ..inputs.argument_checks import checked
from ..inputs.quantities import Count
from ..inputs.refusal_messages import did_you_mean, shown
from ..model.train import DriveTrain
from ..simulation.runs.results import variables_of
from ..simulation.runs.run import run
from ..simulation.scenario.requirements import need_no_impacts
from ..simulation.scenario.scenario import Scenario
from ..simulation.variables_of_trains import axis_variables
from .checkout import made_here
from .dependencies import dependencies_of
from .derivation import Parameter, derivation_of
from .fmu_sources import source_files
from .fmu_variables import Declared, Model, page
from .model_description import model_description, terminals
from .scenario_as_numbers import kernel_of, numbers_of, written

# Directories and extensions of the libraries in an FMU, by the names that the builds have here.
# FMI 2.0 leaves those beside x86-64 to the tools; these are the names of FMI 3.0.
_ENDINGS = {"linux": "so", "windows": "dll", "darwin": "dylib"}
_FMI_3 = {
    f"{cpu}-{system}": (f"{cpu}-{system}", end) for cpu in ("x86_64", "aarch64") for system, end in _ENDINGS.items()
}
_FMI_2 = {"x86_64-linux": ("linux64", "so"), "x86_64-windows": ("win64", "dll"), "x86_64-darwin": ("darwin64", "dylib")}
PLATFORMS: Mapping[int, Mapping[str, tuple[str, str]]] = {2: _FMI_3 | _FMI_2, 3: _FMI_3}
LIBRARIES = Path(__file__).parents[1] / "fmu_libraries"


@checked
def export_fmu(
    scenario: Scenario,
    path: str | Path,
    *,
    fmi: Count = 2,
    controllers: bool = True,
    references: bool = False,
    source: bool = False,
    motion_inputs: Sequence[str] = (),
    libraries: str | Path | None = None,
) -> dict[str, str]:
    """Write a scenario as an FMU for Co-Simulation and Model Exchange. No compiler is needed.

    The inputs of the FMU are commands, load torques and references of continuous controllers; sampled controllers are inside. Its
    outputs are the result variables, and its parameters are the values of the scenario by their keys. The FMU is for Co-Simulation
    alone with field-oriented control, or if the scenario itself has no run.

    Parameters
    ----------
    scenario : Scenario
        The drive. Each input follows its signal in the scenario until the importer sets that input.
    path : str or Path
        File to write, with the extension ``.fmu``.
    fmi : int
        Version of the standard: 2 for FMI 2.0, 3 for FMI 3.0.
    controllers : bool
        Whether to include the controllers. Without them the commands of their motors are inputs.
    references : bool
        Whether the references of sampled controllers are inputs, too, named ``reference`` or ``<motor>_reference``.
    source : bool
        Whether to include the C++ sources, too, for tools and targets that compile FMUs themselves. The model identifier is then the
        name of the file.
    motion_inputs : sequence of str
        Shafts and slides whose position [rad, m], speed and acceleration are inputs: ``<shaft>_given_angle`` (of a slide
        ``<slide>_given_position``), ``<shaft>_given_speed``, ``<shaft>_given_acceleration``. The torque that the motion takes
        is the output ``<shaft>_drive_torque`` or ``<slide>_drive_force``. The FMU is then for Co-Simulation alone, and a drive
        in the short form has the shafts ``motor`` and ``load``.
    libraries : str or Path, optional
        Directory with the libraries of the platforms, as ``make fmu`` builds them. Default: the libraries of this installation.

    Returns
    -------
    dict of str to str
        For each input of the FMU, the key of the scenario whose signal it replaces once it is set.

    Raises
    ------
    InputError
        The scenario cannot be used without Python, a controller requires the past of its reference, there is no library, or the file
        cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import lostmotion as lm
    >>> with TemporaryDirectory() as folder:
    ...     inputs = lm.export_fmu(lm.load("paper-2dof-nl-small"), Path(folder, "drive.fmu"))
    >>> inputs
    {'command': 'command', 'load_torque': 'load.torque'}
    """
    path = Path(path)
    if path.suffix != ".fmu":
        raise InputError(f"{path}: must end in .fmu")
    if fmi not in PLATFORMS:
        raise InputError(f"fmi: {fmi} must be 2 (FMI 2.0) or 3 (FMI 3.0)")
    _check_scenario(scenario)
    if not controllers:
        scenario = scenario.without_controllers()
    if motion_inputs:
        scenario = _with_given(scenario.long(), motion_inputs)
    if references:
        _check_references(scenario)
    if libraries is None:
        made_here("fmu-library", LIBRARIES.glob("*/all.*"), "the library of FMUs for this platform")
    directory, kernel = LIBRARIES if libraries is None else Path(libraries), kernel_of(scenario)
    identifier = re.sub(r"\W", "_", f"_{path.stem}" if path.stem[:1].isdigit() else path.stem, flags=re.ASCII)
    identifier = identifier if source else "lostmotion"
    binaries = _libraries(directory, PLATFORMS[fmi], kernel, identifier)
    derivation = derivation_of(scenario, numbers_of, lambda key: _of_signals(scenario, key, references))
    description = written(scenario, derivation)
    resource = description.astype("<f8").tobytes()
    model = _model(
        scenario, derivation.parameters, hashlib.sha256(resource).hexdigest()[:32], references, motion_inputs
    )
    model = replace(model, identifier=identifier, has_sources=source)
    sources: dict[str, str] = {}
    if source:
        sources = dict(source_files(directory / "sources", fmi, kernel, identifier, description, model.names()))
    icon = (files("lostmotion") / "portable" / "icon.png").read_bytes()

    def write(to: Path) -> None:
        with zipfile.ZipFile(to, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("modelDescription.xml", model_description(model, fmi))
            archive.writestr("resources/scenario.bin", resource)
            archive.writestr("resources/names.txt", model.names())
            archive.writestr("documentation/index.html", page(model))
            if fmi == 2:
                archive.writestr("model.png", icon)
            else:
                archive.writestr("terminalsAndIcons/terminalsAndIcons.xml", terminals(scenario.train(), model))
                archive.writestr("terminalsAndIcons/icon.png", icon)
            for name, content in binaries.items():
                archive.writestr(f"binaries/{name}", content)
            for name, text in sources.items():
                archive.writestr(f"sources/{name}", text)

    write_whole(path, write)
    return {v.name: scenario.input_key(v.name) for v in model.inputs}


def _libraries(directory: Any, places: Mapping[str, tuple[str, str]], kernel: str, identifier: str) -> dict[str, bytes]:
    """The libraries that there are, by their places in an FMU: with its kernel alone, or as installed from source with all."""
    found = {}
    for platform, (place, extension) in places.items():
        files_of = (directory / platform / f"{name}.{extension}" for name in (kernel, "all"))
        if (library := next((file for file in files_of if file.is_file()), None)) is not None:
            found[f"{place}/{identifier}.{extension}"] = library.read_bytes()
    if not found:
        raise InputError(
            f"{directory}: has no library of an FMU; install a wheel, or build it in a checkout by `make fmu-library`"
        )
    return found


def _with_given(scenario: Scenario, names: Sequence[str]) -> Scenario:
    """The scenario with the motions of these shafts and slides given: where they are not, by their speed at t = 0."""
    start, known = scenario.start(), {**scenario.shafts, **scenario.slides}
    changes: dict[str, Any] = {}
    for name in names:
        if name not in known:
            meant = did_you_mean(name, known, f"there are {', '.join(known)}")
            raise InputError(f"motion_inputs: {shown(name)} is no shaft and no slide; {meant}")
        if name in scenario.given():
            continue
        table = "slides" if name in scenario.slides else "shafts"
        changes[f"{table}.{name}.speed"] = {"mean": start.get(scenario.train().variable(name, "speed"), 0.0)}
        for key in ("speeds", "slide_speeds"):
            own = changes.get(f"initial.{key}", getattr(scenario.initial, key))
            changes[f"initial.{key}"] = {shaft: speed for shaft, speed in own.items() if shaft != name}
    return scenario.replace(**changes) if changes else scenario


def _check_scenario(scenario: Scenario) -> None:
    """Refuse a title that XML cannot hold, and impacts."""
    if any(ord(letter) < 32 and letter not in "\t\n\r" for letter in scenario.title or ""):
        raise InputError(
            f"title: {scenario.title!r} holds a control character, which modelDescription.xml cannot; remove it"
        )
    need_no_impacts(scenario, "fmu")


def _check_references(scenario: Scenario) -> None:
    """Whether the references of sampled controllers can be inputs."""
    for motor, controller in scenario.axes().items():
        if controller.position is not None and controller.position.reference_delay > 0.0:
            raise InputError(
                f"controller of {motor}: has a position.reference_delay, for which it has to know the past of its reference; "
                "set it to 0, or leave the references inside"
            )


def _of_signals(scenario: Scenario, key: str, references: bool) -> bool:
    """Whether a key belongs to a signal, which in an FMU the importer gives."""
    parts = key.split(".")
    # Of the command of a brake or a clutch: what the importer gives acts at once.
    delay = parts[0] in ("brakes", "clutches") and parts[-1] in ("engagement_delay", "release_delay")
    followed = [*(scenario.axes() if references else ()), *scenario.continuous()]
    signals = {f"{scenario.controller_key(motor)}.reference" for motor in followed}
    signals |= {*scenario.input_keys().values(), *(scenario.given_key(name) for name in scenario.given())}
    return delay or any(key == signal or key.startswith(f"{signal}.") for signal in signals)


def _reference(scenario: Scenario, prefix: str, kind: str) -> tuple[str, str]:
    """Unit and meaning of what a controller is to follow, as of the core."""
    motor, position = scenario.sliding().get(prefix, (False, False))
    found = {
        "position": ("m", "position") if position else ("rad", "angle"),
        "speed": ("m/s" if position else "rad/s", "speed"),
        "torque": ("N", "force of the motor") if motor else ("N*m", "torque of the motor"),
    }
    unit, what = found[kind]
    return unit, f"{what} that {'is to act' if kind == 'torque' else 'the controller is to follow'}"


def _model(
    scenario: Scenario, parameters: tuple[Parameter, ...], guid: str, references_given: bool, motions: Sequence[str]
) -> Model:
    """Content of modelDescription.xml."""
    core, signals, axes = scenario.core(), scenario.signals(), scenario.by_prefix()
    shown = {v.name for v in axis_variables(axes)}
    train, start = scenario.train(), scenario.start()
    controlled = {train.variable(motor, "command") for motor in scenario.axes()}
    names, variables = core.input_names(), variables_of(scenario)
    sizes, states = _sizes(scenario)
    inputs = [name for name in names if name not in controlled]
    # From tick to tick, or from one switching to the next. Where there is no contact, its variable follows a sign.
    held = controlled | shown | set(core.contact_names())
    by_name = {v.name: Declared(v.name, v.unit, v.meaning, sizes.get(v.name, 0.0), v.name in held) for v in variables}
    for shaft in scenario.given():
        by_name |= {v.name: v for v in _given_motion(train, shaft)}
    positions = _positions(train, motions, by_name)
    windings = any(c.current.kind == "field_oriented" for c in axes.values())
    exchanged = () if windings or positions else states
    of_states = [by_name.get(s) or Declared(s, "1", "state of a controller", 0.0) for s in exchanged]
    given = {train.variable(motor, "reference"): c for motor, c in scenario.axes().items() if references_given}
    references = [
        Declared(name, *_reference(scenario, name.removesuffix("reference"), c.reference.kind), 0.0)
        for name, c in given.items()
    ]
    return Model(
        title=scenario.title or "drive",
        guid=guid,
        duration=scenario.simulation.duration,
        step=scenario.simulation.sample_interval,
        inputs=[
            replace(v, meaning=f"{v.meaning}; until it is set: {scenario.input_key(v.name)} of the scenario")
            for v in (
                *(by_name[name] for name in inputs),
                *references,
                *(_given_position(train, shaft) for shaft in positions),
            )
        ],
        starts=[
            *(signals[name].at_start() for name in inputs),
            *(float(c.reference.at(0.0)[0]) for c in given.values()),
            *(float(start.get(name, 0.0)) for name in positions.values()),
        ],
        # The quotient of two outputs is undefined while the drive stands, which no tool expects.
        outputs=[v for name, v in by_name.items() if name not in inputs and name != "efficiency"],
        # With a hundredth of their size: integrators take their absolute tolerance from there, and small speeds decide
        # the motion after a standstill.
        states=[replace(v, size=v.size / 100.0) for v in of_states],
        state_starts=[float(start.get(v.name, 0.0)) for v in of_states],
        indicators=core.guards(),  # those beyond the guards of a regime are 1
        parameters=list(parameters),
        references_given=references_given,
        positions=positions,
        dependencies=dependencies_of(scenario, states, inputs),
        note=scenario.note(),
    )


def _positions(train: DriveTrain, shafts: Sequence[str], variables: Mapping[str, Declared]) -> dict[str, str]:
    """The variables of the positions of these shafts."""
    found = {shaft: train.variable(shaft, "angle") for shaft in shafts}
    for shaft, name in found.items():
        if name not in variables:
            raise InputError(
                f"motion_inputs: the angle of {shaft} is no variable of this train; give its motion as a speed of the scenario"
            )
    return found


def _given_motion(train: DriveTrain, shaft: str) -> tuple[Declared, Declared]:
    """The inputs that give the motion of a shaft or a slide."""
    kind, unit = "slide" if train.is_slide(shaft) else "shaft", train.speed_unit(shaft)
    speed, acceleration = (train.variable(shaft, f"given_{what}") for what in ("speed", "acceleration"))
    return (
        Declared(speed, unit, f"speed that the {kind} has at the start of a step", 0.0),
        Declared(acceleration, f"{unit}^2", f"acceleration that the {kind} has", 0.0),
    )


def _given_position(train: DriveTrain, shaft: str) -> Declared:
    """The input that gives its position beside these."""
    meaning = "position that the slide has" if train.is_slide(shaft) else "angle that the shaft has"
    return Declared(train.variable(shaft, "given_angle"), train.angle_unit(shaft), meaning, 0.0)


def _sizes(scenario: Scenario) -> tuple[dict[str, float], list[str]]:
    """The largest magnitudes of the variables in a run of the scenario, and its states; nothing if it has none."""
    try:
        result = run(scenario, energy=False)
    except (_core.SolverError, InputError):
        return {}, []
    largest = {name: float(np.max(np.abs(values), initial=0.0)) for name, values in result.values.items()}
    states = [name for name in json.loads(result.attrs["end_state"]) if not name.endswith("hysteresis_capacity")]
    return {name: size for name, size in largest.items() if np.isfinite(size)}, states
