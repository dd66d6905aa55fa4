"""The verdict of a selection: a fit, a reservation, no fit, or not decided, and what each says first."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from lostmotion.reports.study_selection import SelectionReport
from lostmotion.studies.runs.candidate_rows import HOLDS
from lostmotion.studies.selection.ranking import NOT_RUN, RankedCandidate
from lostmotion.studies.study.drive_check_columns import NO_DATA, UNSTABLE
from lostmotion.studies.study.select_table import Selection
from lostmotion.verdict import Verdict

pa = pytest.importorskip("pyarrow")
SELECT = Selection(objectives={"mass": "least"})
STUDY = SimpleNamespace(select=SELECT, axis=None)


def candidate(run: int, *violated: str, not_judged: str = "", estimated: str = "") -> RankedCandidate:
    mass = {"mass": 1.0 + run}
    return RankedCandidate(run, f"pair {run}", violated, " ".join(violated), not_judged, mass, estimated=estimated)


def verdict(*ranked: RankedCandidate) -> Verdict:
    table = pa.table({"mass": [c.values["mass"] for c in ranked]})
    return SelectionReport(table, STUDY, list(ranked)).verdict


CASES: list[tuple[list[RankedCandidate], tuple[str, int], str]] = [
    ([candidate(0), candidate(1, "current")], ("fits", 0), "1 of 2 candidates fits"),
    # Voltage is judged for none of those that fit.
    (
        [candidate(0, not_judged="voltage"), candidate(1, not_judged="voltage current"), candidate(2, "current")],
        ("fits with a reservation", 0),
        "not judged: voltage (of none that fits)",
    ),
    ([candidate(0, not_judged="voltage"), candidate(1)], ("fits with a reservation", 0), "the first without a reservation is pair 1"),
    ([candidate(0, estimated=HOLDS)], ("fits", 0), ""),
    ([candidate(0, estimated="not decided: fits to violates")], ("fits with a reservation", 0), ""),
    ([candidate(0, "current"), candidate(1, "voltage", "current")], ("does not fit", 1), "0 of 2 candidates fit"),
]
CASES += [
    ([candidate(0, "current"), replace(candidate(1, why), why=why)], ("not decided", 3), "0 of 2 candidates fit, 1 cannot be judged")
    for why in (NO_DATA, NOT_RUN, UNSTABLE)
]


@pytest.mark.parametrize(("ranked", "state", "line"), CASES)
def test_candidates_make_a_verdict(ranked: list[RankedCandidate], state: tuple[str, int], line: str) -> None:
    found = verdict(*ranked)
    assert (found.state, found.exit_code) == state
    assert line in found.lines[0]
