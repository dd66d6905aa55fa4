"""What the modelDescription.xml of an FMU says, and its page."""

from __future__ import annotations

import html
import math
from collections.abc import Mapping
from dataclasses import dataclass
from xml.etree import ElementTree as ET

from ..simulation.results import installed_version
from ..units.grammar import read_unit
from .parameters import Parameter

# bindings/fmu/instance.hpp has the same.
FIRST_INPUT, FIRST_OUTPUT, FIRST_PARAMETER = 1000, 3000, 10000

# Powers of kg, m, s, A, K, rad.
_BASE = {
    "kilogram": (1, 0, 0, 0, 0, 0),
    "gram": (1, 0, 0, 0, 0, 0),
    "meter": (0, 1, 0, 0, 0, 0),
    "second": (0, 0, 1, 0, 0, 0),
    "ampere": (0, 0, 0, 1, 0, 0),
    "kelvin": (0, 0, 0, 0, 1, 0),
    "degree_Celsius": (0, 0, 0, 0, 1, 0),
    "radian": (0, 0, 0, 0, 0, 1),
    "newton": (1, 1, -2, 0, 0, 0),
    "joule": (1, 2, -2, 0, 0, 0),
    "watt": (1, 2, -3, 0, 0, 0),
    "volt": (1, 2, -3, -1, 0, 0),
    "ohm": (1, 2, -3, -2, 0, 0),
    "henry": (1, 2, -2, -2, 0, 0),
    "hertz": (0, 0, -1, 0, 0, 0),
}
_NAMES = ("kg", "m", "s", "A", "K", "rad")
# Other units of the same quantity: name and how many of it one of the SI unit is.
_DISPLAY = {
    "rad": (("deg", 180.0 / math.pi), ("arcmin", 10800.0 / math.pi), ("mrad", 1e3)),
    "rad/s": (("rpm", 30.0 / math.pi), ("deg/s", 180.0 / math.pi)),
    "s": (("ms", 1e3),),
    "N*m": (("mN*m", 1e3),),
}


@dataclass(frozen=True)
class Declared:
    """A variable."""

    name: str
    unit: str
    meaning: str
    size: float
    """largest magnitude in a run of the scenario, 0 if it is not known"""


@dataclass(frozen=True)
class Model:
    """All that is said of an FMU."""

    title: str
    guid: str
    duration: float
    step: float
    inputs: list[Declared]
    starts: list[float]
    """values of the inputs at t = 0"""
    outputs: list[Declared]
    parameters: list[Parameter]
    note: str


def model_description(model: Model) -> bytes:
    """modelDescription.xml of FMI 2.0."""
    root = ET.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=model.title,
        guid=model.guid,
        generationTool=f"lostmotion {installed_version()}",
        variableNamingConvention="flat",
    )
    ET.SubElement(
        root,
        "CoSimulation",
        modelIdentifier="lostmotion",
        canHandleVariableCommunicationStepSize="true",
        canInterpolateInputs="true",
        canNotUseMemoryManagementFunctions="true",
        canGetAndSetFMUstate="true",
        canSerializeFMUstate="true",
        providesDirectionalDerivative="true",
    )
    units = sorted({v.unit for v in (*model.inputs, *model.outputs)} | {p.unit for p in model.parameters} | {"s"})
    definitions = ET.SubElement(root, "UnitDefinitions")
    for unit in units:
        _add_unit(definitions, unit)
    categories = ET.SubElement(root, "LogCategories")
    ET.SubElement(categories, "Category", name="logStatusError")
    ET.SubElement(categories, "Category", name="logStatusDiscard")
    ET.SubElement(root, "DefaultExperiment", startTime="0", stopTime=repr(model.duration), stepSize=repr(model.step))
    variables = ET.SubElement(root, "ModelVariables")
    _add_variables(variables, model)
    structure = ET.SubElement(root, "ModelStructure")
    first = 2 + len(model.inputs)
    for list_name in ("Outputs", "InitialUnknowns"):
        listed = ET.SubElement(structure, list_name)
        for k in range(len(model.outputs)):
            ET.SubElement(listed, "Unknown", index=str(first + k))
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'.encode()


