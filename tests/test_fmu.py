"""FMUs under FMPy: valid, the same bits as step by step in Python, state and rollback, parameters and errors."""

import importlib
import math
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from ctypes import byref, c_double, c_int, c_size_t, c_uint, c_void_p
from pathlib import Path
from typing import Any

import pytest

import lostmotion as lm
from conftest import ALL_SCENARIOS, ROOT, jamming
from lostmotion.portable import fmu_export as exporting
from refusals import refused

fmpy: Any = pytest.importorskip("fmpy", reason="FMPy is missing: .venv/bin/pip install --group portable")
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="FMPy runs the library for this platform, tests know Linux alone")


class Slave:
    """An FMU of FMI 2.0 for Co-Simulation, initialised."""

    def __init__(self, path: Path, directory: Path, changes: dict[str, float] | None = None) -> None:
        from fmpy.fmi2 import FMU2Slave

        self.said: list[str] = []
        description = fmpy.read_model_description(str(path))
        self.reference = {v.name: v.valueReference for v in description.modelVariables}
        self.names = [v.name for v in description.modelVariables if v.causality == "output"]
        fmpy.extract(str(path), unzipdir=str(directory))
        self.fmu = FMU2Slave(guid=description.guid, unzipDirectory=str(directory), modelIdentifier="lostmotion", instanceName="drive")
        self.fmu.instantiate(callbacks=self.callbacks())
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.set(changes or {})
        self.fmu.exitInitializationMode()
        self.time = 0.0

    def callbacks(self) -> Any:
        from fmpy import fmi2

        def log(environment: Any, name: bytes, status: int, category: bytes, message: bytes) -> None:
            self.said.append(message.decode())

        callbacks = fmi2.fmi2CallbackFunctions()
        callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(log)
        callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmi2.calloc)
        callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmi2.free)
        self._callbacks = callbacks
        return callbacks

    def set(self, values: dict[str, float]) -> None:
        if values:
            self.fmu.setReal([self.reference[name] for name in values], list(values.values()))

    def step(self, interval: float, **inputs: tuple[float, float]) -> None:
        """Each input from its first value in a straight line to its second."""

        self.set({name: first for name, (first, _) in inputs.items()})
        n = len(inputs)
        self.fmu.fmi2SetRealInputDerivatives(
            self.fmu.component,
            (c_uint * n)(*(self.reference[name] for name in inputs)),
            c_size_t(n),
            (c_int * n)(*([1] * n)),
            (c_double * n)(*((b - a) / interval for a, b in inputs.values())),
        )
        self.fmu.doStep(self.time, interval)
        self.time += interval

    def read(self) -> dict[str, float]:
        return dict(zip(self.names, self.fmu.getReal([self.reference[n] for n in self.names]), strict=True))

    def close(self) -> None:
        self.fmu.terminate()
        self.fmu.freeInstance()


@pytest.fixture(scope="module")
def paper(tmp_path_factory: Any) -> Path:
    path = tmp_path_factory.mktemp("fmu") / "paper.fmu"
    lm.export_fmu(lm.load("paper-2dof-nl-small"), path)
    return path


@pytest.fixture
def drive(paper: Path, tmp_path: Path) -> Iterator[Slave]:
    slave = Slave(paper, tmp_path)
    yield slave
    slave.close()


def exported(path: Path, to: Path) -> Path:
    out = to / f"{path.stem}.fmu"
    lm.export_fmu(lm.load(path), out)
    return out


@pytest.mark.parametrize("path", ALL_SCENARIOS, ids=lambda p: p.stem)
def test_the_description_of_every_scenario_is_valid(path: Path, tmp_path: Path) -> None:
    from fmpy.validation import validate_fmu

    platform = next(exporting.LIBRARIES.glob("*/all.*")).relative_to(exporting.LIBRARIES)
    (tmp_path / platform).parent.mkdir()
    (tmp_path / platform).write_bytes(b"")  # the library takes the longest to pack
    scenario = lm.load(path)
    for version in (2, 3):
        out = tmp_path / f"{version}.fmu"
        lm.export_fmu(scenario, out, fmi=version, libraries=tmp_path)
        assert validate_fmu(str(out)) == []


