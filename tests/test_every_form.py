"""Public functions take every scenario, in each form in which it can be written, or refuse it for a physical reason."""

import random
import re
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from conftest import some
from fuzz.random_trains import train as fuzz_train
from lostmotion.identification.identify import identify_logs
from lostmotion.identification.monitor.monitor import monitor_logs
from lostmotion.identification.preparation.prepare import prepared
from lostmotion.identification.prepared_log import Prepared
from lostmotion.identification.readers.log import Log
from lostmotion.identification.rig.rig_scenario import Rig
from lostmotion.identification.task.identification_file import Identification
from lostmotion.identification.virtual_logs import virtual_log
from lostmotion.inputs.toml_text import toml_text
from lostmotion.live_page.description import describe
from lostmotion.studies.runs.read_table import read_table
from refusals import refused
from test_random_axes import random_axis

LARGE = ("conveyor-start", "gantry-two-screws", "thruster-in-ice", "stepper-equatorial-mount")  # which only take longer
# They differ from another one in numbers alone.
ALIKE = re.compile(r"paper-.*-large|tracking-constant-efficiency")
NAMES_A_FORM = re.compile(
    r"\[shafts\]|\[axis\]|short form|long form|is a (drive )?train|are for (drives|trains)|must be a Drive|give an Initial|takes a (drive|train)|is no (drive|train)",
    re.I,
)
JOINT = '<mujoco><worldbody><body><joint name="j" type="{}" axis="0 0 1"/><geom type="box" size=".1 .2 .3" mass="1"/></body></worldbody></mujoco>'


def inertias(scenario: lm.Scenario) -> Iterator[str]:
    yield from (f"shafts.{name}.inertia" for name, shaft in scenario.shafts.items() if shaft.inertia > 0.0)
    yield from (f"slides.{name}.mass" for name, slide in scenario.slides.items() if slide.mass > 0.0)
    yield from (f"mass_matrices.{name}.matrix.0.0" for name in scenario.mass_matrices)


def stepped(scenario: lm.Scenario, _: Path) -> None:
    simulation = lm.Simulation(scenario)
    simulation.reset(lm.TrainInitial() if scenario.given() else lm.Initial())


def stepped_together(scenario: lm.Scenario, _: Path) -> None:
    batch = lm.SimulationBatch(scenario, step=1e-3, count=2)
    batch.step(**dict.fromkeys(batch.inputs, 0.1))


def studied(scenario: lm.Scenario, path: Path, **more: Any) -> None:
    vary = {"key": next(inertias(scenario)), "relative": True, "values": [1.0, 1.01]}
    keep = {"largest": f"peak({scenario.variables()[0].name})"}
    lm.study(lm.studies.Study(scenario=scenario, vary=[vary], keep=keep, **more), path / "study", threads=1)


def rig_of(scenario: lm.Scenario, path: Path, **more: Any) -> tuple[Rig, list[Prepared]]:
    """A rig whose first inertia is sought, and logs of its last speed."""
    long = scenario.long()
    (path / "rig.toml").write_text(toml_text(scenario.model_dump(exclude_none=True, mode="json")))
    key = next(inertias(long))
    value = lm.simulation.runs.sensitivities.value_at(long, key)
    start = {"start": 1.02 * value, "min": 0.5 * value, "max": 2.0 * value}
    speed = long.train().variable(list(long.train().shafts)[-1], "speed")
    task = Identification(
        scenario="rig.toml",
        logs={"files": ["*.csv"]},
        measured={"speed": {"channel": "speed", "variable": speed}},
        set={key: "J"},
        parameters={"J": start},
        fit={"iterations": 1},
        **more,
    )
    rig = Rig(task, path)
    time = np.linspace(0.0, scenario.simulation.duration, 12)
    logs = [virtual_log(rig, Log(f"{k}", time, {}, {"hours": float(k)}), {"J": value}) for k in range(5)]
    return rig, [prepared(task, log, rig.units) for log in logs]


def identified(scenario: lm.Scenario, path: Path) -> None:
    rig, logs = rig_of(scenario, path)
    identify_logs(rig, logs[:1], threads=1)


def monitored(scenario: lm.Scenario, path: Path) -> None:
    monitor_logs(*rig_of(scenario, path, monitor={"baseline": 5, "order": "hours", "watch": {"J": {}}}))


def exported(scenario: lm.Scenario, path: Path) -> None:
    library = path / "x86_64-linux" / "all.so"  # of which nothing is run
    library.parent.mkdir()
    library.write_bytes(b"")
    lm.export_fmu(scenario, path / "x.fmu", libraries=path)


