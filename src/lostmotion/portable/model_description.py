"""modelDescription.xml of FMI 2.0 and FMI 3.0, and the terminals and icon of FMI 3.0."""

from itertools import repeat
from xml.etree import ElementTree as ET

from ..model.train import DriveTrain
from ..simulation.runs.results import installed_version
from .fmu_sources import SOURCES
from .fmu_variables import (
    FIRST_DERIVATIVE,
    FIRST_INDICATOR,
    FIRST_INPUT,
    FIRST_INPUT_RATE,
    FIRST_OUTPUT,
    FIRST_PARAMETER,
    FIRST_STATE,
    Model,
    add_units,
    document,
    is_of_start,
    parameter_meaning,
    parameter_range,
    rate_unit,
)

TOLERANCE = "1e-8"  # relative, of integrators in Model Exchange


def model_description(model: Model, fmi: int) -> bytes:
    """The file, of version 2 or 3 of the standard."""
    about = {"fmiVersion": f"{fmi}.0", "modelName": model.title}
    about |= {"generationTool": f"lostmotion {installed_version()}", "variableNamingConvention": "flat"}
    exchange, simulation = ["providesDirectionalDerivative"], ["canHandleVariableCommunicationStepSize"]
    if fmi == 2:
        about |= {"guid": model.guid, "numberOfEventIndicators": str(model.indicators if model.states else 0)}
        can = ("canNotUseMemoryManagementFunctions", "canGetAndSetFMUstate", "canSerializeFMUstate")
        simulation += ["canInterpolateInputs", "providesDirectionalDerivative"]
    else:
        about |= {"instantiationToken": model.guid}
        can = ("canGetAndSetFMUState", "canSerializeFMUState", "providesDirectionalDerivatives")
        exchange = ["needsCompletedIntegratorStep"]
    root = ET.Element("fmiModelDescription", about)
    both = {"modelIdentifier": model.identifier} | dict.fromkeys(can, "true")
    if model.states:
        ET.SubElement(root, "ModelExchange", both | dict.fromkeys(exchange, "true"))
    ET.SubElement(root, "CoSimulation", both | dict.fromkeys(simulation, "true"))
    for kind in root if model.has_sources and fmi == 2 else ():
        sources = ET.SubElement(kind, "SourceFiles")
        for name in SOURCES:
            ET.SubElement(sources, "File", name=name)
    add_units(root, model, input_rates=fmi == 3)
    categories = ET.SubElement(root, "LogCategories")
    for name in ("logStatusError", "logStatusDiscard"):
        ET.SubElement(categories, "Category", name=name)
    times = {"startTime": "0", "stopTime": repr(model.duration), "stepSize": repr(model.step)}
    ET.SubElement(root, "DefaultExperiment", times | {"tolerance": TOLERANCE})
    variables = ET.SubElement(root, "ModelVariables")
    _add_variables(variables, model, fmi)
    structure = ET.SubElement(root, "ModelStructure")
    if fmi == 2:
        _add_structure_2(structure, model, {v.get("name", ""): str(k) for k, v in enumerate(variables, start=1)})
    else:
        _add_structure_3(structure, model)
    return document(root)


def _add_variables(variables: ET.Element, model: Model, fmi: int) -> None:
    def add(name: str, reference: int, meaning: str, real: dict[str, str], *, change: str = "", **more: str) -> None:
        named = {"name": name, "valueReference": str(reference), "description": meaning} | more
        named |= {"variability": change or "continuous"} if change or fmi == 2 else {}
        if fmi == 2:
            ET.SubElement(ET.SubElement(variables, "ScalarVariable", named), "Real", real)
        else:
            ET.SubElement(variables, "Float64", named | real)

    add("time", 0, "time", {"unit": "s"}, causality="independent", change="continuous")
    for k, (v, start) in enumerate(zip(model.inputs, model.starts, strict=True)):
        real = {"unit": v.unit} | v.nominal | {"start": repr(start)}
        add(v.name, FIRST_INPUT + k, v.meaning, real, causality="input")
    for k, v in enumerate(model.inputs if fmi == 3 else ()):
        meaning = f"time derivative of {v.name} over the next communication step; without meaning in Model Exchange"
        real = {"unit": rate_unit(v.unit), "start": "0"}
        add(f"der({v.name})", FIRST_INPUT_RATE + k, meaning, real, causality="input")
    for k, v in enumerate(model.outputs):
        real, change = {"unit": v.unit} | v.nominal, "discrete" if v.discrete else ""
        add(v.name, FIRST_OUTPUT + k, v.meaning, real, causality="output", initial="calculated", change=change)
    first = 2 + len(model.inputs) + len(model.outputs)  # place of the first state
    for k, (v, start) in enumerate(zip(model.states, model.state_starts, strict=True)):
        meaning, real = f"continuous state: {v.meaning}", {"unit": v.unit} | v.nominal | {"start": repr(start)}
        add(f"state.{v.name}", FIRST_STATE + k, meaning, real, causality="local", initial="approx")
    local = {"causality": "local", "initial": "calculated"}
    for k, v in enumerate(model.states):
        real = {"unit": rate_unit(v.unit), "derivative": str((first if fmi == 2 else FIRST_STATE) + k)}
        add(f"der(state.{v.name})", FIRST_DERIVATIVE + k, f"time derivative of state.{v.name}", real, **local)
    for k in range(model.indicators if model.states and fmi == 3 else 0):
        meaning = "positive while the contacts stay as they are"
        add(f"event_indicator.{k}", FIRST_INDICATOR + k, meaning, {"unit": "1"}, **local)
    for k, p in enumerate(model.parameters):
        real, change = {"unit": p.unit} | parameter_range(p), "fixed" if is_of_start(p) else "tunable"
        real |= {"start": repr(p.value)}
        meaning = parameter_meaning(p)
        add(p.key, FIRST_PARAMETER + k, meaning, real, causality="parameter", initial="exact", change=change)


