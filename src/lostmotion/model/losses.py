"""The losses of a gearbox."""

from __future__ import annotations

import itertools
from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from .. import _core
from ..inputs.part import Part
from ..inputs.quantities import (
    Limit,
    NotNegative,
    Number,
    Switch,
)


class ConstantEfficiency(Part):
    """T_1 = T_2/(i eta) in both directions of power flow (5b), so it creates energy while the load drives."""

    kind: Literal["constant_efficiency"] = "constant_efficiency"
    efficiency: Annotated[Number, Limit(gt=0.0, le=1.0)]


class LossMap(Part):
    """Loss coefficient m_2B over relative speed and signed relative load (12), linear on triangles."""

    kind: Literal["map"] = "map"
    speeds: tuple[Annotated[Number, NotNegative], ...] = Field(min_length=2)
    """v = |w_M|/n_1R, rising from 0"""
    loads: tuple[Number, ...] = Field(min_length=2)
    """mu = T_2 sign(w_M)/T_2R, rising; positive where the motor drives"""
    values: tuple[tuple[Annotated[Number, NotNegative], ...], ...]
    """m_2B, one row for each load, one entry for each speed"""
    mirrored: Switch = False
    """loads begin at 0 and hold for both directions of power flow"""

    @field_validator("speeds", "loads")
    @classmethod
    def _rising(cls, axis: tuple[float, ...]) -> tuple[float, ...]:
        for k, (a, b) in enumerate(itertools.pairwise(axis)):
            if b <= a:
                raise ValueError(f"must rise, but entry {k + 1} is {b} after {a}")
        return axis

    @model_validator(mode="after")
    def _is_a_map(self) -> Self:
        if self.speeds[0] != 0.0:
            raise ValueError(f"has speeds that begin at {self.speeds[0]}; the first must be 0, for sticking")
        if len(self.values) != len(self.loads):
            raise ValueError(
                f"has {len(self.values)} rows of values for {len(self.loads)} loads; it needs one for each"
            )
        for j, row in enumerate(self.values):
            if len(row) != len(self.speeds):
                raise ValueError(
                    f"has a hole: row {j} (load {self.loads[j]}) has {len(row)} values for {len(self.speeds)} speeds"
                )
        if self.mirrored and self.loads[0] != 0.0:
            raise ValueError(f"is mirrored, so its loads must begin at 0, not {self.loads[0]}")
        if not self.mirrored and not self.loads[0] < 0.0 < self.loads[-1]:
            raise ValueError(
                "covers only one direction of power flow; add loads of the other sign or set mirrored = true"
            )
        return self

    def whole(self) -> tuple[list[float], list[float], list[list[float]]]:
        """(speeds, loads, values[load][speed]) with both signs of the load."""
        loads, values = list(self.loads), [list(row) for row in self.values]
        if self.mirrored:
            loads = [-x for x in reversed(loads[1:])] + loads
            values = list(reversed(values[1:])) + values
        return list(self.speeds), loads, values

    def core(self) -> _core.LossMap:
        speeds, loads, values = self.whole()
        return _core.LossMap(speeds, loads, [x for row in values for x in row])
