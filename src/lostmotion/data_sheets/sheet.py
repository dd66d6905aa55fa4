"""What every record of a data sheet has: sources of its data, and gaps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from ..inputs.part import Part
from .loss_data import LossData


def current_word(word: Any) -> Any:
    """A key or a status as it is called now: sheets written before may say `maker` for the manufacturer."""
    return "manufacturer" if word == "maker" else word


def in_current_words(table: Mapping[str, Any]) -> dict[str, Any]:
    """A table with its keys as they are called now; a key that is given in both words stays, and is refused as unknown."""
    return {key if current_word(key) in table else current_word(key): value for key, value in table.items()}


class Source(Part):
    """Where data come from."""

    figures: tuple[str, ...]
    """keys of the record that it covers"""
    status: Annotated[Literal["manufacturer", "transcription", "inferred"], BeforeValidator(current_word)]
    """read in the manufacturer's own text, in somebody's transcription of it, or concluded from other data"""
    text: str


class Gap(Part):
    """A datum that the record lacks."""

    figure: str
    where: str
    """where one would read it"""


class Record(Part):
    """What data sheets of all kinds have."""

    name: str = Field(pattern=r"^[a-z0-9][a-z0-9.-]*$")
    """lower-case letters, digits, dots and dashes"""
    manufacturer: str = ""
    title: str = ""
    """as the manufacturer calls it"""
    note: str = ""
    """what a reader of results must know"""
    sources: tuple[Source, ...] = ()
    gaps: tuple[Gap, ...] = ()

    def given(self) -> list[str]:
        """Dotted keys of all data that are given."""
        plain = {*Record.model_fields, "kind"}
        out = []
        for name in self.model_fields_set - plain:
            value = getattr(self, name)
            if isinstance(value, LossData):
                out += [f"losses.{k}" for k in sorted(value.model_fields_set)]
            else:
                out.append(name)
        return sorted(out)

    def source_of(self, datum: str) -> Source | None:
        """The source that covers a datum."""
        for source in self.sources:
            if datum in source.figures or datum.split(".", maxsplit=1)[0] in source.figures:
                return source
        return None

    def where(self, datum: str) -> str:
        """Where one would read a datum that is missing."""
        return next((gap.where for gap in self.gaps if gap.figure == datum), "the manufacturer's data sheet")
