"""Keys of a scenario that may have been meant by one that it does not have."""

import difflib
from collections.abc import Iterator, Mapping
from typing import Any

from ...inputs.refusal_messages import nearest
from .scenario import Scenario


def near_key(scenario: Scenario, key: str) -> str:
    """The key of a scenario of the same name in the same table or within it, or that was misspelt as this one; empty if none is."""
    known = [*_keys(scenario.model_dump(), ""), *scenario.record_keys()]
    first, dot, _ = key.partition(".")
    table = nearest(first, {k.split(".")[0] for k in known}) if dot else None  # left out, it may be any
    same = [k for k in known if k.rpartition(".")[2] == key.rpartition(".")[2] and table in (None, k.split(".")[0])]
    return next(iter(difflib.get_close_matches(key, same, n=1, cutoff=0.0)), nearest(key, known))


def _keys(table: Mapping[str, Any], before: str) -> Iterator[str]:
    for name, value in table.items():
        yield f"{before}{name}"
        if isinstance(value, dict):
            yield from _keys(value, f"{before}{name}.")
