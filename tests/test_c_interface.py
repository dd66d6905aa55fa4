"""The C interface: the same bits as Python, by way of its header alone."""

import ctypes as c
import math
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from conftest import ROOT, TRAINS, jamming
from lostmotion import _core
from lostmotion.model.angle_torques import TorqueCurve
from lostmotion.model.shaft import DragCurve
from lostmotion.model.torsion import Rigid
from lostmotion.simulation.forms.initial_state import start_values

LIBRARY = ROOT / "build" / "c" / "liblostmotion.so"
STATES, INPUTS, VARIABLES, CAPACITIES = range(4)
OK, INTERRUPTED, JAMMED, INVALID = 0, 1, 2, 100


class Parameter(c.Structure):
    _fields_ = [("key", c.c_char_p), ("value", c.c_double)]


class Curve(c.Structure):
    _fields_ = [("breaks", c.POINTER(c.c_double)), ("slopes", c.POINTER(c.c_double)), ("n_breaks", c.c_size_t)]


class PeriodicCurve(c.Structure):
    _fields_ = [("period", c.c_double), ("angles", c.POINTER(c.c_double)), ("values", c.POINTER(c.c_double)), ("n", c.c_size_t)]


class Signal(c.Structure):
    _fields_ = [
        ("breakpoints", c.POINTER(c.c_double)),
        ("n_breakpoints", c.c_size_t),
        ("sines", c.POINTER(c.c_double)),
        ("n_sines", c.c_size_t),
    ]


def doubles(values: Any) -> Any:
    flat = [float(v) for v in np.ravel(np.asarray(values, dtype=float))]
    return (c.c_double * max(1, len(flat)))(*flat)


@pytest.fixture(scope="module")
def library() -> c.CDLL:
    """`make test` builds it; a checkout that only runs pytest builds it here."""
    if not LIBRARY.exists():
        subprocess.run(["make", "c-library"], cwd=ROOT, check=True)
    lib = c.CDLL(str(LIBRARY))
    for name in ("lm_train_new", "lm_simulation_new", "lm_snapshot_new"):
        getattr(lib, name).restype = c.c_void_p
    for name in ("train_error", "error", "name", "unit", "meaning", "parameter_key", "parameter_unit"):
        getattr(lib, f"lm_{name}").restype = c.c_char_p
    for name in ("lm_count", "lm_state_size", "lm_parameter_count"):
        getattr(lib, name).restype = c.c_size_t
    lib.lm_time.restype = c.c_double
    return lib


