"""The drive check of each run of a study, as columns of its table."""

import math
from collections.abc import Iterable, Mapping

from ...simulation.scenario.scenario import Scenario
from ...sizing.drive_check import check_drive
from ...sizing.finding import SOURCES, Finding
from .select_table import SHARES, TASK_SHARES, USE

TEXTS = ("violated", "why", "not judged")
"""rules that are violated, in words, and rules without a limit to compare with"""
COLUMNS: dict[str, float | str] = {f"{USE}{rule}": math.nan for rule in SHARES} | dict.fromkeys(TEXTS, "")
"""each with what stands in the row of a run that has failed"""
ESTIMATED = "estimated losses"  # column of tasks: verdict over the range of estimated losses
MISSING = "missing data"  # column of tasks: what the rules that are not judged lack, or what its records lack for a run
NO_DATA = "data"  # stands among the violated rules of a pair whose record lacks what a run needs
UNSTABLE = "its loop, with gains by rule, is unstable"
"""begins the reason of a candidate whose run says little of its parts"""
BETWEEN = " | "  # stands between two of these
TASK_COLUMNS: dict[str, float | str] = {f"{USE}{rule}": math.nan for rule in TASK_SHARES} | dict.fromkeys(
    (*TEXTS, MISSING, ESTIMATED), ""
)
"""the same of tasks"""


def check_columns(scenario: Scenario) -> dict[str, float | str]:
    """The columns of one run. Raises InputError, SolverError: as `check_drive`."""
    return columns_of(check_drive(scenario))


def columns_of(findings: Iterable[Finding], columns: Mapping[str, float | str] = COLUMNS) -> dict[str, float | str]:
    """Findings as columns; of findings of one rule, the one that uses most of its limit."""
    row, findings = dict(columns), list(findings)
    for finding in findings:
        column = f"{USE}{finding.rule}"
        if finding.use is not None and column in row:  # studies have no columns for rules of tasks
            before = float(row[column])
            row[column] = finding.use if math.isnan(before) else max(before, finding.use)
    wrong = [f for f in findings if f.verdict == "warning"]
    row["violated"] = " ".join(rule for rule in SOURCES if any(f.rule == rule for f in wrong))
    row["why"] = "; ".join(f"{f.what}: {f.value}" + (f" ({f.remark})" if f.remark else "") for f in wrong)
    unknown = [f for f in findings if f.verdict == "unknown"]
    row["not judged"] = " ".join(dict.fromkeys(f.rule for f in unknown))
    if MISSING in columns:
        row[MISSING] = BETWEEN.join(dict.fromkeys(f"{f.rule}: {f.remark}" for f in unknown))
    return row
