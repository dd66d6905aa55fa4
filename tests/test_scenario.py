"""Scenario files, parts and signals."""

import json
import math
import time
from copy import deepcopy
from pathlib import Path

import numpy as np
import pytest

import lostmotion as lm
from conftest import ALL_SCENARIOS, ROOT, SCENARIOS
from lostmotion.data_sheets.components import Conditions
from lostmotion.model.gearbox import GearboxLimits
from lostmotion.model.losses import LossMap
from lostmotion.model.motor import MotorLimits
from lostmotion.model.torsion import Hysteresis, TorsionCurve
from lostmotion.simulation.forms.drive_tables import DriveTables, LoadTable, drive_schema
from lostmotion.simulation.forms.set_by_dotted_key import set_values
from refusals import refusals, refused


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda p: p.stem)
def test_scenarios_load_and_survive_json(path: Path) -> None:
    scenario = lm.load(path)
    assert lm.Scenario.from_json(scenario.to_json()) == scenario
    assert lm.Scenario(**scenario.model_dump()) == scenario
    assert type(lm.Scenario.model_validate(scenario.model_dump())) is type(scenario)
    assert hash(scenario.drive()) == hash(lm.load(path).drive())
    text = '{"shafts": {"rotor": {"inertia": -1}}, "simulation": {"duration": 1, "sample_interval": 0.1}}'
    refused(lambda: lm.Scenario.from_json(text), "shafts.rotor.inertia")


@pytest.mark.parametrize("path", ALL_SCENARIOS, ids=lambda p: p.stem)
def test_names_of_variables_are_those_of_the_core(path: Path) -> None:
    """In both forms: what the train calls its variables is what the solver samples."""
    scenario = lm.load(path)
    train, core = scenario.train(), scenario.core()
    named = {name for name, *_ in core.channels()}
    assert {train.variable(shaft, "speed") for shaft in train.shafts} <= named
    assert {train.variable(motor, "torque") for motor in train.motors} <= named
    for gear in train.gears:
        assert {train.variable(gear, "output_torque"), train.variable(gear, "input_torque")} <= named
    assert set(core.input_names()) <= set(scenario.signals())
    assert {train.variable(motor, "command") for motor in train.motors} <= named | set(scenario.signals())
    assert set(scenario.input_keys()) >= {train.variable(shaft, "load_torque") for shaft in train.shafts}


def test_units_are_converted_to_si(small: Path) -> None:
    s = lm.load(small, {"gearbox.rated_input_speed": "3630 rpm", "load.inertia": "2e4 kg*cm^2"})
    assert s.gearbox.rated_input_speed == pytest.approx(3630 * math.pi / 30, rel=1e-14)
    assert s.load.inertia == pytest.approx(2.0, rel=1e-14)
    stiff = {"kind": "linear", "stiffness": "23 N*m/arcmin"}
    assert lm.load(small, {"gearbox.stiffness": stiff}).gearbox.stiffness.stiffness == pytest.approx(23 * 10800 / math.pi)
    assert lm.load(small, {"gearbox.hysteresis.efficiency": "93 percent"}).gearbox.hysteresis.efficiency == 0.93
    by_text = lm.load(small, ["command.amplitude=0.1", "load.inertia=1 kg*m^2", "load.torque.mean = 3"])
    assert by_text == lm.load(small, {"command.amplitude": 0.1, "load.inertia": 1.0, "load.torque": 3.0})
    with pytest.raises(ValueError, match="frozen"):
        s.motor.rotor_inertia = 1.0
    assert (s.replace(**{"load.inertia": 3.0}).load.inertia, s.load.inertia) == (3.0, pytest.approx(2.0, rel=1e-14))


