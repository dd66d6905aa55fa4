"""modelDescription.xml of FMI 2.0."""

from __future__ import annotations

from xml.etree import ElementTree as ET

from .fmu_model import (
    FIRST_DERIVATIVE,
    FIRST_INPUT,
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
from .fmu_sources import SOURCES

_STATE = {"canGetAndSetFMUstate": "true", "canSerializeFMUstate": "true", "providesDirectionalDerivative": "true"}


def model_description(model: Model) -> bytes:
    """The file."""
    root = ET.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=model.title,
        guid=model.guid,
        generationTool=generation_tool(),
        variableNamingConvention="flat",
        numberOfEventIndicators=str(model.indicators if model.states else 0),
    )
    both = {"modelIdentifier": model.identifier, "canNotUseMemoryManagementFunctions": "true"} | _STATE
    if model.states:
        ET.SubElement(root, "ModelExchange", both)
    ET.SubElement(
        root, "CoSimulation", both | {"canHandleVariableCommunicationStepSize": "true", "canInterpolateInputs": "true"}
    )
    for kind in root if model.has_sources else ():
        sources = ET.SubElement(kind, "SourceFiles")
        for name in SOURCES:
            ET.SubElement(sources, "File", name=name)
    add_units(root, model, input_rates=False)
    add_log_categories(root)
    add_default_experiment(root, model)
    variables = ET.SubElement(root, "ModelVariables")
    _add_variables(variables, model)
    structure = ET.SubElement(root, "ModelStructure")
    places = {v.get("name"): str(k) for k, v in enumerate(variables, start=1)}
    outputs = [places[v.name] for v in model.outputs]
    states = [places[f"state.{v.name}"] for v in model.states]
    derivatives = [places[f"der(state.{v.name})"] for v in model.states]
    known = {v.name: places[v.name] for v in model.inputs} | {v.name: places[f"state.{v.name}"] for v in model.states}
    of_outputs = dict(zip(outputs, (v.name for v in model.outputs), strict=True))
    of_derivatives = dict(zip(derivatives, (f"der({v.name})" for v in model.states), strict=True))
    for name, listed in (
        ("Outputs", of_outputs),
        ("Derivatives", of_derivatives),
        ("InitialUnknowns", dict.fromkeys([*outputs, *states, *derivatives], "")),
    ):
        if not listed:
            continue
        element = ET.SubElement(structure, name)
        for index, unknown in listed.items():
            needed = [known[n] for n in model.known(unknown) if n in known] if unknown else None
            ET.SubElement(
                element, "Unknown", {"index": index} | ({} if needed is None else {"dependencies": " ".join(needed)})
            )
    return document(root)


def _add_variables(variables: ET.Element, model: Model) -> None:
    def add(name: str, reference: int, meaning: str, real: dict[str, str], **attributes: str) -> None:
        named = {"name": name, "valueReference": str(reference), "description": meaning}
        scalar = ET.SubElement(variables, "ScalarVariable", named | attributes)
        ET.SubElement(scalar, "Real", real)

    add("time", 0, "time", {"unit": "s"}, causality="independent", variability="continuous")
    for k, (v, start) in enumerate(zip(model.inputs, model.starts, strict=True)):
        real = {"unit": v.unit} | v.nominal | {"start": repr(start)}
        add(v.name, FIRST_INPUT + k, v.meaning, real, causality="input", variability="continuous")
    for k, v in enumerate(model.outputs):
        real = {"unit": v.unit} | v.nominal
        kind = "discrete" if v.discrete else "continuous"
        add(v.name, FIRST_OUTPUT + k, v.meaning, real, causality="output", variability=kind, initial="calculated")
    local = {"causality": "local", "variability": "continuous", "initial": "calculated"}
    first = 2 + len(model.inputs) + len(model.outputs)
    for k, (v, start) in enumerate(zip(model.states, model.state_starts, strict=True)):
        meaning = f"continuous state: {v.meaning}"
        real = {"unit": v.unit} | v.nominal | {"start": repr(start)}
        add(f"state.{v.name}", FIRST_STATE + k, meaning, real, **local | {"initial": "approx"})
    for k, v in enumerate(model.states):
        real = {"unit": rate_unit(v.unit), "derivative": str(first + k)}
        add(f"der(state.{v.name})", FIRST_DERIVATIVE + k, f"time derivative of state.{v.name}", real, **local)
    for k, p in enumerate(model.parameters):
        real = {"unit": p.unit} | parameter_range(p) | {"start": repr(p.value)}
        kind = "fixed" if is_of_start(p) else "tunable"
        meaning = parameter_meaning(p)
        add(p.key, FIRST_PARAMETER + k, meaning, real, causality="parameter", variability=kind, initial="exact")