class Train:
    """A train of the C interface from a scenario in the long form, element by element."""

    def __init__(self, library: c.CDLL, scenario: lm.Scenario) -> None:
        self.lib, self.train = library, c.c_void_p(library.lm_train_new())
        train = scenario.train()
        for name, s in train.shafts.items():
            law = s.friction()
            assert not law["speeds"]
            assert s.drag is None
            own = (s.inertia, s.viscous_friction, law["torque"], law["breakaway_torque"])
            self.add("lm_add_shaft", name, *own, None, name in scenario.loaded())
        for name, mass in train.mass_matrices.items():
            shafts = (c.c_char_p * len(mass.shafts))(*(shaft.encode() for shaft in mass.shafts))
            self.add("lm_add_mass_matrix", name, shafts, len(mass.shafts), doubles(np.ravel(mass.matrix)))
        for name, m in train.motors.items():
            limit = m.torque_limit if m.torque_limit is not None else float("inf")
            parameters = self.parameters(m, "motor")
            self.add("lm_add_motor", name, m.shaft, *parameters, m.kind == "torque_source", limit)
        for name, g in train.gears.items():
            curve = None
            if not isinstance(g.stiffness, Rigid):
                breaks, slopes = g.stiffness.pieces()
                curve = c.byref(Curve(doubles(breaks), doubles(slopes), len(breaks)))
            both = doubles(g.losses.efficiencies()) if hasattr(g.losses, "efficiencies") else None
            parameters = self.parameters(g, "gearbox")
            self.add("lm_add_gear", name, g.input, g.output, *parameters, curve, None, both, None)
            if g.mesh_stiffness is not None:
                period, angles, factors = g.mesh_stiffness.curve()
                mesh = PeriodicCurve(period, doubles(angles), doubles(factors), len(angles))
                self.add("lm_set_mesh_stiffness", name, c.byref(mesh))
        for name, b in train.brakes.items():
            self.add("lm_add_brake", name, b.shaft, b.torque, b.breakaway_torque or 0.0)
        for name, k in train.clutches.items():
            function = {"friction": "lm_add_clutch", "safety": "lm_add_safety_clutch"}[k.kind]
            self.add(function, name, k.input, k.output, k.torque, k.breakaway_torque or 0.0)
        for name, f in train.freewheels.items():
            self.add("lm_add_freewheel", name, f.input, f.output)
        for name, d in train.dampers.items():
            drag = None
            if d.drag is not None:
                assert isinstance(d.drag, DragCurve)
                breaks = d.drag.speeds[1:-1]
                slopes = np.diff(d.drag.torques) / np.diff(d.drag.speeds)
                drag = c.byref(Curve(doubles(breaks), doubles(slopes), len(breaks)))
            self.add("lm_add_damper", name, d.input, d.output, d.viscous_friction, drag)
        for name, t in train.angle_torques.items():
            assert isinstance(t, TorqueCurve)
            curve = PeriodicCurve(t.period, doubles(t.angles), doubles(t.torques), len(t.angles))
            self.add("lm_add_angle_torque", name, t.shaft, c.byref(curve))
        for name, s in train.springs.items():
            breaks, slopes = s.stiffness.pieces()
            self.add("lm_add_spring", name, s.shaft, c.byref(Curve(doubles(breaks), doubles(slopes), len(breaks))), s.rest_angle)

    def parameters(self, part: Any, table: str) -> tuple[Any, int]:
        keys = dict(_core.parameters())
        values = {f"{table}.{key}": value for key, value in part.core_fields().items() if value is not None}
        given = {key: float(value) for key, value in values.items() if key in keys}
        array = (Parameter * max(1, len(given)))(*(Parameter(k.encode(), v) for k, v in given.items()))
        return array, len(given)

    def add(self, function: str, *arguments: Any) -> None:
        assert self.attempt(function, *arguments) == OK, self.error()

    def attempt(self, function: str, *arguments: Any) -> int:
        types = {str: lambda a: a.encode(), float: c.c_double, bool: c.c_int, int: c.c_size_t}
        converted = [types[type(a)](a) if type(a) in types else a for a in arguments]
        return int(getattr(self.lib, function)(self.train, *converted))

    def error(self) -> str:
        return self.lib.lm_train_error(self.train).decode()

    def simulation(self, step: float) -> "Simulation":
        made = self.lib.lm_simulation_new(self.train, c.c_double(step))
        assert made, self.error()
        self.lib.lm_train_free(self.train)
        return Simulation(self.lib, c.c_void_p(made))


class Simulation:
    def __init__(self, library: c.CDLL, handle: c.c_void_p) -> None:
        self.lib, self.handle = library, handle

    def names(self, kind: int) -> list[str]:
        count = self.lib.lm_count(self.handle, kind)
        return [self.lib.lm_name(self.handle, kind, c.c_size_t(k)).decode() for k in range(count)]

    def error(self) -> str:
        return self.lib.lm_error(self.handle).decode()

    def state(self) -> Any:
        values = (c.c_double * self.lib.lm_state_size(self.handle))()
        assert self.lib.lm_get_state(self.handle, values) == OK
        return values

    def advance(self, interval: float, inputs: Any) -> int:
        given = doubles(inputs)
        return int(self.lib.lm_advance(self.handle, c.c_double(interval), given, given))

    def read(self) -> np.ndarray:
        values = (c.c_double * len(self.names(VARIABLES)))()
        assert self.lib.lm_read(self.handle, values) == OK, self.error()
        return np.array(values)


