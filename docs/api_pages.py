"""The pages of the Python interface, from the docstrings: one page for `lostmotion` and one for each namespace."""

from __future__ import annotations

import importlib
import inspect
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any

from lostmotion.inputs.docstrings import docstring_of
from lostmotion.inputs.part import Part
from lostmotion.namespace import homes_of

HEADS = {
    "lostmotion": """Most used names: `lostmotion`

This page lists the names of `lostmotion` itself, for engineers who work in Python: functions, classes and errors.""",
    "control": """Controllers, references, encoders and filters: `lm.control`

This page lists the parts of controllers, for engineers who close loops around a drive. Their fields are those of `[controller]` in the
[scenario](../scenario.md). [Controllers](../../control.md) describes what they compute, [References](../../references.md) what they follow,
[Tracking](../../tracking.md) cameras and targets. `lm.Controller` and `lm.PositionReference` are in `lostmotion` itself.""",
    "data_sheets": """Data sheets and loss maps: `lm.data_sheets`

This page lists data sheets of parts, for engineers who enter a product that the catalogue lacks. [Catalogue data](../../catalogue-data.md)
describes their keys. `lm.catalogue`, `lm.gearbox`, `lm.motor` and `lm.actuator` are in `lostmotion` itself.""",
    "identification": """Logs, identification tasks and their results: `lm.identification`

This page lists what belongs to `lm.identify`, for engineers who fit a drive to measured logs.
[Identification](../../identification.md) describes the file, the methods and the limits.""",
    "live_page": """The live page in notebooks: `lm.live_page`

This page describes what `lm.live` returns in a notebook. [Live page](../../live.md) shows what it does.""",
    "model": """Parts with special laws: `lm.model`

This page lists the parts of drives that few models need, for engineers who describe a drive in Python. All are frozen. Their fields are
those of the [scenario files](../scenario.md) and of the [long form](../train.md). The usual parts, such as `lm.Motor` and `lm.Gear`, are in
`lostmotion` itself. [Drive trains](../../drive-trains.md) and [Linear motion](../../linear.md) describe the laws.""",
    "mujoco": """MuJoCo: `lm.mujoco`

This page lists the names of `lostmotion.mujoco`, for engineers who simulate robots. [Robots in MuJoCo](../../robots.md) describes the method
and its accuracy. It needs `pip install "lostmotion[mujoco]"`.""",
    "pointing": """Pointing budgets: `lm.pointing`

This page lists what `lm.pointing_budget` returns, for engineers of pointing axes. [Tracking](../../tracking.md) describes the method.""",
    "portable": """Scenarios for programs without Python: `lm.portable`

This page lists what writes a scenario for other programs: [C, WebAssembly and other languages](../../c-interface.md) and
[FMUs](../../fmu.md). `lm.export_fmu` is in `lostmotion` itself.""",
    "reports": """Figures and tables of a result: `lm.reports`

This page describes the accessor `result.lm` of datasets, which draws and explains them.""",
    "response": """Linear models, periodic motions and frequency responses: `lm.response`

This page lists the analyses beside `lm.frequency_response`, `lm.linearize`, `lm.periodic_motion` and `lm.spectrum`, and what these return.""",
    "servo": """Commissioning results, tuning and limit cycles: `lm.servo`

This page lists what `lm.commission` and `lm.tune` return, and the search for limit cycles, for engineers who commission an axis.
[Servo](../../servo.md) and [Limit cycles](../../limit-cycles.md) describe the methods.""",
    "simulation": """Results, explanations and states of runs: `lm.simulation`

This page lists the types that `lm.simulate`, `lm.explain` and `lm.Simulation` return, and the table of result variables
([Result variables](../variables.md)).""",
    "sizing": """Drive check, temperatures and self-locking: `lm.sizing`

This page lists what belongs to `lm.check_drive`, for engineers who select a drive. [Drive check](../../drive-check.md),
[Motors](../../motors.md) and [Self-locking](../../self-locking.md) describe the rules.""",
    "studies": """Study and task files: `lm.studies`

This page lists what reads the files that `lm.study` and `lm.select` run: [Studies](../../studies.md) and [Selection](../../select.md).""",
    "test_rig": """The virtual test rig: `lm.test_rig`

This page lists the measurements of gearboxes and screws on a virtual rig, as data sheets report them: torsional stiffness, lost motion,
losses. The command is `lostmotion rig`.""",
    "warp": """Graphics processors: `lm.warp`

This page lists the names of `lostmotion.warp`, for those who train policies on thousands of drives. [Batches](../../batches.md) describes
the method and its accuracy. It needs `pip install "lostmotion[warp]"`.""",
}
"""Title and introduction of each page"""


