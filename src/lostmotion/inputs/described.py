"""The parameters of parts as the core describes them: keys, units, ranges, defaults and meanings.

What a part in `model` and `control` adds to them is what the core does not see: tables within, and what must fit together.
The names for type checkers are in `described.pyi`, which ``make stub`` writes.
"""

from typing import Annotated, Any, ClassVar

from pydantic import Field, create_model

from .. import _core
from ..units.conversion import Unit
from .part import Part
from .quantities import MAX_ENTRIES, Limit, Switch, Whole


class Described(Part):
    """A part whose own numbers the core describes."""

    described: ClassVar[tuple[str, ...]] = ()
    """keys of these"""

    def core_fields(self) -> dict[str, Any]:
        """Fields for the core, in SI units, without those that are None."""
        keys = (key for base in reversed(type(self).__mro__) for key in vars(base).get("described", ()))
        return {key: getattr(self, key) for key in keys}


def _type(kind: str, unit: str, limits: tuple[float | None, float | None, float | None], least_entries: int) -> Any:
    above, least, most = limits
    if kind == "flag":
        return Switch
    if kind == "integer":
        return Annotated[Whole, Field(ge=least, le=most)]
    number: Any = Annotated[float, Unit(unit)]
    if limits != (None, None, None):
        number = Annotated[number, Limit(gt=above, ge=least, le=most)]
    if kind == "list":
        return Annotated[tuple[number, ...], Field(min_length=least_entries, max_length=MAX_ENTRIES)]
    return tuple[number, number] if kind == "pair" else number


def _part(name: str, rows: list[tuple[Any, ...]]) -> type[Described]:
    fields: dict[str, Any] = {}
    for key, kind, _, unit, meaning, limits, needed, default in rows:
        given = _type(kind, unit, limits, int(needed))
        optional = default is None and not needed
        fields[key] = (
            given | None if optional else given,
            Field(... if needed else default, description=meaning or None),
        )
    part = create_model(f"{name}Fields", __base__=Described, __module__=__name__, **fields)
    part.described = tuple(fields)
    return part


def tables() -> dict[str, list[tuple[Any, ...]]]:
    """Rows of the parameters of each part: key, kind, symbol, unit, meaning, range, whether it is needed, default."""
    return _core.described_tables(of_controllers=False) | _core.described_tables(of_controllers=True)


globals().update({f"{name}Fields": _part(name, rows) for name, rows in tables().items()})


def _reference_blocks() -> type[Part]:
    """Base of controllers, with a table for each block that shapes the reference."""
    blocks: dict[str, Any] = {}
    for key, name, meaning in _core.reference_blocks():
        part = create_model(name, __base__=globals()[f"{name}Fields"], __module__=__name__, __doc__=meaning)
        globals()[name] = part
        blocks[key] = (part | None, Field(None, description=meaning))
    return create_model("ReferenceBlocks", __base__=Part, __module__=__name__, **blocks)


ReferenceBlocks = _reference_blocks()


def stub() -> str:
    """The text of `described.pyi`."""
    types = {"number": "float", "pair": "tuple[float, float]", "integer": "int", "flag": "bool"}
    types["list"] = "tuple[float, ...]"
    lines = ["from typing import Any, ClassVar", "", "from .part import Part", "", "class Described(Part):"]
    lines += ["    described: ClassVar[tuple[str, ...]]", "    def core_fields(self) -> dict[str, Any]: ..."]
    for name, rows in tables().items():
        lines += ["", f"class {name}Fields(Described):"]
        for key, kind, _, _, _, _, needed, default in rows:
            optional = " | None" if default is None and not needed else ""
            lines.append(f"    {key}: {types[kind]}{optional}{'' if needed else ' = ...'}")
    blocks = _core.reference_blocks()
    lines += [line for _, name, _ in blocks for line in ("", f"class {name}({name}Fields): ...")]
    lines += ["", f"class ReferenceBlocks(Part):{'' if blocks else ' ...'}"]
    lines += [f"    {key}: {name} | None = ..." for key, name, _ in blocks]
    return "\n".join(
        [*lines, "", "def tables() -> dict[str, list[tuple[Any, ...]]]: ...", "def stub() -> str: ...", ""]
    )