def test_the_paper_s_constants_stand_in_the_scenario(large: Path) -> None:
    s = lm.load(large)
    assert s.gearbox.inertia + s.motor.rotor_inertia == pytest.approx(147e-7)
    J_MR, k_20 = 147e-7, 0.65 * 26.5e3
    assert s.gearbox.viscous_friction == pytest.approx(0.04 * math.sqrt(k_20 / (90**2 * 0.9 * J_MR)) * J_MR, rel=1e-14)
    assert s.load.viscous_friction == pytest.approx(0.04 * math.sqrt(k_20 / 2.0) * 2.0, rel=1e-14)
    # The stand-in table follows its formula, and has the efficiency that is stated for it (0.893) at rated load and speed.
    losses = s.gearbox.losses
    for mu, row in zip(losses.loads, losses.values, strict=True):
        for v, m in zip(losses.speeds, row, strict=True):
            formula = 0.020 + 0.06 * mu if v == 0 else 0.018 + 0.032 * v**0.7 + (0.05 + 0.02 * v) * mu
            assert m == pytest.approx(formula, abs=5e-7)
    assert 1.0 / (1.0 + losses.core()(1.0, 1.0)) == pytest.approx(0.893, abs=5e-4)


def test_the_three_models_differ_in_compliance_and_losses_only() -> None:
    a, b, c = (lm.load(ROOT / "scenarios" / f"paper-{m}-large.toml") for m in ("1dof-l", "2dof-l", "2dof-nl"))
    assert [x.gearbox.stiffness.kind for x in (a, b, c)] == ["rigid", "linear", "curve"]
    assert [x.gearbox.losses.kind for x in (a, b, c)] == ["constant_efficiency", "constant_efficiency", "map"]
    for x in (a, b):
        assert (x.motor, x.load, x.command) == (c.motor, c.load, c.command)


def test_backlash_and_preload_reshape_the_curve() -> None:
    curve = lm.model.TorsionCurve(slopes=(2650.0, 21200.0, 26500.0), breaks=(0.6e-3, 3e-3))
    gap = lm.model.TorsionCurve(**(curve.model_dump() | {"backlash": 2e-3}))
    for d in (0.0, 0.5e-3, 1e-3):
        assert gap.torque(d) == 0.0
    for d in (0.1e-3, 2e-3, 5e-3):
        assert gap.torque(d + 1e-3) == pytest.approx(curve.torque(d))
    for preload in (0.5, 1.59, 10.0, 52.47, 80.0):
        tight = lm.model.TorsionCurve(**(curve.model_dump() | {"preload": preload}))
        # 1.59 N m at the first break, 52.47 N m at the second.
        at = float(np.interp(preload, [0.0, 1.59, 52.47, 52.47 + 26500.0], [0.0, 0.6e-3, 3e-3, 3e-3 + 1.0]))
        for d in (0.1e-3, 1e-3, 4e-3):
            assert tight.torque(d) == pytest.approx(curve.torque(at + d) - preload)
            assert tight.torque(-d) == -tight.torque(d)


def value(signal: lm.CommandSignal, times: np.ndarray) -> np.ndarray:
    """The signal as the solver sees it, read from a run of a drive that it does not move."""
    still = lm.load("paper-1dof-l-small", {"motor.friction_torque": 1e6, "command": 0.0})
    step = times[1] - times[0]
    return lm.simulate(still.replace(command=signal), duration=times[-1], sample_interval=step)["command"].values


def test_signals_have_their_closed_forms() -> None:
    t = np.arange(401) * 0.005
    assert value(lm.CommandSignal(mean=0.3), t) == pytest.approx(np.full_like(t, 0.3))
    sine = lm.CommandSignal(mean=0.1, amplitude=2.0, frequency=3.0, phase=0.4)
    assert value(sine, t) == pytest.approx(0.1 + 2.0 * np.sin(2 * np.pi * 3.0 * t + 0.4), abs=1e-13)
    two = lm.CommandSignal(sines=[{"amplitude": 1, "frequency": 1}, {"amplitude": 0.5, "frequency": 7, "phase": 1}])
    assert value(two, t) == pytest.approx(np.sin(2 * np.pi * t) + 0.5 * np.sin(14 * np.pi * t + 1), abs=1e-13)
    steps = lm.CommandSignal(steps=[{"height": 1.0, "time": 0.5}, {"height": -3.0, "time": 1.0}])
    assert value(steps, t) == pytest.approx(np.where(t >= 1.0, -2.0, np.where(t >= 0.5, 1.0, 0.0)))
    ramp = lm.CommandSignal(ramps=[{"rise": 2.0, "duration": 0.8, "begin": 0.4}])
    assert value(ramp, t) == pytest.approx(np.clip((t - 0.4) / 0.8, 0, 1) * 2.0, abs=1e-13)
    samples = lm.CommandSignal(samples={"times": [0.2, 0.7, 1.5], "values": [1.0, -1.0, 4.0]})
    assert value(samples, t) == pytest.approx(np.interp(t, [0.2, 0.7, 1.5], [1.0, -1.0, 4.0]), abs=1e-12)