def measured(scenario: lm.Scenario, _: Path) -> None:
    for gear in scenario.train().gears.values():
        measure_once(gear)


@cache
def measure_once(gear: lm.Gear) -> None:
    lm.test_rig.measure(gear)


def attached(scenario: lm.Scenario, path: Path) -> None:
    (path / "model.xml").write_text(JOINT.format("slide" if scenario.slides else "hinge"))
    lm.mujoco.attach(path / "model.xml", {"j": scenario}, replace=True)


FUNCTIONS: dict[str, Callable[[lm.Scenario, Path], Any]] = {
    "simulate": lambda s, _: lm.simulate(s),
    "sensitivities": lambda s, _: lm.simulate(s, sensitivities=[next(inertias(s))]),
    "Simulation": stepped,
    "SimulationBatch": stepped_together,
    "explain": lambda s, _: lm.explain(s, time=0.0),
    "linearize": lambda s, _: lm.linearize(s, lm.TrainInitial()),
    "linearize at rest": lambda s, _: lm.linearize(s, lm.Initial()),
    "linearize at a time": lambda s, _: lm.linearize(s, time=0.0),
    "periodic_motion": lambda s, _: lm.periodic_motion(s, max_periods=5),
    "spectrum": lambda s, _: lm.spectrum(s),
    "check_drive": lambda s, _: lm.check_drive(s),
    "tune": lambda s, _: lm.tune(s),
    "study": studied,
    "attach": attached,
    "write_drive": lambda s, path: lm.mujoco.write_drive(s, path / "x.drive"),
    "rigid_constants": lambda s, _: lm.response.rigid_constants(s),
    "reduce": lambda s, _: lm.mujoco.reduce(s, 0.5, 1.0),
    "frequency_response": lambda s, _: lm.frequency_response(s, [2.0], 0.2, max_periods=5),
    "select": lambda s, path: studied(s, path, select={"objectives": {"largest": "least"}}),
    "commission": lambda s, _: lm.commission(s),
    "hunting_certificate": lambda s, _: lm.hunting_certificate(s),
    "limit_cycle": lambda s, _: lm.servo.limit_cycle(s, causes=False),
    "identify": identified,
    "monitor": monitored,
    "export_fmu": exported,
    "live": lambda s, _: describe(s, "x"),
    "measure": measured,
    "stepper_curves": lambda s, _: lm.sizing.stepper_curves(s, [2000.0]),
    "pointing_budget": lambda s, _: lm.pointing_budget(s, after=0.0, robustness=False),
}


QUICK = {name: FUNCTIONS[name] for name in FUNCTIONS.keys() - {"commission", "live", "export_fmu", "monitor"}}
"""those that take less than some seconds; pages, FMUs and servo sheets of shipped scenarios are tested by themselves"""
QUICKEST = {name: QUICK[name] for name in QUICK.keys() - {"limit_cycle", "sensitivities", "stepper_curves"}}
"""those that take no long runs to rest, nor derivatives through many switchings"""


def refusals(scenario: lm.Scenario, path: Path, functions: Mapping[str, Any] = QUICK) -> list[str]:
    """Messages of the functions that refuse a scenario by its form."""
    found = []
    for name, function in functions.items():
        (path / name).mkdir()
        try:
            function(scenario, path / name)
        except (lm.InputError, lm.SolverError, RuntimeError) as refusal:
            if NAMES_A_FORM.search(str(refusal)):
                found.append(f"{name}: {refusal}")
    return found


def brief(name: str) -> lm.Scenario:
    scenario = lm.load(name)
    duration = min(scenario.simulation.duration, 0.01)
    times = {"simulation.duration": duration, "simulation.sample_interval": 0.1 * duration}
    return scenario.replace(**times, task={})


@pytest.mark.parametrize("name", [name for name in lm.shipped_scenarios() if name not in LARGE and not ALIKE.match(name)])
def test_no_function_refuses_a_shipped_scenario_by_its_form(name: str, tmp_path: Path) -> None:
    (tmp_path / "own").mkdir()
    scenario = brief(name)
    # The four that track a target have a form in common, in which a run to rest takes seconds.
    quick = QUICKEST if name.startswith("tracking-") else QUICK
    assert refusals(scenario, tmp_path / "own", FUNCTIONS if name == "ball-screw-axis" else quick) == []
    if (long := scenario.long()) != scenario:
        (tmp_path / "long").mkdir()
        assert refusals(long, tmp_path / "long", QUICKEST) == []
        own, other = lm.simulate(scenario), lm.simulate(long)
        for shaft in ("motor", "load"):
            assert np.array_equal(own[f"{shaft}_speed"], other[f"{shaft}_speed"])


