"""Results in notebooks: as the pages that the commands write of them."""

from importlib import import_module
from types import ModuleType
from typing import Any

# Module -> its class, and the module and function here that make the page.
PAGES = {
    "identification.identify": ("IdentificationResult", "identification", "identification_report"),
    "identification.monitor.monitor": ("MonitorResult", "monitor", "monitor_report"),
    "pointing.budget": ("PointingBudget", "pointing", "pointing_report"),
    "servo.commissioning_report": ("ServoReport", "servo", "servo_report"),
    "sizing.drive_check": ("Findings", "drive_check", "check_report"),
    "test_rig.measurement": ("RigReport", "rig", "rig_report"),
}


def attach(module: ModuleType) -> None:
    """Gives the class of results in a module what notebooks call to show one."""
    name, home, function = PAGES[module.__name__.partition(".")[2]]

    def shown(result: Any) -> str:
        report = getattr(import_module(f".{home}", __package__), function)(name.lower(), result)
        return str(report._repr_html_())

    setattr(getattr(module, name), "_repr_html_", shown)  # noqa: B010
