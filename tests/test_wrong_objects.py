"""Whatever object a public name is given, it works or says in one plain line what it wants."""

import inspect
import re
from collections.abc import Callable
from dataclasses import is_dataclass
from decimal import Decimal
from fractions import Fraction
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.signal
import xarray as xr

import lostmotion as lm
from conftest import for_all
from lostmotion.identification.task.free_parameters import FreeParameter
from lostmotion.inputs.implausible_values import ValueWarning
from lostmotion.inputs.part import Part
from lostmotion.studies.study.select_table import Selection
from public_names import PATHS, public
from refusals import refused

try:
    import mujoco
except ImportError:
    mujoco = None

WRONG: list[Any] = [5, None, "x", "1,5 m", [], [None], (), xr.Dataset(), {}, {"a": 1}, {5: 3}, object(), np.zeros(2), True]
WRONG += [-1, 0, float("nan"), 10**30, Path("none"), lambda: None, lm.Load(inertia=1)]
# What is nearly a number.
WRONG += [np.array([0.1]), xr.DataArray([0.1, 0.2], dims="x"), np.complex128(1.0), 10**400, np.timedelta64(1, "ns")]
WRONG += [xr.DataArray(0.1, attrs={"units": "deg"}), np.ma.masked, Decimal("sNaN"), np.array(True), np.array([[1.0]])]

SCENARIO = lm.load("paper-2dof-nl-small", {"simulation.duration": 0.02, "command.frequency": "50 Hz"})
TRAIN = lm.load("worm-lowering")
HUNTING = lm.load("hunting-with-static-friction")
# Without an integrator, so that its certificate takes milliseconds.
RESTING = HUNTING.replace(
    **{"controllers.servo.position": {"gain": 8.0, "derivative_gain": 0.3}, "controllers.servo.anti_windup_time": None}
)
TRACKING = lm.load("tracking-loss-map", {"simulation.duration": 0.05})
RESULT = lm.simulate(SCENARIO)
STEPS = {"kind": "stepper", "rotor_inertia": 5.4e-6, "steps_per_revolution": 200, "holding_torque": 0.44}
STEPPER = lm.Motor(**STEPS, rated_current=1.7, resistance_phase=1.5, inductance_phase=2.8e-3, supply_voltage=24.0)
ROTOR = lm.Scenario(
    shafts={"motor": {"inertia": 0.0}}, motors={"m": {"shaft": "motor", **STEPS}}, simulation={"duration": 1.0, "sample_interval": 0.01}
)
THERMAL = {"winding_case": 1.0, "case_ambient": 2.0}
HEATED = SCENARIO.replace(
    **{f"motor.limits.thermal_resistance_{key}": value for key, value in THERMAL.items()},
    **{"motor.limits.thermal_time_constant_winding": 10.0, "motor.limits.thermal_time_constant_motor": 100.0},
    **{"motor.limits.resistance": 0.3, "motor.limits.torque_constant": 0.06},
)
HEAT = lm.simulate(HEATED)
RESPONSE = lm.frequency_response(SCENARIO, [1.0, 2.0, 4.0], [0.5, 1.0], threads=1)
LINEAR = lm.linearize(SCENARIO, lm.Initial())
SHEET = next(r for r in lm.catalogue() if r.name == "schaeffler-rt1-h-20-100")
RIG = lm.test_rig.TestRig(SCENARIO.gearbox)
SCREW = lm.model.Screw(input="motor", output="table", lead="10 mm", stiffness="200 N/um", efficiency=0.9)
STUDY = lm.studies.Study(scenario=SCENARIO, vary=[{"key": "load.inertia", "values": [1.0]}], keep={"top": "peak(load_speed)"})


def dangle(*_: object, **__: object) -> None:
    """Takes all."""


