"""Variables that an FMU declares, for all versions of the standard, their units, and its page."""

import html
import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from xml.etree import ElementTree as ET

from ..units.grammar import read_si
from ..units.unit_table import powers_of
from .derivation import Parameter

# bindings/fmu/variables.hpp has the same.
FIRST_INPUT, FIRST_INPUT_RATE, FIRST_OUTPUT, FIRST_STATE, FIRST_DERIVATIVE = 1000, 2000, 3000, 5000, 6000
FIRST_INDICATOR, FIRST_PARAMETER = 7000, 1_000_000

_BASES = ("kg", "m", "s", "A", "K", "rad")
# Other units of the same quantity: name and how many of it one of the SI unit is.
_DISPLAY = {
    "rad": (("deg", 180.0 / math.pi), ("arcmin", 10800.0 / math.pi), ("mrad", 1e3)),
    "rad/s": (("rpm", 30.0 / math.pi), ("deg/s", 180.0 / math.pi)),
    "m": (("mm", 1e3), ("µm", 1e6)),
    "m/s": (("mm/s", 1e3),),
    "s": (("ms", 1e3),),
    "N*m": (("mN*m", 1e3),),
}


@dataclass(frozen=True)
class Declared:
    """A variable."""

    name: str
    unit: str
    meaning: str
    size: float  # largest magnitude in a run of the scenario, 0 if it is not known
    discrete: bool = False  # whether it changes at events alone

    @property
    def decade(self) -> int:
        """The power of ten nearest to its size."""
        return round(math.log10(self.size)) if self.size > 0.0 else 0

    @property
    def nominal(self) -> dict[str, str]:
        """The attribute of this name, if the size is known."""
        return {"nominal": f"1e{self.decade}"} if self.size > 0.0 and not self.discrete else {}


@dataclass(frozen=True)
class Model:
    """Description of the model in an FMU."""

    title: str
    guid: str
    duration: float
    step: float
    inputs: list[Declared]
    starts: list[float]  # values of the inputs at t = 0
    outputs: list[Declared]
    states: list[Declared]  # states of Model Exchange; empty: the FMU is for Co-Simulation alone
    state_starts: list[float]  # values of the states at t = 0
    indicators: int  # number of event indicators
    parameters: list[Parameter]
    references_given: bool  # whether the references of sampled controllers are inputs
    positions: Mapping[str, str]  # shafts whose position is an input, the last of these, with its variable
    dependencies: Mapping[str, list[str]]
    """inputs and states that outputs and derivatives, as ``der(NAME)``, depend on at once; what is left out may depend on all"""
    note: str
    identifier: str = "lostmotion"  # model identifier
    has_sources: bool = False

    def names(self) -> str:
        """Names of the variables by value reference, for the library: bindings/fmu/variables.hpp."""
        lines = [self.guid, *(["references"] if self.references_given else []), f"indicators {self.indicators}"]
        free = self.inputs[: len(self.inputs) - len(self.positions)]
        lines += [f"input {v.name}" for v in free] + [f"motion {s} {v}" for s, v in self.positions.items()]
        lines += [f"output {v.name}" for v in self.outputs]
        text = "\n".join([*lines, *(f"state {v.name} {v.decade}" for v in self.states)]) + "\n"
        return f"{text}checksum {zlib.crc32(text.encode())}\n"

    def known(self, unknown: str) -> list[str]:
        """Inputs and states that an output or a derivative depends on at once."""
        return self.dependencies.get(unknown, [v.name for v in (*self.inputs, *self.states)])


def rate_unit(unit: str) -> str:
    """The unit of the time derivative of a quantity."""
    return {"rad/s": "rad/s^2", "m/s": "m/s^2"}.get(unit, f"{unit}/s")


