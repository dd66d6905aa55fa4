"""Inputs that the importer has not set follow the signals of the scenario: the exact run, in both interfaces and versions."""

from ctypes import byref, c_bool, c_double, c_int, c_uint, c_void_p
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import lostmotion as lm
from lostmotion.cli import app
from test_fmu import Slave, pytestmark
from test_fmu3 import Slave3
from test_fmu_exchange import Model

fmpy: Any = pytest.importorskip("fmpy", reason="FMPy is missing: .venv/bin/pip install --group portable")
fmi2: Any = pytest.importorskip("fmpy.fmi2")
__all__ = ["pytestmark"]


def largest_error(got: Any, exact: Any, variable: str) -> float:
    """At the samples that both have, before an event that falls on one; relative to the largest value."""
    at = np.searchsorted(got["time"], exact["time"].values - 1e-9)
    there = at < len(got)
    there[there] &= np.abs(got["time"][at[there]] - exact["time"].values[there]) < 1e-9
    assert there.sum() > 300
    error = got[variable][at[there]] - exact[variable].values[there]
    return float(np.max(np.abs(error)) / np.max(np.abs(exact[variable].values)))


STATES = {
    "paper-2dof-nl-small": ["motor_speed", "load_speed", "twist", "load_angle"],  # a sine
    "overrunning-load": ["motor_speed", "load_speed", "twist", "load_angle"],  # ramps
    "step-to-standstill": ["motor_speed", "load_speed", "twist", "load_angle"],  # steps
    "backlash-reversing-load": ["motor_speed", "load_speed", "load_angle"],  # a sine of the load torque
    "voltage-limited-start": ["motor_speed", "load_speed", "twist"],
    "belt-before-gearbox": ["joint_speed", "belt_twist", "joint_angle"],  # a train
}


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("name", STATES)
def test_an_importer_that_sets_nothing_gets_the_run_of_the_scenario(name: str, fmi: int, tmp_path: Path) -> None:
    scenario = lm.load(name)
    lm.export_fmu(scenario, tmp_path / "drive.fmu", fmi=fmi)
    exact = lm.simulate(scenario)
    there = fmpy.simulate_fmu(str(tmp_path / "drive.fmu"), fmi_type="CoSimulation")
    for variable in STATES[name]:
        assert largest_error(there, exact, variable) < 1e-11, variable


def test_an_importer_finds_tolerance_step_start_and_stop(tmp_path: Path) -> None:
    scenario = lm.load("paper-2dof-nl-small")
    for fmi in (2, 3):
        lm.export_fmu(scenario, tmp_path / "drive.fmu", fmi=fmi)
        told = fmpy.read_model_description(str(tmp_path / "drive.fmu")).defaultExperiment
        values = [float(v) for v in (told.startTime, told.stopTime, told.stepSize, told.tolerance)]
        assert values == [0.0, scenario.simulation.duration, scenario.simulation.sample_interval, 1e-8]


@pytest.mark.parametrize("name", STATES)
def test_the_load_in_model_exchange_with_the_defaults_of_the_importer_moves_as_in_the_run_to_a_millionth(name: str, tmp_path: Path) -> None:
    scenario = lm.load(name)
    lm.export_fmu(scenario, tmp_path / "drive.fmu")
    there = fmpy.simulate_fmu(str(tmp_path / "drive.fmu"), fmi_type="ModelExchange")
    exact = lm.simulate(scenario)
    for variable in STATES[name]:
        # The integrator keeps the error of a step below 1e-8; the motor, which turns in the gap alone, is disturbed most.
        limit = 1e-6 if variable.startswith(("load_", "joint_")) else 1e-5
        assert largest_error(there, exact, variable) < limit, variable


STEPPED = [
    "command={steps=[{height=0.4, time='0.05 s'}, {height=-0.4, time='0.4 s'}]}",
    "load.torque={amplitude=2.0, frequency='3 Hz'}",
    "simulation.duration=0.7",
]


