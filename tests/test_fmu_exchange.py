"""FMUs in Model Exchange: under FMPy's CVODE the exact run; derivatives, indicators, ticks and state."""

import math
from ctypes import c_double
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from lostmotion.simulation.forms.key_aliases import DRIVE
from test_fmu import pytestmark

fmpy: Any = pytest.importorskip("fmpy", reason="FMPy is missing: .venv/bin/pip install --group portable")
__all__ = ["pytestmark"]

TOLERANCE = 1e-8
# CVODE keeps the error of a step below its tolerance; over some thousand steps and tens of events, each found to 1e-9 of
# the natural magnitudes, that adds up to some 1e-6 of the largest values.
ACCURACY = 2e-5


@pytest.fixture
def cvode(monkeypatch: Any) -> None:
    """FMPy's solver, with the inputs of the instant in the right-hand side, where FMPy itself leaves those of the last step."""
    from fmpy.sundials import CVodeSolver

    make, rate = CVodeSolver.__init__, CVodeSolver.f

    def made(self: Any, *arguments: Any, **options: Any) -> None:
        make(self, *arguments, **(options | {"maxNumSteps": 100_000}))

    def rated(self: Any, t: float, *others: Any) -> Any:
        self.set_time(t)
        self.input.apply(t)
        return rate(self, t, *others)

    monkeypatch.setattr(CVodeSolver, "__init__", made)
    monkeypatch.setattr(CVodeSolver, "f", rated)


def signals(scenario: Any, names: list[str]) -> np.ndarray:
    """Inputs over time as FMPy takes them: breakpoints, jumps as two rows, sines sampled every 0.1 ms."""
    given = scenario.signals()
    end = scenario.simulation.duration
    ends = sorted({0.0, end} | {b[0] for n in names for b in given[n].breakpoint_list() if 0.0 < b[0] < end})
    dense = any(given[n].sine_list() for n in names)
    pieces = [(a, np.linspace(a, b, max(2, int((b - a) / 1e-4) if dense else 2))) for a, b in pairwise(ends)]
    table = np.zeros(sum(len(t) for _, t in pieces), [("time", "f8"), *((n, "f8") for n in names)])
    table["time"] = np.concatenate([t for _, t in pieces])
    for n in names:
        columns = []
        for begin, t in pieces:
            time, value, slope = max(b for b in given[n].breakpoint_list() if b[0] <= begin)
            sines = sum(A * np.sin(2.0 * math.pi * f * t + phase) for A, f, phase in given[n].sine_list())
            columns.append(value + slope * (t - time) + sines)
        table[n] = np.concatenate(columns)
    return table


def under_cvode(scenario: Any, path: Path, fmi: int, variables: list[str], **options: Any) -> Any:
    lm.export_fmu(scenario, path, fmi=fmi, **options)
    description = fmpy.read_model_description(str(path))
    names = [v.name for v in description.modelVariables if v.causality == "input" and not v.name.startswith("der(")]
    rates = [v.name for v in description.modelVariables if v.causality == "input" and v.name.startswith("der(")]
    return fmpy.simulate_fmu(
        str(path),
        fmi_type="ModelExchange",
        solver="CVode",
        relative_tolerance=TOLERANCE,
        stop_time=scenario.simulation.duration,
        output_interval=scenario.simulation.sample_interval,
        output=variables,
        input=signals(scenario, names),
        start_values=dict.fromkeys(rates, 0.0),
    )


RUNS = {
    "lossy-rigid-gear": ["motor_speed", "load_speed"],  # stuck and slipping gear
    "overrunning-load": ["motor_speed", "load_speed", "output_torque"],  # hysteresis and loss map
    "paper-2dof-nl-small": ["motor_speed", "twist", "output_torque"],
    "voltage-limited-start": ["motor_speed", "output_torque", "load_angle"],  # limits of an input
    "belt-before-gearbox": ["joint_speed", "belt_twist", "joint_angle"],  # a train
}


