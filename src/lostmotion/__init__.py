"""Dynamics of geared servo drives: lost motion, sticking and load-dependent losses, solved exactly.

>>> import lostmotion as lm
>>> scenario = lm.load("scenarios/paper-2dof-nl-large.toml")      # doctest: +SKIP
>>> result = lm.simulate(scenario)                                # doctest: +SKIP
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._core import SolverError as SolverError
    from .control.camera import Camera as Camera
    from .control.camera import Tracker as Tracker
    from .control.continuous import ContinuousController as ContinuousController
    from .control.continuous import PositionPID as PositionPID
    from .control.continuous import PositionSignal as PositionSignal
    from .control.continuous import SpeedPID as SpeedPID
    from .control.continuous import SpeedSignal as SpeedSignal
    from .control.continuous import StateSpace as StateSpace
    from .control.continuous import as_state_space as as_state_space
    from .control.controller import Controller as Controller
    from .control.encoder import Encoder as Encoder
    from .control.filters import TransferFunction as TransferFunction
    from .control.filters import as_filter as as_filter
    from .control.inverse_model import InverseModel as InverseModel
    from .control.inverse_model import LoadObserver as LoadObserver
    from .control.law import Law as Law
    from .control.references import Move as Move
    from .control.references import PositionReference as PositionReference
    from .control.references import SpeedReference as SpeedReference
    from .control.references import TorqueReference as TorqueReference
    from .data_sheets.components import gearbox as gearbox
    from .data_sheets.components import motor as motor
    from .data_sheets.gearbox_sheet import GearboxSheet as GearboxSheet
    from .data_sheets.linear_sheets import BeltSheet as BeltSheet
    from .data_sheets.linear_sheets import LinearMotorSheet as LinearMotorSheet
    from .data_sheets.linear_sheets import RackSheet as RackSheet
    from .data_sheets.linear_sheets import ScrewSheet as ScrewSheet
    from .data_sheets.loss_map_builder import BuiltMap as BuiltMap
    from .data_sheets.loss_map_builder import build_loss_map as build_loss_map
    from .data_sheets.motor_sheet import MotorSheet as MotorSheet
    from .data_sheets.records import catalogue as catalogue
    from .data_sheets.sheet import Source as Source
    from .errors import InputError as InputError
    from .errors import MissingLibraryError as MissingLibraryError
    from .identification.campaign import write_campaign as write_campaign
    from .identification.design import Candidate as Candidate
    from .identification.design import design_experiment as design_experiment
    from .identification.errors_of_logs import LogError as LogError
    from .identification.first_task import first_task as first_task
    from .identification.identifiability import Undetermined as Undetermined
    from .identification.identify import IdentificationResult as IdentificationResult
    from .identification.identify import identify as identify
    from .identification.intervals import Interval as Interval
    from .identification.ladder import RungResult as RungResult
    from .identification.logs import Channel as Channel
    from .identification.logs import Log as Log
    from .identification.readers import read_log as read_log
    from .identification.task import Identification as Identification
    from .identification.task import load_identification as load_identification
    from .live_page.notebook import LivePage as LivePage
    from .live_page.notebook import live as live
    from .model.angle_torques import ErrorCurve as ErrorCurve
    from .model.angle_torques import ErrorHarmonic as ErrorHarmonic
    from .model.angle_torques import Gravity as Gravity
    from .model.angle_torques import TorqueCurve as TorqueCurve
    from .model.angle_torques import TorqueHarmonic as TorqueHarmonic
    from .model.couplings import Brake as Brake
    from .model.couplings import Clutch as Clutch
    from .model.couplings import Freewheel as Freewheel
    from .model.dampers import Damper as Damper
    from .model.drive import Drive as Drive
    from .model.gear import Gear as Gear
    from .model.gearbox import Gearbox as Gearbox
    from .model.gearbox import GearboxLimits as GearboxLimits
    from .model.linear import Belt as Belt
    from .model.linear import EndStops as EndStops
    from .model.linear import ForceCurve as ForceCurve
    from .model.linear import LinearMotor as LinearMotor
    from .model.linear import PitchCurve as PitchCurve
    from .model.linear import PitchHarmonic as PitchHarmonic
    from .model.linear import Rack as Rack
    from .model.linear import Screw as Screw
    from .model.linear import ScrewData as ScrewData
    from .model.linear import Slide as Slide
    from .model.linear import StiffnessCurve as StiffnessCurve
    from .model.load import Load as Load
    from .model.losses import ConstantEfficiency as ConstantEfficiency
    from .model.losses import LossMap as LossMap
    from .model.losses import MeshEfficiency as MeshEfficiency
    from .model.losses import WormMesh as WormMesh
    from .model.motor import Motor as Motor
    from .model.motor import MotorLimits as MotorLimits
    from .model.motor import ShaftMotor as ShaftMotor
    from .model.self_locking import Overrunning as Overrunning
    from .model.self_locking import SelfLocking as SelfLocking
    from .model.self_locking import overrunning as overrunning
    from .model.self_locking import self_locking as self_locking
    from .model.shaft import DragCurve as DragCurve
    from .model.shaft import EddyCurrentDrag as EddyCurrentDrag
    from .model.shaft import FrictionCurve as FrictionCurve
    from .model.shaft import QuadraticDrag as QuadraticDrag
    from .model.shaft import Shaft as Shaft
    from .model.signals import CommandSignal as CommandSignal
    from .model.signals import ForceSignal as ForceSignal
    from .model.signals import TorqueSignal as TorqueSignal
    from .model.springs import Spring as Spring
    from .model.synchronous_motor import PhaseValues as PhaseValues
    from .model.synchronous_motor import Winding as Winding
    from .model.torsion import Hysteresis as Hysteresis
    from .model.torsion import LinearStiffness as LinearStiffness
    from .model.torsion import Rigid as Rigid
    from .model.torsion import TorsionCurve as TorsionCurve
    from .model.train import DriveTrain as DriveTrain
    from .pointing.budget import PointingBudget as PointingBudget
    from .pointing.budget import PointingError as PointingError
    from .pointing.budget import View as View
    from .pointing.budget import pointing_budget as pointing_budget
    from .portable.description import description as description
    from .portable.fmu import export_fmu as export_fmu
    from .reports.accessor import ResultAccessor as ResultAccessor
    from .response.bandwidth import bandwidth as bandwidth
    from .response.bandwidth import characteristics as characteristics
    from .response.harmonic import frequency_response as frequency_response
    from .response.harmonic import to_control as to_control
    from .response.linear import LinearModel as LinearModel
    from .response.linear import RigidConstants as RigidConstants
    from .response.linear import linearize as linearize
    from .response.linear import rigid_constants as rigid_constants
    from .response.shooting import periodic_motion as periodic_motion
    from .response.shooting import periodic_motions as periodic_motions
    from .response.spectrum import Spectrum as Spectrum
    from .response.spectrum import SpectrumLine as SpectrumLine
    from .response.spectrum import spectrum as spectrum
    from .servo.commission import LoopSheet as LoopSheet
    from .servo.commission import ServoReport as ServoReport
    from .servo.commission import Stiffness as Stiffness
    from .servo.commission import commission as commission
    from .servo.hunting import Hunting as Hunting
    from .servo.hunting import hunting_map as hunting_map
    from .servo.hunting import limit_cycle as limit_cycle
    from .servo.margins import Bandwidth as Bandwidth
    from .servo.margins import Instability as Instability
    from .servo.margins import Margins as Margins
    from .servo.motion import AtRest as AtRest
    from .servo.motion import Following as Following
    from .servo.motion import LimitCycle as LimitCycle
    from .servo.motion import Settling as Settling
    from .servo.motion import StepResponse as StepResponse
    from .servo.tuning import Tuning as Tuning
    from .servo.tuning import tune as tune
    from .simulation.explanation import ContactState as ContactState
    from .simulation.explanation import Explanation as Explanation
    from .simulation.explanation import MotorState as MotorState
    from .simulation.explanation import explain as explain
    from .simulation.result_files import open_result as open_result
    from .simulation.result_files import save as save
    from .simulation.results import RunArrays as RunArrays
    from .simulation.results import energy_of as energy_of
    from .simulation.results import scenario_of as scenario_of
    from .simulation.run import simulate as simulate
    from .simulation.scenario import Initial as Initial
    from .simulation.scenario import Scenario as Scenario
    from .simulation.shipped import shipped_scenarios as shipped_scenarios
    from .simulation.sources import load as load
    from .simulation.stepping import Simulation as Simulation
    from .simulation.stepping import SimulationState as SimulationState
    from .simulation.switchings import switchings_of as switchings_of
    from .simulation.train_scenario import ShaftTable as ShaftTable
    from .simulation.train_scenario import SlideTable as SlideTable
    from .simulation.train_scenario import TrainInitial as TrainInitial
    from .simulation.train_scenario import TrainScenario as TrainScenario
    from .simulation.variables import VARIABLES as VARIABLES
    from .simulation.variables import Variable as Variable
    from .sizing.drive_check import check_drive as check_drive
    from .sizing.finding import Finding as Finding
    from .sizing.finding import Findings as Findings
    from .sizing.motor_run import motor_current as motor_current
    from .sizing.motor_run import temperatures as temperatures
    from .studies.engine import study as study
    from .studies.file import load_study as load_study
    from .studies.select_drive import select as select
    from .studies.study import Study as Study
    from .studies.task_file import load_task as load_task
    from .test_rig.comparison import Comparison as Comparison
    from .test_rig.loop import Loop as Loop
    from .test_rig.measurement import RigReport as RigReport
    from .test_rig.measurement import measure as measure
    from .test_rig.rig import TestRig as TestRig
    from .test_rig.screw_measurement import ScrewReport as ScrewReport
    from .test_rig.screw_measurement import measure_screw as measure_screw
    from .version import __version__ as __version__

# Where each public name lives; it is imported when first used, so that `import lostmotion` stays quick.
_HOMES = {
    "_core": ("SolverError",),
    "control.continuous": (
        "ContinuousController",
        "PositionPID",
        "PositionSignal",
        "SpeedPID",
        "SpeedSignal",
        "StateSpace",
        "as_state_space",
    ),
    "control.controller": ("Controller",),
    "control.camera": ("Camera", "Tracker"),
    "control.encoder": ("Encoder",),
    "control.filters": ("TransferFunction", "as_filter"),
    "control.inverse_model": ("InverseModel", "LoadObserver"),
    "control.law": ("Law",),
    "control.references": ("Move", "PositionReference", "SpeedReference", "TorqueReference"),
    "data_sheets.components": ("gearbox", "motor"),
    "data_sheets.gearbox_sheet": ("GearboxSheet",),
    "data_sheets.linear_sheets": ("BeltSheet", "LinearMotorSheet", "RackSheet", "ScrewSheet"),
    "data_sheets.loss_map_builder": ("BuiltMap", "build_loss_map"),
    "data_sheets.motor_sheet": ("MotorSheet",),
    "data_sheets.records": ("catalogue",),
    "data_sheets.sheet": ("Source",),
    "errors": ("InputError", "MissingLibraryError"),
    "identification.campaign": ("write_campaign",),
    "identification.design": ("Candidate", "design_experiment"),
    "identification.errors_of_logs": ("LogError",),
    "identification.first_task": ("first_task",),
    "identification.identifiability": ("Undetermined",),
    "identification.identify": ("IdentificationResult", "identify"),
    "identification.intervals": ("Interval",),
    "identification.ladder": ("RungResult",),
    "identification.logs": ("Channel", "Log"),
    "identification.readers": ("read_log",),
    "identification.task": ("Identification", "load_identification"),
    "live_page.notebook": ("LivePage", "live"),
    "model.angle_torques": ("ErrorCurve", "ErrorHarmonic", "Gravity", "TorqueCurve", "TorqueHarmonic"),
    "model.couplings": ("Brake", "Clutch", "Freewheel"),
    "model.dampers": ("Damper",),
    "model.drive": ("Drive",),
    "model.gear": ("Gear",),
    "model.gearbox": ("Gearbox", "GearboxLimits"),
    "model.load": ("Load",),
    "model.linear": (
        "Belt",
        "EndStops",
        "ForceCurve",
        "LinearMotor",
        "PitchCurve",
        "PitchHarmonic",
        "Rack",
        "Screw",
        "ScrewData",
        "Slide",
        "StiffnessCurve",
    ),
    "model.losses": ("ConstantEfficiency", "LossMap", "MeshEfficiency", "WormMesh"),
    "model.motor": ("Motor", "MotorLimits", "ShaftMotor"),
    "model.self_locking": ("Overrunning", "SelfLocking", "overrunning", "self_locking"),
    "model.shaft": ("DragCurve", "EddyCurrentDrag", "FrictionCurve", "QuadraticDrag", "Shaft"),
    "model.signals": ("CommandSignal", "ForceSignal", "TorqueSignal"),
    "model.springs": ("Spring",),
    "model.synchronous_motor": ("PhaseValues", "Winding"),
    "model.torsion": ("Hysteresis", "LinearStiffness", "Rigid", "TorsionCurve"),
    "model.train": ("DriveTrain",),
    "portable.description": ("description",),
    "portable.fmu": ("export_fmu",),
    "reports.accessor": ("ResultAccessor",),
    "pointing.budget": ("PointingBudget", "PointingError", "View", "pointing_budget"),
    "response.bandwidth": ("bandwidth", "characteristics"),
    "response.harmonic": ("frequency_response", "to_control"),
    "response.linear": ("LinearModel", "RigidConstants", "linearize", "rigid_constants"),
    "response.shooting": ("periodic_motion", "periodic_motions"),
    "response.spectrum": ("Spectrum", "SpectrumLine", "spectrum"),
    "simulation.explanation": ("ContactState", "Explanation", "MotorState", "explain"),
    "simulation.result_files": ("open_result", "save"),
    "simulation.results": ("RunArrays", "energy_of", "scenario_of"),
    "simulation.run": ("simulate",),
    "simulation.scenario": ("Initial", "Scenario"),
    "simulation.shipped": ("shipped_scenarios",),
    "simulation.sources": ("load",),
    "simulation.stepping": ("Simulation", "SimulationState"),
    "simulation.switchings": ("switchings_of",),
    "simulation.train_scenario": ("ShaftTable", "SlideTable", "TrainInitial", "TrainScenario"),
    "simulation.variables": ("VARIABLES", "Variable"),
    "servo.commission": ("LoopSheet", "ServoReport", "Stiffness", "commission"),
    "servo.hunting": ("Hunting", "hunting_map", "limit_cycle"),
    "servo.margins": (
        "Bandwidth",
        "Instability",
        "Margins",
    ),
    "servo.motion": ("AtRest", "Following", "LimitCycle", "Settling", "StepResponse"),
    "servo.tuning": ("Tuning", "tune"),
    "sizing.drive_check": ("check_drive",),
    "sizing.finding": ("Finding", "Findings"),
    "sizing.motor_run": ("motor_current", "temperatures"),
    "studies.engine": ("study",),
    "studies.file": ("load_study",),
    "studies.select_drive": ("select",),
    "studies.study": ("Study",),
    "studies.task_file": ("load_task",),
    "test_rig.comparison": ("Comparison",),
    "test_rig.loop": ("Loop",),
    "test_rig.measurement": ("RigReport", "measure"),
    "test_rig.rig": ("TestRig",),
    "test_rig.screw_measurement": ("ScrewReport", "measure_screw"),
    "version": ("__version__",),
}
# Modules whose functions return datasets: with them comes `result.lm`.
_WITH_DATASETS = (
    "response.bandwidth",
    "response.harmonic",
    "response.shooting",
    "servo.hunting",
    "simulation.result_files",
    "simulation.results",
    "simulation.run",
    "simulation.switchings",
    "test_rig.measurement",
    "test_rig.rig",
)
# Modules whose results notebooks show as the page that the command writes.
_WITH_PAGES = (
    "identification.identify",
    "pointing.budget",
    "servo.commission",
    "sizing.drive_check",
    "test_rig.measurement",
)
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [*_HOME_OF]  # noqa: PLE0604


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'lostmotion' has no attribute {name!r}")
    home = _HOME_OF[name]
    if home in _WITH_DATASETS:
        importlib.import_module(".reports.accessor", __name__)
    module = importlib.import_module(f".{home}", __name__)
    if home in _WITH_PAGES:
        importlib.import_module(".reports.notebook", __name__).attach(module)
    value = getattr(module, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
