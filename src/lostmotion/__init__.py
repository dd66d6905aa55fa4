"""Dynamics of geared servo drives: lost motion, sticking and load-dependent losses, solved exactly.

>>> import lostmotion as lm
>>> scenario = lm.load("scenarios/paper-2dof-nl-large.toml")      # doctest: +SKIP
>>> result = lm.simulate(scenario)                                # doctest: +SKIP

The names that most programs use are in `lostmotion` itself, the others in namespaces such as `lostmotion.servo`.
"""

from __future__ import annotations

from types import ModuleType

from .namespace import namespace, when_taken

# Modules whose functions return datasets: importing one of their names registers the accessor `result.lm`.
_WITH_DATASETS = (
    "response.crossovers",
    "response.harmonic",
    "response.shooting",
    "servo.hunting.certificate",
    "servo.hunting.hunting",
    "simulation.runs.result_files",
    "simulation.runs.results",
    "simulation.runs.run",
    "simulation.runs.switchings",
    "test_rig.measurement",
    "test_rig.virtual_rig",
)
# Modules whose results notebooks show as the page that the command writes.
_WITH_PAGES = (
    "identification.identify",
    "identification.monitor.monitor",
    "pointing.budget",
    "servo.commissioning_report",
    "sizing.drive_check",
    "test_rig.measurement",
)


def _show_results(module: ModuleType) -> None:
    """Gives the results of a module their charts and pages, when the first of its names is taken."""
    inner = module.__name__.removeprefix(f"{__name__}.")
    if inner in _WITH_DATASETS:
        from .reports import accessor  # noqa: F401
    if inner in _WITH_PAGES:
        from .reports import notebook

        notebook.attach(module)


when_taken.append(_show_results)

__getattr__, __dir__ = namespace(__name__)