@pytest.mark.parametrize("name", RUNS)
def test_cvode_gives_the_exact_run(name: str, cvode: None, tmp_path: Path) -> None:
    scenario = lm.load(name)
    exact = lm.simulate(scenario)
    there = under_cvode(scenario, tmp_path / "drive.fmu", 3 if name == "overrunning-load" else 2, RUNS[name])
    at = np.searchsorted(there["time"], exact["time"].values - 1e-9)  # events are rows, too
    assert int(exact.attrs["switching_count"]) >= 4
    for variable in RUNS[name]:
        largest = float(np.max(np.abs(exact[variable].values)))
        assert np.max(np.abs(there[variable][at] - exact[variable].values)) <= ACCURACY * largest, variable


def test_sampled_controllers_act_at_time_events(cvode: None, tmp_path: Path) -> None:
    """The encoders' steps part the two runs by a step at most now and then: the angles are compared."""
    scenario = lm.load("position-axis", ["simulation.duration=0.2"])
    exact = lm.simulate(scenario)
    there = under_cvode(scenario, tmp_path / "axis.fmu", 2, ["load_angle", "position_reference", "measured_position"])
    at = np.searchsorted(there["time"], exact["time"].values - 1e-9)
    largest = float(np.max(np.abs(exact["load_angle"].values)))
    assert largest > 0.0
    assert np.max(np.abs(there["load_angle"][at] - exact["load_angle"].values)) <= 1e-4 * largest


class Model:
    """An FMU of FMI 2.0 for Model Exchange, after initialisation, in continuous-time mode."""

    def __init__(self, path: Path, directory: Path) -> None:
        from fmpy.fmi2 import FMU2Model

        description = fmpy.read_model_description(str(path))
        self.reference = {v.name: v.valueReference for v in description.modelVariables}
        fmpy.extract(str(path), unzipdir=str(directory))
        self.fmu = FMU2Model(guid=description.guid, unzipDirectory=str(directory), modelIdentifier="lostmotion", instanceName="drive")
        self.fmu.instantiate()
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        self.fmu.newDiscreteStates()
        self.fmu.enterContinuousTimeMode()
        self.n, self.z = description.numberOfContinuousStates, description.numberOfEventIndicators
        self.states = [v.name for v in description.modelVariables if v.name.startswith("state.")]

    def rates(self, time: float, states: list[float], **inputs: float) -> list[float]:
        self.fmu.setReal([self.reference[k] for k in inputs], list(inputs.values()))
        self.fmu.setTime(time)
        self.fmu.setContinuousStates((c_double * self.n)(*states), self.n)
        out = (c_double * self.n)()
        self.fmu.getDerivatives(out, self.n)
        return list(out)

    def indicators(self) -> list[float]:
        out = (c_double * self.z)()
        self.fmu.getEventIndicators(out, self.z)
        return list(out)


@pytest.fixture
def model(tmp_path: Path) -> Any:
    path = tmp_path / "drive.fmu"
    scenario = lm.load("paper-2dof-nl-small", ["initial.motor_speed=20", "initial.load_speed=0.2", "initial.twist=2e-4"])
    lm.export_fmu(scenario, path)
    model = Model(path, tmp_path / "open")
    yield model
    model.fmu.terminate()
    model.fmu.freeInstance()


POINT = [0.3, 25.0, 0.25, 2.5e-4, 0.01]


def test_directional_derivatives_are_differences_of_the_rates(model: Model) -> None:
    """Within a regime the rates are linear, so that differences have no error but rounding."""
    inputs = {"command": 0.2, "load_torque": 1.0}
    here = model.rates(0.01, POINT, **inputs)
    assert any(here)
    unknown = [model.reference[f"der({s})"] for s in model.states]
    for k, state in enumerate(model.states):
        step = 1e-3 * POINT[k]
        moved = [x + step * (j == k) for j, x in enumerate(POINT)]
        differences = (np.array(model.rates(0.01, moved, **inputs)) - here) / step
        model.rates(0.01, POINT, **inputs)
        exact = np.array(model.fmu.getDirectionalDerivative(unknown, [model.reference[state]], [1.0]))
        rounding = 1e-12 * np.abs(here) / step
        assert np.all(np.abs(exact - differences) <= 1e-9 * np.abs(exact) + rounding), state
    exact = model.fmu.getDirectionalDerivative(unknown, [model.reference["load_torque"]], [1.0])
    differences = np.array(model.rates(0.01, POINT, command=0.2, load_torque=2.0)) - here
    assert list(exact) == pytest.approx(list(differences), rel=1e-9, abs=1e-9)


