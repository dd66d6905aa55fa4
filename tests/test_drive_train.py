"""Drive trains: scenario files in the long form, what is refused, and the short form as a train."""

import copy
import json
import math
import pickle
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from conftest import SCENARIOS, TRAINS
from lostmotion.inputs.refusal_messages import shown
from lostmotion.simulation.forms.axis_form import file_schema
from lostmotion.simulation.forms.initial_state import start_values
from lostmotion.simulation.forms.key_aliases import DRIVE
from lostmotion.simulation.forms.train_tables import TrainTables, train_schema
from refusals import refused
from tables import gear_between, run_of, torque_source

TRAIN: dict[str, Any] = {
    "shafts": {
        "motor": {},
        "worm": {"inertia": "1 kg*cm^2"},
        "table": {"inertia": "2 kg*m^2", "friction_torque": 0.5, "torque": {"mean": "20 N*m"}},
    },
    "motors": {"m1": torque_source(1e-4, "motor")},
    "gears": {
        "belt": gear_between("motor", "worm", 2.0, 300.0),
        "worm": gear_between("worm", "table", 50.0, 1e4, losses={"kind": "worm", "lead_angle": "4 deg", "friction_coefficient": 0.084}),
    },
    "brakes": {"hold": {"shaft": "motor", "torque": "1 N*m"}},
    "command": {"hold": 0, "m1": {"amplitude": 0.3, "frequency": "1 Hz"}},
    "simulation": run_of("0.5 s", "1 ms"),
}


def train(**changes: Any) -> lm.Scenario:
    """The train above with changes by dotted key."""
    tables = lm.Scenario(**copy.deepcopy(TRAIN))
    return tables.replace(**{key.replace("__", "."): value for key, value in changes.items()}) if changes else tables


def written(tables: Any, path: tuple[str, ...] = ()) -> str:
    """A nested mapping as TOML."""
    lines, inner = [], []
    for key, value in tables.items():
        if isinstance(value, dict):
            inner.append(written(value, (*path, key)))
        else:
            lines.append(f"{key} = {shown(value)}")
    head = [f"[{'.'.join(path)}]"] if path else []
    return "\n".join([*head, *lines, *inner])


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "train.toml"
    path.write_text(written(TRAIN))
    return path


# --- files ---
def test_a_file_in_the_long_form_gives_the_train_in_si(file: Path) -> None:
    scenario = lm.load(file)
    assert scenario.form != DRIVE
    assert scenario == train()
    assert scenario.shafts["worm"].inertia == pytest.approx(1e-4, rel=1e-14)
    assert list(scenario.train().gears) == ["belt", "worm"]
    assert scenario.loaded() == ["table"]


