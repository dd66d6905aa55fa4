"""The report of a drive check: how much of each limit is used, and the rule behind each point."""

from ..sizing.finding import Findings
from .page import Report, Table
from .panels import Bars, Group

FINDINGS = (
    "“ok” means within the limit, “caution” beyond a rule of thumb, “WARNING” beyond a stated limit, “not judged” that the limit or "
    "a datum is not given. A blank remark means that there is none."
)
WIDEST = 200.0  # [%] of the chart; a longer bar ends there with its value
MARKS = {"ok": "ok", "caution": "caution", "warning": "WARNING", "unknown": "not judged"}


def check_report(name: str, findings: Findings, title: str = "") -> Report:
    """The page of a check."""
    used = {f.what: (100.0 * f.use,) for f in findings if f.use is not None and f.verdict != "caution"}
    reach = min(WIDEST, max([110.0, *(1.05 * value for (value,) in used.values())]))
    bars = Bars("Use of the limits", "share of the limit [%]", used, x_range=(0.0, reach), limit=100.0)
    rows = [[f.what, f.value, MARKS[f.verdict], f.remark, f.source] for f in findings]
    marked = frozenset(k for k, f in enumerate(findings) if f.verdict == "warning")
    header = ("point", "value", "verdict", "remark", "rule and its source")
    return Report(
        title=title or name,
        lead=f"Drive check of `{name}`: loads, speeds, heat, resonance and holding against the limits.",
        verdict=findings.verdict,
        main=Group("limits", "", "", (bars,) if used else (), 1),
        parts=(Table("Findings", header, rows, FINDINGS, marked=marked),),
    )
