"""The C interface: the same bits as Python, by way of its header alone."""

import ctypes as c
import math
import re
import shutil
import subprocess
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from conftest import ROOT, TRAINS, jamming
from lostmotion.model.angle_torques import TorqueCurve
from lostmotion.model.mesh_stiffness import MeshStiffness
from lostmotion.model.train import COUPLINGS, ON_SHAFTS
from lostmotion.simulation.forms.initial_state import start_values
from tables import gear_between, linked, run_of, torque_source

LIBRARY = ROOT / "build" / "c" / "liblostmotion.so"
STATES, INPUTS, VARIABLES, CAPACITIES = range(4)
OK, INTERRUPTED, JAMMED, INVALID = 0, 1, 2, 100


class Value(c.Structure):
    _fields_ = [("key", c.c_char_p), ("values", c.POINTER(c.c_double)), ("n", c.c_size_t)]


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
    for name in ("train_error", "error", "name", "unit", "meaning"):
        getattr(lib, f"lm_{name}").restype = c.c_char_p
    for name in ("lm_count", "lm_state_size"):
        getattr(lib, name).restype = c.c_size_t
    lib.lm_time.restype = c.c_double
    return lib


CHOICES = {"dc": 0, "torque_source": 1, "rotation": 0, "translation": 1}


def curve_values(curve: Any) -> dict[str, Any]:
    """The parts of a curve by the keys of the C interface."""
    if isinstance(curve, TorqueCurve):
        return {"period": curve.period, "angles": curve.angles, "values": curve.torques}
    if isinstance(curve, MeshStiffness):
        return dict(zip(("period", "angles", "values"), curve.curve(), strict=True))
    assert curve.odd
    return dict(zip(("breaks", "slopes"), curve.side(True), strict=True))


def flat(fields: Mapping[str, Any], table: str = "") -> dict[str, list[float]]:
    """Fields of the core as the C interface has them: lists of numbers, of tables and curves by longer keys."""
    out: dict[str, list[float]] = {}
    for key, value in fields.items():
        if value is None or value in ([], ()):
            continue
        if isinstance(value, Mapping):
            out |= flat(value, f"{table}{key}.")
        elif not isinstance(value, (str, int, float, list, tuple)):
            out |= flat(curve_values(value), f"{table}{key}.")
        else:
            out[table + key] = [float(v) for v in np.ravel(CHOICES[value] if isinstance(value, str) else value)]
    return out


