"""Scenarios as numbers: read by the C library, run, stepped and altered there as in Python."""

import ctypes as c
import math
import time
import zlib
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from lostmotion import _core
from lostmotion.portable.derivation import Derivation, derivation_of
from lostmotion.portable.scenario_as_numbers import numbers_of
from lostmotion.reproducible import arctan, cbrt, cos, sin
from refusals import refused
from test_c_interface import INPUTS, INTERRUPTED, INVALID, OK, STATES, VARIABLES, Signal, doubles, library  # noqa: F401
from test_c_interface import Simulation as Stepped

SAMPLES = 0


class Scenario:
    """A scenario that the C library has read."""

    def __init__(self, lib: c.CDLL, numbers: np.ndarray) -> None:
        for name in ("lm_scenario_read", "lm_scenario_run", "lm_simulation_from", "lm_result_values"):
            getattr(lib, name).restype = c.c_void_p
        for name in ("lm_scenario_error", "lm_scenario_parameter_key", "lm_result_name", "lm_result_error"):
            getattr(lib, name).restype = c.c_char_p
        for name in ("lm_scenario_parameter_count", "lm_result_count", "lm_result_samples"):
            getattr(lib, name).restype = c.c_size_t
        lib.lm_scenario_get.restype = c.c_double
        self.lib, error = lib, c.create_string_buffer(500)
        handle = lib.lm_scenario_read(doubles(numbers), c.c_size_t(len(numbers)), error, c.c_size_t(500))
        self.refused = error.value.decode()
        self._handle = c.c_void_p(handle)

    @property
    def handle(self) -> c.c_void_p:
        assert self._handle, f"{self.refused}; after a change of the core `make c-library` builds the library"
        return self._handle

    def error(self) -> str:
        return self.lib.lm_scenario_error(self.handle).decode()

    def keys(self) -> list[str]:
        count = self.lib.lm_scenario_parameter_count(self.handle)
        return [self.lib.lm_scenario_parameter_key(self.handle, c.c_size_t(k)).decode() for k in range(count)]

    def set(self, key: str, value: float) -> int:
        place = c.c_size_t(self.keys().index(key))
        return int(self.lib.lm_scenario_set(self.handle, place, c.c_double(value)))

    def run(self) -> dict[str, np.ndarray]:
        result = c.c_void_p(self.lib.lm_scenario_run(self.handle, 0, c.c_size_t(0)))
        assert result, self.error()
        assert self.lib.lm_result_status(result) == OK, self.lib.lm_result_error(result)
        count, samples = self.lib.lm_result_count(result, SAMPLES), self.lib.lm_result_samples(result)
        address = self.lib.lm_result_values(result, SAMPLES)
        table = np.ctypeslib.as_array(c.cast(address, c.POINTER(c.c_double)), (count, samples)).copy()
        names = [self.lib.lm_result_name(result, SAMPLES, c.c_size_t(k)).decode() for k in range(count)]
        self.lib.lm_result_free(result)
        return dict(zip(names, table, strict=True))

    def simulation(self, step: float) -> Stepped:
        made = self.lib.lm_simulation_from(self.handle, c.c_double(step))
        assert made, self.error()
        return Stepped(self.lib, c.c_void_p(made))


@pytest.mark.parametrize("name", ["paper-2dof-nl-small", "position-axis", "field-weakening", "joint-under-gravity", "stepper-belt-axis"])
def test_a_run_has_the_bits_of_python(library: c.CDLL, name: str) -> None:  # noqa: F811
    there = Scenario(library, lm.portable.description(lm.load(name), parameters=False)).run()
    here = lm.simulate(lm.load(name))
    assert set(there) == set(here)
    for variable in there:
        assert np.array_equal(there[variable], here[variable].to_numpy(), equal_nan=True), variable
    if name == "paper-2dof-nl-small":  # the efficiency of a gearbox that reverses is that of one that does not
        reversing = lm.load(name, {"gearbox.ratio": -lm.load(name).gearbox.ratio})
        back = Scenario(library, lm.portable.description(reversing, parameters=False)).run()
        assert np.array_equal(there["efficiency"], back["efficiency"], equal_nan=True)


@pytest.fixture
def axis(library: c.CDLL) -> Scenario:  # noqa: F811
    return Scenario(library, lm.portable.description(lm.load("position-axis"), parameters=False))


def loads() -> Iterator[tuple[float, float]]:
    return ((0.5 * math.sin(0.1 * k), 0.5 * math.sin(0.1 * (k + 1))) for k in range(200))