def test_an_fmu_with_its_parameters_is_valid_and_says_what_it_has(paper: Path) -> None:
    from fmpy.validation import validate_fmu

    assert validate_fmu(str(paper)) == []
    variables = {v.name: v for v in fmpy.read_model_description(str(paper)).modelVariables}
    assert variables["load.inertia"].causality == "parameter"
    assert variables["load.inertia"].variability == "tunable"
    assert float(variables["load.inertia"].start) == 2.0
    assert variables["load.inertia"].unit == "kg*m^2"
    ranges = {key: (variables[key].min, variables[key].max) for key in ("load.inertia", "gearbox.hysteresis.efficiency")}
    assert ranges == {"load.inertia": ("0.0", None), "gearbox.hysteresis.efficiency": ("0.0", "1.0")}
    contacts = {name: variables[name].variability for name in ("input_contact", "twist_contact", "load_contact")}
    # Without friction on the load its "contact" is the sign of its speed.
    assert contacts == {"input_contact": "discrete", "twist_contact": "discrete", "load_contact": "continuous"}
    assert variables["initial.load_speed"].variability == "fixed"
    assert "command.amplitude" not in variables
    run = lm.simulate(lm.load("paper-2dof-nl-small"))
    for name in ("motor_speed", "twist", "output_torque"):  # the nearest decade
        assert 10.0**-0.5 <= float(abs(run[name]).max()) / float(variables[name].nominal) <= 10.0**0.5
    assert variables["command"].causality == "input"
    with zipfile.ZipFile(paper) as archive:
        assert "load.inertia" in archive.read("documentation/index.html").decode()


STEPS = {"1e-5 s": [1e-5] * 200, "0.1 s": [0.1] * 8, "irregular": [1e-3 * (1.0 + 0.9 * math.sin(3.0 * k)) for k in range(150)]}


@pytest.mark.parametrize("steps", STEPS.values(), ids=STEPS)
def test_steps_have_the_bits_of_python(steps: list[float], drive: Slave) -> None:
    python = lm.Simulation(lm.load("paper-2dof-nl-small"), step=1e-3)
    time = 0.0
    for interval in steps:
        ends = [(0.2 * math.sin(7.0 * t), 3.0 * math.sin(2.0 * t)) for t in (time, time + interval)]
        (u0, m0), (u1, m1) = ends
        # The end as the FMU has it, from the derivative.
        u, m = ((a, a + (b - a) / interval * interval) for a, b in ((u0, u1), (m0, m1)))
        drive.step(interval, command=(u0, u1), load_torque=(m0, m1))
        python.advance(interval, command=u, load_torque=m)
        time += interval
        told, wanted = drive.read(), python.read()
        assert {name: told[name] for name in told} == {name: wanted[name] for name in told}
    assert wanted["motor_torque"] != 0.0


@pytest.mark.parametrize("name", ["position-axis", "hunting-with-backlash", "two-motors-one-ring", "field-weakening", "stepper-belt-axis"])
def test_trains_and_controllers_have_the_bits_of_python(name: str, tmp_path: Path) -> None:
    scenario = lm.load(name)
    interval = scenario.simulation.sample_interval
    python = lm.Simulation(scenario, step=interval)
    slave = Slave(exported(ROOT / "scenarios" / f"{name}.toml", tmp_path), tmp_path / "open")
    inputs = dict.fromkeys(python.inputs, (0.05, 0.05))
    for _ in range(150):
        slave.step(interval, **inputs)
        python.advance(interval, **inputs)
    told, wanted = slave.read(), python.read()
    shared = [n for n in told if n in wanted]
    assert len(shared) > 8
    assert {n: told[n] for n in shared} == {n: wanted[n] for n in shared}
    slave.close()


def test_after_a_rollback_and_from_bytes_the_motion_is_the_same(drive: Slave, paper: Path, tmp_path: Path) -> None:
    for _ in range(80):
        drive.step(1e-3, command=(0.1, 0.1))
    state, time = drive.fmu.getFMUState(), drive.time
    kept = drive.fmu.serializeFMUState(state)
    for _ in range(80):
        drive.step(1e-3, command=(0.1, 0.1))
    first = drive.read()
    drive.fmu.setFMUState(state)
    drive.time = time
    drive.step(0.02, command=(-0.3, 0.3))
    drive.fmu.setFMUState(state)
    drive.time = time
    for _ in range(80):
        drive.step(1e-3, command=(0.1, 0.1))
    assert drive.read() == first
    drive.fmu.freeFMUState(state)

    other = Slave(paper, tmp_path / "other")
    other.fmu.setFMUState(other.fmu.deSerializeFMUstate(kept))
    other.time = time
    for _ in range(80):
        other.step(1e-3, command=(0.1, 0.1))
    assert other.read() == first
    other.close()


