"""One verdict of all that was asked: four states, their order, headings, colours and exit codes."""

import re
from itertools import permutations
from typing import get_args

import pytest

from lostmotion.reports.page import style, verdict
from lostmotion.verdict import Point, State, Verdict

STATES = get_args(State)
WORST_FIRST = ("does not fit", "not decided", "fits with a reservation", "fits")


@pytest.mark.parametrize("points", list(permutations([Point(state, f"sentence of {state}") for state in STATES])))
def test_the_worst_point_decides_whatever_the_order(points: tuple[Point, ...]) -> None:
    for count in range(1, len(points) + 1):
        found = Verdict.of(points[:count], ["more"])
        worst = min((p.state for p in points[:count]), key=WORST_FIRST.index)
        assert (found.state, found.lines) == (worst, (f"sentence of {worst}", "more"))


def test_the_first_of_several_points_of_one_state_decides() -> None:
    found = Verdict.of([Point("fits", "a"), Point("does not fit", "b"), Point("does not fit", "c")])
    assert str(found) == "does not fit: b"


def test_nothing_judged_is_not_decided() -> None:
    found = Verdict.of([])
    assert (found.state, found.exit_code) == ("not decided", 3)
    assert found.lines[0]


def test_exit_codes_and_headings_of_the_four_states() -> None:
    verdicts = [Verdict(state, ("text",)) for state in STATES]
    assert [(v.heading, v.exit_code) for v in verdicts] == [
        ("fits", 0),
        ("fits, with a reservation", 0),
        ("does not fit", 1),
        ("not decided", 3),
    ]


def test_each_state_has_a_colour_of_its_own_on_pages() -> None:
    shown = [verdict(Verdict(state, ("text",))) for state in STATES]
    kinds = [found.group(1) for text in shown if (found := re.search(r'class="verdict (\w+)"', text))]
    colours = [re.search(rf"\.verdict\.{kind} {{\s*border-color: (\S+);", style()) for kind in kinds]
    assert len({found.group(1) for found in colours if found}) == len(STATES)
    assert [Verdict(s, ("",)).heading in text for s, text in zip(STATES, shown, strict=True)] == [True] * len(STATES)


def test_lines_without_a_question_are_a_result_and_no_verdict() -> None:
    assert "Verdict" not in verdict(("2 s of motion",))