def test_steps_under_a_controller_have_the_bits_of_python(axis: Scenario) -> None:
    python, there = lm.Simulation(lm.load("position-axis"), step=1e-3), axis.simulation(1e-3)
    assert there.names(INPUTS) == ["load_torque"]
    names = there.names(VARIABLES)
    for first, last in loads():
        python.advance(1e-3, load_torque=(first, last))
        assert axis.lib.lm_advance(there.handle, c.c_double(1e-3), doubles([first]), doubles([last])) == OK
    told, wanted = dict(zip(names, there.read(), strict=True)), python.read()
    assert {name: told[name] for name in wanted} == pytest.approx(wanted, rel=0.0, abs=0.0, nan_ok=True)
    assert told["position_reference"] > 0.1


def test_a_state_under_a_controller_is_continued_bit_for_bit_and_damage_is_seen(axis: Scenario) -> None:
    one, other = axis.simulation(1e-3), axis.simulation(1e-3)
    for _ in range(150):
        assert one.advance(1e-3, [0.2]) == OK
    kept = one.state()
    assert other.lib.lm_set_state(other.handle, kept) == OK
    for _ in range(150):
        assert one.advance(1e-3, [0.2]) == other.advance(1e-3, [0.2]) == OK
    assert bytes(one.state()) == bytes(other.state())
    kept[3] += 1e-9
    assert other.lib.lm_set_state(other.handle, kept) == INVALID
    assert other.error() == "these numbers are not those of a state of this simulation"


def explained(scenario: Scenario, time: float) -> dict[int, dict[str, list[float]]]:
    """Contacts (0) and motors (1) by name, as lm_scenario_explain tells them."""
    lib = scenario.lib
    lib.lm_scenario_explain.restype = c.c_void_p
    lib.lm_explanation_count.restype = c.c_size_t
    lib.lm_explanation_name.restype = c.c_char_p
    lib.lm_explanation_values.restype = c.POINTER(c.c_double)
    told = c.c_void_p(lib.lm_scenario_explain(scenario.handle, c.c_double(time)))
    assert told, scenario.error()
    out = {
        what: {
            lib.lm_explanation_name(told, what, c.c_size_t(k)).decode(): [
                lib.lm_explanation_values(told, what, c.c_size_t(k))[i] for i in range(numbers)
            ]
            for k in range(lib.lm_explanation_count(told, what))
        }
        for what, numbers in ((0, 5), (1, 2))
    }
    lib.lm_explanation_free(told)
    return out


@pytest.mark.parametrize("name", ["position-axis", "ball-screw-axis", "direction-finder"])
def test_a_scenario_has_one_description(name: str) -> None:
    """So that an FMU keeps its identifier: where numbers lie in memory has no say in the order in which they are compared."""
    made = [lm.portable.description(lm.load(name)) for _ in range(2)]
    assert np.array_equal(*made)


@pytest.mark.parametrize("name", ["paper-2dof-nl-small", "worm-lowering", "two-motors-one-ring"])
def test_an_explanation_is_that_of_python(library: c.CDLL, name: str) -> None:  # noqa: F811
    scenario, time = lm.load(name), 0.3
    told, wanted = (explained(Scenario(library, lm.portable.description(scenario, parameters=False)), time), lm.explain(scenario, time))
    contacts = {
        contact.name: [contact.mode, contact.speed, contact.torque, contact.capacity_forward, contact.capacity_backward]
        for contact in wanted.contacts
    }
    assert told[0].keys() == contacts.keys()
    for contact, values in contacts.items():
        assert told[0][contact] == pytest.approx(values, rel=1e-11, abs=1e-12)
    commands = {m.name: [m.command_forward, m.command_backward] for m in wanted.motors}
    assert told[1].keys() == commands.keys()
    for motor, values in commands.items():
        assert told[1][motor] == pytest.approx(values, rel=1e-11)


