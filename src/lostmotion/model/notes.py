"""Notes of parts: each states which key it is about, and holds while that key has the value that it had."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, Field

from ..inputs.named_elements import Named

WHOLE = "general"  # key of a note that is about no single key of its part


class Notes(Named[str]):
    """Sentences by the dotted key of the part that they are about, such as ``limits.peak_torque``.

    Examples
    --------
    >>> str(Notes({"losses": "The loss table is a stand-in.", "general": "Measured in 2024."}))
    'The loss table is a stand-in. Measured in 2024.'
    """

    def __init__(self, notes: str | Mapping[str, str]) -> None:
        by_key = {WHOLE: notes} if isinstance(notes, str) else notes
        dict.__init__(self, {key: text for key, text in by_key.items() if text})

    def __str__(self) -> str:
        return " ".join(self.values())

    def still_true(self, old: Mapping[str, Any], new: Mapping[str, Any]) -> Notes:
        """The notes whose keys have the same values in both tables."""
        return Notes({key: text for key, text in self.items() if key == WHOLE or _at(old, key) == _at(new, key)})


def _texts(note: Any) -> Any:
    if isinstance(note, str) or (isinstance(note, Mapping) and all(isinstance(part, str) for part in note.values())):
        return note
    raise ValueError("must be text, in quotes, or a table of texts by the key that each is about")


Note = Annotated[str | dict[str, str], BeforeValidator(_texts), AfterValidator(Notes), Field(validate_default=True)]
"""text, or a table of texts by the key that each is about"""
NO_NOTE: dict[str, str] = {}


def note_is_about(part: type[BaseModel], notes: Notes) -> Notes:
    """Check that a part has the keys that its notes are about."""
    for key in notes:
        if key.partition(".")[0] not in (WHOLE, *part.model_fields):
            raise ValueError(f"is about {key}, which is no key here; a note about no single key is text")
    return notes


def together(*notes: str | Mapping[str, str]) -> Notes:
    """Notes of several sources as one; those about the same key follow each other."""
    texts: dict[str, str] = {}
    for key, text in (item for each in notes for item in Notes(each).items()):
        texts[key] = f"{texts[key]} {text}" if key in texts else text
    return Notes(texts)


class Noted:
    """Note of a part's table and the values that it is about, before the table is changed."""

    def __init__(self, table: Mapping[str, Any]) -> None:
        note = table.get("note")
        self._notes = Notes(note) if isinstance(note, Mapping) else Notes("")
        about = {key.partition(".")[0] for key in self._notes} | ({"losses"} if "loss_range" in table else set())
        self._values = {key: _copy(table.get(key)) for key in about}
        self._range = table.get("loss_range")

    def keep_true(self, table: dict[str, Any]) -> None:
        """Remove from the changed table what was said of other values: notes, and the range of an estimate of losses."""
        if self._notes and isinstance(note := table.get("note"), Mapping):
            true = self._notes.still_true(self._values, table)
            table["note"] = {k: text for k, text in note.items() if k in true or text != self._notes.get(k)}
        estimated = self._range is not None and table.get("loss_range") == self._range
        if estimated and self._values["losses"] != _copy(table.get("losses")):
            del table["loss_range"]


def _at(table: Any, key: str) -> Any:
    """The value of a table at a dotted key; None where there is none."""
    for part in key.split("."):
        table = table.get(part) if isinstance(table, Mapping) else None
    return _copy(table)


def _copy(value: Any) -> Any:
    """A value as it can be compared later, with lists in place of tuples."""
    if isinstance(value, Mapping):
        return {key: _copy(each) for key, each in value.items()}
    return [_copy(each) for each in value] if isinstance(value, list | tuple) else value