def add_units(root: ET.Element, model: Model, *, input_rates: bool) -> None:
    """The units of all variables, as FMI 2 and 3 have them.

    input_rates: whether the time derivatives of the inputs are variables too.
    """
    units = (
        {v.unit for v in (*model.inputs, *model.outputs, *model.states)} | {p.unit for p in model.parameters} | {"s"}
    )
    rates = {rate_unit(v.unit): v.unit for v in (*model.states, *(model.inputs if input_rates else ()))}
    powers = {rate: powers_of([*read_si(unit).items(), ("second", -1)]) for rate, unit in rates.items()}
    powers |= {unit: powers_of(read_si(unit).items()) for unit in units}
    definitions = ET.SubElement(root, "UnitDefinitions")
    for unit in sorted(powers):
        element = ET.SubElement(definitions, "Unit", name=unit)
        ET.SubElement(element, "BaseUnit", {base: str(powers[unit][base]) for base in _BASES if base in powers[unit]})
        for name, factor in _DISPLAY.get(unit, ()):
            ET.SubElement(element, "DisplayUnit", name=name, factor=repr(factor))


def parameter_meaning(p: Parameter) -> str:
    """Meaning of a parameter."""
    start = ", at t = 0" if is_of_start(p) else ""
    return f"value of the key {p.key}{start}{': ' if p.meaning else ''}{p.meaning}"


def parameter_range(p: Parameter) -> dict[str, str]:
    """The attributes min and max of a parameter. One that must be above a limit has the limit itself as its min."""
    low = p.limit.gt if p.limit.ge is None else p.limit.ge
    return {name: repr(v) for name, v in (("min", low), ("max", p.limit.le)) if v is not None}


def is_of_start(p: Parameter) -> bool:
    """Whether a parameter is read at t = 0 alone."""
    return p.key.startswith("initial.")


def document(root: ET.Element) -> bytes:
    """XML document as text."""
    ET.indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{ET.tostring(root, encoding="unicode")}\n'.encode()


def page(model: Model) -> str:
    """documentation/index.html of an FMU."""

    def table(rows: list[tuple[str, ...]], heads: tuple[str, ...]) -> str:
        lines = "".join("<tr>" + "".join(f"<td>{html.escape(c)}</td>" for c in row) + "</tr>" for row in rows)
        return f"<table><tr>{''.join(f'<th>{h}</th>' for h in heads)}</tr>{lines}</table>"

    inputs: list[tuple[str, ...]] = [(v.name, v.unit, v.meaning) for v in model.inputs]
    outputs: list[tuple[str, ...]] = [(v.name, v.unit, v.meaning) for v in model.outputs]
    parameters: list[tuple[str, ...]] = [(p.key, p.unit, repr(p.value), p.meaning) for p in model.parameters]
    note = f"<p>{html.escape(model.note)}</p>" if model.note else ""
    exchange = (
        "<p>In Model Exchange the importer's integrator has these equations between two events; stuck and slipping "
        "contacts, the pieces of the laws and the ticks of sampled controllers are found at events.</p>"
        if model.states
        else ""
    )
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html.escape(model.title)}</title>'
        "<style>body{font-family:sans-serif;max-width:60em;margin:2em auto;padding:0 1em}table{border-collapse:collapse}"
        "td,th{border:1px solid #999;padding:.2em .6em;text-align:left}</style>"
        f"<h1>{html.escape(model.title)}</h1>{note}"
        "<p>A geared servo drive, in Co-Simulation solved exactly between communication points: its result does not depend on their "
        "distance where the inputs run in straight lines between them. Give the inputs their time derivatives (FMI 2.0: "
        "fmi2SetRealInputDerivatives; FMI 3.0: the inputs der(...)); without these they are held over a step. Values are in SI units.</p>"
        f"{exchange}<h2>Inputs</h2><p>Each follows its signal in the scenario until the importer sets it.</p>"
        f"{table(inputs, ('name', 'unit', 'meaning'))}"
        f"<h2>Outputs</h2>{table(outputs, ('name', 'unit', 'meaning'))}"
        "<h2>Parameters</h2><p>By their keys in the scenario file. They can be changed between communication points, those of the "
        f"start before the first.</p>{table(parameters, ('key', 'unit', 'value', 'meaning'))}</html>\n"
    )
