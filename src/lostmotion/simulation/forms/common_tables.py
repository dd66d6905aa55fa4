"""Common parts of the tables of scenarios, however these are written."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, Any, Protocol

import numpy as np

from ... import _core
from ...control.continuous import ContinuousController
from ...control.controller import Controller
from ...data_sheets.components import ACCESSORIES
from ...inputs.part import Part, rule
from ...inputs.quantities import Positive, Time
from ...model.train import DriveTrain

MAX_SAMPLES = 100_000_000

# In the JSON Schema of files, beside what a scenario has.
BASE = {"type": "string", "description": "scenario file that this one changes"}
RECORD_NAME = {"type": "string", "description": "name of a record of the catalogue, or a file with one (.toml)"}


def with_accessories(schema: dict[str, Any]) -> dict[str, Any]:
    """A JSON Schema in which brake and amplifier of a task may name a record."""
    from_record = {"type": "object", "properties": {"from": RECORD_NAME}, "required": ["from"]}
    properties = schema["$defs"]["Task"]["properties"]
    for key in ACCESSORIES:
        properties[key]["anyOf"] += [RECORD_NAME, from_record]
    return schema


class SimulationTable(Part):
    """Duration and instants of the result: the multiples of the interval, and the end. They do not affect the motion."""

    duration: Annotated[Time, Positive]
    sample_interval: Annotated[Time, Positive]

    @rule
    def _not_too_many(self) -> Iterator[str]:
        if self.sample_interval > self.duration:
            yield f"has a sample_interval of {self.sample_interval} s, longer than its duration"
        if self.duration / self.sample_interval > MAX_SAMPLES:
            yield f"asks for more than {MAX_SAMPLES:.0e} samples; lengthen sample_interval"

    @property
    def samples(self) -> int:
        """Number of instants."""
        return _core.sample_count(self.duration, self.sample_interval)

    def instants(self) -> np.ndarray:
        """0, sample_interval, ... and, where it is no multiple of the interval, the duration [s]."""
        return _core.sample_times(self.duration, self.sample_interval)

    def grid(self) -> dict[str, Any]:
        """Duration, sample interval and number of samples, as runs of the core take them."""
        return {"duration": self.duration, "sample_interval": self.sample_interval, "samples": self.samples}


class Whole(Protocol):
    """A scenario, as far as its tables are checked against each other."""

    @property
    def tables(self) -> Any: ...
    def own_key(self, key: str) -> str: ...
    def train(self) -> DriveTrain: ...
    def commanded(self) -> list[str]: ...
    def axes(self) -> dict[str, Controller]: ...
    def continuous(self) -> dict[str, ContinuousController]: ...
    def core(self) -> _core.Train: ...
    def begin(self) -> Any: ...
    def start(self) -> dict[str, float]: ...
    def control(self) -> Any: ...


class ScenarioTables(Part):
    """Tables of a scenario."""

    if TYPE_CHECKING:
        title: str
        initial: Any
        task: Any
        simulation: SimulationTable

    @classmethod
    def _subject(cls) -> str:
        return "the scenario"
