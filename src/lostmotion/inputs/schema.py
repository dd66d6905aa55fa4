"""The JSON Schema of parts: what stands at a place in it, and in which unit."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any


def options(schema: Mapping[str, Any], node: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """A node, and all that it refers to or may be instead."""
    if "$ref" in node:
        yield from options(schema, schema["$defs"][node["$ref"].rsplit("/", 1)[1]])
        return
    yield node
    for key in ("anyOf", "oneOf", "allOf"):
        for option in node.get(key, []):
            yield from options(schema, option)


def follow(
    schema: Mapping[str, Any], location: tuple[int | str, ...], unknown_at_end: bool = False
) -> tuple[tuple[int | str, ...], list[Mapping[str, Any]]]:
    """The keys of a location without the names of the choices made on the way, and the nodes where it ends.

    For an unknown key these are the nodes of its table.
    """
    keys: list[int | str] = []
    nodes = list(options(schema, schema))
    for n, key in enumerate(location):
        if unknown_at_end and n == len(location) - 1:
            return (*keys, key), nodes
        chosen = [m[str(key)] for node in nodes if key in (m := node.get("discriminator", {}).get("mapping", {}))]
        if chosen:
            nodes = list(options(schema, {"$ref": chosen[0]}))
            continue
        if narrowed := [node for node in nodes if node.get("properties", {}).get("kind", {}).get("const") == key]:
            nodes = narrowed
            continue
        inner = [child for node in nodes if (child := _child(node, key)) is not None]
        if isinstance(key, int) or inner:
            keys.append(key)
            nodes = [option for node in inner for option in options(schema, node)]
    return tuple(keys), nodes


def _child(node: Mapping[str, Any], key: int | str) -> Any:
    if isinstance(key, int):
        fixed = node.get("prefixItems", [])
        return fixed[key] if key < len(fixed) else node.get("items")
    more = node.get("additionalProperties")
    return node.get("properties", {}).get(key, more if isinstance(more, Mapping) else None)


def keys_within(
    schema: Mapping[str, Any], nodes: Iterable[Mapping[str, Any]], levels: int = 2
) -> Iterator[tuple[str, ...]]:
    """Keys of the tables within the tables of some nodes, without lists and tables with names of their own."""
    found: dict[tuple[str, ...], None] = {}
    for node in nodes:
        for table, child in node.get("properties", {}).items():
            inside = list(options(schema, child))
            found |= dict.fromkeys((table, key) for one in inside for key in one.get("properties", {}))
            if levels > 1:
                found |= dict.fromkeys((table, *path) for path in keys_within(schema, inside, levels - 1))
    yield from found


def unit_in_schema(node: Mapping[str, Any]) -> str | None:
    """The SI unit of a field, from its JSON Schema; ``""`` for a pure number, None for what is no quantity."""
    if "x-unit" in node:
        return str(node["x-unit"])
    options = [option for key in ("anyOf", "oneOf", "allOf") for option in node.get(key, [])]
    options += [node["items"]] if isinstance(node.get("items"), dict) else []
    return next((unit for option in options if (unit := unit_in_schema(option)) is not None), None)
