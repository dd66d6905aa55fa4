"""The one verdict of a page or a command: four states, derived from the answers to all questions that were asked."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, get_args

State = Literal["fits", "fits with a reservation", "does not fit", "not decided"]
ORDER: tuple[State, ...] = ("does not fit", "not decided", "fits with a reservation", "fits")
"""The state of a verdict is the first of these that one of its points has."""
HEADINGS: dict[State, str] = {state: state.replace("fits with", "fits, with") for state in get_args(State)}
EXIT_CODES: dict[State, int] = {"fits": 0, "fits with a reservation": 0, "does not fit": 1, "not decided": 3}
EXIT_HELP = "Exit code 0: fits, with or without a reservation; 1: does not fit, or an error; 3: not decided."
NOTHING = "Nothing was judged: the input states no requirement and no limit."


@dataclass(frozen=True)
class Point:
    """Answer to one question that was asked.

    Attributes
    ----------
    state : {"fits", "fits with a reservation", "does not fit", "not decided"}
        The answer.
    sentence : str
        The point, its value, its limit and the difference: "the window of 1 arcmin is missed by 5.9 arcmin".
    """

    state: State
    sentence: str


@dataclass(frozen=True)
class Verdict:
    """Answer to all that was asked.

    Attributes
    ----------
    state : {"fits", "fits with a reservation", "does not fit", "not decided"}
        The answer.
    lines : tuple of str
        The point that decides, and what else a reader should know first.

    Examples
    --------
    >>> from lostmotion.verdict import Point, Verdict
    >>> window = Point("does not fit", "the window of 1 arcmin is missed by 5.9 arcmin")
    >>> verdict = Verdict.of([Point("fits", "the loops are stable"), window], ["gain margin 12 dB"])
    >>> print(verdict)
    does not fit: the window of 1 arcmin is missed by 5.9 arcmin
    >>> verdict.exit_code, verdict.lines[1]
    (1, 'gain margin 12 dB')
    """

    state: State
    lines: tuple[str, ...]

    @classmethod
    def of(cls, points: Iterable[Point], lines: Iterable[str] = ()) -> Verdict:
        """Verdict by the worst point; among several of its state, the first one decides.

        Parameters
        ----------
        points
            Answers to all questions, the most important first. Without any, nothing was judged and the verdict is not decided.
        lines
            Lines after the sentence of the point that decides.
        """
        found = min(points, key=lambda point: ORDER.index(point.state), default=Point("not decided", NOTHING))
        return cls(found.state, (found.sentence, *lines))

    @property
    def exit_code(self) -> int:
        """Exit code of the command that gives this verdict."""
        return EXIT_CODES[self.state]

    @property
    def heading(self) -> str:
        """The state as headings have it."""
        return HEADINGS[self.state]

    def __str__(self) -> str:
        """The line that commands print."""
        return f"{self.heading}: {self.lines[0]}"