def test_a_sampled_series_is_read_from_a_file(small: Path, tmp_path: Path) -> None:
    (tmp_path / "points.csv").write_text("time,value\n0,0\n0.5,0.02\n1.5,-0.01\n")
    path = tmp_path / "sampled.toml"
    path.write_text(f'base = "{small}"\ncommand.samples.file = "points.csv"\n')
    command = lm.load(path).command
    assert command.samples is not None
    assert command.samples.times == (0.0, 0.5, 1.5)
    assert command.samples.values == (0.0, 0.02, -0.01)
    for content, words in (
        ("0,0\n1,x\n", ""),
        ("0\n1\n", ""),
        ("0,0\n", ""),
        ("0;0\n1;1\n", 'line 1: "0;0" must be two numbers with decimal points, separated by one comma'),
        ("0,0\n1,2,3\n", 'line 2: "1,2,3" must be two numbers'),
        ('0,0\n"0,5",1\n', 'line 2: "0,5" has a decimal comma; write "0.5"'),
        ("0,0\n1_000,1\n", 'line 2: "1_000" has separators'),
        ("time [min],value\n# why\n0,0\n1,x\n", 'line 4: "x" is not one number'),
        ("time,load [5]\n0,0\n", 'line 1: "load [5]" has no unit in its brackets; write [-] there, or leave them out'),
        ("time [rpm],value\n0,0\n", 'line 1: the unit of "time [rpm]" has the unit of something else'),
        ("0,0\n1,nan\n", "values[1]: nan must be a finite number"),
    ):
        (tmp_path / "points.csv").write_text(content)
        assert words in refused(lambda: lm.load(path), match=r"command\.samples")
    (tmp_path / "points.csv").write_text("\ufefftime [ms],command [%]\r\n0,0\r\n500,2\r\n")
    command = lm.load(path).command
    assert (command.samples.times, command.samples.values) == ((0.0, 0.5), (0.0, 0.02))
    # What stands in parentheses is the unit, or the number of a channel.
    for heading, second, percent in (
        ("time (ms),command (%)", 1e-3, 1e-2),
        ("pos (5),pos (3)", 1.0, 1.0),
        ("time (ch 2),command (5)", 1.0, 1.0),
        ("time [ms] (1),command (5) [%]", 1e-3, 1e-2),
    ):
        (tmp_path / "points.csv").write_text(f"{heading}\n0,0\n0.5,0.25\n")
        samples = lm.load(path).command.samples
        assert (samples.times, samples.values) == ((0.0, 0.5 * second), (0.0, 0.25 * percent)), heading
    (tmp_path / "points.csv").unlink()
    refused(lambda: lm.load(path), reason="cannot be read")


def test_a_chirp_departs_from_its_sine_by_no_more_than_stated() -> None:
    t = np.arange(20001) * 1e-4
    chirp = lm.CommandSignal(chirp={"amplitude": 2.0, "begin_frequency": 1.0, "end_frequency": 20.0, "duration": 2.0})
    exact = 2.0 * np.sin(2 * np.pi * (1.0 + 0.5 * 9.5 * t) * t)
    assert np.max(np.abs(value(chirp, t) - exact)) <= 2.0 * (np.pi / 64) ** 2 / 2 * 1.01


def test_scenarios_of_the_package_are_those_of_the_repository() -> None:
    from importlib.resources import files

    schema = drive_schema()
    assert set(DriveTables.model_fields) < set(schema["properties"])
    assert json.loads(json.dumps(schema)) == schema
    packaged = {p.name: p.read_text() for p in files("lostmotion").joinpath("scenarios").iterdir()}
    assert packaged == {p.name: p.read_text() for p in ALL_SCENARIOS}