# A call of each function that does something, and takes a short time.
CALLS: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    "bandwidth": (lm.response.bandwidth, {"drive": SCENARIO, "amplitude": 1.0, "output": "load_speed", "source": "command", "mean_command": 0.0, "mean_load_torque": 0.0, "lowest": 1.0, "highest": 2.0}),
    "build_loss_map": (lm.data_sheets.build_loss_map, {"sheet": SHEET, "temperature": None, "loss_factor": 1.0}),
    "catalogue": (lm.catalogue, {}),
    "characteristics": (lm.response.characteristics, {"response": RESPONSE, "drive": SCENARIO, "output": "load_speed"}),
    "check_drive": (lm.check_drive, {"scenario": SCENARIO}),
    "description": (lm.portable.description, {"scenario": SCENARIO, "parameters": False}),
    "export_fmu": (lm.export_fmu, {"scenario": SCENARIO, "path": "drive.fmu", "fmi": 2, "controllers": True, "references": False, "motion_inputs": (), "source": False, "libraries": None}),
    "energy_of": (lm.energy_of, {"dataset": RESULT}),
    "actuator": (lm.actuator, {"name": "t-motor-ak80-6", "rotor_inertia": None, "efficiency": None}),
    "explain": (lm.explain, {"what": SCENARIO, "time": 0.01}),
    "lost_steps": (lm.simulation.lost_steps, {"result": RESULT}),
    "frequency_response": (lm.frequency_response, {"drive": SCENARIO, "frequencies": [10.0], "amplitudes": [1.0], "source": "command", "mean_command": 0.0, "mean_load_torque": 0.0, "harmonics": 1, "refine": None, "threads": 1, "max_periods": 5, "law": None, "progress": dangle}),
    "gearbox": (lm.gearbox, {"name": "paper-gearbox", "temperature": None, "added_backlash": 0.0, "loss_factor": 1.0}),
    "linearize": (lm.linearize, {"drive": SCENARIO, "state": lm.Initial(), "command": 0.0, "load_torque": 0.0, "command_rate": 0.0, "load_torque_rate": 0.0, "time": None, "inputs": None, "input_rates": None}),
    "linearize of a train": (lm.linearize, {"drive": TRAIN, "state": lm.TrainInitial(), "inputs": {}, "input_rates": {}}),
    "live": (lm.live, {"scenario": SCENARIO, "height": 400}),
    "LivePage": (lm.live_page.LivePage, {"scenario": SCENARIO, "height": 400}),
    "load": (lm.load, {"source": "paper-2dof-nl-small", "overrides": {}}),
    "load_study": (lm.studies.load_study, {"path": "none.toml"}),
    "measure": (lm.test_rig.measure, {"gearbox": None, "sheet": None, "notes": (), "progress": dangle}),
    "motor": (lm.motor, {"name": "paper-motor", "voltage_limit": None}),
    "motor_current": (lm.sizing.motor_current, {"result": HEAT, "motor": None}),
    "pull_out_torque": (lm.sizing.pull_out_torque, {"motor": STEPPER, "speed": 10.0}),
    "open_loop": (lm.sizing.open_loop, {"scenario": lm.load("stepper-belt-axis"), "motor": None, "window": None}),
    "stepper_curves": (lm.sizing.stepper_curves, {"scenario": ROTOR, "step_rates": [9000.0], "motor": None}),
    "overrunning": (lm.sizing.overrunning, {"gear": SCENARIO.gearbox, "load_torque": 10.0, "input_speed": 100.0}),
    "self_locking": (lm.sizing.self_locking, {"train": SCENARIO.drive().train(), "gear": "gearbox", "load_torque": 10.0, "input_speed": 100.0}),
    "open_result": (lm.open_result, {"path": "none.csv"}),
    "periodic_motion": (lm.periodic_motion, {"drive": SCENARIO, "command": None, "load_torque": 0.0, "multiple": 1, "start": lm.Initial(), "max_periods": 5}),
    "periodic_motions": (lm.response.periodic_motions, {"drive": SCENARIO, "command": None, "load_torque": 0.0, "starts": [lm.Initial()], "multiples": [1]}),
    "rigid_constants": (lm.response.rigid_constants, {"drive": lm.load("paper-1dof-l-small"), "motor_time_constant": None, "time_constant": None}),
    "save": (lm.save, {"dataset": RESULT, "path": "out.csv"}),
    "scenario_of": (lm.simulation.scenario_of, {"dataset": RESULT}),
    "shipped_scenarios": (lm.shipped_scenarios, {}),
    "simulate": (lm.simulate, {"scenario_or_drive": SCENARIO, "command": 0.0, "load_torque": 0.0, "duration": 0.01, "sample_interval": 0.001, "initial": None, "solver": "exact", "relative_tolerance": None, "energy": True, "law": None, "sensitivities": None, "output": "dataset"}),
    "study": (lm.study, {"what": STUDY, "directory": "study", "threads": 1, "executor": None, "repair": False, "progress": None}),
    "switchings_of": (lm.switchings_of, {"result": RESULT}),
    "as_filter": (lm.control.as_filter, {"system": scipy.signal.dlti([1.0], [1.0, -0.5], dt=1e-3)}),
    "as_state_space": (lm.control.as_state_space, {"system": scipy.signal.lti([1.0], [1.0, 1.0])}),
    "limit_cycle": (lm.servo.limit_cycle, {"scenario": HUNTING, "motor": None, "causes": False}),
    "hunting_certificate": (lm.hunting_certificate, {"scenario": RESTING, "motor": None, "largest_error": 0.1}),
    "hunting_map": (lm.servo.hunting_map, {"scenario": HUNTING, "grid": {"shafts.table.inertia": [0.8]}, "variable": None, "threads": 1, "progress": dangle}),
    "pointing_budget": (lm.pointing_budget, {"scenario": TRACKING, "after": 0.0, "view": None, "limit": None, "robustness": False, "progress": dangle}),
    "first_task": (lm.identification.first_task, {"directory": "none", "home": "", "rig": "", "progress": dangle}),
    "spectrum": (lm.spectrum, {"scenario": SCENARIO, "against": "motor", "motor": None, "start": None, "max_order": 4.0}),
    "Findings": (lm.sizing.Findings, {"findings": ()}),
    "identify": (lm.identify, {"source": "none.toml", "threads": 1, "profiles": False, "progress": dangle, "resume": None}),
    "monitor": (lm.monitor, {"source": "none.toml", "logs": [], "progress": dangle}),
    "load_identification": (lm.identification.load_identification, {"path": "none.toml"}),
    "read_log": (lm.identification.read_log, {"path": "none.csv", "time": "", "decimal": ""}),
    "write_campaign": (lm.identification.write_campaign, {"directory": "none", "gearbox": SCENARIO.gearbox, "title": "", "ripple": None, "seed": 1, "progress": dangle}),
    "design_experiment": (lm.identification.design_experiment, {"result": 5, "plans": [], "deviation": None}),
    "commission": (lm.commission, {"scenario": SCENARIO, "motor": None, "window": None, "progress": dangle}),
    "tune": (lm.tune, {"scenario": SCENARIO, "rule": "margins", "damping": None, "phase_margin": 1.0, "gain_margin": 2.0, "bandwidth": 10.0, "goal": None, "sensitivity_peak": None, "feedforward": False, "motor": None}),
    "select": (lm.select, {"task": "task.toml", "directory": None, "threads": 1, "executor": None, "progress": None}),
    "load_task": (lm.studies.load_task, {"path": "task.toml"}),
    "temperatures": (lm.sizing.temperatures, {"result": HEAT, "motor": None, "ambient": 25.0, "winding": 25.0, "case": 25.0, "repeated": False, "constant_resistance": False}),
    "warm_up": (lm.sizing.warm_up, {"scenario": HEATED, "update": 0.01, "motor": None, "lubricant": None, "lubricant_temperature": 25.0, "magnet_coefficient": 0.0, "ambient": 25.0, "winding": 25.0, "housing": 25.0, "heating": None}),
    "to_control": (lm.response.to_control, {"response": RESPONSE, "amplitude": 1.0, "output": "load_speed"}),
    "Simulation": (lm.Simulation, {"drive": SCENARIO, "step": 1e-3, "initial": None, "loaded": None, "given": None, "law": None, "error_bound": False}),
    "SimulationBatch": (lm.SimulationBatch, {"drives": SCENARIO.drive(), "step": 1e-3, "count": 2, "vary": None, "seed": 0, "threads": 1, "controllers": None, "given_motion": False, "sensitivities": ()}),
    "Simulation of a train": (lm.Simulation, {"drive": TRAIN, "step": 1e-3, "initial": None, "loaded": ["worm"]}),
    "measure_screw": (lm.test_rig.measure_screw, {"screw": SCREW, "sheet": None, "load": 1000.0, "progress": dangle}),
    "TestRig": (lm.test_rig.TestRig, {"gearbox": SCENARIO.gearbox}),
    "ResultAccessor": (lm.reports.ResultAccessor, {"dataset": RESULT}),
    "Simulation.reset": (lambda **a: lm.Simulation(SCENARIO).reset(**a), {"initial": lm.Initial()}),
    "Simulation.advance": (lambda **a: lm.Simulation(SCENARIO).advance(**a), {"interval": 1e-3, "command": 0.0, "load_torque": 0.0}),
    "Simulation.advance of a train": (lambda **a: lm.Simulation(TRAIN).advance(**a), {"interval": 1e-3, "motor_command": 0.0, "drum_load_torque": 0.0}),
    "Simulation[...] of a train": (lambda name: lm.Simulation(TRAIN)[name], {"name": "worm_speed"}),
    "Simulation.state of a train": (lambda state: setattr(lm.Simulation(TRAIN), "state", state), {"state": lm.Simulation(TRAIN).state}),
    "Simulation[...]": (lambda name: lm.Simulation(SCENARIO)[name], {"name": "twist"}),
    "Simulation.state": (lambda state: setattr(lm.Simulation(SCENARIO), "state", state), {"state": lm.Simulation(SCENARIO).state}),
    "TestRig.steady": (RIG.steady, {"input_speed": 10.0, "load": 0.5}),
    "TestRig.efficiency": (RIG.efficiency, {"input_speed": 10.0, "load": 0.5}),
    "TestRig.efficiency_map": (RIG.efficiency_map, {"speeds": [10.0], "loads": [0.5], "progress": dangle}),
    "TestRig.no_load_torque": (RIG.no_load_torque, {"input_speed": 10.0}),
    "TestRig.torsion": (RIG.torsion, {"turning_points": [1.0], "samples": 20}),
    "TestRig.initial_loading_curve": (RIG.initial_loading_curve, {"torque": 1.0}),
    "TestRig.stiffness": (RIG.stiffness, {"torques": [1.0], "up_to": 50.0}),
    "TestRig.backlash": (RIG.backlash, {"torque": 1.0}),
    "TestRig.loop": (RIG.loop, {"amplitude": 1.0}),
    "TestRig.starting_torque": (RIG.starting_torque, {"load": 0.0}),
    "LinearModel.response": (LINEAR.response, {"frequency": [1.0], "output": "load_speed", "source": "command"}),
    "LinearModel.antiresonances": (LINEAR.antiresonances, {"output": "load_speed", "source": "command"}),
    "ResultAccessor.plot": (RESPONSE.lm.plot, {"output": "load_speed"}),
    "ResultAccessor.plot_maps": (RESPONSE.lm.plot_maps, {"output": "load_speed"}),
    "PositionReference.at": (lm.PositionReference(moves=[{"to": 1, "speed": 1, "acceleration": 1}]).at, {"time": [0.0, 1.0]}),
    "Motor.at_voltage": (SCENARIO.motor.at_voltage, {"voltage": 24.0}),
    "Scenario.replace": (lambda value: SCENARIO.replace(**{"load.inertia": value}), {"value": 1.0}),
    "Scenario.from_json": (lm.Scenario.from_json, {"text": "{}"}),
}  # fmt: skip
if mujoco is not None:
    HINGE = "<body><joint name='elbow' armature='0.4'/><geom size='0.1'/></body>"
    ROBOT = mujoco.MjSpec.from_string(f"<mujoco><worldbody>{HINGE}</worldbody></mujoco>")
    CALLS |= {
        "attach": (lm.mujoco.attach, {"model": ROBOT, "drives": {"elbow": SCENARIO}, "controllers": None, "replace": True, "substeps": None}),
        "from_mjcf": (lm.mujoco.from_mjcf, {"model": ROBOT, "joint": "elbow", "ratio": 100.0}),
        "load_plugin": (lm.mujoco.load_plugin, {}),
        "write_drive": (lm.mujoco.write_drive, {"drive": SCENARIO, "path": "elbow.drive", "controller": None, "replace": False}),
        "reduce": (lm.mujoco.reduce, {"drive": SCENARIO, "amplitude": 0.5, "frequency": 1.0, "load_torque": 0.0}),
    }  # fmt: skip
