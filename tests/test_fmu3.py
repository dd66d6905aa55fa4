"""FMUs of FMI 3.0: the same bits as Python, state, terminals; and references of controllers as inputs, in both versions."""

import zipfile
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pytest

import lostmotion as lm
from refusals import refused
from test_fmu import Slave, pytestmark

fmpy: Any = pytest.importorskip("fmpy", reason="FMPy is missing: .venv/bin/pip install --group portable")
__all__ = ["pytestmark"]


class Slave3:
    """An FMU of FMI 3.0 for Co-Simulation, initialised."""

    def __init__(self, path: Path, directory: Path) -> None:
        from fmpy.fmi3 import FMU3Slave

        description = fmpy.read_model_description(str(path))
        self.reference = {v.name: v.valueReference for v in description.modelVariables}
        self.names = [v.name for v in description.modelVariables if v.causality == "output"]
        fmpy.extract(str(path), unzipdir=str(directory))
        self.fmu = FMU3Slave(guid=description.guid, unzipDirectory=str(directory), modelIdentifier="lostmotion", instanceName="drive")
        self.fmu.instantiate()
        self.fmu.enterInitializationMode(startTime=0.0)
        self.fmu.exitInitializationMode()
        self.time = 0.0

    def step(self, interval: float, **inputs: tuple[float, float]) -> None:
        values = {name: a for name, (a, _) in inputs.items()}
        values |= {f"der({name})": (b - a) / interval for name, (a, b) in inputs.items()}
        self.fmu.setFloat64([self.reference[name] for name in values], list(values.values()))
        self.fmu.doStep(self.time, interval)
        self.time += interval

    def read(self) -> dict[str, float]:
        return dict(zip(self.names, self.fmu.getFloat64([self.reference[n] for n in self.names]), strict=True))

    def close(self) -> None:
        self.fmu.terminate()
        self.fmu.freeInstance()


@pytest.mark.parametrize("name", ["paper-2dof-nl-small", "position-axis", "worm-lowering"])
def test_steps_have_the_bits_of_python(name: str, tmp_path: Path) -> None:
    scenario = lm.load(name)
    interval = scenario.simulation.sample_interval
    lm.export_fmu(scenario, tmp_path / "drive.fmu", fmi=3)
    slave = Slave3(tmp_path / "drive.fmu", tmp_path / "open")
    python = lm.Simulation(scenario, step=interval)
    for k in range(150):
        a, b = 0.001 * k, 0.001 * (k + 1)
        slave.step(interval, **dict.fromkeys(python.inputs, (a, b)))
        end = a + (b - a) / interval * interval
        python.advance(interval, **dict.fromkeys(python.inputs, (a, end)))
        if k == 60:
            state = slave.fmu.getFMUState()
            bytes_of = slave.fmu.serializeFMUState(state)
            kept, time = slave.fmu.deserializeFMUState(bytes_of), slave.time
            slave.step(0.02, **dict.fromkeys(python.inputs, (-0.3, 0.3)))
            slave.fmu.setFMUState(kept)
            slave.time = time
    told, wanted = slave.read(), python.read()
    shared = [n for n in told if n in wanted]
    assert len(shared) > 8
    assert {n: told[n] for n in shared} == {n: wanted[n] for n in shared}
    slave.close()


def test_terminals_name_variables_that_there_are(tmp_path: Path) -> None:
    path = tmp_path / "drive.fmu"
    lm.export_fmu(lm.load("worm-lowering"), path, fmi=3)
    with zipfile.ZipFile(path) as archive:
        root = ET.fromstring(archive.read("terminalsAndIcons/terminalsAndIcons.xml"))
        assert archive.read("terminalsAndIcons/icon.png").startswith(b"\x89PNG")
    names = {v.name for v in fmpy.read_model_description(str(path)).modelVariables}
    members = {t.get("name"): [m.get("variableName") for m in t] for t in root.iter("Terminal")}
    assert members["drum_shaft"] == ["drum_load_torque", "drum_speed", "drum_angle"]
    assert set(members["commands"]) == {"motor_command"}
    assert {name for listed in members.values() for name in listed} <= names


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_reference_as_input_acts_as_that_of_the_scenario(fmi: int, tmp_path: Path) -> None:
    """Over steps as long as the sample time, each from a tick on; the reference is a straight line there."""
    changes = ["controller.reference={kind='speed', ramps=[{begin='1 ms', duration='1 s', rise='0.5 rad/s'}]}"]
    scenario = lm.load("speed-axis", changes)
    assert scenario.controller is not None
    tick = scenario.controller.sample_time
    slaves = []
    for given in (False, True):
        path = tmp_path / f"{given}.fmu"
        lm.export_fmu(scenario, path, fmi=fmi, references=given)
        inputs = [v.name for v in fmpy.read_model_description(str(path)).modelVariables if v.causality == "input"]
        assert ("reference" in inputs) == given
        slaves.append((Slave if fmi == 2 else Slave3)(path, tmp_path / str(given)))
    inside, given_to = slaves
    for k in range(400):
        value, rate = (float(v) for v in scenario.controller.reference.at(k * tick)[:2])
        inside.step(tick, load_torque=(0.0, 0.0))
        given_to.step(tick, load_torque=(0.0, 0.0), reference=(value, value + rate * tick))
    told, wanted = given_to.read(), inside.read()
    assert abs(wanted["load_speed"]) > 0.01
    # The line's rounding, amplified by the encoder's steps at most by one of them; there is none here.
    for name in ("load_speed", "motor_speed", "torque_reference", "load_angle"):
        assert told[name] == pytest.approx(wanted[name], rel=1e-9), name
    inside.close()
    given_to.close()


def test_a_reference_whose_past_has_to_be_known_stays_inside(tmp_path: Path) -> None:
    scenario = lm.load("position-axis", ["controller.position.reference_delay='1 ms'"])
    assert "reference_delay, for which it has to know" in refused(lambda: lm.export_fmu(scenario, tmp_path / "axis.fmu", references=True))


def test_another_version_is_refused(tmp_path: Path) -> None:
    assert "fmi: 1 must be 2 (FMI 2.0) or 3 (FMI" in refused(lambda: lm.export_fmu(lm.load("speed-axis"), tmp_path / "axis.fmu", fmi=1))