def _add_unit(definitions: ET.Element, unit: str) -> None:
    element = ET.SubElement(definitions, "Unit", name=unit)
    powers = [0] * len(_NAMES)
    for name, n in _product(unit).items():
        powers = [a + n * b for a, b in zip(powers, _BASE[name], strict=True)]
    ET.SubElement(element, "BaseUnit", {n: str(p) for n, p in zip(_NAMES, powers, strict=True) if p})
    for name, factor in _DISPLAY.get(unit, ()):
        ET.SubElement(element, "DisplayUnit", name=name, factor=repr(factor))


def _product(unit: str) -> Mapping[str, int]:
    """The powers of a unit of a result variable or a key; joule is none that is written in scenario files."""
    if unit in ("1", "J"):
        return {"joule": 1} if unit == "J" else {}
    return read_unit(unit)


def _add_variables(variables: ET.Element, model: Model) -> None:
    def add(name: str, reference: int, meaning: str, real: dict[str, str], **attributes: str) -> None:
        named = {"name": name, "valueReference": str(reference), "description": meaning}
        scalar = ET.SubElement(variables, "ScalarVariable", named | attributes)
        ET.SubElement(scalar, "Real", real)

    add("time", 0, "time", {"unit": "s"}, causality="independent", variability="continuous")
    for k, (v, start) in enumerate(zip(model.inputs, model.starts, strict=True)):
        real = {"unit": v.unit} | _nominal(v) | {"start": repr(start)}
        add(v.name, FIRST_INPUT + k, v.meaning, real, causality="input", variability="continuous")
    for k, v in enumerate(model.outputs):
        discrete = v.name.endswith("contact")
        real = {"unit": v.unit} | ({} if discrete else _nominal(v))
        kind = "discrete" if discrete else "continuous"
        add(v.name, FIRST_OUTPUT + k, v.meaning, real, causality="output", variability=kind, initial="calculated")
    for k, p in enumerate(model.parameters):
        fixed = p.key.startswith("initial.")
        meaning = f"value of the key {p.key}" + (", at t = 0" if fixed else "")
        real = {"unit": p.unit, "start": repr(p.value)}
        kind = "fixed" if fixed else "tunable"
        add(p.key, FIRST_PARAMETER + k, meaning, real, causality="parameter", variability=kind, initial="exact")


def _nominal(v: Declared) -> dict[str, str]:
    return {"nominal": f"{v.size:.3g}"} if v.size > 0.0 else {}


def page(model: Model) -> str:
    """documentation/index.html of an FMU."""

    def table(rows: list[tuple[str, str, str]], heads: tuple[str, str, str]) -> str:
        lines = "".join("<tr>" + "".join(f"<td>{html.escape(c)}</td>" for c in row) + "</tr>" for row in rows)
        return f"<table><tr>{''.join(f'<th>{h}</th>' for h in heads)}</tr>{lines}</table>"

    inputs = [(v.name, v.unit, v.meaning) for v in model.inputs]
    outputs = [(v.name, v.unit, v.meaning) for v in model.outputs]
    parameters = [(p.key, p.unit, repr(p.value)) for p in model.parameters]
    note = f"<p>{html.escape(model.note)}</p>" if model.note else ""
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html.escape(model.title)}</title>'
        "<style>body{font-family:sans-serif;max-width:60em;margin:2em auto;padding:0 1em}table{border-collapse:collapse}"
        "td,th{border:1px solid #999;padding:.2em .6em;text-align:left}</style>"
        f"<h1>{html.escape(model.title)}</h1>{note}"
        "<p>A geared servo drive, solved exactly between communication points: its result does not depend on their distance where "
        "the inputs run in straight lines between them. Give the inputs their time derivatives (fmi2SetRealInputDerivatives); "
        "without these they are held over a step. Values are in SI units.</p>"
        f"<h2>Inputs</h2>{table(inputs, ('name', 'unit', 'meaning'))}"
        f"<h2>Outputs</h2>{table(outputs, ('name', 'unit', 'meaning'))}"
        "<h2>Parameters</h2><p>By their keys in the scenario file. They can be changed between communication points, those of the "
        f"start before the first.</p>{table(parameters, ('key', 'unit', 'value'))}</html>\n"
    )
