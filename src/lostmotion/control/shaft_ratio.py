"""Ratio of the turns of two shafts."""

from __future__ import annotations

from ..model.train import DriveTrain


def turns(train: DriveTrain, start: str, end: str) -> float | None:
    """Turns of shaft `start` for one turn of shaft `end`, through gears and clutches; None without a path."""
    found, waiting = {start: 1.0}, [start]
    joints = [(g.input, g.output, g.ratio) for g in train.fixed_gears().values()]
    joints += train.held_together()
    while waiting:
        here = waiting.pop()
        for one, other, ratio in joints:
            for a, b, i in ((one, other, ratio), (other, one, 1.0 / ratio)):
                if a == here and b not in found:
                    found[b] = found[a] * i
                    waiting.append(b)
    return found.get(end)
