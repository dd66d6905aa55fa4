"""The verdict of a selection: a fit, a reservation, no fit, or not decided, and what each says first."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from lostmotion.reports.study_selection import _verdict
from lostmotion.studies.runs.axis_pairs import HOLDS
from lostmotion.studies.selection.ranking import NOT_RUN, RankedCandidate, prices
from lostmotion.studies.study.drive_check_columns import NO_DATA, UNSTABLE
from lostmotion.studies.study.select_table import Selection
from lostmotion.verdict import Verdict

pa = pytest.importorskip("pyarrow")
SELECT = Selection(objectives={"mass": "least"})
STUDY = SimpleNamespace(select=SELECT)


def candidate(run: int, *violated: str, not_judged: str = "", estimated: str = "") -> RankedCandidate:
    mass = {"mass": 1.0 + run}
    return RankedCandidate(run, f"pair {run}", violated, " ".join(violated), not_judged, mass, estimated=estimated)


def verdict(*ranked: RankedCandidate) -> Verdict:
    table = pa.table({"mass": [c.values["mass"] for c in ranked]})
    return _verdict(table, list(ranked), prices(list(ranked), SELECT), STUDY, [])


def test_a_pair_that_keeps_all_limits_fits() -> None:
    found = verdict(candidate(0), candidate(1, "current"))
    assert (found.state, found.exit_code, found.lines[0]) == ("fits", 0, "1 of 2 candidates fits")


def test_what_was_judged_for_no_pair_is_a_reservation() -> None:
    """Voltage is judged for none of those that fit."""
    found = verdict(candidate(0, not_judged="voltage"), candidate(1, not_judged="voltage current"), candidate(2, "current"))
    assert (found.state, found.exit_code) == ("fits with a reservation", 0)
    assert "not judged: voltage (of none that fits)" in found.lines[0]


def test_a_reservation_names_the_first_pair_that_has_none() -> None:
    found = verdict(candidate(0, not_judged="voltage"), candidate(1))
    assert found.state == "fits with a reservation"
    assert "the first without a reservation is pair 1" in found.lines[0]


@pytest.mark.parametrize(("estimated", "state"), [(HOLDS, "fits"), ("not decided: fits to violates", "fits with a reservation")])
def test_estimated_losses_that_turn_the_verdict_are_a_reservation(estimated: str, state: str) -> None:
    assert verdict(candidate(0, estimated=estimated)).state == state


def test_no_pair_that_fits_does_not_fit() -> None:
    found = verdict(candidate(0, "current"), candidate(1, "voltage", "current"))
    assert (found.state, found.exit_code, found.lines[0]) == ("does not fit", 1, "0 of 2 candidates fit")


@pytest.mark.parametrize("why", [NO_DATA, NOT_RUN, UNSTABLE])
def test_no_pair_that_fits_is_not_decided_while_one_cannot_be_judged(why: str) -> None:
    found = verdict(candidate(0, "current"), replace(candidate(1, why), why=why))
    assert (found.state, found.exit_code) == ("not decided", 3)
    assert found.lines[0] == "0 of 2 candidates fit, 1 cannot be judged"