def test_signals_references_and_times_are_replaced(library: c.CDLL, axis: Scenario) -> None:  # noqa: F811
    lib, load = library, Signal(doubles([(0.0, 0.3, 0.0), (0.4, 0.3, -0.5)]), 2, doubles([(0.1, 3.0, 0.5)]), 1)
    place = 1  # command, then load torque
    assert lib.lm_scenario_set_signal(axis.handle, c.c_size_t(place), c.byref(load)) == OK, axis.error()
    lib.lm_scenario_input_at_start.restype = c.c_double
    at_start = lib.lm_scenario_input_at_start(axis.handle, c.c_size_t(place))
    assert at_start == pytest.approx(0.3 + 0.1 * math.sin(0.5), rel=1e-15)
    pieces = doubles([(0.0, 0.1, 0.0, 0.0, 0.0), (0.2, 0.1, 0.4, 0.0, 0.0)])
    assert lib.lm_scenario_set_reference(axis.handle, c.c_size_t(0), pieces, c.c_size_t(2), None, c.c_size_t(0)) == OK
    assert lib.lm_scenario_set_times(axis.handle, c.c_double(0.8), c.c_double(2e-3)) == OK
    for name in ("duration", "interval"):
        getattr(lib, f"lm_scenario_{name}").restype = c.c_double
    assert (lib.lm_scenario_duration(axis.handle), lib.lm_scenario_interval(axis.handle)) == (0.8, 2e-3)
    sine = {"amplitude": 0.1, "frequency": 3.0, "phase": 0.5}
    falling = {"begin": 0.4, "duration": 10.0, "rise": -5.0}
    changes = {
        "load.torque": {"mean": 0.3, "ramps": [falling], "sines": [sine]},
        "controller.reference": {
            "kind": "position", "mean": 0.1, "ramps": [{"begin": 0.2, "duration": 10.0, "rise": 4.0}]
        },
        "simulation.duration": 0.8,
        "simulation.sample_interval": 2e-3,
    }  # fmt: skip
    told, wanted = axis.run(), lm.simulate(lm.load("position-axis").replace(**changes))
    for name in ("load_angle", "position_reference", "load_torque", "motor_torque"):
        scale = float(np.abs(wanted[name]).max())
        assert np.allclose(told[name], wanted[name], rtol=0.0, atol=1e-9 * scale), name
    assert lib.lm_scenario_set_times(axis.handle, c.c_double(-1.0), c.c_double(1e-3)) == INVALID
    assert lib.lm_scenario_set_reference(axis.handle, c.c_size_t(7), pieces, c.c_size_t(2), None, c.c_size_t(0)) == INVALID
    for times, wrong in (((0.1, 0.2), "begin at 0 s"), ((0.0, 0.0), "rise in time"), ((0.0, math.nan), "[1].time")):
        pieces = doubles([(t, 0.1, 0.0, 0.0, 0.0) for t in times])
        lib.lm_scenario_set_reference(axis.handle, c.c_size_t(0), pieces, c.c_size_t(2), None, c.c_size_t(0))
        assert wrong in axis.error()
        load = Signal(doubles([(t, 0.1, 0.0) for t in times]), 2, None, 0)
        assert lib.lm_scenario_set_signal(axis.handle, c.c_size_t(place), c.byref(load)) == INVALID
        assert wrong in axis.error()


def test_a_result_tells_how_far_it_came(library: c.CDLL) -> None:  # noqa: F811
    scenario = lm.load("paper-2dof-nl-large")
    there, wanted = Scenario(library, lm.portable.description(scenario, parameters=False)), lm.simulate(scenario)
    library.lm_scenario_title.restype = c.c_char_p
    for name in ("time", "left_data_at"):
        getattr(library, f"lm_result_{name}").restype = c.c_double
    for name in ("switchings", "switching_count"):
        getattr(library, f"lm_result_{name}").restype = c.c_size_t
    assert library.lm_scenario_title(there.handle).decode() == scenario.title
    result = c.c_void_p(library.lm_scenario_run(there.handle, 1, c.c_size_t(5)))
    assert library.lm_result_time(result) == scenario.simulation.duration
    assert library.lm_result_left_data_at(result) == math.inf
    assert library.lm_result_switchings(result) == 5
    assert library.lm_result_switching_count(result) == wanted.attrs["switching_count"] > 5
    library.lm_result_free(result)


