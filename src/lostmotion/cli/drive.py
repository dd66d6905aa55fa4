"""`lostmotion drive check`."""

from __future__ import annotations

from .arguments import Overrides, SourceArgument
from .terminal import simulating


def check(
    scenario: SourceArgument,
    overrides: Overrides = None,
) -> None:
    """Torques, speeds, voltage, current, heat, inertia ratio, resonance, dead zone, lost motion, holding and self-locking.

    Of a drive train: torques, speeds, voltage, current, heat and self-locking, of each gear and motor. Each point names its rule and the source of the rule. The table [task] of the scenario gives the duty cycle and requirements.

    \b
    lostmotion drive check drive.toml --set task.cycle="2 s"
    """
    from ..errors import InputError
    from ..simulation.sources import load
    from ..sizing.drive_check import check_drive

    loaded = load(scenario, overrides or ())
    try:
        with simulating("Checking", loaded):
            findings = check_drive(loaded)
    except (InputError, RuntimeError) as error:
        raise InputError(f"{scenario}: {error}") from None
    print(loaded.title or scenario)
    for finding in findings:
        print(f"  {finding}")
    warnings, unknown = (sum(f.verdict == verdict for f in findings) for verdict in ("warning", "unknown"))
    counted = "No warnings." if warnings == 0 else f"{warnings} warning{'s' if warnings > 1 else ''}."
    print(f"{counted} {unknown} not judged (?)." if unknown else counted)
