"""The stiffness of a gear over the angle of its input shaft, as pairs of teeth come into mesh and leave it."""

import itertools
import math
from typing import Self

from pydantic import model_validator

from .. import _core
from ..inputs import described
from ..inputs.breakpoints import RESOLUTION, check_apart
from ..reproducible import total


class MeshStiffness(described.MeshStiffnessFields):
    """A factor on the stiffness of a gear over the angle of its input shaft, constant while the same pairs of teeth mesh.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.model.MeshStiffness(teeth=30, contact_ratio=1.6, fewer_pairs=0.7).mean()
    0.88
    """

    @model_validator(mode="after")
    def _is_one_form(self) -> Self:
        by_ratio = (self.contact_ratio, self.fewer_pairs)
        if bool(self.pairs) == any(value is not None for value in by_ratio):
            raise ValueError("needs contact_ratio and fewer_pairs, or pairs in place of both")
        if not self.pairs and None in by_ratio:
            raise ValueError("has one of contact_ratio and fewer_pairs; give both")
        if self.contact_ratio is not None and self.contact_ratio % 1.0 == 0.0:
            raise ValueError(
                f"has a contact_ratio of {self.contact_ratio:g}, with which the number of pairs never changes; leave the table out"
            )
        shares = [share for share, _ in self.pairs]
        if shares and shares[0] != 0.0:
            raise ValueError(f"has pairs that begin at {shares[0]:g}; the first must be 0, the begin of the period")
        for k, (a, b) in enumerate(itertools.pairwise(shares)):
            if b <= a:
                raise ValueError(f"shares must rise, but pairs[{k + 1}] begins at {b:g} after {a:g}")
        if shares and shares[-1] >= 1.0:
            raise ValueError(
                f"has pairs that begin at {shares[-1]:g}; the last must begin below 1, the end of the period"
            )
        check_apart((*shares, 1.0), "shares")
        return self

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