def test_a_simulation_goes_on_with_another_inertia(library: c.CDLL) -> None:  # noqa: F811
    """A free load: the torque of the gear gives it half the acceleration at twice the inertia."""
    scenario = lm.load("paper-2dof-nl-small", {"load.friction_torque": 0.0, "load.viscous_friction": 0.0})
    there = Scenario(library, lm.portable.description(scenario))
    simulation = there.simulation(1e-3)
    place = simulation.names(INPUTS).index("command")
    inputs = [0.3 if k == place else 0.0 for k in range(len(simulation.names(INPUTS)))]
    for _ in range(50):
        assert simulation.advance(1e-3, inputs) == OK, simulation.error()
    names = simulation.names(VARIABLES)
    before = dict(zip(names, simulation.read(), strict=True))
    assert there.set("load.inertia", 2.0 * scenario.load.inertia) == OK
    assert library.lm_go_on_with(simulation.handle, there.handle, c.c_double(1e-3)) == OK, simulation.error()
    assert library.lm_time(simulation.handle) == pytest.approx(0.05, rel=1e-12)
    h = 1e-7
    assert simulation.advance(h, inputs) == OK
    after = dict(zip(names, simulation.read(), strict=True))
    assert after["load_angle"] == pytest.approx(before["load_angle"], abs=1e-5)
    acceleration = (after["load_speed"] - before["load_speed"]) / h
    assert acceleration == pytest.approx(before["output_torque"] / (2.0 * scenario.load.inertia), rel=1e-3)
    assert library.lm_go_on_with(simulation.handle, there.handle, c.c_double(-1.0)) == INVALID


SMALL = {"load.inertia": 2.7, "gearbox.ratio": 80.0, "motor.friction_torque": 0.013, "command.amplitude": 0.06}
SMALL |= {"gearbox.hysteresis.efficiency": 0.9, "gearbox.stiffness.preload": 3.0}


def changed_in_c(library: c.CDLL, scenario: Any, values: dict[str, float]) -> Scenario:  # noqa: F811
    there = Scenario(library, lm.portable.description(scenario))
    for key, value in values.items():
        assert there.set(key, value) == OK, there.error()
    return there


# What is derived of several values; by roots and angles; what adds segments; what a controller has of the train.
CHANGES = [
    ("paper-2dof-nl-small", SMALL),
    ("backlash-reversing-load", {"gearbox.stiffness.backlash": 1.3e-3, "gearbox.stiffness.backward": 0.8}),
    ("position-axis", {"controller.reference.jerk": 210.0, "gearbox.ratio": 83.0, "motor.voltage_limit": 25.0}),
    ("ball-screw-axis", {"screws.screw.core_diameter": 0.0171, "slides.slide.stribeck_speed": 0.011}),
    ("rack-axis-with-play", {"racks.rack.helix_angle": 0.31, "motors.motor.rated_torque": 1.1}),
    ("position-axis-with-belt", {"controllers.servo.speed.torque_filters.0.frequency": 95.0}),
    ("worm-lowering", {"gears.worm_gear.losses.friction_coefficient": 0.06}),
    ("joint-under-gravity", {"gravity.arm.mass": 4.1}),
    ("hobby-servo-continuous", {"controllers.servo.firmware.resistance": 4.2}),
]


@pytest.mark.parametrize(("name", "values"), CHANGES, ids=[name for name, _ in CHANGES])
def test_a_value_that_is_set_gives_the_bits_of_the_changed_scenario(
    library: c.CDLL,  # noqa: F811
    name: str,
    values: dict[str, float],
) -> None:
    scenario = lm.load(name, {"simulation.duration": 0.3})
    told, wanted = changed_in_c(library, scenario, values).run(), lm.simulate(scenario.replace(**values))
    for variable in wanted.data_vars:
        assert np.array_equal(told[str(variable)], wanted[variable].to_numpy(), equal_nan=True), variable


def test_a_value_out_of_its_range_or_of_its_regime_is_refused(library: c.CDLL) -> None:  # noqa: F811
    there = Scenario(library, lm.portable.description(lm.load("position-axis")))
    assert there.set("load.inertia", -1.0) == INVALID
    assert there.error() == "parameter load.inertia: -1 must be greater than 0"
    # With so little jerk the moves do not reach their speed, so that their profile has other segments.
    assert there.set("controller.reference.jerk", 1e-3) == INVALID
    assert there.error().startswith("parameter controller.reference.jerk: changes what the scenario consists of")


@pytest.mark.parametrize("name", ["paper-2dof-nl-small", "belt-before-gearbox"])
def test_a_parameter_keeps_to_the_range_of_scenario_files(library: c.CDLL, name: str) -> None:  # noqa: F811
    scenario = lm.load(name)
    there = Scenario(library, lm.portable.description(scenario))
    seen = 0
    for p in derivation_of(scenario, numbers_of).parameters:
        limits = ((p.limit.gt, -1.0), (p.limit.gt, 0.0), (p.limit.ge, -1.0), (p.limit.le, 44.0))
        for outside in [limit + beyond for limit, beyond in limits if limit is not None]:
            with pytest.raises(lm.InputError) as refused:
                scenario.replace(**{p.key: outside})
            assert there.set(p.key, outside) == INVALID
            said = str(refused.value).partition(" must")[2].partition("; write ")[0]  # the core knows no percentages
            assert there.error() == f"parameter {p.key}: {outside:g} must{said}"
            seen += 1
    assert seen > 15