def test_an_override_reaches_an_entry_of_a_list() -> None:
    path = ROOT / "scenarios" / "overrunning-load.toml"  # its command is one ramp
    assert lm.load(path, ["command.ramps.0.rise=-0.2"]).command.ramps[0].rise == -0.2
    changed = lm.load(path).replace(**{"command.ramps.0.rise": 0.3, "gearbox.stiffness.slopes.1": 3e4})
    assert changed.command.ramps[0].rise == 0.3
    assert changed.gearbox.stiffness.slopes == (2650.0, 3e4, 26500.0)
    for place in ("1", "-1", "first"):
        with pytest.raises(lm.InputError, match=rf"key command.ramps.{place}: .*numbered from 0"):
            lm.load(path, [f"command.ramps.{place}.rise=1"])


# --- changes to motor, gearbox and load ---
# A catalogue motor and gearbox near their limits, so that every limit is judged.
BASE = {"load.torque": "2 Nm", "gearbox.limits.peak_output_torque": "1 Nm", "motor.limits.max_current": "10 A"}

# For each key another value. Refused are those that have no meaning here.
OF_STEPPERS = {
    "motor.steps_per_revolution": 400,
    "motor.holding_torque": "0.4 Nm",
    "motor.detent_torque": "10 mNm",
    "motor.torque_error": "1 mNm",
    "motor.standstill_current": 0.5,
    "motor.rated_current": "1 A",
    "motor.resistance_phase": "1 ohm",
    "motor.inductance_phase": "1 mH",
    "motor.supply_voltage": "24 V",
}
OTHER = OF_STEPPERS | {
    "motor.kind": "torque_source",
    "motor.rotor_inertia": "500 gcm2",
    "motor.friction_torque": "0.1 Nm",
    "motor.rated_torque": "0.5 Nm",
    "motor.rated_speed": "2500 rpm",
    "motor.rated_voltage": "48 V",
    "motor.electrical_time_constant": "5 ms",
    "motor.armature_voltage_constant": 10,
    "motor.voltage_limit": "12 V",
    "motor.stall_torque": "4 Nm",
    "motor.no_load_speed": "5000 rpm",
    "motor.stall_current": "30 A",
    "motor.no_load_current": "1 A",
    "motor.limits.continuous_torque": "0.1 Nm",
    "motor.limits.peak_torque": "0.2 Nm",
    "motor.note": "another one",
    "motor.limits.max_speed": "100 rpm",
    "motor.limits.resistance": "1 ohm",
    "motor.limits.torque_constant": "50 mNm/A",
    "motor.limits.thermal_resistance": "9 K/W",
    "motor.limits.thermal_resistance_winding_case": "2 K/W",
    "motor.limits.thermal_resistance_case_ambient": "2 K/W",
    "motor.limits.thermal_time_constant_winding": "20 ms",
    "motor.limits.thermal_time_constant_motor": "10 ms",
    "motor.winding": {"pole_pairs": 4},
    "motor.dc_voltage": "12 V",
    "motor.limits.max_winding_temperature": "90 degC",
    "motor.limits.max_inertia_ratio": 5,
    "motor.limits.max_voltage": "10 V",
    "motor.limits.max_current": "1 A",
    "gearbox.ratio": 80,
    "gearbox.inertia": "1e-4 kg*m^2",
    "gearbox.viscous_friction": 1e-4,
    "gearbox.rated_input_speed": "1000 rpm",
    "gearbox.rated_output_torque": "20 Nm",
    "gearbox.stiffness.kind": "rigid",
    "gearbox.stiffness.slopes": [1e4, 2e4, 3e4],
    "gearbox.stiffness.breaks": ["0.3 mrad", "2 mrad"],
    "gearbox.stiffness.backlash": "1 arcmin",
    "gearbox.stiffness.preload": "1 Nm",
    "gearbox.stiffness.backward": 1.5,
    "gearbox.hysteresis.efficiency": 0.8,
    "gearbox.losses.kind": "constant_efficiency",
    "gearbox.losses.speeds": [0, 1],
    "gearbox.losses.loads": [0, 1],
    "gearbox.losses.values": [[0, 1], [1, 2]],
    "gearbox.losses.mirrored": True,
    "gearbox.limits.average_output_torque": "1 Nm",
    "gearbox.limits.peak_output_torque": "2 Nm",
    "gearbox.limits.momentary_output_torque": "3 Nm",
    "gearbox.limits.average_input_speed": "100 rpm",
    "gearbox.limits.max_input_speed": "100 rpm",
    "gearbox.mesh_damping": "20 N*m*s/rad",
    "gearbox.mesh_stiffness": {"teeth": 30, "contact_ratio": 1.6, "fewer_pairs": 0.7},
    "gearbox.damping_limited": True,
    "gearbox.note": "worn",
    "gearbox.loss_range": [0.5, 2.0],
    "gearbox.temperature": "60 degC",
    "gearbox.added_backlash": "1 arcmin",
    "gearbox.loss_factor": 1.5,
    "load.inertia": "2 kg*m^2",
    "load.viscous_friction": 0.1,
    "load.friction_torque": "1 Nm",
    "load.torque": "3 Nm",
}
# Judged where a task asks for it: test_axis_tasks.py.
OF_TASKS = {f"gearbox.limits.{key}" for key in ("rated_life", "life_exponent", "max_radial_force", "max_axial_force")}
REFUSED = {
    **dict.fromkeys(OF_STEPPERS, 'kind "stepper"'),
    **{f"motor.{key}": "give both" for key in ("stall_torque", "no_load_speed", "stall_current", "no_load_current")},
    "motor.limits.thermal_resistance": "say the same",  # as both of its parts
    "motor.winding": "resistance_phase",
    "motor.dc_voltage": "winding",
    "gearbox.stiffness.kind": "gearbox.hysteresis",  # rigid, with hysteresis
    "gearbox.losses.kind": "gearbox.losses.efficiency",
    "gearbox.losses.speeds": "has a hole",
    "gearbox.losses.loads": "rows of values",
    "gearbox.losses.values": "rows of values",
    "gearbox.losses.mirrored": "must begin at 0",
    "gearbox.damping_limited": "needs mesh_damping",
}