@pytest.mark.parametrize("steps", [[0.7], [0.3, 0.4], [0.037] * 18 + [0.034]])
def test_steps_over_jumps_and_sines_are_exact(steps: list[float], tmp_path: Path) -> None:
    scenario = lm.load("paper-2dof-nl-small", STEPPED)
    lm.export_fmu(scenario, tmp_path / "drive.fmu")
    slave = Slave(tmp_path / "drive.fmu", tmp_path / "open")
    for interval in steps:
        slave.step(interval)
    wanted, told = lm.simulate(scenario), slave.read()
    for name in ("motor_speed", "load_speed", "twist", "motor_torque"):
        assert told[name] == pytest.approx(float(wanted[name][-1]), rel=1e-9), name
    inputs = slave.fmu.getReal([slave.reference[n] for n in ("command", "load_torque")])
    assert inputs == pytest.approx([0.0, 2.0 * np.sin(6.0 * np.pi * 0.7)], abs=1e-12)
    slave.close()


def test_an_input_replaces_its_own_signal_from_when_it_is_set(tmp_path: Path) -> None:
    """From 0.3 s on the command is 0.1; the sine of the load torque goes on. A state from before has the signal again."""
    scenario = lm.load("paper-2dof-nl-small", STEPPED)
    lm.export_fmu(scenario, tmp_path / "drive.fmu")
    steps = [{"time": 0.05, "height": 0.4}, {"time": 0.3, "height": -0.3}]
    other = lm.simulate(scenario.replace(command={"steps": steps}))
    slave = Slave(tmp_path / "drive.fmu", tmp_path / "open")
    slave.step(0.3)
    before = slave.fmu.getFMUState()
    slave.set({"command": 0.1})
    slave.step(0.4)
    assert slave.read()["motor_speed"] == pytest.approx(float(other["motor_speed"][-1]), rel=1e-9)
    slave.fmu.setFMUState(before)
    slave.time = 0.3
    slave.step(0.4)
    played = lm.simulate(scenario)["motor_speed"]
    assert slave.read()["motor_speed"] == pytest.approx(float(played[-1]), rel=1e-9)
    assert abs(float(played[-1]) - float(other["motor_speed"][-1])) > 1.0
    slave.fmu.freeFMUState(before)
    slave.close()


def test_an_input_set_to_its_present_value_stays_there(tmp_path: Path) -> None:
    """A command of 0 that is set before the first step: the motor never turns, whatever the signal would do."""
    lm.export_fmu(lm.load("paper-2dof-nl-small", STEPPED[:1]), tmp_path / "drive.fmu", fmi=3)
    slave = Slave3(tmp_path / "drive.fmu", tmp_path / "open")
    slave.step(0.2, command=(0.0, 0.0))
    assert slave.read()["motor_speed"] == 0.0
    slave.close()


@pytest.mark.parametrize("fmi", [2, 3])
def test_references_that_are_inputs_follow_those_of_the_scenario(fmi: int, tmp_path: Path) -> None:
    scenario = lm.load("position-axis", ["simulation.duration=0.5"])
    exact = lm.simulate(scenario)
    lm.export_fmu(scenario, tmp_path / "axis.fmu", fmi=fmi, references=True)
    slave = (Slave if fmi == 2 else Slave3)(tmp_path / "axis.fmu", tmp_path / "open")
    for _ in range(5):
        slave.step(0.1)
    assert abs(float(exact["load_angle"][-1])) > 0.01
    assert slave.read()["load_angle"] == pytest.approx(float(exact["load_angle"][-1]), rel=1e-9)
    slave.close()


def test_the_command_says_which_input_replaces_which_key(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["fmu", "position-axis", "-o", str(tmp_path / "axis.fmu"), "--reference-inputs"])
    assert "Input load_torque replaces load.torque of the scenario" in done.stdout
    assert "Input reference replaces controller.reference of the scenario" in done.stdout
    described = {v.name: v.description for v in fmpy.read_model_description(str(tmp_path / "axis.fmu")).modelVariables}
    assert described["load_torque"].endswith("until it is set: load.torque of the scenario")