@pytest.mark.parametrize(("change", "line"), [
    ("gears.worm.output=tble", 'key gears.worm.output: "tble" is no shaft; did you mean table?'),
    ("motors.m1.shaft=x", 'key motors.m1.shaft: "x" is no shaft; the shafts are motor, worm, table'),
    ("gears.belt.outptu=x", "key gears.belt.outptu: is not known; did you mean output?"),
    ("gears.wrm.ratio=3", "keys gears.wrm.input, gears.wrm.output: are missing; add them"),
    ("gears.belt.ratio=0", "key gears.belt.ratio: 0 is no ratio; give input speed / output speed, below 0 for a gear that reverses"),
    ("shafts.table.inertia=2 kg", 'key shafts.table.inertia: "2 kg" has the unit of something else (kg); it must be a value in kg*m^2, such as "1 kg*m^2"'),
    ("gears.belt.housing=tble", 'key gears.belt.housing: "tble" is no shaft; did you mean table?'),
    ("gears.belt.housing=worm", "key gears.belt: has its housing on shaft 'worm', which it joins as well; give the housing a shaft of its own"),
    (
        "gears.worm.housing=motor",
        "key gears.worm: has a housing that turns and losses that depend on the direction of its motion, which are "
        "solved against the frame only; leave one of them out",
    ),
    ("gears.belt.output=motor", "key gears.belt: joins shaft 'motor' with itself; give it another output"),
    ("shafts.idle.inertia=1", "key shafts.idle: is turned by nothing: no motor, gear or load torque acts on it; join it to the train"),
    ("command.m2=1", "key command.m2: is no motor, brake or friction clutch of this train; those with a command are m1, hold"),
    ("motor.rotor_inertia=1", "key motor: is not known; did you mean motors?"),
    ("initial.speeds.motr=1", "key initial.speeds.motr: is no shaft of this train; did you mean motor?"),
    ("initial.twists.belt=x", 'key initial.twists.belt: "x" is not one number with one unit; write a value in rad, such as "1 rad"'),
    ("gears.belt.gearbox=nix", 'key gears.belt.gearbox: gearbox "nix" is not in the catalogue; `lostmotion catalogue` lists them'),
    ("gears.belt.added_backlash=0.01", "key gears.belt.added_backlash: acts on a record; give gears.belt.gearbox, or leave it out"),
    ("gears.belt.losses={kind='worm'}", "key gears.belt.losses: lacks lead_angle, or module, starts and diameter; add it"),
    ("gears.belt.losses={kind='worm',lead_angle=0.1}", "key gears.belt.losses: lacks friction_angle and friction_coefficient; give one of them"),
    (
        "shafts.table.breakaway_torque=0.1",
        "key shafts.table: has breakaway_torque = 0.1 N*m, less than its friction in motion, 0.5 N*m; give at least that, or leave it out",
    ),
    ("brakes.hold.torque=-1", "key brakes.hold.torque: -1.0 must be greater than 0"),
    ('brakes.second={shaft="worm",torque=1}', "key command.second: is missing; add a number from 0 (open) to 1 (full torque), or a signal"),
    ('brakes.m1={shaft="worm",torque=1}', "keys motors.m1, brakes.m1: have a result variable of the same name, m1_command; rename one of them"),
])  # fmt: skip
def test_what_is_wrong_with_a_train_is_said_in_one_line(file: Path, change: str, line: str) -> None:
    assert refused(lambda: lm.load(file, [change])) == f"{file}: {line}"


def test_tables_that_make_no_train_are_refused_with_their_keys() -> None:
    arm = {"shaft": "table", "mass": 1.0, "radius": 0.1}
    torques = {"gravity": {"arm": arm}, "angle_torques": {"arm": {"kind": "sine", "shaft": "table", "amplitude": 0.1}}}
    refused(lambda: lm.Scenario(**TRAIN | torques), "gravity.arm", "angle_torques.arm")
    refused(lambda: lm.Scenario(**TRAIN | {"shafts": TRAIN["shafts"] | {"my shaft": {"inertia": 1}}}), "shafts")
    gears = {name: gear | {"stiffness": {"kind": "rigid"}} for name, gear in TRAIN["gears"].items()}
    for ratio, loop in ((100.0, "with the same ratio"), (90.0, "with another ratio: nothing")):
        both = gears | {"direct": {"input": "motor", "output": "table", "ratio": ratio}}
        message = f"^key gears.direct: closes a loop of rigid gears {loop}"
        refused(lambda both=both: lm.Scenario(**TRAIN | {"gears": both}), "gears.direct", match=message)
    rigid = {"gears.belt.stiffness": {"kind": "rigid"}}  # binds the speeds at the start
    assert train(**rigid, **{"initial.speeds": {"motor": 4.0, "worm": 2.0}})
    refused(lambda: train(**rigid, **{"initial.speeds": {"motor": 5.0, "worm": 2.0}}), "initial.speeds.worm")
    refused(lambda: lm.response.rigid_constants(train()), "brakes.hold")
    refused(lambda: lm.test_rig.TestRig(train()), reason=" the test rig measures one gear; give one, such as scenario.gears")