def keys() -> set[str]:
    """All keys of motor, gearbox and load, with those of the tables that the record's parts have."""
    inner = {"motor.limits": MotorLimits, "gearbox.limits": GearboxLimits, "gearbox.stiffness": TorsionCurve}
    inner |= {"gearbox.hysteresis": Hysteresis, "gearbox.losses": LossMap}
    whole = {"motor": lm.Motor, "gearbox": lm.Gearbox, "load": LoadTable} | inner
    found = {f"{table}.{key}" for table, part in whole.items() for key in part.model_fields}
    return (found | {f"gearbox.{key}" for key in Conditions.model_fields}) - inner.keys()


def what_is_seen(scenario: lm.Scenario) -> tuple[object, ...]:
    result = lm.simulate(scenario)
    motion = [result[name].values.tobytes() for name in result.data_vars]
    try:
        heat = lm.sizing.temperatures(result)["case_temperature"].values.tobytes()
    except lm.InputError as lacking:  # such as the resistance of a torque source
        heat = str(lacking).encode()
    return (*motion, heat, result.attrs.get("note"), *map(str, lm.check_drive(scenario)))


def test_every_key_is_tried() -> None:
    assert keys() == OTHER.keys() | OF_TASKS


@pytest.mark.parametrize("key", OTHER)
def test_a_change_to_a_catalogue_part_is_felt_or_refused(key: str) -> None:
    before = what_is_seen(lm.load("catalogue-robot-joint", BASE))
    changes = BASE | {key: OTHER[key]}
    if key in REFUSED or key == "gearbox.temperature":
        assert REFUSED.get(key, "lubricant").split(".")[-1] in refused(lambda: lm.load("catalogue-robot-joint", changes))
        return
    assert what_is_seen(lm.load("catalogue-robot-joint", changes)) != before


