"""Signals of a controller at a tick as linear forms, computed one after the other as the controller does."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

INPUTS = ("reference", "rate", "second", "measured")
"""of a loop: its reference with two derivatives, and what takes the place of its measured value where it is cut"""

Row = np.ndarray
"""a signal as a linear form over the state at a tick, and the inputs"""


@dataclass
class Tick:
    """The signals of one tick, computed in the order of the controller."""

    names: list[str]
    """of the state"""
    rows: dict[str, Row] = field(default_factory=dict)

    def __post_init__(self) -> None:
        unit = np.eye(len(self.names) + len(INPUTS))
        self.rows = dict(zip((*self.names, *INPUTS), unit, strict=True))

    def __getitem__(self, name: str) -> Row:
        return self.rows[name]

    def __setitem__(self, name: str, row: Row) -> None:
        self.rows[name] = row

    @property
    def zero(self) -> Row:
        """Nothing."""
        return np.zeros(len(self.names) + len(INPUTS))

    def delayed(self, name: str, row: Row, ticks: int) -> Row:
        """A signal some ticks ago."""
        for k in range(ticks):
            row, self[f"{name}{k}"] = self[f"{name}{k}"], row
        return row

    def filtered(self, name: str, row: Row, system: tuple[np.ndarray, np.ndarray, np.ndarray, float]) -> Row:
        """A signal behind a discrete system (A, B, C, D)."""
        A, B, C, D = system
        z = [self[f"{name}{k}"] for k in range(len(B))]
        for k, (a, b) in enumerate(zip(A, B, strict=True)):
            self[f"{name}{k}"] = b * row + sum((x * y for x, y in zip(a, z, strict=True)), self.zero)
        return np.asarray(D * row + sum((c * y for c, y in zip(C, z, strict=True)), self.zero))