class Train:
    """A train of the C interface from a scenario in the long form, element by element."""

    def __init__(self, library: c.CDLL, scenario: lm.Scenario, given: Collection[str] = ()) -> None:
        self.lib, self.train = library, c.c_void_p(library.lm_train_new())
        train = scenario.train()
        for name, shaft in train.shafts.items():
            inputs = {"loaded": name in scenario.loaded(), "given_motion": name in given}
            self.add("shafts", name, [], shaft.core_fields() | inputs)
        for name, mass in train.mass_matrices.items():
            self.add("mass_matrices", name, mass.shafts, {"matrix": mass.matrix})
        for name, motor in train.motors.items():
            self.add("motors", name, [motor.shaft], motor.core_fields())
        for name, gear in train.gears.items():
            self.add("gears", name, [gear.input, gear.output], gear.core_fields() | {"mesh_stiffness": gear.mesh_stiffness})
        for table in COUPLINGS:
            for name, element in getattr(train, table).items():
                self.add(table, name, [element.input, element.output], element.core_fields())
        for table, kind in ON_SHAFTS.items():
            for name, element in getattr(train, table).items():
                over_angle = {"torque": element} if kind == "angle_torques" else {}
                self.add(kind, name, [element.shaft], element.core_fields() | over_angle)

    def add(self, table: str, name: str, shafts: Sequence[str], fields: Mapping[str, Any]) -> None:
        assert self.attempt(table, name, shafts, **fields) == OK, self.error()

    def attempt(self, table: str, name: str, shafts: Sequence[str], **fields: Any) -> int:
        values = [Value(key.encode(), doubles(numbers), len(numbers)) for key, numbers in flat(fields).items()]
        on = (c.c_char_p * max(1, len(shafts)))(*(shaft.encode() for shaft in shafts))
        array = (Value * max(1, len(values)))(*values)
        n_shafts, n = c.c_size_t(len(shafts)), c.c_size_t(len(values))
        return int(self.lib.lm_add(self.train, table.encode(), name.encode(), on, n_shafts, array, n))

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
            "mesh": gear_between(
                "d", "e", 2.0, 5.0, mesh_stiffness={"teeth": 60, "pairs": [[0.0, 1.0], [0.4, 0.5], [0.7, 0.8]], "phase": 0.03}
            )
        },
        motors={"motor": torque_source(0.01, "a", rated_torque=4.0)},
        clutches={"clutch": linked("a", "b", torque=3.0, breakaway_torque=3.5), "limiter": linked("c", "d", kind="safety", torque=1.5)},
        freewheels={"freewheel": linked("b", "c")},
        angle_torques={"cogging": {"kind": "curve", "shaft": "d", "angles": [0, 1.5, 4], "torques": [0, 1.2, -1.2]}},
        springs={"stops": {"shaft": "d", "stiffness": {"kind": "curve", "backlash": 0.2, "slopes": [9.0]}}},
        command={"clutch": {"mean": 1.0}},
        simulation=run_of(1.0, 1e-3),
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
        gears={"mesh": gear_between("crank", "lever", 2.0, {"kind": "curve", "backlash": 0.01, "slopes": [800.0]})},
        simulation=run_of(1.0, 0.02),
    )
    train = Train(library, scenario, given=["crank"])
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
    assert there.error() == "the motion of no shaft 'lever' is given; given_motion gives it"
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
    assert train.attempt("brakes", "b", ["nix"], torque=1.0) == OK
    assert library.lm_train_check(train.train) == INVALID
    assert "brake 'b'" in train.error()
    housed = {"ratio": 2.0}
    for table, name, shafts, fields, error in (
        ("brakes", "worm", ["worm"], {"torque": 1.0}, "the name 'worm' is taken; use another one"),
        ("brakes", "", ["worm"], {"torque": 1.0}, "an element has no name"),
        ("clutches", "k", ["worm", "load"], {"torque": -1.0}, "clutch 'k': torque is -1; it must be finite and > 0"),
        ("clutches", "k", ["worm", "load"], {"torque": [1.0, 2.0]}, "clutch 'k': torque must be one number"),
        ("clutches", "k", ["worm"], {"torque": 1.0}, "clutch 'k': is on 1 shafts; it must be on 2"),
        ("springs", "k", ["worm"], {"curve.breaks": 1.0, "curve.slopes": 1.0}, "spring 'k': curve.slopes must be one more than breaks"),
        ("motors", "m2", ["worm"], {"colour": 1.0}, "motor 'm2': there is no 'colour'"),
        ("wheels", "w", ["worm"], {}, "there is no table 'wheels'"),
        ("gears", "g", ["worm", "drum", "nix"], housed, "gear 'g': there is no shaft 'nix' for its housing"),
    ):
        assert train.attempt(table, name, shafts, **fields) == INVALID
        assert train.error() == error
    train = Train(library, lm.load("worm-lowering"))
    assert train.attempt("torque_limiters", "t", ["rotor", "worm"], release_torque=2.0, slip_torque=1.0) == OK
    assert train.attempt("end_stops", "e", ["drum"], lower=-1.0, upper=1.0, stiffness=1e3) == OK
    assert library.lm_train_check(train.train) == OK, train.error()
    assert train.attempt("gears", "g", ["worm", "drum", "worm"], **housed) == OK
    assert library.lm_train_check(train.train) == INVALID
    assert "gear 'g' has its housing on" in train.error()
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