def random_gear(seed: int) -> dict[str, Any]:
    """A motor that turns a load through one gear, with names of its own."""
    r = random.Random(f"gear {seed}")
    gear: dict[str, Any] = {"input": "a", "output": "b", "ratio": r.uniform(2.0, 100.0) * r.choice([1.0, -1.0])}
    gear |= {"rated_input_speed": 300.0, "rated_output_torque": 50.0}
    if r.random() < 0.7:
        gear["stiffness"] = {"kind": "curve", "backlash": r.choice([0.0, 1e-3]), "slopes": [1e4], "breaks": []}
    gear["losses"] = {"kind": "constant_efficiency", "efficiency": r.uniform(0.6, 1.0)}
    return {
        "shafts": {"a": {"inertia": r.choice([0.0, 1e-5])}, "b": {"inertia": r.uniform(0.1, 2.0), "torque": {"mean": r.uniform(-5.0, 5.0)}}},
        "motors": {"m": {"shaft": "a", "kind": "torque_source", "rotor_inertia": 1e-4, "rated_torque": 1.0, "friction_torque": r.choice([0.0, 0.02])}},
        "gears": {"g": gear},
        "command": {"m": {"amplitude": r.uniform(0.2, 1.0), "frequency": 20.0}},
        "simulation": {"duration": 0.05, "sample_interval": 0.005},
    }  # fmt: skip


def short_drive(r: random.Random) -> dict[str, Any]:
    """A motor, a gearbox and a load, under a command, a sampled or a continuous controller."""
    tables = lm.load(r.choice(["position-axis", "speed-axis", "paper-2dof-nl-small", "catalogue-robot-joint"]))
    made = tables.replace(**{"load.inertia": tables.load.inertia * r.uniform(0.8, 1.3), "task": {}}).model_dump()
    if made["controller"] is None and r.random() < 0.5:
        del made["command"], made["task"]
        made["controller"] = {"kind": "continuous", "reference": {"kind": "speed", "mean": 0.1}, "speed": {"gain": 0.5}}
    return made


def axis_table(r: random.Random) -> dict[str, Any]:
    """An axis with gearbox, brake and payload or without, tilted or not, under a process force and a command or a controller."""
    kind = r.choice(["screw", "rack", "belt"])
    axis: dict[str, Any] = {
        "motor": {"kind": "torque_source", "rotor_inertia": 2e-4, "rated_torque": 3.0},
        kind: {"lead" if kind == "screw" else "travel_per_turn": r.uniform(0.005, 0.1), "efficiency": r.uniform(0.6, 0.95)},
        "slide": {"mass": r.uniform(2.0, 40.0), "friction_force": r.choice([0.0, 20.0]), "inclination": r.choice([0.0, 0.3, 1.57])},
    }  # fmt: skip
    if r.random() < 0.7:
        axis[kind] |= {"stiffness": 10.0 ** r.uniform(6.0, 7.5), "backlash": r.choice([0.0, 2e-5]), "damping": 1e3}
    if r.random() < 0.5:
        axis["gearbox"] = {"ratio": r.choice([3.0, -5.0]), "inertia": 1e-5}
    if r.random() < 0.5:
        axis["brake"] = {"torque": 5.0, "command": 0.0}
    if r.random() < 0.5:
        axis["payload"] = {"mass": r.uniform(1.0, 10.0)}
    if r.random() < 0.5:
        axis["slide"]["force"] = {"mean": -30.0}
    if r.random() < 0.5:
        axis["slide"]["end_stops"] = {"lower": -0.2, "upper": 0.2, "stiffness": 1e6}
    made = {"axis": axis, "simulation": {"duration": 0.05, "sample_interval": 0.005}}
    if r.random() < 0.5:
        reference = {"kind": "position", "speed": 0.2, "acceleration": 2.0, "moves": [{"to": 0.005}]}
        loops = {"sample_time": 5e-4, "position": {"gain": 20.0}, "speed": {"gain": 0.05, "integral_time": 0.05}}
        return made | {"controller": {"encoder": {"bits": 20}, "reference": reference, **loops}}
    return made | {"command": {"mean": 0.3, "amplitude": 0.2, "frequency": 5.0}}