def test_parameters_act_from_the_start_and_between_steps(paper: Path, tmp_path: Path) -> None:
    changes = {"load.inertia": 3.0, "motor.friction_torque": 0.02}
    slave = Slave(paper, tmp_path, changes)
    python = lm.Simulation(lm.load("paper-2dof-nl-small").replace(**changes), step=1e-3)
    for _ in range(60):
        slave.step(1e-3, command=(0.2, 0.2))
        python.advance(1e-3, command=0.2)
    told, wanted = slave.read(), python.read()
    assert {n: told[n] for n in told} == {n: wanted[n] for n in told}
    before = slave.read()
    slave.set({"load.inertia": 30.0})
    after = slave.read()
    for name in ("motor_speed", "load_speed", "twist", "load_angle"):
        assert after[name] == before[name]
    slave.step(1e-4, command=(0.2, 0.2))
    rate = (slave.read()["load_speed"] - before["load_speed"]) / 1e-4
    viscous = 7.424284477308235 * before["load_speed"]
    assert rate == pytest.approx((before["output_torque"] - viscous) / 30.0, rel=0.05)
    slave.close()


def test_what_is_wrong_is_said_in_the_words_of_the_project(drive: Slave) -> None:
    from fmpy.fmi1 import FMICallException

    with pytest.raises(FMICallException):
        drive.set({"load.inertia": -1.0})
    assert drive.said == ["parameter load.inertia: -1 must be greater than 0"]
    with pytest.raises(FMICallException):
        drive.fmu.doStep(1e300, 1e-3)
    assert drive.said[-1] == "the communication point is 1e+300 s, but the FMU is at 0 s"
    drive.step(1e-3, command=(0.1, 0.1))
    fmu, component, size = drive.fmu.dll, c_void_p(drive.fmu.component), c_size_t(1)
    fmu.fmi2SetFMUstate.argtypes = fmu.fmi2SerializeFMUstate.argtypes = fmu.fmi2SerializedFMUstateSize.argtypes = None
    assert fmu.fmi2SetFMUstate(component, None) == 3
    assert drive.said[-1] == "these bytes are no state of this FMU"
    assert fmu.fmi2SerializedFMUstateSize(component, None, byref(size)) == 0
    assert size.value == 0
    outputs, command = ([drive.reference[name] for name in names] for names in (("motor_torque", "output_torque"), ("command",)))
    # Both outputs are states or follow from them: an input changes them later.
    assert list(drive.fmu.getDirectionalDerivative(outputs, command, [1.0])) == [0.0, 0.0]


# Instantiates the FMU of a directory with resources that are cut and changed at random, half of them with the checksum of
# what they are then; prints how many it refused, and how many without their checksum it did not.
DAMAGED = """
import random, struct, sys, zlib
from pathlib import Path
from fmpy import fmi2

directory, guid = Path(sys.argv[1]), sys.argv[2]
said = []
log = fmi2.fmi2CallbackLoggerTYPE(lambda *words: said.append(words[-1].decode(errors="replace")))
callbacks = fmi2.fmi2CallbackFunctions()
callbacks.logger = log
callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmi2.calloc)
callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmi2.free)
fmu = fmi2.FMU2Slave(guid=guid, unzipDirectory=str(directory), modelIdentifier="lostmotion", instanceName="drive")
random.seed(1)
refused = unnoticed = 0

def sealed_anew(name, content):
    if name == "names.txt":
        lines = content[:content.rfind(b"checksum ")] if b"checksum " in content else content
        return lines + f"checksum {zlib.crc32(lines)}\\n".encode()
    return content[:16] + struct.pack("<d", zlib.crc32(content[24 : len(content) // 8 * 8])) + content[24:]

for name in ("names.txt", "scenario.bin"):
    file = directory / "resources" / name
    whole = file.read_bytes()
    cuts = [whole[:n] for n in range(0, len(whole), 1 if name == "names.txt" else 97)]
    changed = []
    for _ in range(400):
        some = bytearray(whole)
        for _ in range(random.randint(1, 4)):
            some[random.randrange(len(some))] = random.randrange(256)
        changed.append(bytes(some))
    damaged = [(content, False) for content in (*cuts, *changed) if content != whole]
    for content, sealed in (*damaged, *((sealed_anew(name, content), True) for content, _ in damaged)):
        file.write_bytes(content)
        before = len(said)
        try:
            fmu.instantiate(callbacks=callbacks)
        except Exception:
            refused += 1
            assert len(said) > before and said[-1], content
        else:
            unnoticed += not sealed
            fmu.freeInstance()
            fmu = fmi2.FMU2Slave(guid=guid, unzipDirectory=str(directory), modelIdentifier="lostmotion", instanceName="drive")
    file.write_bytes(whole)
fmu.instantiate(callbacks=callbacks)
print(refused, unnoticed)
"""