class Calls:
    """The functions of an FMU of FMI 2.0, called in any order; what they return is their status."""

    def __init__(self, path: Path, directory: Path, kind: int) -> None:
        self.said: list[str] = []
        description = fmpy.read_model_description(str(path))
        fmpy.extract(str(path), unzipdir=str(directory))
        self.fmu = fmi2.FMU2Model(guid=description.guid, unzipDirectory=str(directory), modelIdentifier="lostmotion", instanceName="drive")
        callbacks = Slave.callbacks(self)  # type: ignore[arg-type]
        self.handle = c_void_p(
            self.fmu.fmi2Instantiate(
                b"drive", kind, description.guid.encode(), (directory / "resources").as_uri().encode(), byref(callbacks), 0, 0
            )
        )
        self.variable = {v.name: v.valueReference for v in description.modelVariables}

    def __call__(self, name: str, *arguments: Any) -> int:
        function = getattr(self.fmu.dll, f"fmi2{name}")
        function.restype = c_int
        return int(function(self.handle, *arguments))

    def get(self, name: str) -> tuple[int, float]:
        value = c_double()
        return self("GetReal", byref(c_uint(self.variable[name])), 1, byref(value)), value.value


STEP = ("DoStep", c_double(0.0), c_double(0.01), 1)
SETUP = ("SetupExperiment", 0, c_double(0.0), c_double(5.0), 0, c_double(0.0))
NUMBERS = (c_double * 5)()
WRONG = {  # what leads there, and what is refused there
    "before initialization": ([], [STEP, ("ExitInitializationMode",), ("Terminate",)]),
    "in initialization mode": ([("EnterInitializationMode",)], [STEP, SETUP, ("EnterInitializationMode",), ("Terminate",)]),
    "between steps": (
        [("EnterInitializationMode",), ("ExitInitializationMode",)],
        [SETUP, ("EnterInitializationMode",), ("ExitInitializationMode",), ("SetTime", c_double(3.0)), ("EnterEventMode",),
         ("NewDiscreteStates", byref(fmi2.fmi2EventInfo())), ("EnterContinuousTimeMode",), ("SetContinuousStates", NUMBERS, 5),
         ("GetDerivatives", NUMBERS, 5)],
    ),
    "after termination": (
        [("EnterInitializationMode",), ("ExitInitializationMode",), ("Terminate",)],
        [STEP, SETUP, ("EnterInitializationMode",), ("Terminate",), ("SetReal", byref(c_uint(1000)), 1, byref(c_double(1.0)))],
    ),
}  # fmt: skip


@pytest.mark.parametrize("where", WRONG)
def test_a_function_that_is_called_in_the_wrong_order_is_refused_and_changes_nothing(where: str, tmp_path: Path) -> None:
    lm.export_fmu(lm.load("paper-2dof-nl-small"), tmp_path / "drive.fmu")
    call = Calls(tmp_path / "drive.fmu", tmp_path / "open", kind=1)
    lead, refused = WRONG[where]
    assert [call(*step) for step in lead] == [0] * len(lead)
    for function, *arguments in refused:
        assert call(function, *arguments) == 3, function
        assert call.said[-1].startswith(f"fmi2{function} cannot be called {where}, only "), function
    if "initialization" not in where:
        assert call.get("time") == (0, 0.0)
        assert call.get("motor_speed") == (0, 0.0)
    assert call("Reset") == 0
    for step in (("EnterInitializationMode",), ("ExitInitializationMode",), STEP, ("Terminate",)):
        assert call(*step) == 0
    assert call.get("time") == (0, 0.01)
    call("FreeInstance")