PLAIN = [path for path in TRAINS if path.stem in ("worm-lowering", "two-motors-one-ring", "two-link-arm-frozen")]


@pytest.mark.parametrize("path", PLAIN, ids=lambda path: path.stem)
def test_a_run_has_the_bits_of_python(library: c.CDLL, path: Path) -> None:
    scenario = lm.load(path)
    simulation = Train(library, scenario).simulation(scenario.simulation.sample_interval)
    signals = scenario.signals()
    names = simulation.names(INPUTS)
    array = (Signal * len(names))(
        *(
            Signal(doubles(s.breakpoint_list()), len(s.breakpoint_list()), doubles(s.sine_list()), len(s.sine_list()))
            for s in (signals[name] for name in names)
        )
    )
    start = start_values(scenario.train(), scenario.initial)
    states = doubles([start.get(name, 0.0) for name in simulation.names(STATES)])
    samples = scenario.simulation.samples
    table = np.zeros((len(simulation.names(VARIABLES)), samples))
    status = library.lm_run(
        simulation.handle,
        array,
        states,
        None,
        c.c_double(scenario.simulation.duration),
        c.c_double(scenario.simulation.sample_interval),
        c.c_size_t(samples),
        table.ctypes.data_as(c.POINTER(c.c_double)),
    )
    assert status == OK, simulation.error()
    result = lm.simulate(scenario)
    for name, row in zip(simulation.names(VARIABLES), table, strict=True):
        assert np.array_equal(row, result[name].to_numpy()), name


@pytest.fixture
def worm(library: c.CDLL) -> Simulation:
    return Train(library, lm.load("worm-lowering")).simulation(1e-3)


@pytest.mark.parametrize("way", ["state", "snapshot"])
def test_stepping_from_a_kept_state_repeats_bit_for_bit(worm: Simulation, library: c.CDLL, way: str) -> None:
    inputs = [-0.15 if name == "motor_command" else 20.0 for name in worm.names(INPUTS)]
    for _ in range(200):
        assert worm.advance(1e-3, inputs) == OK, worm.error()
    kept, snapshot = worm.state(), c.c_void_p(worm.lib.lm_snapshot_new(worm.handle))
    for _ in range(300):
        assert worm.advance(1e-3, inputs) == OK
    first = worm.read()
    if way == "state":
        assert worm.lib.lm_set_state(worm.handle, kept) == OK
    else:
        assert worm.lib.lm_snapshot_restore(worm.handle, snapshot) == OK
        other = Train(library, lm.load("two-link-arm-frozen")).simulation(1e-3)
        assert library.lm_snapshot_restore(other.handle, snapshot) in (OK, INVALID)  # by the kernels
    worm.lib.lm_snapshot_free(snapshot)
    for _ in range(300):
        assert worm.advance(1e-3, inputs) == OK
    assert np.array_equal(first, worm.read())
    assert worm.lib.lm_time(worm.handle) == pytest.approx(0.5, abs=1e-12)


class Answer(c.Structure):
    _fields_ = (("torque", c.c_double), ("derivative", c.c_double), ("acceleration", c.c_double))


def test_a_load_gets_the_answer_of_python(worm: Simulation) -> None:
    alone = lm.Simulation(lm.load("worm-lowering"), step=1e-3, initial=lm.TrainInitial())
    answer = Answer()
    for k in range(200):
        load = {"motor_command": -0.15, "drum_load_torque": 20.0 - 0.01 * k}
        inputs = doubles([load[name] for name in worm.names(INPUTS)])
        status = worm.lib.lm_advance_answer(worm.handle, c.c_double(1e-3), inputs, inputs, b"drum", c.byref(answer))
        assert status == OK, worm.error()
        expected = alone.answer(1e-3, shaft="drum", **load)
        assert (answer.torque, answer.acceleration) == (expected.torque, expected.acceleration)
        assert answer.derivative == expected.derivative
    wrong = worm.lib.lm_advance_answer(worm.handle, c.c_double(1e-3), inputs, inputs, b"dru", c.byref(answer))
    assert wrong == INVALID
    assert worm.error().startswith("the shaft 'dru' has no load torque of its own")