@pytest.mark.parametrize("name", ["catalogue-robot-joint", "paper-2dof-nl-large"])
@pytest.mark.parametrize("how", ["set", "replace", "base", "saved"])
def test_half_the_command_at_twice_the_rated_voltage_is_the_same_motion(name: str, how: str, tmp_path: Path) -> None:
    """Volts turn a motor, whatever is called 1."""
    scenario = lm.load(name)
    voltage, amplitude = scenario.motor.rated_voltage, scenario.command.amplitude
    assert voltage is not None
    assert amplitude is not None
    changes = {"motor.rated_voltage": 2.0 * voltage, "command.amplitude": 0.5 * amplitude}
    if how == "set":
        changed = lm.load(name, [f"{key}={value}" for key, value in changes.items()])
    elif how == "replace":
        changed = scenario.replace(**changes)
    elif how == "base":
        text = f'base = "{name}"\nmotor.rated_voltage = "{2.0 * voltage} V"\ncommand.amplitude = {0.5 * amplitude}\n'
        (tmp_path / "other.toml").write_text(text)
        changed = lm.load(tmp_path / "other.toml")
    else:
        lm.save(lm.simulate(scenario), tmp_path / "result.csv")
        changed = lm.load(tmp_path / "result.csv", changes)
    assert changed.motor.rated_voltage == 2.0 * voltage
    first, second = lm.simulate(scenario), lm.simulate(changed)
    for variable in ("motor_torque", "motor_speed", "load_speed", "twist"):
        size = float(abs(first[variable]).max())
        # The parameters differ by rounding, which breaking away at standstill amplifies somewhat.
        np.testing.assert_allclose(second[variable], first[variable], rtol=0.0, atol=1e-9 * size)
    assert float(abs(lm.simulate(scenario.replace(**{"motor.rated_voltage": 2.0 * voltage}))["load_speed"]).max()) > 1.5 * float(
        abs(first["load_speed"]).max()
    )


def test_the_time_for_overrides_is_linear() -> None:
    tables = {"load": {"inertia": 2.0}, "shared": {"list": [1.0, {"x": 1.0}]}}
    before = deepcopy(tables)
    data = dict(tables)
    begin = time.process_time()
    set_values(data, ((f"load.k{k}", k) for k in range(200_000)))
    assert time.process_time() - begin < 10.0  # 1 s; copying the table for each took 100 s
    assert len(data["load"]) == 200_001
    set_values(data, [("shared.list.1.x", 2.0), ("shared.list.0", 3.0), ("shared.list.1.y", 4.0)])
    assert data["shared"] == {"list": [3.0, {"x": 2.0, "y": 4.0}]}
    assert tables == before


def test_what_is_given_beside_a_rated_voltage_does_not_follow_it() -> None:
    motor = lm.load("paper-2dof-nl-large").motor
    own = {"motor.rated_voltage": 48, "motor.rated_speed": 300, "motor.armature_voltage_constant": 3}
    for order in (own, dict(reversed(own.items()))):
        changed = lm.load("paper-2dof-nl-large", order).motor
        assert (changed.rated_voltage, changed.rated_speed, changed.armature_voltage_constant) == (48, 300, 3)
        assert changed.rated_torque == motor.rated_torque


test_what_cannot_be_is_refused = refusals(
    (lambda: lm.load("paper-2dof-nl-large", {"motor.rated_voltage": 7}), "motor.rated_voltage"),
    (lambda: lm.load("catalogue-robot-joint", {"motor.voltage_limit": 24, "motor.limits.max_voltage": 24}), "motor"),
)


def test_a_torque_source_refuses_what_it_has_no_use_for() -> None:
    for name in ("catalogue-robot-joint", "paper-2dof-nl-large"):
        assert lm.load(name, {"motor.kind": "torque_source"}).motor.rated_speed is None
        for key, value in (("rated_speed", 300), ("rated_voltage", 24), ("armature_voltage_constant", 3)):
            with pytest.raises(lm.InputError, match=f"has {key}, of no use to a torque_source"):
                lm.load(name, {f"motor.{key}": value, "motor.kind": "torque_source"})
