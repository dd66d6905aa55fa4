"""The parameters of controllers as the core describes them: keys, units, ranges, defaults and meanings of each part.

What a part adds to them in `loops.py` and its neighbours is what the core does not see: tables within, and what must fit together.
The names for type checkers are in `described.pyi`, which ``make stub`` writes.
"""

from typing import Annotated, Any, ClassVar

from pydantic import Field, create_model

from .. import _core
from ..inputs.part import Part
from ..inputs.quantities import Limit, Switch, Whole
from ..units.conversion import Unit


class Described(Part):
    """A part whose own numbers the core describes."""

    described: ClassVar[tuple[str, ...]] = ()
    """keys of these"""

    def core_fields(self) -> dict[str, Any]:
        """Fields for the core, in SI units, without those that are None."""
        return {key: getattr(self, key) for key in self.described}


def _type(kind: str, unit: str, limits: tuple[float | None, float | None, float | None]) -> Any:
    above, least, most = limits
    if kind == "flag":
        return Switch
    if kind == "integer":
        return Annotated[Whole, Field(ge=least, le=most)]
    number: Any = Annotated[float, Unit(unit)]
    if limits != (None, None, None):
        number = Annotated[number, Limit(gt=above, ge=least, le=most)]
    return tuple[number, number] if kind == "pair" else number


def _part(name: str, rows: list[tuple[Any, ...]]) -> type[Described]:
    fields: dict[str, Any] = {}
    for key, kind, _, unit, meaning, limits, needed, default in rows:
        given = _type(kind, unit, limits)
        optional = default is None and not needed
        fields[key] = (
            given | None if optional else given,
            Field(... if needed else default, description=meaning or None),
        )
    part = create_model(f"{name}Fields", __base__=Described, __module__=__name__, **fields)
    part.described = tuple(fields)
    return part


globals().update({f"{name}Fields": _part(name, rows) for name, rows in _core.control_tables().items()})


def stub() -> str:
    """The text of `described.pyi`."""
    types = {"number": "float", "pair": "tuple[float, float]", "integer": "int", "flag": "bool"}
    lines = ["from typing import Any, ClassVar", "", "from ..inputs.part import Part", "", "class Described(Part):"]
    lines += ["    described: ClassVar[tuple[str, ...]]", "    def core_fields(self) -> dict[str, Any]: ..."]
    for name, rows in _core.control_tables().items():
        lines += ["", f"class {name}Fields(Described):"]
        for key, kind, _, _, _, _, needed, default in rows:
            optional = " | None" if default is None and not needed else ""
            lines.append(f"    {key}: {types[kind]}{optional}{'' if needed else ' = ...'}")
    return "\n".join([*lines, "", "def stub() -> str: ...", ""])
