"""Scenario files, parts and signals."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

import lostmotion as lm
from conftest import ALL_SCENARIOS, ROOT, SCENARIOS
from lostmotion.simulation.forms.drive_tables import DriveTables, drive_schema
from refusals import refused, refuses


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda p: p.stem)
def test_scenarios_load_and_survive_json(path: Path) -> None:
    scenario = lm.load(path)
    assert lm.Scenario.from_json(scenario.to_json()) == scenario
    assert lm.Scenario(**scenario.model_dump()) == scenario
    assert type(lm.Scenario.model_validate(scenario.model_dump())) is type(scenario)


def test_wrong_json_of_a_train_is_refused_by_its_own_key() -> None:
    text = '{"shafts": {"rotor": {"inertia": -1}}, "simulation": {"duration": 1, "sample_interval": 0.1}}'
    with refuses("shafts.rotor.inertia"):
        lm.Scenario.from_json(text)


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


def test_overrides_by_text_and_by_mapping_are_the_same(small: Path) -> None:
    by_text = lm.load(small, ["command.amplitude=0.1", "load.inertia=1 kg*m^2", "load.torque.mean = 3"])
    by_mapping = lm.load(small, {"command.amplitude": 0.1, "load.inertia": 1.0, "load.torque": 3.0})
    assert by_text == by_mapping


def test_parts_are_immutable_and_hashable(small: Path) -> None:
    scenario = lm.load(small)
    with pytest.raises(ValueError, match="frozen"):
        scenario.motor.rotor_inertia = 1.0
    assert hash(scenario.drive()) == hash(lm.load(small).drive())
    assert scenario.replace(**{"load.inertia": 3.0}).load.inertia == 3.0
    assert scenario.load.inertia == 2.0


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
    drive = lm.Drive(
        motor=lm.Motor(kind="torque_source", rotor_inertia=1.0),
        gearbox=lm.Gearbox(
            ratio=1,
            rated_input_speed=1,
            rated_output_torque=1,
            stiffness=lm.model.Rigid(),
            losses=lm.model.ConstantEfficiency(efficiency=1),
        ),
        load=lm.Load(inertia=1.0),
    )
    step = times[1] - times[0]
    return lm.simulate(drive, command=signal, duration=times[-1], sample_interval=step)["command"].values


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
    for content in ("0,0\n1,x\n", "0\n1\n", "0,0\n"):
        (tmp_path / "points.csv").write_text(content)
        with pytest.raises(lm.InputError, match=r"command\.samples"):
            lm.load(path)
    for content, words in (
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
        with pytest.raises(lm.InputError) as caught:
            lm.load(path)
        assert words in str(caught.value)
        assert "command.samples" in str(caught.value)
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
    refused(lambda: lm.load(path), match=r"points\.csv.*cannot be read")


def test_a_chirp_departs_from_its_sine_by_no_more_than_stated() -> None:
    t = np.arange(20001) * 1e-4
    chirp = lm.CommandSignal(chirp={"amplitude": 2.0, "begin_frequency": 1.0, "end_frequency": 20.0, "duration": 2.0})
    exact = 2.0 * np.sin(2 * np.pi * (1.0 + 0.5 * 9.5 * t) * t)
    assert np.max(np.abs(value(chirp, t) - exact)) <= 2.0 * (np.pi / 64) ** 2 / 2 * 1.01


def test_schema_describes_every_key_and_is_printed() -> None:
    schema = drive_schema()
    assert set(DriveTables.model_fields) < set(schema["properties"])
    assert json.loads(json.dumps(schema)) == schema


def test_scenarios_of_the_package_are_those_of_the_repository() -> None:
    from importlib.resources import files

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
