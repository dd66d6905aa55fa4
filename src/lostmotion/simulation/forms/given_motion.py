"""Motions that are given: of a scenario as signals of speed and acceleration, of a step of a simulation by its end."""

import itertools
import math
from collections.abc import Mapping
from typing import Any

from ...control.references import PositionReference, SlideReference
from ...errors import InputError
from ...inputs.quantities import Number, argument
from ...inputs.refusal_messages import did_you_mean, shown
from ...model.signals import Breakpoint, Signal, taylor

UNITS = {"angle": "rad", "speed": "rad/s", "acceleration": "rad/s^2"}
SLIDE_UNITS = {"position": "m", "speed": "m/s", "acceleration": "m/s^2"}


class MotionDerivative(Signal[Number]):
    """The speed (order 1) or the acceleration (order 2) of a position that is given."""

    reference: PositionReference | SlideReference
    order: int

    def breakpoint_list(self) -> list[Breakpoint]:
        return [(piece[0], piece[1 + self.order], piece[2 + self.order]) for piece in self.reference.pieces()]

    def sine_list(self) -> list[tuple[float, float, float]]:
        found = []
        for amplitude, frequency, phase in self.reference.sine_list():
            factor = 2.0 * math.pi * frequency
            size = factor * amplitude if self.order == 1 else factor * factor * amplitude
            found.append((size, frequency, phase + 0.5 * math.pi * self.order))
        return found


def check_continuous(reference: PositionReference | SlideReference, unit: str) -> None:
    """Refuse a position that jumps, or whose speed does.

    unit: of the position.

    Raises ValueError
    """
    pieces = reference.pieces()
    for order, what, unit_there in ((0, "position", unit), (1, "speed", f"{unit}/s")):
        size = max(abs(piece[1 + order]) for piece in pieces)
        for (begin, *given), (end, *after) in itertools.pairwise(pieces):
            before = taylor(given, end - begin)[order]
            if not math.isclose(before, after[order], rel_tol=1e-9, abs_tol=1e-9 * max(size, 1e-300)):
                raise ValueError(
                    f"its {what} jumps at {end:g} s from {before:.6g} to {after[order]:.6g} {unit_there}, which takes an infinite "
                    "acceleration; give moves"
                )


def motion_given(name: str, values: Any, units: Mapping[str, str] = UNITS) -> dict[str, float]:
    """Given motion at the end of a step, in SI.

    units: of what may be given: units of a shaft, or of a slide.

    Raises InputError: there is no speed among it, or something else.
    """
    check_motion(f"motion.{name}", values, units)
    return {key: argument(f"motion.{name}.{key}", value, units[key]) for key, value in values.items()}


def check_motion(where: str, values: Any, units: Mapping[str, str] = UNITS) -> None:
    """Refuse what names no motion. Raises InputError: there is no speed among it, or something else."""
    if not isinstance(values, Mapping):
        raise InputError(
            f'{where}: {shown(values)} must name what is given, such as {{"speed": 2.0, "acceleration": 0.0}}'
        )
    for key in values:
        if key not in units:
            raise InputError(f"{where}.{key}: is not known; {did_you_mean(key, units, f'there are {list(units)}')}")
    if "speed" not in values:
        raise InputError(f"{where}.speed: is missing; give the speed at the end of the interval [{units['speed']}]")
