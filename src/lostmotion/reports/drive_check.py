"""The report of a drive check: how much of each limit is used, and the rule behind each point."""

from __future__ import annotations

from collections.abc import Sequence

from ..sizing.finding import Finding
from ..verdict import State, Verdict
from .page import Report, Table
from .panels import Bars, Group

FINDINGS = "“ok” means within the limit, “not judged” that the limit or a datum is not given. A blank remark means that there is none."
MARKS = {"ok": "ok", "warning": "WARNING", "unknown": "not judged"}


def counted(findings: Sequence[Finding]) -> str:
    """Number of exceeded rules, and of those that are not judged."""
    warnings, unknown = (sum(f.verdict == verdict for f in findings) for verdict in ("warning", "unknown"))
    text = "No warnings." if warnings == 0 else f"{warnings} warning{'s' if warnings > 1 else ''}."
    return f"{text} {unknown} not judged (?)." if unknown else text


def _verdict(findings: Sequence[Finding]) -> Verdict:
    warnings = [f for f in findings if f.verdict == "warning"]
    lines = [counted(findings).replace(" (?)", "")]
    lines += [f"{f.what}: {f.value}{f' ({f.remark})' if f.remark else ''}." for f in warnings[:1]]
    used = [f for f in findings if f.use is not None]
    if used:
        most = max(used, key=lambda f: f.use or 0.0)
        lines.append(f"The most used limit is {most.what}: {100.0 * (most.use or 0.0):.3g} %.")
    unknown = [f.what for f in findings if f.verdict == "unknown"]
    lines += [f"Not judged: {'; '.join(unknown)}."] if unknown else []
    state: State = "does not fit" if warnings else "fits with a reservation" if unknown else "fits"
    return Verdict(state, tuple(lines[:3]))


def check_report(name: str, findings: Sequence[Finding], title: str = "") -> Report:
    """The page of a check."""
    used = {f.what: (100.0 * f.use,) for f in findings if f.use is not None}
    reach = max([110.0, *(1.05 * value for (value,) in used.values())])
    bars = Bars("Use of the limits", "share of the limit [%]", used, x_range=(0.0, reach), limit=100.0)
    rows = [[f.what, f.value, MARKS[f.verdict], f.remark, f.source] for f in findings]
    marked = frozenset(k for k, f in enumerate(findings) if f.verdict == "warning")
    header = ("point", "value", "verdict", "remark", "rule and its source")
    return Report(
        title=title or name,
        lead=f"Drive check of `{name}`: loads, speeds, heat, resonance and holding against the limits.",
        verdict=_verdict(findings),
        main=Group("limits", "", "", (bars,) if used else (), 1),
        parts=(Table("Findings", header, rows, FINDINGS, marked=marked),),
    )
