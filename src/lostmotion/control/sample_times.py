"""Sample times of loops, which nest."""

from __future__ import annotations

import math

from ..errors import InputError

MAX_TICKS = 1_000_000  # of the base tick in a sample time


def whole_multiple(time: float, base: float, key: str) -> int:
    """How many times `base` a sample time is.

    Raises
    ------
    InputError
        It is no whole multiple.
    """
    ticks = round(time / base)
    if ticks < 1 or ticks > MAX_TICKS or not math.isclose(ticks * base, time, rel_tol=1e-9):
        near = max(1, min(ticks, MAX_TICKS)) * base
        raise InputError(
            f"{key}: {time:g} s is no whole multiple of the sample time {base:g} s; take {near:g} s, or another sample time"
        )
    return ticks
