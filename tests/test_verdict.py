"""One verdict of all that was asked: four states, their order, headings, colours and exit codes."""

import math
import re
from itertools import permutations
from typing import get_args

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from lostmotion.reports.page import style, verdict
from lostmotion.sizing.axis_rules import least, with_safety
from lostmotion.sizing.finding import Finding, within
from lostmotion.studies.selection.nearest_misses import Miss, _rounded_up
from lostmotion.studies.selection.ranking import RankedCandidate
from lostmotion.units.practical import ROUNDING, counted, excess, part_of_whole, share_of_limit, told_apart
from lostmotion.verdict import Point, State, Verdict

STATES = get_args(State)
WORST_FIRST = ("does not fit", "not decided", "fits with a reservation", "fits")


@pytest.mark.parametrize("points", list(permutations([Point(state, f"sentence of {state}") for state in STATES])))
def test_the_worst_point_decides_whatever_the_order(points: tuple[Point, ...]) -> None:
    for count in range(1, len(points) + 1):
        found = Verdict.of(points[:count], ["more"])
        worst = min((p.state for p in points[:count]), key=WORST_FIRST.index)
        assert (found.state, found.lines) == (worst, (f"sentence of {worst}", "more"))


def test_exit_codes_and_headings_of_the_four_states() -> None:
    verdicts = [Verdict(state, ("text",)) for state in STATES]
    headings = [("fits", 0), ("fits, with a reservation", 0), ("does not fit", 1), ("not decided", 3)]
    assert [(v.heading, v.exit_code) for v in verdicts] == headings
    nothing = Verdict.of([])  # is judged
    assert (nothing.state, nothing.exit_code) == ("not decided", 3) and nothing.lines[0]
    first = Verdict.of([Point("fits", "a"), Point("does not fit", "b"), Point("does not fit", "c")])
    assert str(first) == "does not fit: b"
    assert "Verdict" not in verdict(("2 s of motion",))  # lines without a question are a result


def test_each_state_has_a_colour_of_its_own_on_pages() -> None:
    shown = [verdict(Verdict(state, ("text",))) for state in STATES]
    kinds = [found.group(1) for text in shown if (found := re.search(r'class="verdict (\w+)"', text))]
    colours = [re.search(rf"\.verdict\.{kind} {{\s*border-color: (\S+);", style()) for kind in kinds]
    assert len({found.group(1) for found in colours if found}) == len(STATES)
    assert [Verdict(s, ("",)).heading in text for s, text in zip(STATES, shown, strict=True)] == [True] * len(STATES)


# --- sentences of verdicts against their numbers ---
LIMITS = st.floats(1e-6, 1e6)
MISSED = st.floats(2e-9, 1e4)
"""by how much a limit is exceeded, as a share of it"""


def percents(text: str) -> list[float]:
    return [float(number) for number in re.findall(r"([\d.]+(?:e[+-]\d+)?) %", text)]


def numbers(finding: Finding) -> tuple[float, float]:
    """Value and limit as they are printed."""
    value, limit = re.findall(r"[\d.]+(?:e[+-]\d+)?", finding.value)[:2]
    return float(value), float(limit)


@given(limit=LIMITS, share=MISSED)
@example(limit=1.0, share=2e-5)
@example(limit=100.0, share=0.004)
def test_what_exceeds_a_limit_does_so_in_print(limit: float, share: float) -> None:
    found = within("voltage", "voltage", limit * (1.0 + share), limit, "V", "limit of the amplifier")
    assert found.verdict == "warning"
    shown, most = numbers(found)
    assert shown > most
    (percent,) = percents(found.remark)
    if "less than" in found.remark:
        # The excess is known to a rounding of the limit.
        assert percent == 1e-4
        assert 100.0 * share < percent * (1.0 + 1e-9)
    else:
        assert percent == pytest.approx(100.0 * share, rel=0.051)  # two digits


@given(limit=LIMITS, share=st.floats(2e-9, 0.999))
def test_what_keeps_a_limit_or_is_short_of_a_wanted_value_is_so_in_print(limit: float, share: float) -> None:
    found = least("gearbox_life", "life", limit * (1.0 - share), limit, "h", "wanted life")
    assert found.verdict == "warning"
    shown, wanted = numbers(found)
    assert shown < wanted
    assert percents(found.remark)[0] > 0.0
    kept = within("voltage", "voltage", limit * (1.0 - share), limit, "V", "limit")
    assert (kept.verdict, kept.remark) == ("ok", "")
    shown, most = numbers(kept)
    assert shown <= most


@pytest.mark.parametrize("rpm", [3000.0, 4700.0, 12345.6])
def test_a_value_at_its_limit_keeps_it_whatever_the_units_that_both_came_from(rpm: float) -> None:
    """Two conversions of one speed differ by roundings, 1e-16 each."""
    value = rpm / 60.0 * 2.0 * math.pi * (30.0 / math.pi) * (1.0 + 4e-16)
    assert within("max_motor_speed", "speed", value, rpm, "rpm", "limit").verdict == "ok"
    assert within("max_motor_speed", "speed", rpm * (1.0 + 10.0 * ROUNDING), rpm, "rpm", "limit").verdict == "warning"


@given(use=st.floats(0.5, 2.0), factor=st.floats(0.5, 2.0))
@example(use=1.0, factor=1.00001)
def test_a_safety_factor_that_is_exceeded_says_more_than_100_percent(use: float, factor: float) -> None:
    finding = Finding("voltage", "voltage", "1 of 1 V", "ok" if use <= 1.0 else "warning", "", use)
    (found,) = with_safety([finding], {"voltage": factor})
    (percent,) = percents(found.remark)
    assert (percent > 100.0) == (use * factor > 1.0 + ROUNDING) or percent == 100.0 >= 100.0 * use * factor


@given(share=st.floats(0.0, 1.0))
@example(share=1e-12)
@example(share=1.0 - 1e-12)
def test_a_share_is_nothing_or_all_only_where_it_is_and_an_excess_never_0_percent(share: float) -> None:
    said = part_of_whole(share)
    assert (said == "0 %") == (share == 0.0)
    assert (said == "100 %") == (share == 1.0)
    assert abs(float(re.findall(r"\d+", said)[0]) - 100.0 * share) <= 1.0
    assert percents(share_of_limit(share))[0] <= 100.0
    over = 1e-12 + 1e6 * share
    assert percents(excess(over))[0] > 0.0
    miss = Miss(RankedCandidate(0, "pair", ("current",), "", "", {}), {"current": 2e-9 + 1e3 * share}, None)
    assert percents(str(miss))[0] > 0.0
    assert told_apart(1.00001, 1.0, differ=False) == ("1", "1")  # texts that need not differ have four digits
    assert told_apart(1.00001, 1.0) == ("1.00001", "1")
    assert (counted(1, "run"), counted(2, "run"), counted(0, "run")) == ("1 run", "2 runs", "0 runs")


@given(excess_of_factor=st.floats(1e-5, 9.0))
@example(excess_of_factor=2e-5)
def test_a_cycle_is_longer_by_no_more_than_a_miss_needs(excess_of_factor: float) -> None:
    """Two digits of what the factor is beyond 1 are 10 % of it at most, and hundredths above 0.1."""
    found = _rounded_up(1.0 + excess_of_factor) - 1.0
    assert excess_of_factor * (1.0 - 1e-5) <= found
    assert found <= excess_of_factor + max(0.01 if excess_of_factor >= 0.1 else 0.0, 0.1 * excess_of_factor) + 1e-9
