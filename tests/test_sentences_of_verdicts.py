"""Sentences of verdicts against their numbers: a limit that is missed is not missed by 0 %, and its texts differ."""

import math
import re

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from lostmotion.sizing.axis_rules import least, with_safety
from lostmotion.sizing.finding import Finding, within
from lostmotion.studies.selection.nearest_misses import Miss, _rounded_up
from lostmotion.studies.selection.ranking import RankedCandidate
from lostmotion.units.practical import ROUNDING, counted, excess, part_of_whole, share_of_limit, told_apart

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
def test_what_is_short_of_a_wanted_value_is_so_in_print(limit: float, share: float) -> None:
    found = least("gearbox_life", "life", limit * (1.0 - share), limit, "h", "wanted life")
    assert found.verdict == "warning"
    shown, wanted = numbers(found)
    assert shown < wanted
    assert percents(found.remark)[0] > 0.0


@given(limit=LIMITS, below=st.floats(0.0, 1.0))
def test_what_keeps_a_limit_is_not_said_to_exceed_it(limit: float, below: float) -> None:
    found = within("voltage", "voltage", limit * (1.0 - below), limit, "V", "limit")
    assert (found.verdict, found.remark) == ("ok", "")
    shown, most = numbers(found)
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


@given(share=st.floats(1e-12, 1e6))
def test_an_excess_is_never_0_percent(share: float) -> None:
    assert percents(excess(share))[0] > 0.0


@given(use=st.floats(0.0, 1.0))
def test_a_share_that_keeps_a_limit_is_at_most_100_percent(use: float) -> None:
    assert percents(share_of_limit(use))[0] <= 100.0


@given(share=st.floats(0.0, 1.0))
@example(share=1e-12)
@example(share=1.0 - 1e-12)
def test_a_part_is_nothing_or_all_only_where_it_is(share: float) -> None:
    said = part_of_whole(share)
    assert (said == "0 %") == (share == 0.0)
    assert (said == "100 %") == (share == 1.0)
    assert abs(float(re.findall(r"\d+", said)[0]) - 100.0 * share) <= 1.0


def test_texts_that_need_not_differ_have_four_digits() -> None:
    assert told_apart(1.00001, 1.0, differ=False) == ("1", "1")
    assert told_apart(1.00001, 1.0) == ("1.00001", "1")


def test_one_thing_has_no_plural() -> None:
    assert (counted(1, "run"), counted(2, "run"), counted(0, "run")) == ("1 run", "2 runs", "0 runs")


@given(excess_of_factor=st.floats(1e-5, 9.0))
@example(excess_of_factor=2e-5)
def test_a_cycle_is_longer_by_no_more_than_a_miss_needs(excess_of_factor: float) -> None:
    """Two digits of what the factor is beyond 1 are 10 % of it at most, and hundredths above 0.1."""
    found = _rounded_up(1.0 + excess_of_factor) - 1.0
    assert excess_of_factor * (1.0 - 1e-5) <= found
    assert found <= excess_of_factor + max(0.01 if excess_of_factor >= 0.1 else 0.0, 0.1 * excess_of_factor) + 1e-9


@given(share=st.floats(2e-9, 1e3))
def test_a_miss_is_never_0_percent_over_its_limit(share: float) -> None:
    miss = Miss(RankedCandidate(0, "pair", ("current",), "", "", {}), {"current": share}, None)
    (percent,) = percents(str(miss))
    assert percent > 0.0