LAWS: dict[str, Callable[[float, float], float]] = {
    "sum": lambda a, b: a + b,
    "difference": lambda a, b: a - b,
    "product": lambda a, b: a * b,
    "quotient": lambda a, b: a / b,
    "root": lambda a, _: math.sqrt(a),
    "sine": lambda a, _: sin(a),
    "cosine": lambda a, _: cos(a),
    "arctangent": lambda a, _: arctan(a),
    "cube_root": lambda a, _: cbrt(a),
    "worm_driving": lambda a, b: _core.worm_efficiencies(a, b)[0],
    "worm_overrunning": lambda a, b: _core.worm_efficiencies(a, b)[1],
    "less": lambda a, b: a < b,
    "at_most": lambda a, b: a <= b,
    "equal": lambda a, b: a == b,
}


def derived(of: Derivation, base: np.ndarray, key: str, value: float) -> np.ndarray | None:
    """The numbers by the formulas, with another value of one parameter; None where these do not hold."""
    given = [value if p.key == key else p.value for p in of.parameters]
    v: list[float] = []
    for law, one, other, constant in of.formulas:
        v.append(given[one] if law == "parameter" else constant if law == "constant" else LAWS[law](v[one], v[other]))
    if any(LAWS[comparison](v[one], v[other]) != holds for comparison, one, other, holds in of.conditions):
        return None
    numbers = base.copy()
    for place, formula in of.results:
        numbers[place] = v[formula]
    return numbers