def test_damaged_resources_are_refused_and_never_crash(paper: Path, tmp_path: Path) -> None:
    fmpy.extract(str(paper), unzipdir=str(tmp_path))
    guid = fmpy.read_model_description(str(paper)).guid
    words = [sys.executable, "-c", DAMAGED, str(tmp_path), guid]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    refused, unnoticed = map(int, done.stdout.split())
    assert refused > 2000
    assert unnoticed == 0


def test_a_jam_ends_in_an_error_with_the_sentence_of_python(tmp_path: Path) -> None:
    from fmpy.fmi1 import FMICallException

    scenario = jamming()
    with pytest.raises(lm.SolverError) as jammed:
        lm.simulate(scenario)
    path = tmp_path / "jam.fmu"
    lm.export_fmu(scenario, path)
    slave = Slave(path, tmp_path / "open")
    with pytest.raises(FMICallException):
        slave.step(1e-3, drum_load_torque=(20.0, 20.0))
    assert slave.said == [str(jammed.value)]
    slave.close()


def test_what_cannot_be_exported_is_refused(tmp_path: Path) -> None:
    scenario = lm.load("paper-2dof-nl-small")
    for what, path, options, said in (
        (scenario, "drive.zip", {}, "must end in .fmu"),
        (scenario, "nowhere/drive.fmu", {}, "its directory does not exist"),
        (scenario, "drive.fmu", {"libraries": tmp_path}, "has no library"),
        (scenario.replace(title="a\u0001b"), "x.fmu", {}, r"title: 'a\\x01b' holds a control character"),
    ):
        refused(lambda w=what, p=path, o=options: lm.export_fmu(w, tmp_path / p, **o), match=said)
    assert not list(tmp_path.iterdir())


def test_an_importer_gives_the_command_in_place_of_a_controller_and_of_delays(tmp_path: Path) -> None:
    lm.export_fmu(lm.load("position-axis"), tmp_path / "plant.fmu", controllers=False)
    variables = fmpy.read_model_description(str(tmp_path / "plant.fmu")).modelVariables
    assert [v.name for v in variables if v.causality == "input"] == ["command", "load_torque"]
    brake = '[brakes.b]\nshaft = "drum"\ntorque = 5.0\nengagement_delay = 0.1\n[command.b]\nmean = 1.0\n'
    (tmp_path / "braked.toml").write_text(HELD_DRUM + brake)
    lm.export_fmu(lm.load(tmp_path / "braked.toml"), tmp_path / "braked.fmu")
    names = [v.name for v in fmpy.read_model_description(str(tmp_path / "braked.fmu")).modelVariables]
    assert "brakes.b.torque" in names
    assert not [n for n in names if n.endswith("_delay")]


HELD_DRUM = """
shafts.drum = { inertia = 1.0, friction_torque = 2.0, breakaway_torque = 4.0, torque = 6.0 }
shafts.rotor = { inertia = 1.0 }
gears.g = { input = "rotor", output = "drum", ratio = 1.0 }
simulation = { duration = 1.0, sample_interval = 0.1 }
"""


@pytest.fixture
def drum(tmp_path: Path) -> Path:
    (tmp_path / "drum.toml").write_text(HELD_DRUM)
    path = tmp_path / "drum.fmu"
    lm.export_fmu(lm.load(tmp_path / "drum.toml"), path)
    return path


def test_what_is_read_before_the_first_step_commits_nothing(drum: Path, tmp_path: Path) -> None:
    """The load of the file would break the drum away; that of the first step does not."""
    for name, reads in (("unread", False), ("read", True)):
        slave = Slave(drum, tmp_path / name)
        if reads:
            assert slave.read()["drum_speed"] == 0.0
        slave.step(0.5, drum_load_torque=(3.0, 3.0))
        assert slave.read()["drum_speed"] == 0.0
        slave.close()


def test_initial_values_set_before_initialization_are_those_of_the_start(paper: Path, tmp_path: Path) -> None:
    slave = Slave(paper, tmp_path, {"initial.load_angle": 0.5})
    scenario = lm.load("paper-2dof-nl-small").replace(**{"initial.load_angle": 0.5})
    python = lm.Simulation(scenario, step=scenario.simulation.sample_interval)
    slave.step(0.01, command=(0.5, 0.5))
    python.advance(0.01, command=0.5)
    assert slave.read()["load_angle"] == python["load_angle"] > 0.49
    with pytest.raises(Exception, match="fmi2SetReal failed with status 2"):
        slave.set({"initial.load_angle": 0.1})
    assert "is of the start" in slave.said[-1]
    slave.close()