def test_a_rigid_gear_on_a_housing_binds_three_speeds_at_the_start() -> None:
    planetary = {"input": "sun", "output": "carrier", "housing": "ring", "ratio": 4.0}
    tables: dict[str, Any] = {
        "shafts": {name: {"inertia": 1.0, "torque": 0.0} for name in ("sun", "carrier", "ring")},
        "gears": {"planetary": planetary},
        "simulation": {"duration": 1.0, "sample_interval": 0.1},
    }
    speeds = {"sun": 9.0, "carrier": 3.0, "ring": 1.0}
    result = lm.simulate(lm.Scenario(**tables, initial={"speeds": speeds}))
    assert {name: float(result[f"{name}_speed"][-1]) for name in speeds} == speeds
    assert {name: float(result[f"{name}_angle"][-1]) for name in speeds} == pytest.approx(speeds, rel=1e-14)
    refused(lambda: lm.Scenario(**tables, initial={"speeds": speeds | {"ring": 0.5}}), "initial.speeds")


def test_angles_at_the_start_follow_through_the_gears() -> None:
    scenario = train(**{"initial.angles": {"worm": 10.0}, "initial.twists": {"belt": 0.1, "worm": 0.02}})
    start = start_values(scenario.train(), scenario.initial)
    assert start["motor_angle"] == pytest.approx(2.0 * (10.0 + 0.1), rel=1e-14)
    assert start["table_angle"] == pytest.approx(10.0 / 50.0 - 0.02, rel=1e-14)
    refused(lambda: train(**{"initial.angles": {"motor": 1.0, "table": 0.2}}), "initial.angles.table")


def test_records_of_the_catalogue_fit_at_any_place(file: Path) -> None:
    text = file.read_text() + '\n[gears.last]\ninput = "table"\noutput = "arm"\ngearbox = "schaeffler-rt1-h-20-100"\n'
    text += 'loss_factor = 1.5\n[shafts.arm]\ninertia = 1\n[motors.servo]\nshaft = "table"\nfrom = "maxon-ec-i-52-606793"\n'
    file.write_text(text)
    scenario = lm.load(file)
    box = lm.gearbox("schaeffler-rt1-h-20-100", loss_factor=1.5)
    for key in lm.Gearbox.model_fields:
        assert getattr(scenario.gears["last"], key) == getattr(box, key)
    motor = lm.motor("maxon-ec-i-52-606793")
    for key in lm.Motor.model_fields:
        assert getattr(scenario.motors["servo"], key) == getattr(motor, key)
    other = scenario.replace(**{"gears.last.gearbox": "paper-gearbox"})
    assert other.gears["last"].ratio == lm.gearbox("paper-gearbox").ratio
    assert other.gears["last"].output == "arm"


def test_a_base_may_be_a_train(file: Path) -> None:
    changed = file.with_name("changed.toml")
    changed.write_text('base = "train.toml"\n[gears.belt]\nratio = 3\n[gears.worm]\ngearbox = "schaeffler-rt1-h-20-100"\n')
    scenario = lm.load(changed)
    assert scenario.gears["belt"].ratio == 3.0
    assert scenario.gears["worm"].ratio == 100.0
    assert scenario.gears["worm"].input == "worm"


def test_the_rated_voltage_of_a_motor_in_a_train_takes_its_speed_with_it() -> None:
    servo = {"shaft": "motor", "from": "maxon-ec-i-52-606793"}
    low = train(**{"motors.m1": servo})
    high = low.replace(**{"motors.m1.rated_voltage": "48 V"})
    assert high.motors["m1"].rated_voltage == 48.0
    at = lm.motor("maxon-ec-i-52-606793").at_voltage(48.0)
    assert high.motors["m1"].rated_speed == pytest.approx(at.rated_speed, rel=1e-14)


def test_a_series_may_load_a_shaft(file: Path) -> None:
    (file.parent / "torque.csv").write_text("time [ms],torque [Ncm]\n0,0\n100,50\n")
    text = file.read_text().replace('[shafts.table.torque]\nmean = "20 N*m"', '[shafts.table.torque.samples]\nfile = "torque.csv"')
    file.write_text(text)
    samples = lm.load(file).shafts["table"].torque.samples
    assert samples.times == pytest.approx((0.0, 0.1))
    assert samples.values == pytest.approx((0.0, 0.5))