if find_spec("warp") is not None:
    CALLS["Drives"] = (lm.warp.Drives, {"drive": SCENARIO.drive(), "count": 2, "vary": None, "dtype": "float64", "device": "cpu", "seed": 0})  # fmt: skip
# With an argument that is right; some need the built page or libraries, or files that are not there.
SLOW = {"live", "description", "export_fmu", "LivePage", "check_drive", "measure", "measure_screw", "commission", "identify", "monitor"}
SLOW |= {"first_task", "spectrum", "load_identification", "read_log", "write_campaign", "design_experiment", "pointing_budget"}
SLOW |= {"stepper_curves", "open_loop", "tune", "select", "load_task"}
if find_spec("mujoco_warp") is not None:
    import mujoco_warp

    FREE = mujoco.MjModel.from_xml_string("<mujoco><worldbody><body><joint name='j'/><geom size='0.1'/></body></worldbody></mujoco>")
    CALLS["warp.attach"] = (lm.warp.attach, {"model": FREE, "m": mujoco_warp.put_model(FREE), "d": mujoco_warp.make_data(FREE), "drives": {"j": "schaeffler-rt1-h-20-100"}, "stiffness": 1.0, "damping": 0.0, "samples": 1, "dtype": "float64", "replace": False})  # fmt: skip


