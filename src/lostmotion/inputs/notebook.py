"""Parts as HTML, for notebooks."""

from __future__ import annotations

import html
from typing import Any

from .quantities import Part, abridged, unit_in_schema


def table(part: Part) -> str:
    """A table of the values of a part with their units and meanings; parts inside it fold out."""
    fields = type(part).model_json_schema()["properties"]
    rows = []
    for name in type(part).model_fields:
        value = getattr(part, name)
        if value is None or value in ((), ""):
            continue
        if isinstance(value, Part):
            rows.append(
                f'<tr><td colspan="4"><details><summary><b>{name}</b></summary>{table(value)}</details></td></tr>'
            )
            continue
        meaning = fields[name].get("description", "").replace("`", "")
        cells = (name, _shown(value), (unit_in_schema(fields[name]) or "").replace("*", "·"), meaning)
        rows.append("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in cells) + "</tr>")
    return f"<div><code>{html.escape(repr(part))}</code><table>{''.join(rows)}</table></div>"


def _shown(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    return str(abridged(value))
