"""The stiffness of a gear over the angle of its input shaft, as pairs of teeth come into mesh and leave it."""

import itertools
import math
from collections.abc import Iterator
from typing import Annotated

from pydantic import Field

from .. import _core
from ..inputs.breakpoints import RESOLUTION, check_apart, check_rising
from ..inputs.part import Part, rule
from ..inputs.quantities import Angle, Limit, NotNegative, Number, Positive, UpToOne
from ..reproducible import total


class MeshStiffness(Part):
    """A factor on the stiffness of a gear over the angle of its input shaft, constant while the same pairs of teeth mesh.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.model.MeshStiffness(teeth=30, contact_ratio=1.6, fewer_pairs=0.7).mean()
    0.88
    """

    teeth: Annotated[Number, Positive]
    """teeth of the wheel on the input shaft; for other gears, mesh periods in one turn of the input shaft"""
    contact_ratio: Annotated[Number, Limit(ge=1.0)] | None = None
    """mean number of pairs of teeth in mesh; its fraction is the share of the period in which one pair more meshes, with the factor 1"""
    fewer_pairs: Annotated[Number, UpToOne] | None = None
    """factor on the stiffness while the fewer pairs mesh, below 1; with contact_ratio"""
    phase: Angle = 0.0
    """angle of the input shaft at which a period begins: with contact_ratio, at the middle of the more pairs"""
    pairs: Annotated[
        tuple[tuple[Annotated[Number, NotNegative], Annotated[Number, Positive]], ...], Field(max_length=1000)
    ] = ()
    """in place of contact_ratio and fewer_pairs: from which share of a mesh period on, and the factor on the stiffness"""

    @rule
    def _is_one_form(self) -> Iterator[str]:
        by_ratio = (self.contact_ratio, self.fewer_pairs)
        if bool(self.pairs) == any(value is not None for value in by_ratio):
            yield "needs contact_ratio and fewer_pairs, or pairs in place of both"
        if not self.pairs and None in by_ratio:
            yield "has one of contact_ratio and fewer_pairs; give both"
        if self.contact_ratio is not None and self.contact_ratio % 1.0 == 0.0:
            yield f"has a contact_ratio of {self.contact_ratio:g}, with which the number of pairs never changes; leave the table out"
        shares = [share for share, _ in self.pairs]
        if shares and shares[0] != 0.0:
            yield f"has pairs that begin at {shares[0]:g}; the first must be 0, the begin of the period"
        yield from check_rising(shares, "shares")
        if shares and shares[-1] >= 1.0:
            yield f"has pairs that begin at {shares[-1]:g}; the last must begin below 1, the end of the period"
        check_apart((*shares, 1.0), "shares")

    def segments(self) -> tuple[tuple[float, float], ...]:
        """(share of a mesh period at which it begins, factor) of each segment, from 0 on."""
        if self.pairs:
            return self.pairs
        assert self.contact_ratio is not None
        assert self.fewer_pairs is not None
        more = self.contact_ratio % 1.0
        return (0.0, 1.0), (0.5 * more, self.fewer_pairs), (1.0 - 0.5 * more, 1.0)

    def mean(self) -> float:
        """The mean of the factor over a period."""
        ends = [*(share for share, _ in self.segments()[1:]), 1.0]
        return total((end - begin) * factor for (begin, factor), end in zip(self.segments(), ends, strict=True))

    def steps(self) -> int:
        """Steps of the stiffness in one mesh period: each of them is an event of a run."""
        factors = [factor for _, factor in self.segments()]
        return sum(a != b for a, b in itertools.pairwise([factors[-1], *factors]))

    def curve(self) -> tuple[float, list[float], list[float]]:
        """Period, angles in it at which the factor steps [rad], and the factors from there on."""
        period = 2.0 * math.pi / self.teeth
        rounding = RESOLUTION * period

        def angle(share: float) -> float:
            found = (share * period + self.phase) % period
            return found if rounding < found < period - rounding else 0.0

        begins = sorted((angle(share), factor) for share, factor in self.segments())
        steps = [b for a, b in itertools.pairwise([begins[-1], *begins]) if a[1] != b[1]] or begins[:1]
        return period, [angle for angle, _ in steps], [factor for _, factor in steps]

    def core(self) -> _core.PeriodicCurve:
        return _core.PeriodicCurve(*self.curve())