def test_the_schema_of_files_holds_all_forms() -> None:
    schema = file_schema()
    assert [form["title"] for form in schema["anyOf"]] == ["Scenario", "Drive train", "Linear axis"]
    named = set(re.findall(r'"#/\$defs/([^"]*)"', json.dumps(schema)))
    assert named <= set(schema["$defs"])
    assert {"Motor", "train_ShaftMotor"} <= named
    assert set(TrainTables.model_fields) < set(train_schema()["properties"])


# --- elements ---
def test_a_worm_follows_from_its_drawing() -> None:
    # m = 2 mm, one thread, d = 22.4 mm: tan g = 0.0892857; mu = 0.1: tan r = 0.1
    worm = lm.model.WormMesh(module="2 mm", starts=1, diameter="22.4 mm", friction_coefficient=0.1)
    tan_g, tan_r = 2.0 / 22.4, 0.1
    forward = tan_g * (1.0 - tan_g * tan_r) / (tan_g + tan_r)
    backward = (tan_g - tan_r) / (1.0 + tan_g * tan_r) / tan_g
    assert worm.efficiencies() == pytest.approx((forward, backward), rel=1e-13)
    assert backward < 0.0


def test_gravity_is_a_sine_to_the_stated_error() -> None:
    arm = lm.model.Gravity(shaft="s", mass="2 kg", radius="300 mm", angle=0.3, error=0.01)
    torque = arm.core()
    for phi in np.linspace(-7.0, 7.0, 1000):
        assert abs(torque(float(phi)) + 2.0 * 9.80665 * 0.3 * math.sin(phi + 0.3)) <= 0.01 * (1.0 + 1e-9)


def test_a_transmission_error_shifts_the_angles_at_the_start() -> None:
    error = {"kind": "sine", "amplitude": 1e-3, "order": 3}
    scenario = train(**{"gears.belt.transmission_error": error, "initial.angles": {"table": 0.2}, "initial.twists": {"belt": 1e-3}})
    start = start_values(scenario.train(), scenario.initial)
    phi = start["motor_angle"]
    e = scenario.gears["belt"].transmission_error.core()(phi)
    assert start["worm_angle"] == pytest.approx(50.0 * 0.2, rel=1e-14)
    assert phi / 2.0 - start["worm_angle"] - e == pytest.approx(1e-3, rel=1e-9)


def test_trains_are_immutable_and_survive_pickling() -> None:
    scenario = train()
    for thing in (scenario, scenario.train()):
        assert pickle.loads(pickle.dumps(thing)) == thing
        assert hash(copy.deepcopy(thing)) == hash(thing)
    with pytest.raises(lm.InputError, match="frozen"):
        scenario.shafts["more"] = lm.Shaft()  # type: ignore[assignment]
    assert "frozen" in refused(scenario.shafts.clear)
    assert lm.Scenario.from_json(scenario.to_json()) == scenario
    assert repr(scenario.train()) == "DriveTrain(shafts motor, worm, table; motors m1; gears belt, worm; brakes hold)"
    reversed_shafts = dict(reversed(scenario.train().shafts.items()))
    assert scenario.train().model_copy(update={"shafts": reversed_shafts}) != scenario.train()


# --- the short form as a train ---
@pytest.mark.parametrize("path", SCENARIOS, ids=lambda p: p.stem)
def test_a_drive_is_a_train_of_two_shafts(path: Path) -> None:
    drive = lm.load(path).drive()
    of_it = drive.train()
    assert list(of_it.shafts) == ["motor", "load"]
    gear = of_it.gears["gearbox"]
    assert (gear.input, gear.output) == ("motor", "load")
    for key in lm.Gearbox.model_fields:
        assert getattr(gear, key) == getattr(drive.gearbox, key)
    long = lm.load(path).long()
    assert long.train() == of_it
    assert lm.Scenario.from_json(long.to_json()) == long