def names() -> list[str]:
    # `attach` alone makes an `Actuated` or `Joints`. MuJoCo is optional.
    missing = tuple(f"{library}." for library in ("mujoco", "warp") if find_spec(library) is None)
    wanted = {n: path for n, path in PATHS.items() if not path.startswith(missing)}
    return [name for name in wanted if name not in ("Actuated", "Joints") and callable(public(name))]


def refused_plainly(call: Callable[[], Any], where: str) -> None:
    """Runs a call that may work; what it raises is an `InputError` or a report of the solver, in one plain line."""
    try:
        call()
    except (lm.InputError, lm.SolverError, RuntimeError, ValueWarning) as error:
        message = str(error)
    except TypeError as error:
        assert re.search(r"positional argument|required .*argument|keyword argument|multiple values", str(error)), where
        return
    except Exception as error:
        pytest.fail(f"{where}: {type(error).__name__}: {error}")
    else:
        return
    assert message, where
    assert "\n" not in message, where
    assert not re.search(r"<class|<xarray|<lost|NoneType|object at 0x|pydantic|\bdict\b|ndarray|incompatible|_core|\\n", message), (
        f"{where}: {message}"
    )


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@for_all(names())
def test_an_exported_name_refuses_wrong_objects_by_place(name: str) -> None:
    exported = public(name)
    for wrong in WRONG:
        refused_plainly(lambda wrong=wrong: exported(wrong), f"{name}({wrong!r:.30})")
        refused_plainly(lambda wrong=wrong: exported(wrong, wrong), f"{name}(two of {wrong!r:.30})")


