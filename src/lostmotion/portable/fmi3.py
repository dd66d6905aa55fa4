"""modelDescription.xml of FMI 3.0, and its terminals and icon."""

from __future__ import annotations

from itertools import repeat
from xml.etree import ElementTree as ET

from ..model.train import DriveTrain
from .fmu_model import (
    FIRST_DERIVATIVE,
    FIRST_INDICATOR,
    FIRST_INPUT,
    FIRST_INPUT_RATE,
    FIRST_OUTPUT,
    FIRST_PARAMETER,
    FIRST_STATE,
    Model,
    add_default_experiment,
    add_log_categories,
    add_units,
    document,
    generation_tool,
    is_of_start,
    parameter_meaning,
    parameter_range,
    rate_unit,
)


def model_description(model: Model) -> bytes:
    """The file."""
    root = ET.Element(
        "fmiModelDescription",
        fmiVersion="3.0",
        modelName=model.title,
        instantiationToken=model.guid,
        generationTool=generation_tool(),
        variableNamingConvention="flat",
    )
    both = {
        "modelIdentifier": model.identifier,
        "canGetAndSetFMUState": "true",
        "canSerializeFMUState": "true",
        "providesDirectionalDerivatives": "true",
    }
    if model.states:
        ET.SubElement(root, "ModelExchange", both | {"needsCompletedIntegratorStep": "true"})
    ET.SubElement(root, "CoSimulation", both | {"canHandleVariableCommunicationStepSize": "true"})
    add_units(root, model, input_rates=True)
    add_log_categories(root)
    add_default_experiment(root, model)
    _add_variables(ET.SubElement(root, "ModelVariables"), model)
    _add_structure(ET.SubElement(root, "ModelStructure"), model)
    return document(root)


def _add_structure(structure: ET.Element, model: Model) -> None:
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
    of_outputs, of_derivatives = (
        [needed(v.name) for v in model.outputs],
        [needed(f"der({v.name})") for v in model.states],
    )
    for name, listed, dependencies in (
        ("Output", outputs, of_outputs),
        ("ContinuousStateDerivative", derivatives, of_derivatives),
        ("InitialUnknown", [*outputs, *states, *derivatives], repeat(start)),
        ("EventIndicator", indicators, repeat(known)),
    ):
        for reference, those in zip(listed, dependencies, strict=False):
            text = " ".join(map(str, those))
            ET.SubElement(structure, name, valueReference=str(reference), dependencies=text)


def _add_variables(variables: ET.Element, model: Model) -> None:
    def add(name: str, reference: int, meaning: str, unit: str, **attributes: str) -> None:
        named = {"name": name, "valueReference": str(reference), "description": meaning}
        ET.SubElement(variables, "Float64", named | attributes | {"unit": unit})

    add("time", 0, "time", "s", causality="independent", variability="continuous")
    for k, (v, start) in enumerate(zip(model.inputs, model.starts, strict=True)):
        add(v.name, FIRST_INPUT + k, v.meaning, v.unit, causality="input", start=repr(start), **v.nominal)
    for k, v in enumerate(model.inputs):
        meaning = f"time derivative of {v.name} over the next communication step; without meaning in Model Exchange"
        add(f"der({v.name})", FIRST_INPUT_RATE + k, meaning, rate_unit(v.unit), causality="input", start="0")
    for k, v in enumerate(model.outputs):
        kind = {"variability": "discrete"} if v.discrete else {}
        add(v.name, FIRST_OUTPUT + k, v.meaning, v.unit, causality="output", initial="calculated", **kind, **v.nominal)
    local = {"causality": "local", "initial": "calculated"}
    for k, (v, start) in enumerate(zip(model.states, model.state_starts, strict=True)):
        kind = {"causality": "local", "initial": "approx", "start": repr(start)}
        add(f"state.{v.name}", FIRST_STATE + k, f"continuous state: {v.meaning}", v.unit, **kind, **v.nominal)
    for k, v in enumerate(model.states):
        meaning, attributes = f"time derivative of state.{v.name}", {"derivative": str(FIRST_STATE + k)}
        add(f"der(state.{v.name})", FIRST_DERIVATIVE + k, meaning, rate_unit(v.unit), **local, **attributes)
    for k in range(model.indicators if model.states else 0):
        meaning = "positive while the contacts stay as they are"
        add(f"event_indicator.{k}", FIRST_INDICATOR + k, meaning, "1", **local)
    for k, p in enumerate(model.parameters):
        kind = {"causality": "parameter", "variability": "fixed" if is_of_start(p) else "tunable", "initial": "exact"}
        kind |= parameter_range(p) | {"start": repr(p.value)}
        add(p.key, FIRST_PARAMETER + k, parameter_meaning(p), p.unit, **kind)


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