@pytest.mark.parametrize("name", lm.shipped_scenarios())
def test_each_value_gives_the_numbers_of_the_changed_scenario(name: str) -> None:
    scenario = lm.load(name)
    base, of = numbers_of(scenario), derivation_of(scenario, numbers_of)
    assert np.array_equal(numbers_of(scenario), base) and np.array_equal(numbers_of(lm.load(name)), base)  # recording leaves it as it is
    step, seen = max(1, len(of.parameters) // 30), 0
    for p in of.parameters[::step]:
        value = 1.03 * p.value if p.value != 0.0 else 1e-4
        found = derived(of, base, p.key, value)
        if found is None:
            continue
        try:
            wanted = numbers_of(scenario.replace(**{p.key: value}))
        except lm.InputError:  # what belongs together, such as friction at rest and in motion
            continue
        assert np.array_equal(found, wanted), p.key
        seen += 1
    assert seen >= 0.8 * len(of.parameters[::step])


def test_keys_that_follow_by_any_law_are_parameters() -> None:
    keys = {
        name: {p.key for p in derivation_of(lm.load(name), numbers_of).parameters}
        for name in ("position-axis", "ball-screw-axis", "position-axis-with-belt")
    }
    assert {"motor.electrical_time_constant", "controller.reference.jerk"} <= keys["position-axis"]
    assert {"screws.screw.core_diameter", "screws.screw.diameter"} <= keys["ball-screw-axis"]
    assert {f"controllers.servo.speed.torque_filters.0.{key}" for key in ("frequency", "depth", "width")} <= keys["position-axis-with-belt"]
    # A phase has no use without a sine, nor an error of an encoder without its periods.
    assert not any(key.endswith("torque.phase") for key in keys["position-axis"])


def sealed(numbers: np.ndarray) -> np.ndarray:
    """With the checksum of what they are, by another implementation of CRC-32."""
    return np.concatenate([numbers[:2], [zlib.crc32(numbers[3:].astype("<f8").tobytes())], numbers[3:]])


@pytest.mark.parametrize(("change", "said"), [
    (lambda n: n[:0], "these numbers are no description of a scenario"),
    (lambda n: n[:100], "the description is cut off"),
    (lambda n: np.concatenate([n[:1], [99.0], n[2:]]), "the description is of another version; write it anew"),
    (lambda n: np.append(n, 0.0), "the description is damaged: its checksum is wrong; write it anew"),
    (lambda n: sealed(np.append(n, 0.0)), "the description goes on beyond its end"),
    (lambda n: sealed(np.concatenate([n[:4], np.where(n[4:] == 2.0, math.nan, n[4:])])), " is nan; it must be "),
])  # fmt: skip
def test_numbers_that_are_no_description_are_refused(
    library: c.CDLL,  # noqa: F811
    change: Any,
    said: str,
) -> None:
    scenario = Scenario(library, change(lm.portable.description(lm.load("paper-2dof-nl-small"), parameters=False)))
    assert not scenario._handle
    assert said in scenario.refused


def test_rates_and_guards_serve_an_integrator_of_the_caller_s_own(library: c.CDLL) -> None:  # noqa: F811
    """Runge-Kutta's steps of 5 us through a stretch without an event: an error of some (rate * step)^4 = 1e-10."""
    scenario = lm.load("paper-2dof-nl-small", ["initial.motor_speed=30", "initial.load_speed=0.3"])
    described = Scenario(library, lm.portable.description(scenario, parameters=False))
    exact, placed = described.simulation(1e-3), described.simulation(1e-3)
    n, guards = len(placed.names(STATES)), int(library.lm_guard_count(placed.handle))
    library.lm_next_event.restype = c.c_double
    inputs, out, z = doubles([0.3, 2.0]), (c.c_double * n)(), (c.c_double * guards)()

    def rates(time: float, x: np.ndarray) -> np.ndarray:
        assert library.lm_place(placed.handle, c.c_double(time), doubles(x), inputs) == OK
        assert library.lm_rates(placed.handle, out) == OK
        assert library.lm_guards(placed.handle, z) == OK
        assert min(z) > 0.0
        return np.array(out)

    assert library.lm_states(placed.handle, out) == OK
    x, h = np.array(out), 5e-6
    assert library.lm_place(placed.handle, c.c_double(0.0), doubles(x), inputs) == OK
    assert library.lm_settle(placed.handle) == OK
    assert library.lm_next_event(placed.handle) == math.inf
    for k in range(80):
        a = rates(k * h, x)
        b = rates((k + 0.5) * h, x + 0.5 * h * a)
        d = rates((k + 0.5) * h, x + 0.5 * h * b)
        x = x + h / 6.0 * (a + 2.0 * b + 2.0 * d + rates((k + 1) * h, x + h * d))
    assert library.lm_accept(placed.handle) == 0
    assert library.lm_advance(exact.handle, c.c_double(80 * h), inputs, inputs) == OK
    assert library.lm_states(exact.handle, out) == OK
    assert x == pytest.approx(np.array(out), rel=1e-8)
    assert abs(x[0]) > 0.01


def test_given_references_are_inputs(library: c.CDLL) -> None:  # noqa: F811
    described = Scenario(library, lm.portable.description(lm.load("position-axis"), parameters=False))
    assert library.lm_scenario_give_references(described.handle, 1) == OK
    assert described.simulation(1e-3).names(INPUTS) == ["load_torque", "reference"]
    delayed = lm.load("position-axis", ["controller.position.reference_delay='1 ms'"])
    described = Scenario(library, lm.portable.description(delayed, parameters=False))
    assert library.lm_scenario_give_references(described.handle, 1) == 100
    assert "has to know the past of its reference" in described.error()
    own = {"law": True, "sample_time": 1e-3, "reference": {"kind": "torque"}, "encoder": {"ideal": True}}
    law = lm.load("speed-axis").replace(controller=own)
    refused(lambda: lm.portable.description(law), reason="controller of motor: has a law of your own")


@pytest.mark.parametrize("name", ["paper-2dof-nl-small", "two-motors-one-ring"])
def test_a_function_of_the_caller_ends_a_run_and_a_step(library: c.CDLL, name: str) -> None:  # noqa: F811
    scenario = lm.load(name, {"simulation.duration": 1e7, "simulation.sample_interval": 1e4})
    there = Scenario(library, lm.portable.description(scenario))
    begin = time.perf_counter()
    asked = c.CFUNCTYPE(c.c_int, c.c_void_p)(lambda _: time.perf_counter() > begin + 0.3)
    library.lm_scenario_set_interrupt(there.handle, asked, None)
    result = c.c_void_p(library.lm_scenario_run(there.handle, 1, c.c_size_t(0)))
    assert library.lm_result_status(result) == INTERRUPTED
    library.lm_result_free(result)
    simulation = there.simulation(1e-3)
    library.lm_set_interrupt(simulation.handle, asked, None)
    inputs = [0.1] * len(simulation.names(INPUTS))
    assert simulation.advance(1e7, inputs) == INTERRUPTED
    assert time.perf_counter() < begin + 1.3
