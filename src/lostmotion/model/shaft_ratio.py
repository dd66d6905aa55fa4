"""Speeds of shafts that gears and clutches tie to each other, and the ratio of the turns of two shafts."""

from collections.abc import Iterable, Mapping

from .train import DriveTrain

Joint = tuple[str, str, float]  # input, output, and the speed of the input over the speed of the output


def joints_of(train: DriveTrain) -> list[Joint]:
    """All that joins two shafts at a fixed ratio: gears on the frame, and what may hold two shafts at one speed."""
    return [(g.input, g.output, g.ratio) for g in train.fixed_gears().values()] + train.held_together()


def tied(speeds: Mapping[str, float], joints: Iterable[Joint]) -> dict[str, float]:
    """Given speeds of shafts, and the speeds of the shafts that joints tie to them."""
    found, waiting = dict(speeds), list(speeds)
    both_ways = [way for a, b, ratio in joints for way in ((a, b, 1.0 / ratio), (b, a, ratio))]
    while waiting:
        here = waiting.pop()
        for shaft, other, factor in both_ways:
            if shaft == here and other not in found:
                found[other] = found[here] * factor
                waiting.append(other)
    return found


def turns(train: DriveTrain, start: str, end: str) -> float | None:
    """Turns of shaft `start` for one turn of shaft `end`, through gears and clutches; None without a path."""
    return tied({start: 1.0}, [(output, input_, ratio) for input_, output, ratio in joints_of(train)]).get(end)
