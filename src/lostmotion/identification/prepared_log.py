"""A log that is compared with runs of the rig: channels in SI, what formulas may name, and phases."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from .readers.log import Log
from .task.identification_file import FormulaText, Identification


@dataclass(frozen=True)
class Segment:
    """Samples ``begin`` to ``end`` of a log, in one phase of the rig (-1: as it is)."""

    begin: int
    end: int
    phase: int
    initial: Mapping[str, FormulaText] | None = None
    """formulas of the measured state at which a run begins anew, by dotted key of the scenario; None: it goes on from the segment
    before"""


@dataclass
class Prepared:
    """A log that is compared with runs of the rig."""

    log: Log  # screened; all channels whose unit is known in SI
    time: np.ndarray  # [s], from 0
    inputs: dict[str, np.ndarray]
    measured: dict[str, np.ndarray]
    """NaN where a channel has no number: such samples are not compared, and what acts goes on"""
    facts: dict[str, Any]  # names for formulas: its header, and `first_CHANNEL` and `mean_CHANNEL` in SI
    segments: tuple[Segment, ...]
    held_out: bool
    weight: np.ndarray  # weight of each sample, by which its errors are multiplied
    first: bool  # whether the search is to begin with it
    begin: float = 0.0  # [s] of the run: of a log behind a pause, when all that acts is known
    cache: dict[Any, Any] = field(default_factory=dict, repr=False)

    @cached_property
    def valid(self) -> np.ndarray:
        """Channels x samples: whether there is a number."""
        return np.asarray(np.isfinite(np.array(list(self.measured.values()))))

    @property
    def name(self) -> str:
        """Name of its file."""
        return self.log.name

    def changed(
        self, task: Identification, channels: Mapping[str, np.ndarray], *, time: np.ndarray | None = None
    ) -> Prepared:
        """The log with other values of some channels of its file [SI], or at other times [s]."""
        values = {name: replace(self.log.channels[name], values=x) for name, x in channels.items()}
        own = replace(self.log, time=self.log.time if time is None else time, channels={**self.log.channels, **values})
        return replace(
            self,
            log=own,
            time=own.time - own.time[0],
            inputs={name: own.values(i.channel) for name, i in task.inputs.items()},
            measured={name: own.values(m.channel) for name, m in task.measured.items()},
            facts=self.facts | facts_of(own),
            cache={},
        )

    def part(self, begin: int, end: int) -> Prepared:
        """Some of its samples as a log of their own, whose time begins at 0; all of them as they are."""
        if (begin, end) == (0, len(self.time)):
            return self
        samples = slice(begin, end)
        own = replace(
            self.log,
            name=self.name if begin == 0 else f"{self.name} from {self.time[begin]:.4g} s",
            time=self.log.time[samples],
            channels={name: replace(c, values=c.values[samples]) for name, c in self.log.channels.items()},
            notes=self.log.notes if begin == 0 else (),
        )
        segments = [
            Segment(max(s.begin, begin) - begin, min(s.end, end) - begin, s.phase, s.initial)
            for s in self.segments
            if s.begin < end and s.end > begin
        ]
        return replace(
            self,
            log=own,
            time=self.time[samples] - self.time[begin],
            inputs={name: x[samples] for name, x in self.inputs.items()},
            measured={name: x[samples] for name, x in self.measured.items()},
            facts=self.facts | first_values(own) if begin > 0 else self.facts,
            segments=tuple(segments),
            weight=self.weight[samples],
            cache={},
        )


def facts_of(log: Log) -> dict[str, Any]:
    """Facts of a log that formulas may name."""
    facts = {key: value for key, value in log.header.items() if isinstance(value, int | float | str)}
    for name, channel in log.channels.items():
        if (there := np.isfinite(channel.values)).any():
            facts[fact_names(name)[1]] = float(np.mean(channel.values[there]))
    return facts | first_values(log)


def first_values(log: Log) -> dict[str, float]:
    """``first_CHANNEL`` of the channels of a log: the first value that is a number."""
    return {
        fact_names(name)[0]: float(channel.values[np.argmax(there)])
        for name, channel in log.channels.items()
        if (there := np.isfinite(channel.values)).any()
    }


def fact_names(channel: str) -> tuple[str, str]:
    """Names of the first value and the mean of a channel in formulas."""
    key = "".join(c if c.isalnum() else "_" for c in channel)
    return f"first_{key}", f"mean_{key}"