def test_in_model_exchange_each_mode_has_its_functions(tmp_path: Path) -> None:
    lm.export_fmu(lm.load("paper-2dof-nl-small"), tmp_path / "drive.fmu")
    call = Calls(tmp_path / "drive.fmu", tmp_path / "open", kind=0)
    info, event, end = fmi2.fmi2EventInfo(), c_int(), c_int()
    later, completed = ("SetTime", c_double(0.5)), ("CompletedIntegratorStep", 1, byref(event), byref(end))
    assert [call(*later), call("EnterInitializationMode"), call(*later), call("ExitInitializationMode")] == [3, 0, 3, 0]
    assert [call(*completed), call(*STEP), call("SetContinuousStates", NUMBERS, 5)] == [3, 3, 3]
    assert [call("NewDiscreteStates", byref(info)), call("EnterContinuousTimeMode")] == [0, 0]
    assert [call("NewDiscreteStates", byref(info)), call(*STEP), call("EnterContinuousTimeMode")] == [3, 3, 3]
    assert call.get("time") == (0, 0.0)
    assert [call(*later), call(*completed), call("EnterEventMode"), call("Terminate"), call(*later)] == [0, 0, 0, 0, 3]
    assert call.get("time") == (0, 0.5)
    call("FreeInstance")


def test_a_step_before_initialization_is_refused_in_version_3_too(tmp_path: Path) -> None:
    from fmpy.fmi3 import FMU3Slave

    lm.export_fmu(lm.load("paper-2dof-nl-small"), tmp_path / "drive.fmu", fmi=3)
    description = fmpy.read_model_description(str(tmp_path / "drive.fmu"))
    fmpy.extract(str(tmp_path / "drive.fmu"), unzipdir=str(tmp_path / "open"))
    fmu = FMU3Slave(guid=description.guid, unzipDirectory=str(tmp_path / "open"), modelIdentifier="lostmotion", instanceName="drive")  # fmt: skip
    fmu.instantiate()
    flags, last = (c_bool * 3)(), c_double()

    def step() -> int:
        return int(fmu.dll.fmi3DoStep(fmu.component, c_double(0.0), c_double(0.01), c_bool(True), *map(byref, (c_bool.from_buffer(flags, k) for k in range(3))), byref(last)))  # fmt: skip

    assert [step(), fmu.dll.fmi3EnterEventMode(fmu.component), fmu.dll.fmi3Terminate(fmu.component)] == [3, 3, 3]
    fmu.enterInitializationMode(startTime=0.0)
    assert (step(), last.value) == (3, 0.0)
    fmu.exitInitializationMode()
    assert fmu.dll.fmi3EnterEventMode(fmu.component) == fmu.dll.fmi3EnterConfigurationMode(fmu.component) == 3
    assert (step(), last.value) == (0, 0.01)
    fmu.terminate()
    assert step() == 3
    fmu.freeInstance()


def test_a_jump_of_a_signal_is_a_time_event(tmp_path: Path) -> None:
    """Up to the event an integrator sees the command before it, even where it asks for points beyond."""
    lm.export_fmu(lm.load("paper-2dof-nl-small", STEPPED[:1]), tmp_path / "drive.fmu")
    model = Model(tmp_path / "drive.fmu", tmp_path / "open")
    model.fmu.enterEventMode()
    *_, has_next, time = model.fmu.newDiscreteStates()
    assert (has_next, time) == (True, 0.05)
    model.fmu.enterContinuousTimeMode()
    rest = [0.0] * model.n
    assert not any(model.rates(0.05, rest))
    assert not any(model.rates(0.06, rest))
    model.fmu.setTime(0.05)
    model.fmu.enterEventMode()
    *_, has_next, time = model.fmu.newDiscreteStates()
    assert (has_next, time) == (True, 0.4)
    model.fmu.enterContinuousTimeMode()
    assert model.rates(0.05, rest)[0] > 0.0  # the torque of the motor rises
    model.fmu.terminate()
    model.fmu.freeInstance()
