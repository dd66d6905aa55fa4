"""Common fields of the records of data sheets: sources of the data, and gaps."""

from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field

from ..inputs.part import Part
from ..inputs.quantities import Length, Mass, Number, Positive, Switch, Time
from ..model.notes import NO_NOTE, Note, Notes, together
from ..model.synchronous_motor import Winding
from .loss_data import LossData

# Fields of a record that are no data.
WORDS = ("name", "manufacturer", "title", "note", "sources", "gaps", "illustrative")


def in_lower_case(name: Any) -> Any:
    """A name as records are found by it."""
    return name.lower() if isinstance(name, str) else name


class Source(Part):
    """Origin of data: their status, and the text that contains them."""

    data: tuple[str, ...]  #: keys of the record that it covers
    status: Literal["manufacturer", "transcription", "inferred", "identified"]
    """read in the manufacturer's own text, transcribed by somebody else, concluded from other data, or identified from measured logs"""
    text: str


class Gap(Part):
    """A datum that the record lacks."""

    datum: str
    where: str  #: place to read it


class Record(Part):
    """Base of the records of all kinds."""

    name: Annotated[str, BeforeValidator(in_lower_case)] = Field(pattern=r"^[a-z0-9][a-z0-9.-]*$")
    """letters, digits, dots and dashes; capitals are read as small letters"""
    manufacturer: str = ""
    title: str = ""  #: name of the product at the manufacturer
    note: Note = NO_NOTE  #: for readers of results: text, or by the key of the part in a scenario that it is about
    illustrative: Switch = False
    """no product that can be bought: a filter of the catalogue passes it over unless it asks for its name"""
    total_mass: Annotated[Mass, Positive] | None = None  #: mass of the whole component, for the choice
    overall_length: Annotated[Length, Positive] | None = None  #: along the axis, for the space that it takes
    price: Annotated[Number, Positive] | None = None  #: in one currency for all sheets that are compared
    lead_time: Annotated[Time, Positive] | None = None  #: from order to delivery
    sources: tuple[Source, ...] = ()
    gaps: tuple[Gap, ...] = ()

    NEEDS: ClassVar[dict[str, tuple[str, ...]]] = {}
    """data that a run, or the rule on this kind, requires; for each key the alternative keys; one of them is enough"""

    def given(self) -> list[str]:
        """Dotted keys of all data that are given."""
        out = []
        for name in self.model_fields_set - {*WORDS, "kind"}:
            value = getattr(self, name)
            if isinstance(value, LossData | Winding):
                out += [f"{name}.{k}" for k in sorted(value.model_fields_set)]
            else:
                out.append(name)
        return sorted(out)

    def missing(self) -> dict[str, str]:
        """Data that a run requires and the record lacks: the key, and a hint to its place."""
        given = {key for key in self.model_fields_set if getattr(self, key) is not None}
        return {need: f"see {self.where(need)}" for need, keys in self.NEEDS.items() if given.isdisjoint(keys)}

    def level(self) -> str | None:
        """Level of a run with these data; None if it cannot run."""
        return None if self.missing() else "all data"

    def assumptions(self) -> tuple[str, ...]:
        """Assumptions of a run beyond the data, one sentence each."""
        return tuple(self._assumed().values())

    def _assumed(self) -> dict[str, str]:
        """The assumptions, by the key of the part that each is about."""
        return {}

    def _notes(self) -> Notes:
        return together(self.note, self._assumed())

    def source_of(self, datum: str) -> Source | None:
        """The source that covers a datum."""
        for source in self.sources:
            if datum in source.data or datum.split(".", maxsplit=1)[0] in source.data:
                return source
        return None

    def where(self, datum: str) -> str:
        """Place to read a missing datum."""
        return next((gap.where for gap in self.gaps if gap.datum == datum), "the manufacturer's data sheet")
