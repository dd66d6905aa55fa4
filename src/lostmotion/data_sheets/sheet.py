"""What every record of a data sheet has: sources of its figures, and gaps."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from ..inputs.part import Part
from .loss_figures import LossFigures


class Source(Part):
    """Where figures come from."""

    figures: tuple[str, ...]
    """keys of the record that it covers"""
    status: Literal["maker", "transcription", "inferred"]
    """read in the manufacturer's own text, in somebody's transcription of it, or concluded from other figures"""
    text: str


class Gap(Part):
    """A figure that the record lacks."""

    figure: str
    where: str
    """where one would read it"""


class Record(Part):
    """What data sheets of all kinds have."""

    name: str = Field(pattern=r"^[a-z0-9][a-z0-9.-]*$")
    """lower-case letters, digits, dots and dashes"""
    maker: str = ""
    title: str = ""
    """as the manufacturer calls it"""
    note: str = ""
    """what a reader of results must know"""
    sources: tuple[Source, ...] = ()
    gaps: tuple[Gap, ...] = ()

    def figures(self) -> list[str]:
        """Dotted keys of all figures that are given."""
        plain = {*Record.model_fields, "kind"}
        out = []
        for name in self.model_fields_set - plain:
            value = getattr(self, name)
            if isinstance(value, LossFigures):
                out += [f"losses.{k}" for k in sorted(value.model_fields_set)]
            else:
                out.append(name)
        return sorted(out)

    def source_of(self, figure: str) -> Source | None:
        """The source that covers a figure."""
        for source in self.sources:
            if figure in source.figures or figure.split(".", maxsplit=1)[0] in source.figures:
                return source
        return None

    def where(self, figure: str) -> str:
        """Where one would read a figure that is missing."""
        return next((gap.where for gap in self.gaps if gap.figure == figure), "the manufacturer's data sheet")
