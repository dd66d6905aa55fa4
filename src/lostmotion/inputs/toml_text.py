"""TOML files that are written."""

import json
from collections.abc import Mapping
from typing import Any


def toml_text(tables: Mapping[str, Any], comment: str = "") -> str:
    """Nested tables as a TOML file; what is None is left out.

    comment: lines above it.
    """
    lines = [f"# {line}".rstrip() for line in comment.splitlines()]
    plain = {k: v for k, v in tables.items() if not isinstance(v, Mapping) and v is not None}
    lines += [f"{_key(k)} = {_value(v)}" for k, v in plain.items()]
    _write(tables, (), lines)
    return "\n".join(lines).strip() + "\n"


def _write(tables: Mapping[str, Any], where: tuple[str, ...], lines: list[str]) -> None:
    for name, value in tables.items():
        if not isinstance(value, Mapping):
            continue
        path = (*where, name)
        plain = {k: v for k, v in value.items() if v is not None and not isinstance(v, Mapping)}
        if plain or not value:  # a shaft may have no key
            lines += ["", f"[{'.'.join(map(_key, path))}]", *(f"{_key(k)} = {_value(v)}" for k, v in plain.items())]
        _write(value, path, lines)


def _key(name: str) -> str:
    return name if name.replace("_", "").replace("-", "").isalnum() and name.isascii() else json.dumps(name)


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(k)} = {_value(v)}" for k, v in value.items() if v is not None) + " }"
    return "[" + ", ".join(map(_value, value)) + "]"


def without_empty(tables: Mapping[str, Any]) -> dict[str, Any]:
    """The tables without empty lists and tables."""
    found = {k: without_empty(v) if isinstance(v, Mapping) else v for k, v in tables.items()}
    return {k: v for k, v in found.items() if not (isinstance(v, Mapping | list | tuple | str) and not v)}
