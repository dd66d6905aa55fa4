"""Dynamics of geared servo drives: lost motion, sticking and load-dependent losses, solved exactly.

>>> import lostmotion as lm
>>> scenario = lm.load("scenarios/paper-2dof-nl-large.toml")      # doctest: +SKIP
>>> result = lm.simulate(scenario)                                # doctest: +SKIP
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    __version__: str
    from ._core import SolverError as SolverError
    from .accessor import ResultAccessor as ResultAccessor
    from .data_sheet import GearboxSheet as GearboxSheet
    from .data_sheet import MotorSheet as MotorSheet
    from .data_sheet import Source as Source
    from .drive_check import Finding as Finding
    from .drive_check import check_drive as check_drive
    from .errors import InputError as InputError
    from .errors import MissingLibraryError as MissingLibraryError
    from .explanation import ContactState as ContactState
    from .explanation import Explanation as Explanation
    from .explanation import explain as explain
    from .harmonic_response import bandwidth as bandwidth
    from .harmonic_response import characteristics as characteristics
    from .harmonic_response import frequency_response as frequency_response
    from .harmonic_response import to_control as to_control
    from .linear_analysis import LinearModel as LinearModel
    from .linear_analysis import RigidConstants as RigidConstants
    from .linear_analysis import linearize as linearize
    from .linear_analysis import rigid_constants as rigid_constants
    from .loss_map_builder import BuiltMap as BuiltMap
    from .loss_map_builder import build_loss_map as build_loss_map
    from .parts import ConstantEfficiency as ConstantEfficiency
    from .parts import Drive as Drive
    from .parts import Gearbox as Gearbox
    from .parts import GearboxLimits as GearboxLimits
    from .parts import Hysteresis as Hysteresis
    from .parts import LinearStiffness as LinearStiffness
    from .parts import Load as Load
    from .parts import LossMap as LossMap
    from .parts import Motor as Motor
    from .parts import MotorLimits as MotorLimits
    from .parts import Rigid as Rigid
    from .parts import TorsionCurve as TorsionCurve
    from .records import catalogue as catalogue
    from .records import gearbox as gearbox
    from .records import motor as motor
    from .results import energy_of as energy_of
    from .results import open_result as open_result
    from .results import save as save
    from .results import scenario_of as scenario_of
    from .run import simulate as simulate
    from .scenario import Initial as Initial
    from .scenario import Scenario as Scenario
    from .scenario import shipped_scenarios as shipped_scenarios
    from .shooting import periodic_motion as periodic_motion
    from .shooting import periodic_motions as periodic_motions
    from .signals import CommandSignal as CommandSignal
    from .signals import TorqueSignal as TorqueSignal
    from .sources import load as load
    from .stepping import Simulation as Simulation
    from .stepping import SimulationState as SimulationState
    from .study_engine import study as study
    from .study_file import Study as Study
    from .study_file import load_study as load_study
    from .switchings import switchings_of as switchings_of
    from .test_rig import Comparison as Comparison
    from .test_rig import Loop as Loop
    from .test_rig import RigReport as RigReport
    from .test_rig import TestRig as TestRig
    from .test_rig import measure as measure
    from .variables import VARIABLES as VARIABLES
    from .variables import Variable as Variable

# Where each public name lives; it is imported when first used, so that `import lostmotion` stays quick.
_HOMES = {
    "_core": ("SolverError",),
    "accessor": ("ResultAccessor",),
    "drive_check": ("Finding", "check_drive"),
    "errors": ("InputError", "MissingLibraryError"),
    "explanation": ("ContactState", "Explanation", "explain"),
    "data_sheet": ("GearboxSheet", "MotorSheet", "Source"),
    "harmonic_response": ("bandwidth", "characteristics", "frequency_response", "to_control"),
    "linear_analysis": ("LinearModel", "RigidConstants", "linearize", "rigid_constants"),
    "loss_map_builder": ("BuiltMap", "build_loss_map"),
    "parts": (
        "ConstantEfficiency",
        "Drive",
        "Gearbox",
        "GearboxLimits",
        "Hysteresis",
        "LinearStiffness",
        "Load",
        "LossMap",
        "Motor",
        "MotorLimits",
        "Rigid",
        "TorsionCurve",
    ),
    "shooting": ("periodic_motion", "periodic_motions"),
    "records": ("catalogue", "gearbox", "motor"),
    "results": ("energy_of", "open_result", "save", "scenario_of"),
    "scenario": ("Initial", "Scenario", "shipped_scenarios"),
    "sources": ("load",),
    "signals": ("CommandSignal", "TorqueSignal"),
    "run": ("simulate",),
    "stepping": ("Simulation", "SimulationState"),
    "study_engine": ("study",),
    "study_file": ("Study", "load_study"),
    "switchings": ("switchings_of",),
    "test_rig": ("Comparison", "Loop", "RigReport", "TestRig", "measure"),
    "variables": ("VARIABLES", "Variable"),
}
# Modules whose functions return datasets: with them comes `result.lm`.
_WITH_DATASETS = ("harmonic_response", "results", "run", "shooting", "switchings", "test_rig")
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}

__all__ = ["__version__", *_HOME_OF]  # noqa: PLE0604


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        value: Any = version("lostmotion")
    elif name in _HOME_OF:
        home = _HOME_OF[name]
        if home in _WITH_DATASETS:
            importlib.import_module(".accessor", __name__)
        value = getattr(importlib.import_module(f".{home}", __name__), name)
    else:
        raise AttributeError(f"module 'lostmotion' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