@for_all(n for n in names() if inspect.isclass(public(n)) and issubclass(public(n), Part))
def test_a_part_refuses_wrong_objects_under_each_key(name: str) -> None:
    part = public(name)
    for key in part.model_fields:
        for wrong in WRONG:
            refused_plainly(lambda key=key, wrong=wrong: part(**{key: wrong}), f"{name}({key}={wrong!r:.30})")
    for wrong in WRONG:
        refused_plainly(lambda wrong=wrong: part.model_validate(wrong), f"{name}.model_validate({wrong!r:.30})")


@for_all(CALLS)
def test_each_argument_of_a_function_is_checked(name: str) -> None:
    function, good = CALLS[name]
    if name not in SLOW | {"load_study", "open_result", "Scenario.from_json"}:
        function(**good)
    for key in good:
        for wrong in WRONG:
            if name in SLOW and wrong is good[key]:
                continue
            refused_plainly(lambda key=key, wrong=wrong: function(**good | {key: wrong}), f"{name}({key}={wrong!r:.30})")


SCALARS: list[Callable[[Any], Any]] = [np.array, xr.DataArray, lambda x: xr.Variable((), x), lambda x: np.array(x).reshape(())[()]]
SCALARS += [lambda x: xr.DataArray(x, attrs={"units": "rad/s"}), lambda x: np.array(x, dtype=object)]
SCALARS_OF_FLOATS: list[Callable[[Any], Any]] = [*SCALARS, np.float32, np.longdouble, Fraction, Decimal]


