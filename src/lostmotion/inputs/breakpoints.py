"""Breakpoints of piecewise-linear laws."""

import itertools
from collections.abc import Iterator, Sequence

RESOLUTION = 1e-9  # of the largest breakpoint; the solver takes 4e-12 of the terms of a condition for zero


def check_rising(values: Sequence[float], name: str) -> Iterator[str]:
    """Refuse values that do not rise."""
    for k, (a, b) in enumerate(itertools.pairwise(values)):
        if b <= a:
            yield f"{name} must rise, but {name}[{k + 1}] = {b} follows {a}"


def check_apart(breakpoints: Sequence[float], name: str = "") -> None:
    """Refuse rising breakpoints that the solver cannot tell apart."""
    largest = max(map(abs, breakpoints))
    for a, b in itertools.pairwise(breakpoints):
        if b - a < RESOLUTION * largest:
            raise ValueError(
                f"{name} {a:.17g} and {b:.17g} are too close: they differ by less than {RESOLUTION:g} of the largest, "
                f"{largest:.6g}; leave one of them out".lstrip()
            )