# --- runs ---
SHARED = {"command": "motor_command", "load_torque": "load_load_torque", "twist": "gearbox_twist", "output_torque": "gearbox_output_torque"}
SHARED |= {"input_contact": "motor_contact", "twist_contact": "gearbox_twist_contact"}
SHARED |= {name: name for name in ("motor_torque", "motor_speed", "load_speed", "load_angle", "load_contact")}


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda p: p.stem)
def test_the_short_and_the_long_form_give_the_same_bits(path: Path) -> None:
    short = lm.load(path)
    a, b = lm.simulate(short), lm.simulate(short.long())
    for name, long_name in SHARED.items():
        if long_name in b or not name.endswith("_contact"):  # a train has no contacts without friction
            assert np.array_equal(a[name].values, b[long_name].values), name
    assert a.attrs["switching_count"] == b.attrs["switching_count"]
    one, other = lm.switchings_of(a), lm.switchings_of(b)
    assert np.array_equal(one["instant"].values, other["instant"].values)
    # While the input shaft sticks, the short form says which part of the torque that is held there the gear takes.
    slips = a["input_contact"].values != 0
    T_1, size = a["input_torque"].values[slips], float(abs(a["input_torque"]).max())
    assert np.allclose(b["gearbox_input_torque"].values[slips], T_1, rtol=0.0, atol=1e-14 * size)
    one_ledger, other_ledger = lm.energy_of(a), lm.energy_of(b)
    stored = one_ledger["kinetic_change"] + one_ledger["elastic_change"]
    turned_over = one_ledger["turned_over"]
    assert other_ledger["stored_change"] == pytest.approx(stored, abs=1e-12 * turned_over)
    assert other_ledger["motor: motor"] == pytest.approx(one_ledger["source"], abs=1e-9 * turned_over)
    assert abs(other_ledger["residual"]) <= 1e-9 * turned_over


@pytest.mark.parametrize("path", TRAINS, ids=lambda p: p.stem)
def test_shipped_trains_run_and_their_energy_balance_closes(path: Path) -> None:
    scenario = lm.load(path)
    assert scenario.form != DRIVE
    assert lm.Scenario.from_json(scenario.to_json()) == scenario == lm.load(path.stem)
    result = lm.simulate(scenario)
    ledger = lm.energy_of(result)
    assert abs(ledger["residual"]) <= 1e-9 * ledger["turned_over"]
    for name in result:
        assert result[name].attrs["units"]
        assert result[name].attrs["long_name"]
    for shaft in scenario.shafts:
        assert {f"{shaft}_speed", f"{shaft}_angle"} <= set(result)
    for name, gear in scenario.gears.items():
        housing = result[f"{gear.housing}_angle"] if gear.housing else 0.0
        twist = (result[f"{gear.input}_angle"] - housing) / gear.ratio - (result[f"{gear.output}_angle"] - housing)
        size = float(abs(result[f"{gear.output}_angle"]).max()) + 1e-3
        if gear.transmission_error is None:  # else it is less by that
            assert np.allclose(twist, result[f"{name}_twist"], atol=1e-9 * size)


def test_losses_of_a_gear_on_a_turning_housing_are_apart_from_those_of_a_shaft_of_its_name() -> None:
    scenario = lm.Scenario(
        shafts={"a": {"inertia": 0.1, "viscous_friction": 0.5}, "b": {"inertia": 0.2}, "r": {"inertia": 0.3}},
        motors={"m": {"kind": "torque_source", "shaft": "a", "rotor_inertia": 1e-4}},
        gears={"a": {"input": "a", "output": "b", "housing": "r", "ratio": 2, "viscous_friction": 0.3}},
        command={"m": 0.2},
        simulation={"duration": 1, "sample_interval": 0.1},
    )
    energy = lm.energy_of(lm.simulate(scenario))
    assert abs(energy["residual"]) < 1e-12 * energy["turned_over"]