@for_all(n for n in CALLS if n not in SLOW)
def test_a_number_of_any_library_is_taken_where_one_of_python_is(name: str) -> None:
    function, good = CALLS[name]
    for key, value in good.items():
        if type(value) is float:
            for made in SCALARS_OF_FLOATS:
                function(**good | {key: made(value)})
        elif type(value) in (int, bool):
            for made in SCALARS:
                function(**good | {key: made(value)})
        elif isinstance(value, list) and value and type(value[0]) is float:
            for several in (np.array, xr.DataArray, lambda x: [np.array(one) for one in x]):
                function(**good | {key: several(value)})


def test_a_number_of_any_library_is_the_same_number_everywhere() -> None:
    curve = np.array([[0.1, 0.2], [0.3, 0.4]])
    losses = {"kind": "map", "mirrored": np.True_, "speeds": np.array([0.0, 1.0]), "loads": (0, np.float64(1.0))}
    listed = {"kind": "map", "mirrored": True, "speeds": [0.0, 1.0], "loads": [0.0, 1.0], "values": curve.tolist()}
    assert lm.model.LossMap(**losses, values=curve) == lm.model.LossMap(**listed)
    assert lm.model.LossMap(**losses, values=xr.DataArray(curve)) == lm.model.LossMap(**listed)
    assert lm.CommandSignal.model_validate(np.array(0.3)) == lm.CommandSignal(mean=0.3)
    assert lm.control.Encoder(lines=np.array(2048)) == lm.control.Encoder(lines=2048)
    for made in SCALARS_OF_FLOATS:
        number = made(0.25)
        assert lm.Load(inertia=number).inertia == 0.25
        assert SCENARIO.replace(**{"load.inertia": number}).load.inertia == 0.25
        assert SCENARIO.replace(command=number, **{"command.frequency": 1, "command.amplitude": 1}).command.mean == 0.25
        assert lm.load("paper-2dof-nl-small", {"load.inertia": number}).load.inertia == 0.25
        assert lm.gearbox("paper-gearbox", added_backlash=made(2**-6)) == lm.gearbox("paper-gearbox", added_backlash=2**-6)
        assert lm.motor("paper-motor", voltage_limit=number).voltage_limit == 0.25
        vary = [{"key": "load.inertia", "values": [number]}, {"key": "load.torque", "uniform": (0, number)}]
        study = lm.studies.Study(scenario=SCENARIO, vary=vary, keep={"top": "peak(load_speed)"}, design="sobol", runs=np.int64(2))
        assert (study.vary[0].values, study.vary[1].uniform, study.runs) == ((0.25,), (0.0, 0.25), 2)
        assert Selection(objectives={"x": "least"}, limits={"x": {"max": number}}).limits["x"].max == 0.25
        assert FreeParameter(start=number, max=1.0).start == 0.25