def test_clutches_freewheels_and_torques_over_an_angle_have_the_bits_of_python(library: c.CDLL) -> None:
    """A motor drives by a clutch, a freewheel and a safety clutch, which slips on the cogging of the last shaft."""
    scenario = lm.Scenario(
        shafts={
            "a": {"inertia": 0.01},
            "b": {"inertia": 0.02},
            "c": {"inertia": 0.03, "friction_torque": 0.05},
            "d": {"inertia": 0.2, "viscous_friction": 0.4, "torque": 0.0},
            "e": {"inertia": 0.01},
        },
        gears={
            "mesh": {
                "input": "d",
                "output": "e",
                "ratio": 2.0,
                "stiffness": {"kind": "linear", "stiffness": 5.0},
                "mesh_stiffness": {"teeth": 60, "pairs": [[0.0, 1.0], [0.4, 0.5], [0.7, 0.8]], "phase": 0.03},
            }
        },
        motors={"motor": {"shaft": "a", "kind": "torque_source", "rated_torque": 4.0, "rotor_inertia": 0.01}},
        clutches={
            "clutch": {"input": "a", "output": "b", "torque": 3.0, "breakaway_torque": 3.5},
            "limiter": {"kind": "safety", "input": "c", "output": "d", "torque": 1.5},
        },
        freewheels={"freewheel": {"input": "b", "output": "c"}},
        angle_torques={"cogging": {"kind": "curve", "shaft": "d", "angles": [0, 1.5, 4], "torques": [0, 1.2, -1.2]}},
        springs={"stops": {"shaft": "d", "stiffness": {"kind": "curve", "backlash": 0.2, "slopes": [9.0]}}},
        command={"clutch": {"mean": 1.0}},
        simulation={"duration": 1.0, "sample_interval": 1e-3},
    )
    python, there = lm.Simulation(scenario, step=1e-3), Train(library, scenario).simulation(1e-3)
    inputs = there.names(INPUTS)
    assert {"motor_command", "clutch_command", "d_load_torque"} == set(inputs)
    modes: dict[str, set[float]] = {"limiter_contact": set(), "freewheel_contact": set()}
    for k in range(600):
        given = {"motor_command": (0.9, 0.2, -0.3)[k // 200], "clutch_command": 1.0, "d_load_torque": 0.2}
        python.advance(1e-3, **given)
        assert there.advance(1e-3, [given[name] for name in inputs]) == OK, there.error()
        for name, met in modes.items():
            met.add(python[name])
    told, wanted = dict(zip(there.names(VARIABLES), there.read(), strict=True)), python.read()
    assert {name: told[name] for name in wanted} == pytest.approx(wanted, rel=0.0, abs=0.0, nan_ok=True)
    assert all(len(met) > 1 for met in modes.values())


class Motion(c.Structure):
    _fields_ = [("shaft", c.c_char_p), ("position", c.c_double), ("speed", c.c_double), ("acceleration", c.c_double)]


def test_a_given_motion_has_the_bits_of_python(library: c.CDLL) -> None:
    """Angle, speed and acceleration, and two of them; the torque that they take is a variable."""
    scenario = lm.Scenario(
        shafts={"crank": {"inertia": 0.02, "friction_torque": 0.5, "speed": 0.0}, "lever": {"inertia": 0.3, "friction_torque": 0.2}},
        gears={
            "mesh": {"input": "crank", "output": "lever", "ratio": 2.0, "stiffness": {"kind": "curve", "backlash": 0.01, "slopes": [800.0]}}
        },
        simulation={"duration": 1.0, "sample_interval": 0.02},
    )
    train = Train(library, scenario)
    assert train.attempt("lm_give_motion", "crank") == OK
    assert train.attempt("lm_give_motion", "nix") == INVALID
    assert train.error() == "there is no shaft 'nix'"
    python, there = lm.Simulation(scenario, step=0.02), train.simulation(0.02)
    assert set(there.names(INPUTS)) == {"crank_given_speed", "crank_given_acceleration"}
    none = doubles([0.0, 0.0])

    def advance(*motions: Motion) -> int:
        array = (Motion * max(1, len(motions)))(*motions)
        step = c.c_double(0.02), none, none, array, c.c_size_t(len(motions))
        return int(library.lm_advance_motion(there.handle, *step))

    for k in range(1, 60):
        t = 0.02 * k
        end = {"angle": 3.0 * t**2, "speed": 6.0 * t, "acceleration": 6.0}
        if k % 3:
            del end[("angle", "acceleration")[k % 3 - 1]]
        python.advance(0.02, motion={"crank": end})
        given = Motion(b"crank", end.get("angle", math.nan), end["speed"], end.get("acceleration", math.nan))
        assert advance(given) == OK, there.error()
    told, wanted = dict(zip(there.names(VARIABLES), there.read(), strict=True)), python.read()
    assert {name: told[name] for name in wanted} == wanted
    assert wanted["crank_speed"] == pytest.approx(6.0 * t, rel=1e-13)
    kept = list(there.state())
    assert advance(Motion(b"lever", math.nan, 1.0, math.nan)) == INVALID
    assert there.error() == "the motion of no shaft 'lever' is given; lm_give_motion gives it"
    assert advance(Motion(b"crank", math.nan, math.nan, math.nan)) == INVALID
    assert there.error() == "the motion of 'crank' is not finite, or has no speed"
    assert list(there.state()) == kept


def test_variables_have_the_units_and_meanings_of_python(library: c.CDLL, worm: Simulation) -> None:
    assert library.lm_interface_version() == int(
        re.search(r"LM_INTERFACE_VERSION (\d+)", (ROOT / "bindings" / "c" / "lostmotion.h").read_text()).group(1)  # type: ignore[union-attr]
    )
    result = lm.simulate(lm.load("worm-lowering", {"simulation.duration": 0.01}))
    for k, name in enumerate(worm.names(VARIABLES)):
        assert library.lm_unit(worm.handle, VARIABLES, c.c_size_t(k)).decode() == result[name].attrs["units"]
        assert library.lm_meaning(worm.handle, VARIABLES, c.c_size_t(k)).decode() == result[name].attrs["long_name"]


def test_directional_derivatives_are_those_of_finite_differences(worm: Simulation) -> None:
    inputs = np.array([-0.15 if name == "motor_command" else 20.0 for name in worm.names(INPUTS)])
    for _ in range(150):
        assert worm.advance(1e-3, inputs) == OK
    states, variables = worm.names(STATES), worm.names(VARIABLES)
    kept, h = worm.state(), 1e-7
    place = {name: k for k, name in enumerate(states)}

    def rates(more: np.ndarray) -> np.ndarray:
        assert worm.lib.lm_set_state(worm.handle, kept) == OK
        before = dict(zip(variables, worm.read(), strict=True))
        assert worm.advance(h, more) == OK
        after = dict(zip(variables, worm.read(), strict=True))
        return np.array([(after[name] - before[name]) / h for name in states if name in variables])

    step = np.array([0.01, 0.0])
    difference = rates(inputs + step) - rates(inputs)
    out, values = (c.c_double * len(states))(), (c.c_double * len(variables))()
    assert worm.lib.lm_set_state(worm.handle, kept) == OK
    assert worm.lib.lm_directional_derivative(worm.handle, None, doubles(step), out, values) == OK, worm.error()
    expected = [out[place[name]] for name in states if name in variables]
    assert np.allclose(difference, expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max())
    assert np.abs(expected).max() > 1.0
    assert values[variables.index("motor_command")] == step[0]


def test_what_is_wrong_is_said_in_one_line(library: c.CDLL, worm: Simulation) -> None:
    train = Train(library, lm.load("worm-lowering"))
    brake = ("lm_add_brake", "b", "nix", 1.0, 0.0)
    assert train.attempt(*brake) == OK
    assert library.lm_train_check(train.train) == INVALID
    assert "brake 'b'" in train.error()
    assert train.attempt("lm_add_brake", "worm", "worm", 1.0, 0.0) == INVALID
    assert train.error() == "the name 'worm' is taken; use another one"
    assert train.attempt("lm_add_clutch", "k", "worm", "load", -1.0, 0.0) == INVALID
    assert train.error() == "clutch 'k': torque is -1; it must be finite and > 0"
    assert train.attempt("lm_add_spring", "k", "worm", None, 0.0) == INVALID
    assert train.error() == "spring 'k': has no numbers"
    assert train.attempt("lm_set_housing", "nix", "worm") == INVALID
    assert train.error() == "there is no gear 'nix'"
    assert train.attempt("lm_set_housing", "coupling", "nix") == INVALID
    assert train.error() == "there is no shaft 'nix'"
    assert train.attempt("lm_set_housing", "coupling", "worm") == OK
    assert library.lm_train_check(train.train) == INVALID
    assert "gear 'coupling' has its housing on" in train.error()
    wrong = (Parameter * 1)(Parameter(b"motor.colour", 1.0))
    assert train.attempt("lm_add_motor", "m2", "worm", wrong, 1, False, 1.0) == INVALID
    assert train.error() == "motor 'm2': there is no parameter 'motor.colour'"
    assert worm.advance(float("nan"), [0.0, 0.0]) == INVALID
    assert worm.error().startswith("the interval must be > 0")
    assert worm.advance(1e-3, [0.0, float("inf")]) == INVALID
    assert worm.error() == "an input is missing or not finite"


def test_a_jam_is_said_as_in_python(library: c.CDLL) -> None:
    """A rigid self-locking worm under a heavy load (drivetrain: effective inertia below zero)."""
    scenario = jamming()
    with pytest.raises(lm.SolverError) as jammed:
        lm.simulate(scenario)
    simulation = Train(library, scenario).simulation(1e-3)
    start = {"worm_speed": -100.0, "drum_speed": -2.0}
    states = doubles([start.get(name, 0.0) for name in simulation.names(STATES)])
    assert library.lm_reset(simulation.handle, states, None) == OK, simulation.error()
    inputs = [0.0 if name == "motor_command" else 20.0 for name in simulation.names(INPUTS)]
    assert simulation.advance(1e-3, inputs) == JAMMED
    assert simulation.error() == str(jammed.value)


def test_parameters_are_those_of_scenario_files(library: c.CDLL) -> None:
    keys = [library.lm_parameter_key(c.c_size_t(k)).decode() for k in range(library.lm_parameter_count())]
    assert "gearbox.ratio" in keys
    assert library.lm_parameter_key(c.c_size_t(len(keys))) is None
    units = {key: library.lm_parameter_unit(c.c_size_t(k)).decode() for k, key in enumerate(keys)}
    assert units["motor.rotor_inertia"] == "kg*m^2"


def test_the_example_in_c_compiles_without_a_warning_and_runs(library: c.CDLL, tmp_path: Path) -> None:
    compiler = shutil.which("cc") or shutil.which("gcc")
    assert compiler is not None
    program = tmp_path / "worm"
    subprocess.run(
        [compiler, "-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", f"-I{ROOT / 'bindings' / 'c'}",
         str(ROOT / "examples" / "worm.c"), f"-L{LIBRARY.parent}", "-llostmotion", f"-Wl,-rpath,{LIBRARY.parent}", "-lm",
         "-o", str(program)],
        check=True,
    )  # fmt: skip
    out = subprocess.run([str(program)], capture_output=True, text=True, check=True).stdout
    assert out.startswith("t = 2 s\n")
    values = {line.split()[0]: float(line.split()[1]) for line in out.splitlines()[1:]}
    assert values["worm_speed"] == 0.0
    assert values["gear_output_torque"] == pytest.approx(20.0, abs=1e-6)
