"""The parameters of parts as the core describes them: keys, units, ranges, defaults and meanings.

What a part in `model` and `control` adds to them is what the core does not see, such as what must fit together. ``NameFields``
is the base of the part `Name`. It is made when its name is first used: write ``core_parameters.NameFields`` in a class whose
tables are parts of the same module. The names for type checkers are in `core_parameters.pyi`, which ``make stub`` writes.
Keys that the core does not take are fields of the parts themselves.
"""

from typing import Annotated, Any, ClassVar, Generic, TypeVar

from pydantic import Field, create_model

from .. import _core
from ..units.conversion import Unit
from .part import Part
from .quantities import Limit, Switch, Whole

V = TypeVar("V")  # the value of a signal, with its unit
OF_VALUE = "value"  # unit of the value of a signal
TYPES = {"pair": "tuple[float, float]", "integer": "int", "flag": "bool", "list": "tuple[float, ...]"}

ParameterRow = tuple[Any, ...]  # key, kind, symbol, unit, meaning, range, whether it is needed, default, and more


class Described(Part):
    """A part whose own parameters the core describes."""

    described: ClassVar[tuple[str, ...]] = ()  #: keys of these
    core_keys: ClassVar[tuple[str, ...]] = ()  #: keys of those that the core takes

    def core_fields(self) -> dict[str, Any]:
        """Fields for the core, in SI units, without the fields that are None."""
        keys = (key for base in reversed(type(self).__mro__) for key in vars(base).get("core_keys", ()))
        return {key: getattr(self, key) for key in keys}

    def fields_of(self, part: "type[Described]") -> dict[str, Any]:
        """Values of the keys that a base has from the core, tables as mappings."""
        values = ((key, getattr(self, key)) for key in part.described)
        return {key: v.fields_of(type(v)) if isinstance(v, Described) else v for key, v in values}


def _part_named(name: str, base: type[Part] = Part) -> Any:
    """The part of this name that the package has made."""
    own = (part for part in base.__subclasses__() if part.__name__ == name and part.__module__.startswith("lostmotion"))
    return next(own, None) or next((p for b in base.__subclasses__() if (p := _part_named(name, b))), None)


def _type(kind: str, unit: str, limits: tuple[float | None, float | None, float | None], more: tuple[Any, ...]) -> Any:
    above, least, most = limits
    if kind == "table":
        return _part_named(more[0])
    if kind == "flag":
        return Switch
    if kind == "integer":
        return Annotated[Whole, Field(ge=least, le=most)]
    number: Any = V if unit == OF_VALUE else Annotated[float, Unit(unit)]
    if limits != (None, None, None):
        number = Annotated[number, Limit(gt=above, ge=least, le=most)]
    if kind == "list":
        fewest, largest = more
        return Annotated[tuple[number, ...], Field(min_length=fewest or None, max_length=largest)]
    return tuple[number, number] if kind == "pair" else number


def _part(name: str, rows: list[ParameterRow]) -> type[Described]:
    fields: dict[str, Any] = {}
    for row in rows:
        key, kind, _, unit, meaning, limits, needed, default, more = row
        given = _type(kind, unit, limits, more)
        optional = default is None and not needed
        value = Field(... if needed else default, description=meaning or None)
        fields[key] = (given | None if optional else given, value)
    base = (Described, Generic[V]) if _is_of_value(rows) else Described
    part = create_model(f"{name}Fields", __base__=base, __module__=__name__, **fields)
    part.described = tuple(fields)
    part.core_keys = part.described if name in OF_CORE else ()
    return part


def _is_of_value(rows: list[ParameterRow]) -> bool:
    return any(row[3] == OF_VALUE for row in rows)


OF_CORE: dict[str, list[ParameterRow]] = _core.described_tables(of_core=True)
TABLES = OF_CORE | _core.described_tables(of_core=False)  # rows of the parameters of each part


def __getattr__(name: str) -> Any:
    rows = TABLES.get(name.removesuffix("Fields"))
    if rows is None or not name.endswith("Fields"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    made = globals()[name] = _part(name.removesuffix("Fields"), rows)
    return made


def _reference_blocks() -> type[Part]:
    """Base of controllers, with a table for each block that shapes the reference."""
    blocks: dict[str, Any] = {}
    for key, name, meaning in _core.reference_blocks():
        part = create_model(name, __base__=__getattr__(f"{name}Fields"), __module__=__name__, __doc__=meaning)
        globals()[name] = part
        blocks[key] = (part | None, Field(None, description=meaning))
    return create_model("ReferenceBlocks", __base__=Part, __module__=__name__, **blocks)


ReferenceBlocks = _reference_blocks()


def _stub_type(row: ParameterRow) -> str:
    _, kind, _, unit, _, _, _, _, more = row
    if kind == "table":
        return str(more[0])
    return "V" if unit == OF_VALUE else TYPES.get(kind, "float")


def stub() -> str:
    """The text of `core_parameters.pyi`."""
    inner = {row[8][0] for rows in TABLES.values() for row in rows if row[1] == "table"}
    homes: dict[str, list[str]] = {}
    for name in sorted(inner):
        homes.setdefault(_part_named(name).__module__.removeprefix("lostmotion"), []).append(name)
    lines = ["from typing import Any, ClassVar, Generic, TypeVar", ""]
    lines += [f"from .{home} import {', '.join(names)}" for home, names in sorted(homes.items())]
    lines += ["from .part import Part", "", 'V = TypeVar("V")']
    lines += ["", "class Described(Part):", "    described: ClassVar[tuple[str, ...]]"]
    lines += ["    core_keys: ClassVar[tuple[str, ...]]", "    def core_fields(self) -> dict[str, Any]: ..."]
    lines += ["    def fields_of(self, part: type[Described]) -> dict[str, Any]: ..."]
    for name, rows in TABLES.items():
        generic = ", Generic[V]" if _is_of_value(rows) else ""
        lines += ["", f"class {name}Fields(Described{generic}):"]
        for row in rows:
            key, needed, default = row[0], row[6], row[7]
            optional = " | None" if default is None and not needed else ""
            lines.append(f"    {key}: {_stub_type(row)}{optional}{'' if needed else ' = ...'}")
    blocks = _core.reference_blocks()
    lines += [line for _, name, _ in blocks for line in ("", f"class {name}({name}Fields): ...")]
    lines += ["", f"class ReferenceBlocks(Part):{'' if blocks else ' ...'}"]
    lines += [f"    {key}: {name} | None = ..." for key, name, _ in blocks]
    lines += ["", "TABLES: dict[str, list[tuple[Any, ...]]]", "", "def stub() -> str: ...", ""]
    return "\n".join(lines)