def test_an_indicator_falls_where_a_contact_comes_to_rest_and_the_event_finds_what_follows(model: Model) -> None:
    model.rates(0.01, POINT, command=0.0, load_torque=0.0)
    assert min(model.indicators()) > 0.0
    reversed_motor = [0.3, -1e-6, 0.25, 2.5e-4, 0.01]
    model.rates(0.01, reversed_motor, command=0.0, load_torque=0.0)
    assert min(model.indicators()) < 0.0
    model.fmu.enterEventMode()
    needed, terminated, _, changed, has_next, _ = model.fmu.newDiscreteStates()
    assert (needed, terminated, changed, has_next) == (False, False, True, False)
    model.fmu.enterContinuousTimeMode()
    x = (c_double * model.n)()
    model.fmu.getContinuousStates(x, model.n)
    assert x[1] == 0.0  # from there it turns back, or rests
    assert min(model.indicators()) > 0.0


def test_the_state_in_model_exchange_can_be_set_back(model: Model) -> None:
    first = model.rates(0.01, POINT, command=0.2, load_torque=1.0), model.indicators()
    state = model.fmu.getFMUState()
    model.rates(0.02, [0.0, -1.0, 0.0, 0.0, 0.0], command=-1.0, load_torque=0.0)
    model.fmu.enterEventMode()
    model.fmu.newDiscreteStates()
    model.fmu.enterContinuousTimeMode()
    model.fmu.setFMUState(state)
    x, rates = (c_double * model.n)(), (c_double * model.n)()
    model.fmu.getContinuousStates(x, model.n)
    model.fmu.getDerivatives(rates, model.n)
    assert list(x) == POINT
    assert (list(rates), model.indicators()) == first
    model.fmu.freeFMUState(state)


def test_with_windings_inside_there_is_co_simulation_alone(tmp_path: Path) -> None:
    path = tmp_path / "axis.fmu"
    lm.export_fmu(lm.load("field-weakening"), path)
    description = fmpy.read_model_description(str(path))
    assert description.modelExchange is None
    assert description.coSimulation is not None


@pytest.mark.parametrize("name", ["worm-lowering", "lossy-rigid-gear"])
def test_directional_derivatives_of_what_a_contact_at_rest_shares(name: str, tmp_path: Path) -> None:
    """An input shaft that rests holds a torque that bearing and gear share as their capacities are: central differences."""
    scenario = lm.load(name)
    if name == "lossy-rigid-gear":  # at rest, held by the load
        scenario = scenario.replace(**{"command": 6.0, "load.torque": 10.0})
    lm.export_fmu(scenario, tmp_path / "x.fmu")
    model = Model(tmp_path / "x.fmu", tmp_path / "open")
    drive = scenario.form == DRIVE
    outputs = ["input_torque", "loss_coefficient"] if drive else ["worm_gear_input_torque", "worm_contact_torque"]
    contact = "input_contact" if drive else "worm_contact"
    references = [model.reference[o] for o in outputs]
    point = (c_double * model.n)()
    model.fmu.getContinuousStates(point, model.n)
    assert model.fmu.getReal([model.reference[contact]]) == [0.0]
    inputs = {"command": 6.0, "load_torque": 10.0} if drive else {}
    checked = 0

    def values(states: list[float], given: dict[str, float]) -> np.ndarray:
        model.rates(0.0, states, **given)
        return np.array(model.fmu.getReal(references))

    for known in [*model.states, *inputs]:
        if known in ("state.load_angle", "state.drum_angle", "state.motor_speed", "state.rotor_speed"):
            continue
        step = 1e-7
        ends = []
        for side in (step, -step):
            moved = [x + side * (s == known) for x, s in zip(point, model.states, strict=True)]
            ends.append(values(moved, {k: v + side * (k == known) for k, v in inputs.items()}))
        values(list(point), inputs)
        exact = model.fmu.getDirectionalDerivative(references, [model.reference[known]], [1.0])
        differences = (ends[0] - ends[1]) / (2.0 * step)
        assert list(exact) == pytest.approx(list(differences), rel=1e-6, abs=1e-6), known
        checked += bool(np.any(differences))
    assert checked > 1
    model.fmu.terminate()
    model.fmu.freeInstance()