def pages() -> Iterator[tuple[str, str]]:
    """Each namespace with the text of its page."""
    spaces = [name for name, home in homes_of("lostmotion").items() if home == "lostmotion"]
    for space in ("lostmotion", *spaces):
        package = "lostmotion" if space == "lostmotion" else f"lostmotion.{space}"
        module = importlib.import_module(package)
        names = sorted(set(homes_of(package)) - {*spaces, "__version__"}, key=lambda name: (name.lower(), name))
        prefix = "lm" if space == "lostmotion" else f"lm.{space}"
        things = {f"{prefix}.{name}": getattr(module, name) for name in names}
        lines = [f"# {HEADS[space]}", "", "| name | purpose |", "|---|---|"]
        for (name, thing), anchor in zip(things.items(), anchors(things), strict=True):
            lines.append(f"| [`{name}`](#{anchor}) | {summary(docstring(thing)).replace('|', chr(92) + '|')} |")
        for name, thing in things.items():
            lines += ["", f"## `{name}`", "", *section(name, thing)]
        yield space, "\n".join(lines) + "\n"


def anchors(headings: Iterable[str]) -> Iterator[str]:
    """Fragments of headings, as GitHub and MyST make them: those that are equal get a number."""
    seen: Counter[str] = Counter()
    for heading in headings:
        plain = re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
        yield f"{plain}-{seen[plain]}" if seen[plain] else plain
        seen[plain] += 1


def docstring(thing: Any) -> str:
    if not callable(thing):
        return "Constant."
    return inspect.getdoc(thing) or ""


def summary(text: str) -> str:
    """First sentence or paragraph of a docstring."""
    return in_markdown(" ".join(text.split("\n\n", maxsplit=1)[0].split()))


def in_markdown(text: str) -> str:
    return text.replace("``", "`")


def section(name: str, thing: Any) -> list[str]:
    """What a docstring says of a name, then the members of a class."""
    lines = [*call(name, thing), *paragraphs(docstring(thing))]
    if not inspect.isclass(thing) or issubclass(thing, BaseException):
        return lines
    for member, value in members(thing):
        text = docstring_of_member(thing, member, value)
        shown = f"{member}{signature(value)}" if callable(value) else member
        lines.append(f"- `{shown}`: {summary(text)}" if text else f"- `{shown}`")
    return lines


def call(name: str, thing: Any) -> list[str]:
    if not callable(thing) or (inspect.isclass(thing) and issubclass(thing, Part | BaseException)):
        return []
    return ["```python", f"{name}{signature(thing)}", "```", ""]


def signature(thing: Any) -> str:
    """Names and defaults of parameters; their types are in the docstring."""
    try:
        parameters = inspect.signature(thing).parameters.values()
    except (TypeError, ValueError):
        return "()"
    empty = inspect.Parameter.empty
    kept = [p.replace(annotation=empty, default=Unprintable(p.default)) for p in parameters if p.name != "self"]
    return str(inspect.Signature(kept))


class Unprintable:
    """A default whose representation would name an address in memory."""

    def __new__(cls, default: Any) -> Any:
        return object.__new__(cls) if re.search(r" at 0x", repr(default)) else default

    def __repr__(self) -> str:
        return "..."


def members(thing: type) -> Iterator[tuple[str, Any]]:
    """Public fields, properties and methods of a class that the package defines."""
    names: dict[str, None] = {}
    for base in reversed([b for b in thing.__mro__ if b.__module__.startswith("lostmotion")]):
        if not issubclass(thing, Part):
            names |= dict.fromkeys(vars(base).get("__annotations__", {}))
            names |= dict.fromkeys(vars(base))
    for name in names if names else dir(thing):
        value = inspect.getattr_static(thing, name, None)
        value = value.__func__ if isinstance(value, classmethod | staticmethod) else value
        if not name.startswith("_"):
            yield name, value


def docstring_of_member(thing: type, name: str, value: Any) -> str:
    text = docstring_of(thing, name)
    if text is None and (callable(value) or isinstance(value, property) or hasattr(value, "func")):
        text = inspect.getdoc(value)
    return text or ""


def paragraphs(text: str) -> list[str]:
    """A numpydoc docstring in Markdown."""
    before, *sections = re.split(r"^(\w[\w ]*)\n-{3,}\n", text, flags=re.MULTILINE)
    lines = [in_markdown(before.strip()), ""]
    for heading, body in zip(sections[::2], sections[1::2], strict=True):
        if heading == "Examples":
            lines += ["```python", body.strip(), "```", ""]
            continue
        lines += [f"**{heading}**", ""]
        if heading in ("Parameters", "Returns", "Raises", "Yields", "Attributes", "Warns"):
            lines += [*entries(body), ""]
        else:
            lines += [in_markdown(body.strip()), ""]
    return lines


def entries(body: str) -> Iterator[str]:
    """Entries of a section as a list: name, type, meaning."""
    for entry in re.split(r"\n(?=\S)", body.strip("\n")):
        head, _, meaning = entry.partition("\n")
        name, colon, kind = head.partition(" : ")
        meaning = in_markdown(" ".join(inspect.cleandoc(meaning).split()))
        shown = f"`{name}`" + (f" ({in_markdown(kind)})" if colon else "")
        yield f"- {shown}: {meaning}" if meaning else f"- {shown}"