def test_a_friction_that_gives_or_takes_a_dry_contact(drum: Path, tmp_path: Path) -> None:
    """Outputs keep their names where the simulation has a contact more; one that would be lost is refused."""
    before = Slave(drum, tmp_path / "before", {"shafts.rotor.friction_torque": 1.0})
    before.step(0.5, drum_load_torque=(6.0, 6.0))
    scenario = lm.load(tmp_path / "drum.toml").replace(**{"shafts.rotor.friction_torque": 1.0})
    result = lm.simulate(scenario.replace(**{"simulation.duration": 0.5, "simulation.sample_interval": 0.5}))
    values = before.read()
    assert values["drum_speed"] == pytest.approx(float(result["drum_speed"][-1]), rel=1e-12)
    assert values["drum_contact"] == -1.0
    with pytest.raises(Exception, match="fmi2SetReal failed with status 2"):
        before.set({"shafts.rotor.friction_torque": 0.0})
    before.step(0.1, drum_load_torque=(6.0, 6.0))
    before.close()
    during = Slave(drum, tmp_path / "during")
    during.step(0.1, drum_load_torque=(6.0, 6.0))
    with pytest.raises(Exception, match="fmi2SetReal failed with status 2"):
        during.set({"shafts.rotor.friction_torque": 1.0})
    assert "dry contact more" in during.said[-1]
    with pytest.raises(Exception, match="fmi2SetReal failed with status 2"):
        during.set({"shafts.drum.friction_torque": 0.0, "shafts.drum.breakaway_torque": 0.0})
    assert "drum_contact" in during.said[-1]
    during.step(0.1, drum_load_torque=(6.0, 6.0))
    during.close()


def test_parameters_that_fit_together_alone_are_set_and_restored_together(tmp_path: Path) -> None:
    lm.export_fmu(lm.load("position-axis"), tmp_path / "axis.fmu")
    slave = Slave(tmp_path / "axis.fmu", tmp_path)
    moves = ["controller.reference.moves.0.to", "controller.reference.moves.1.to"]
    first = slave.fmu.getFMUState()
    values = slave.fmu.getReal([slave.reference[m] for m in moves])
    for order in (moves, moves[::-1]):
        far = {m: math.radians(100.0 if m == moves[0] else 60.0) for m in order}
        slave.set(far)
        slave.step(0.01)
        slave.time = 0.0
        slave.fmu.setFMUState(first)
        assert slave.fmu.getReal([slave.reference[m] for m in moves]) == values
    slave.fmu.freeFMUState(first)
    slave.close()


def test_more_indicators_than_there_can_be_are_refused(drum: Path, tmp_path: Path) -> None:
    from fmpy.fmi2 import FMU2Slave

    guid = fmpy.read_model_description(str(drum)).guid
    for count in ("99999999999", "-1"):
        fmpy.extract(str(drum), unzipdir=str(tmp_path / count))
        names = tmp_path / count / "resources" / "names.txt"
        lines = [f"indicators {count}" if x.startswith("indicators") else x for x in names.read_text().splitlines()]
        names.write_text("\n".join(lines) + "\n")
        fmu = FMU2Slave(guid=guid, unzipDirectory=str(tmp_path / count), modelIdentifier="lostmotion", instanceName="drum")
        with pytest.raises(Exception, match="instantiate"):
            fmu.instantiate()


@pytest.mark.parametrize(("directories", "said"), [
    (("linux64",), "It runs on Linux x86-64; `make fmu` adds"),
    (("x86_64-linux", "aarch64-windows"), "It runs on Windows aarch64, Linux x86-64; `make fmu` adds"),
    (
        ("linux64", "win64", "darwin64", "aarch64-linux", "aarch64-windows", "aarch64-darwin"),
        "It runs on macOS aarch64, Linux aarch64, Windows aarch64, macOS x86-64, Linux x86-64, Windows x86-64.",
    ),
])  # fmt: skip
def test_the_command_prints_the_platforms_of_an_fmu(directories: tuple[str, ...], said: str, tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "x.fmu", "w") as file:
        for name in directories:
            file.writestr(f"binaries/{name}/drive.so", b"")
    assert importlib.import_module("lostmotion.cli.fmu")._platforms(tmp_path / "x.fmu").startswith(said)
