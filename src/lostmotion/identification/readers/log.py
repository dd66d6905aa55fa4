"""A log: channels over time in SI units, the values of its header, and notes on dropped samples."""

from __future__ import annotations

import gc
import logging
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...errors import InputError
from ...inputs.refusal_messages import MAX_LISTED, did_you_mean, shortened


def reason(error: Exception) -> str:
    """Message of a library on a file that it cannot read, in one line."""
    if isinstance(error, MemoryError):
        return "it announces more than fits into memory"
    return shortened(" ".join(str(error).split()), MAX_LISTED) or "it is damaged"


@contextmanager
def as_refusal(what: str, remedy: str = "") -> Iterator[None]:
    """Whatever a library raises about a file, as one message: `what` the file is not, the reason, and a remedy."""
    try:
        yield
    except (InputError, ImportError):
        raise
    except Exception as error:  # the library raises what its parts raise
        raise InputError(f"{what} ({reason(error)}){remedy}") from None


@contextmanager
def warnings_of(library: str) -> Iterator[list[str]]:
    """Collect the log messages of a library about a file instead of printing them."""
    said: list[str] = []
    handler = logging.Handler(logging.WARNING)
    handler.emit = lambda record: said.append(" ".join(record.getMessage().split()))  # type: ignore[method-assign]
    names = [name for name in logging.root.manager.loggerDict if name.partition(".")[0] == library]
    before = [(logger, logger.handlers, logger.propagate) for logger in map(logging.getLogger, names)]
    for logger, _, _ in before:
        logger.handlers, logger.propagate = [handler], False
    try:
        yield said
    finally:
        for logger, handlers, passing in before:
            logger.handlers, logger.propagate = handlers, passing


@contextmanager
def quiet_ends() -> Iterator[None]:
    """Objects of a library that end half-made print no traceback."""
    before = sys.unraisablehook
    sys.unraisablehook = lambda _: None
    try:
        yield
    finally:
        gc.collect()
        sys.unraisablehook = before


@dataclass(frozen=True)
class Channel:
    """Samples of one quantity, one for each instant of the log."""

    values: np.ndarray
    unit: str = ""  #: unit as in the file; empty if the file has none


@dataclass(frozen=True)
class Log:
    """The record of one measurement: channels, header and notes."""

    name: str  #: name of its file
    time: np.ndarray  #: [s]
    channels: Mapping[str, Channel]
    header: Mapping[str, Any] = field(default_factory=dict)
    """numbers and words that hold for the whole log, such as the mass that was moved"""
    notes: tuple[str, ...] = ()  #: dropped samples and doubtful items, one line each

    def values(self, name: str) -> np.ndarray:
        """Values of a channel as in the file.

        Raises
        ------
        InputError
            There is none of that name.
        """
        if name not in self.channels:
            meant = did_you_mean(name, self.channels, f"its channels are {', '.join(self.channels)}")
            raise InputError(f"{self.name}: has no channel {name}; {meant}")
        return self.channels[name].values

    def only(self, kept: np.ndarray, note: str) -> Log:
        """The log with some of its samples, and why the others are not there."""
        channels = {name: replace(c, values=c.values[kept]) for name, c in self.channels.items()}
        return replace(self, time=self.time[kept], channels=channels, notes=(*self.notes, note))

    def noted(self, note: str) -> Log:
        """The same log with one more note."""
        return replace(self, notes=(*self.notes, note))

    @property
    def duration(self) -> float:
        """[s]"""
        return float(self.time[-1] - self.time[0])

    @property
    def interval(self) -> float:
        """Median time between two samples [s]."""
        return float(np.median(np.diff(self.time)))


def as_number(value: Any) -> Any:
    """A text that is a number, as one; anything else as it is."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.item()
    try:
        return float(value) if isinstance(value, str) else value
    except ValueError:
        return value