NEARLY = [
    (np.array([0.25]), "[0.25] is a list of one; give its entry"),
    (xr.DataArray(0.25, attrs={"units": "deg"}), '0.25 has units = "deg", and bare numbers are in SI; give its float()'),
    (np.array([0.25, 0.5]), "[0.25, 0.5] must be a number"),
    (np.complex128(0.25), "(0.25+0j) must be a number"),
    (np.ma.masked, "nan must be a finite number"),
    (np.array(True), "true "),
    (np.timedelta64(1, "ns"), "1 must be a number"),
]


@for_all(NEARLY)
def test_what_is_nearly_a_number_is_refused_with_the_reason(value: Any, sentence: str) -> None:
    train, drive = lm.Simulation(TRAIN), lm.Simulation(SCENARIO)
    calls: list[tuple[str, Callable[[], Any]]] = [
        ("key inertia: ", lambda: lm.Load(inertia=value)),
        ("key load.inertia: ", lambda: SCENARIO.replace(**{"load.inertia": value})),
        ("interval: ", lambda: drive.advance(value, 0.0)),
        ("command: ", lambda: drive.advance(1e-3, value)),
        ("load_torque: ", lambda: drive.advance(1e-3, 0.0, (0.0, value))),
        ("motor_command: ", lambda: train.advance(1e-3, motor_command=value)),
        ("drum_load_torque: ", lambda: train.advance(1e-3, motor_command=0.0, drum_load_torque=(0.0, value))),
        ("voltage: ", lambda: SCENARIO.motor.at_voltage(value)),
    ]
    for where, call in calls:
        with pytest.raises(lm.InputError, match=f"^{re.escape(where + sentence)}"):
            call()
    assert (train.time, drive.time) == (0.0, 0.0)


def test_every_function_and_argument_is_tried() -> None:
    for name in names():
        exported = public(name)
        own = inspect.isclass(exported) and (is_dataclass(exported) or issubclass(exported, Part | Exception | lm.Scenario))
        assert own or name in CALLS, name
        if name in CALLS and not own:
            parameters = inspect.signature(exported).parameters
            assert set(CALLS[name][1]) == set(parameters), name


SENTENCES = [
    (lambda: lm.test_rig.TestRig(5), 'gearbox: 5 must be a Gearbox, such as gearbox("schaeffler-rt1-h-20-100") returns'),
    (lambda: lm.open_result(5), "path: 5 must be text, or the name of a file or directory"),
    (lambda: lm.save(5, "x.csv"), "dataset: 5 must be a dataset, such as simulate returns"),
    (lambda: lm.save(xr.Dataset(), "x.csv"), "this dataset is no result over time"),
    (lambda: lm.switchings_of(5), "result: 5 must be a dataset"),
    (lambda: lm.switchings_of(xr.Dataset()), "this dataset has no switchings"),
    (lambda: lm.Load(1), "the load takes its values by name, such as inertia=...; not 1"),
    (lambda: RIG.efficiency_map(["3000"], [1]), 'speeds: "3000" has no unit'),
    (lambda: lm.Simulation(SCENARIO)["speed"], '"speed" is no variable; the variables are command,'),
    (lambda: lm.Simulation(SCENARIO)[None], "None is no variable"),
    (lambda: lm.simulate({"motor": 1}), "scenario_or_drive: { motor = 1 } must be a Scenario"),
    (lambda: lm.study(STUDY, "s", threads=0), "threads: 0 must be a whole number above 0"),
]  # fmt: skip