def train_of_couplings(r: random.Random) -> dict[str, Any]:
    """Two motors that turn a drum by a limiter, a ratchet, a freewheel, a clutch or a damper each, with end stops and a brake."""
    shafts: dict[str, Any] = {"drum": {"inertia": 0.2, "friction_torque": 0.1, "torque": {"mean": -1.0}}}
    made: dict[str, Any] = {"shafts": shafts, "motors": {}, "command": {}, "gears": {}}
    joints: dict[str, dict[str, Any]] = {"torque_limiters": {"release_torque": 3.0, "slip_torque": 1.0}, "ratchets": {"teeth": 12}}
    joints |= {"freewheels": {}, "clutches": {"torque": 5.0, "kind": "friction"}, "dampers": {"viscous_friction": 0.3}}
    for k, (table, joint) in enumerate(r.sample(list(joints.items()), 2)):
        shafts |= {f"rotor_{k}": {}, f"middle_{k}": {"inertia": 0.01}}
        made["motors"][f"m_{k}"] = {"shaft": f"rotor_{k}", "kind": "torque_source", "rated_torque": 1.0, "rotor_inertia": 1e-3}
        made["gears"][f"g_{k}"] = {"input": f"rotor_{k}", "output": f"middle_{k}", "ratio": r.choice([5.0, -7.0])}
        made.setdefault(table, {})[f"c_{k}"] = {"input": f"middle_{k}", "output": "drum", **joint}
        made["command"] |= {f"m_{k}": r.uniform(-1.0, 1.0)} | ({f"c_{k}": 1.0} if table == "clutches" else {})
    if r.random() < 0.5:
        shafts["drum"]["end_stops"] = {"lower": -0.5, "upper": 0.5, "stiffness": 1e4}
    if r.random() < 0.5:
        made["brakes"] = {"b": {"shaft": "drum", "torque": 0.5}}
        made["command"]["b"] = 0.5
    return made | {"simulation": {"duration": 0.05, "sample_interval": 0.005}}


def random_scenario(seed: int) -> lm.Scenario:
    """A scenario of one of five kinds."""
    r = random.Random(f"form {seed}")
    kinds: list[Callable[[], dict[str, Any]]] = [
        lambda: short_drive(r),
        lambda: axis_table(r),
        lambda: train_of_couplings(r),
        lambda: random_axis(seed).model_dump(),
        lambda: fuzz_train(r),
    ]
    scenario = lm.Scenario(**kinds[seed % 5]())
    times = {"simulation.duration": 0.01, "simulation.sample_interval": 0.001}
    return scenario.replace(**times)


@pytest.mark.parametrize("seed", range(some(40, 20)))  # four of each kind
def test_no_function_refuses_a_random_scenario_by_its_form(seed: int, tmp_path: Path) -> None:
    scenario = random_scenario(seed)
    assert refusals(scenario, tmp_path, FUNCTIONS if seed < 5 else QUICKEST) == []
    long = lm.Scenario.of(scenario.tables)  # as it is in the long form
    if long != scenario or long.form != scenario.form:
        (tmp_path / "long").mkdir()
        assert refusals(long, tmp_path / "long", QUICKEST) == []
        own, other = lm.simulate(scenario), lm.simulate(long)
        for shaft in long.train().shafts:
            speed = scenario.train().variable(shaft, "speed"), long.train().variable(shaft, "speed")
            assert np.array_equal(own[speed[0]], other[speed[1]])


@pytest.mark.parametrize("seed", range(20))
def test_a_train_of_one_gear_moves_to_the_last_bit_as_the_drive_that_it_is(seed: int) -> None:
    tables = random_gear(seed)
    motor, gear = (
        {key: v for key, v in tables[t][n].items() if key not in ("shaft", "input", "output")} for t, n in (("motors", "m"), ("gears", "g"))
    )
    gear = {"stiffness": {"kind": "rigid"}} | gear | {"inertia": tables["shafts"]["a"]["inertia"]}
    rest = {"load": tables["shafts"]["b"], "command": tables["command"]["m"], "simulation": tables["simulation"]}
    one = lm.Scenario(motor=motor, gearbox=gear, **rest)
    scenario = lm.Scenario(**tables)
    drive, train = lm.simulate(one), lm.simulate(scenario)
    assert np.array_equal(drive["load_speed"], train["b_speed"])
    assert np.array_equal(drive["twist"], train["g_twist"])
    short, long = lm.check_drive(one), lm.check_drive(scenario)
    assert [(f.rule, f.verdict) for f in short] == [(f.rule, f.verdict) for f in long]