def _add_structure_2(structure: ET.Element, model: Model, places: dict[str, str]) -> None:
    outputs = {places[v.name]: v.name for v in model.outputs}
    derivatives = {places[f"der(state.{v.name})"]: f"der({v.name})" for v in model.states}
    of_states = {v.name: places[f"state.{v.name}"] for v in model.states}
    known = {v.name: places[v.name] for v in model.inputs} | of_states
    unknown = dict.fromkeys([*outputs, *of_states.values(), *derivatives], "")
    for kind, listed in (("Outputs", outputs), ("Derivatives", derivatives), ("InitialUnknowns", unknown)):
        element = ET.SubElement(structure, kind) if listed else structure
        for index, name in listed.items():
            needed = " ".join(known[n] for n in model.known(name) if n in known)
            ET.SubElement(element, "Unknown", {"index": index} | ({"dependencies": needed} if name else {}))


def _add_structure_3(structure: ET.Element, model: Model) -> None:
    outputs = [FIRST_OUTPUT + k for k in range(len(model.outputs))]
    states = [FIRST_STATE + k for k in range(len(model.states))]
    derivatives = [FIRST_DERIVATIVE + k for k in range(len(model.states))]
    indicators = [FIRST_INDICATOR + k for k in range(model.indicators if model.states else 0)]
    # Inputs that are not set follow signals of the scenario, which depend on time.
    places = {v.name: FIRST_INPUT + k for k, v in enumerate(model.inputs)}
    on_inputs = frozenset(places)
    places |= {v.name: FIRST_STATE + k for k, v in enumerate(model.states)}

    def needed(unknown: str) -> list[int]:
        names = model.known(unknown)
        return ([0] if on_inputs & {*names} else []) + [places[name] for name in names if name in places]

    known = [0, *places.values()]
    start = [*known[: 1 + len(model.inputs)], *(FIRST_PARAMETER + k for k in range(len(model.parameters)))]
    for name, listed, dependencies in (
        ("Output", outputs, (needed(v.name) for v in model.outputs)),
        ("ContinuousStateDerivative", derivatives, (needed(f"der({v.name})") for v in model.states)),
        ("InitialUnknown", [*outputs, *states, *derivatives], repeat(start)),
        ("EventIndicator", indicators, repeat(known)),
    ):
        for reference, those in zip(listed, dependencies, strict=False):
            text = " ".join(map(str, those))
            ET.SubElement(structure, name, valueReference=str(reference), dependencies=text)


def terminals(train: DriveTrain, model: Model) -> bytes:
    """terminalsAndIcons.xml: a terminal for each shaft or slide that a load acts on, and one for all commands and references."""
    root = ET.Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    graphics = ET.SubElement(root, "GraphicalRepresentation")
    corners = {"x1": "-100", "y1": "-100", "x2": "100", "y2": "100"}
    ET.SubElement(graphics, "CoordinateSystem", corners | {"suggestedScalingFactorTo_mm": "0.1"})
    ET.SubElement(graphics, "Icon", corners)
    listed = ET.SubElement(root, "Terminals")
    outputs = {v.name for v in model.outputs}
    loads = {v.name: shaft for v in model.inputs if (shaft := train.shaft_of(v.name, "load_torque"))}
    for load, shaft in loads.items():
        slide = train.is_slide(shaft)
        moved = {
            m: train.variable(shaft, quantity)
            for m, quantity in (("speed", "speed"), ("position" if slide else "angle", "angle"))
        }
        members = {train.torque_word(shaft): load} | {m: v for m, v in moved.items() if v in outputs}
        _add_terminal(listed, f"{shaft}_{'slide' if slide else 'shaft'}", members)
    if signals := {v.name: v.name for v in model.inputs if v.name not in loads}:
        _add_terminal(listed, "commands", signals)
    if not len(listed):
        root.remove(listed)
    return document(root)


def _add_terminal(listed: ET.Element, name: str, members: dict[str, str]) -> None:
    terminal = ET.SubElement(listed, "Terminal", name=name, matchingRule="bus")
    for member, variable in members.items():
        ET.SubElement(
            terminal, "TerminalMemberVariable", variableName=variable, memberName=member, variableKind="signal"
        )
