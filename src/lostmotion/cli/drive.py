"""`lostmotion check`."""

from pathlib import Path

from .arguments import Overrides, SourceArgument, again, load_scenario, option
from .output_files import try_page
from .terminal import about, conclude, simulating


def check(
    scenario: SourceArgument,
    overrides: Overrides = None,
    report: Path | None = option("FILE", "Also write the findings as a page: .html.", "-o", "--report"),
) -> None:
    """To see whether a drive fits its task: torques, speeds, heat.

    \b
    lostmotion check catalogue-robot-joint --report check.html
    lostmotion check drive.toml --set task.cycle="2 s"

    Also checks voltage, current, inertia ratio, dead zone, lost motion and self-locking.

    The check of a drive train covers torques, speeds, voltage, current, heat and self-locking of each gear and motor. Warnings and the
    page name the source of each rule. The table [task] of the scenario gives the duty cycle and requirements.
    """
    from ..reports.drive_check import check_report
    from ..sizing.drive_check import check_drive

    if report is not None:
        try_page(report)
    loaded = load_scenario(scenario, overrides)
    with about(scenario), simulating("Checking", loaded):
        findings = check_drive(loaded)
    print(loaded.title or scenario)
    for finding in findings:
        print(f"  {finding if finding.verdict == 'warning' else finding.in_short}")
    print(f"Verdict: {findings.verdict}")
    if report is not None:
        from ..reports.page import write_page

        write_page(report, check_report(Path(scenario).stem, findings, loaded.title))
        print(f"Report written to {report}")
        print(f"Next: lostmotion run {again(scenario, overrides)} --plot run.png")
    else:
        print(
            f"All rules with their sources on a page: lostmotion check {again(scenario, overrides)} --report check.html"
        )
    conclude(findings.verdict)