@pytest.mark.parametrize(("name", "own", "long"), [
    ("ball-screw-axis", "axis.slide.mass", "slides.slide.mass"),
    ("ball-screw-axis", "axis.screw.lead", "screws.screw.lead"),
    ("ball-screw-axis", "controller.position.gain", "controllers.motor.position.gain"),
    ("catalogue-robot-joint", "load.inertia", "shafts.load.inertia"),
    ("catalogue-robot-joint", "command.amplitude", "command.motor.amplitude"),
    ("position-axis", "controller.speed.gain", "controllers.motor.speed.gain"),
])  # fmt: skip
def test_a_key_of_the_file_and_that_of_the_long_form_are_one(name: str, own: str, long: str) -> None:
    scenario = lm.load(name).replace(**{"simulation.duration": 0.01, "simulation.sample_interval": 0.001})
    value = 1.25 * lm.simulation.runs.sensitivities.value_at(scenario, own)
    changed = scenario.replace(**{own: value})
    assert changed == scenario.replace(**{long: value}) != scenario
    assert lm.load(name, {own: value}).written == lm.load(name, {long: value}).written
    one, other = (lm.simulate(scenario, sensitivities=[key]) for key in (own, long))
    for variable in one:
        assert np.array_equal(one[variable], other[variable], equal_nan=True)
    for key in (own, long):
        vary = {"key": key, "values": [value]}
        study = lm.studies.Study(scenario=scenario, vary=[vary], keep={"x": f"peak({scenario.variables()[0].name})"})
        assert study.scenario_at(study.parameters(0, 1)[0]) == changed
        assert study.vary[0].title == key


def test_a_result_of_an_axis_has_the_tables_of_its_file(tmp_path: Path) -> None:
    axis = lm.Scenario(**axis_table(random.Random(3))).replace(**{"simulation.duration": 0.01})
    lm.save(lm.simulate(axis), tmp_path / "run.nc")
    again = lm.simulation.scenario_of(lm.open_result(tmp_path / "run.nc"))
    assert again == axis
    assert again.form == axis.form
    refused(lambda: lm.sizing.motor_current(lm.open_result(tmp_path / "run.nc")), reason="axis.motor.limits.torque_constant")
    refused(lambda: axis.replace(**{"slides.slide.mass": -1.0}), "axis.slide.mass")
    more = axis.replace(**{"shafts.motor.inertia": 1e-4})  # which a file of an axis cannot say
    assert lm.Scenario.from_json(more.to_json()).tables == more.tables


def test_the_one_command_and_the_one_load_are_given_alike_in_each_form() -> None:
    scenario = lm.load("catalogue-robot-joint")
    wave = lm.CommandSignal(amplitude=0.2, frequency=2.0)
    times = {"duration": 0.1, "sample_interval": 0.01}
    state = lm.Initial(motor_speed=5.0, load_speed=0.05)
    calls: list[Callable[[lm.Scenario], Any]] = [
        lambda s: lm.simulate(s, command=wave, load_torque=1.0, initial=state, **times)["load_speed"],
        lambda s: lm.simulate(s, initial=state.of_train(), **times)["load_speed"],
        lambda s: lm.periodic_motion(s, wave, 1.0)["load_speed"],
        lambda s: lm.linearize(s, state, command=0.1, load_torque=1.0).response(3.0, "load_speed", next(iter(s.signals()))),
        lambda s: lm.frequency_response(s, [2.0], 0.2, mean_command=0.05, mean_load_torque=1.0)["response"].sel(output="load_speed"),
    ]
    for call in calls:
        assert np.array_equal(call(scenario), call(scenario.long()))


def test_a_study_of_a_train_of_one_gear_has_the_words_of_a_drive(tmp_path: Path) -> None:
    scenario = brief("catalogue-robot-joint")
    keep = {"ideal": "peak(ideal_speed)", "band": "bandwidth(0.2)"}
    tables = [
        read_table(lm.study(lm.studies.Study(scenario=one, vary=[{"key": key, "values": [50.0, 100.0]}], keep=keep), tmp_path / key))
        for one, key in ((scenario, "gearbox.ratio"), (scenario.long(), "gears.gearbox.ratio"))
    ]
    assert tables[0].to_pydict()["ideal"] == tables[1].to_pydict()["ideal"]
    assert tables[0].to_pydict()["band"] == tables[1].to_pydict()["band"]
