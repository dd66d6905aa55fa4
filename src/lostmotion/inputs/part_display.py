"""Representation of parts: as one line of text, and as HTML in notebooks."""

import html
from typing import Any

from pydantic import BaseModel

from ..units.practical import printed
from .schema import unit_in_schema


def table(part: BaseModel) -> str:
    """A table of the values of a part with their units and meanings; parts inside it fold out."""
    fields = type(part).model_json_schema()["properties"]
    rows = []
    for name in type(part).model_fields:
        value = getattr(part, name)
        if value is None or value in ((), ""):
            continue
        if isinstance(value, BaseModel):
            rows.append(
                f'<tr><td colspan="4"><details><summary><b>{name}</b></summary>{table(value)}</details></td></tr>'
            )
            continue
        meaning = fields[name].get("description", "").replace("`", "")
        cells = (name, _shown(value), printed(unit_in_schema(fields[name]) or ""), meaning)
        rows.append("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in cells) + "</tr>")
    return f"<div><code>{html.escape(repr(part))}</code><table>{''.join(rows)}</table></div>"


def _shown(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    return str(abridged(value))


class _Abridged(str):
    """Text that stands for itself in a representation."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)


def abridged(value: Any, max_entries: int = 6) -> Any:
    """The value; a long list as text with its ends and its length."""
    if not isinstance(value, tuple):
        return value
    if value and isinstance(value[0], tuple):
        return _Abridged(f"({len(value)} x {len(value[0])} numbers)")
    if len(value) <= max_entries:
        return value
    return _Abridged(f"({value[0]!r}, {value[1]!r}, ..., {value[-1]!r}; {len(value)} entries)")