@for_all(SENTENCES)
def test_what_is_wanted_is_said(call: Callable[[], Any], sentence: str) -> None:
    assert sentence in refused(call)


def test_numbers_may_be_text_with_a_unit_on_the_rig_too() -> None:
    one, other = RIG.efficiency_map(["3000 rpm"], ["50 %"]), RIG.efficiency_map([100.0 * np.pi], [0.5])
    assert float(one["input_speed"][0]) == pytest.approx(100.0 * np.pi)
    assert np.allclose(one["efficiency"], other["efficiency"], rtol=1e-12)


MISSPELT: list[tuple[Callable[[], Any], str]] = [
    (lambda: lm.linearize(SCENARIO, comand=1.0), "linearize() has no argument comand; did you mean command?"),
    (lambda: lm.linearize(SCENARIO, speed=1.0), "linearize() has no argument speed; its arguments are drive, state, time,"),
    (lambda: lm.study("tolerance.toml"), "study() lacks the argument directory; add it"),
    (lambda: lm.simulate(SCENARIO, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0), "simulate() takes at most 1 value without a name, not 13; give the others by name"),
    (lambda: lm.load("a", {}, 1), "load() takes at most 2 values without a name, not 3"),
    (lambda: lm.catalogue(1), "catalogue() takes no value without a name, not 1"),
    (lambda: lm.shipped_scenarios(all=True), "shipped_scenarios() has no argument all; it has none"),
    (lm.control.as_filter, "as_filter() lacks the argument system; add it"),
    (lambda: SCENARIO.motor.at_voltage(1, 2), "Motor.at_voltage() takes at most 1 value without a name, not 2"),
    (lambda: lm.load("worm-lowering", source="x"), "load() has the argument source twice, by its position and by its name"),
    (lambda: lm.Simulation(SCENARIO, stepp=1e-3), "Simulation() has no argument stepp; did you mean step?"),
    (lambda: lm.Simulation(SCENARIO).advance(1e-3, comand=0.1), "comand: is no input of this train; did you mean command?"),
    (lambda: lm.Simulation(SCENARIO).advance(1e-3, 0.1, load_toque=1), "load_toque: is no input of this train; did you mean load_torque?"),
    (lambda: lm.Simulation(TRAIN).advance(1e-3, motor_comand=0), "motor_comand: is no input of this train; did you mean motor_command?"),
    (lambda: lm.load("worm-lowering", override={}), "load() has no argument override; did you mean overrides?"),
    (lambda: lm.gearbox("paper-gearbox", temprature=20), "gearbox() has no argument temprature; did you mean temperature?"),
    (lambda: lm.gearbox("paper-gearbox", backlash=0.1), "gearbox() has no argument backlash; its arguments are name, temperature, added"),
    (lambda: lm.motor("paper-motor", voltage_limt=24), "motor() has no argument voltage_limt; did you mean voltage_limit?"),
    (lambda: SCENARIO.motor.at_voltage(volts=24), "Motor.at_voltage() has no argument volts; its arguments are voltage"),
    (lambda: RIG.backlash(torqe=1.0), "TestRig.backlash() has no argument torqe; did you mean torque?"),
    (lambda: lm.Load(inertja=1.0), "key inertja: is not known; did you mean inertia?"),
    (lambda: lm.control.Law(dangle, sates=1), "Law() has no argument sates; did you mean states?"),
]  # fmt: skip


@for_all(MISSPELT)
def test_a_misspelt_argument_is_told_with_its_function(call: Callable[[], Any], sentence: str) -> None:
    with pytest.raises(lm.InputError, match=re.escape(sentence)) as caught:
        call()
    assert isinstance(caught.value, TypeError) or "key" in sentence or "train" in sentence
