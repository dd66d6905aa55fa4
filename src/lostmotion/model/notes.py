"""Notes of parts, which are about their data: a sentence goes when the value that it is about is replaced."""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Any

LOSSES = r"\bloss|\blost\b|efficienc|no-load|starting torque|contradiction"
ABOUT = {
    "losses": LOSSES,
    "stiffness": r"stiffness|torsion|backlash|compliance",
    "hysteresis": r"hysteresis",
    "friction_torque": r"\bfriction\b",
    "inductance": r"\binductance\b",
    "electrical_time_constant": r"\binductance\b",
    "kind": r"torque source",
    "winding": r"winding|magnets|torque source|inductance",
    "limits": r"\blimit",
}
"""by key of a part: what the sentences are about that become false with it"""
SENTENCE = re.compile(r"(?<=[.!])\s+(?=[A-Z])")


def still_true(note: str, changed: Collection[str]) -> str:
    """The sentences of a note that are not about values that were changed.

    Examples
    --------
    >>> still_true("The loss table is a stand-in. The ratio is that of the plate.", ["losses"])
    'The ratio is that of the plate.'
    """
    about = [ABOUT[key] for key in changed if key in ABOUT]
    if not about:
        return note
    stale = re.compile("|".join(about), re.IGNORECASE)
    return " ".join(sentence for sentence in SENTENCE.split(note) if not stale.search(sentence))


def forget_stale(table: dict[str, Any], changed: Collection[str]) -> None:
    """Takes out of the values of a part what no longer holds of it: sentences of its note, and the range of an estimate of its losses."""
    if "note" in table and "note" not in changed and isinstance(table["note"], str):
        table["note"] = still_true(table["note"], changed)
    if "loss_range" in table and "losses" in changed and "loss_range" not in changed:
        del table["loss_range"]
