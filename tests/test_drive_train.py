"""Drive trains: scenario files in the long form, what is refused, and runs."""

from __future__ import annotations

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
from lostmotion.inputs.validation import shown
from lostmotion.simulation.train_scenario import file_schema, in_long_form, train_schema
from lostmotion.simulation.train_state import start_values

TRAIN: dict[str, Any] = {
    "shafts": {
        "motor": {},
        "worm": {"inertia": "1 kg*cm^2"},
        "table": {"inertia": "2 kg*m^2", "friction_torque": 0.5, "torque": {"mean": "20 N*m"}},
    },
    "motors": {"m1": {"shaft": "motor", "kind": "torque_source", "rotor_inertia": 1e-4}},
    "gears": {
        "belt": {"input": "motor", "output": "worm", "ratio": 2.0, "stiffness": {"kind": "linear", "stiffness": 300.0}},
        "worm": {
            "input": "worm",
            "output": "table",
            "ratio": 50.0,
            "stiffness": {"kind": "linear", "stiffness": 1e4},
            "losses": {"kind": "worm", "lead_angle": "4 deg", "friction_coefficient": 0.084},
        },
    },
    "brakes": {"hold": {"shaft": "motor", "torque": "1 N*m"}},
    "command": {"hold": 0, "m1": {"amplitude": 0.3, "frequency": "1 Hz"}},
    "simulation": {"duration": "0.5 s", "sample_interval": "1 ms"},
}


def train(**changes: Any) -> lm.TrainScenario:
    """The train above with changes by dotted key."""
    tables = lm.TrainScenario(**copy.deepcopy(TRAIN))
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
    assert isinstance(scenario, lm.TrainScenario)
    assert scenario == train()
    assert scenario.shafts["worm"].inertia == pytest.approx(1e-4, rel=1e-14)
    assert list(scenario.train().gears) == ["belt", "worm"]
    assert scenario.loaded() == ["table"]


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ("gears.worm.output=tble", 'key gears.worm.output: "tble" is no shaft; did you mean table?'),
        ("motors.m1.shaft=x", 'key motors.m1.shaft: "x" is no shaft; the shafts are motor, worm, table'),
        ("gears.belt.outptu=x", "key gears.belt.outptu: is not known; did you mean output?"),
        ("gears.wrm.ratio=3", "keys gears.wrm.input, gears.wrm.output: are missing; add them"),
        ("gears.belt.ratio=0", "key gears.belt.ratio: 0.0 must be greater than 0"),
        (
            "shafts.table.inertia=2 kg",
            'key shafts.table.inertia: "2 kg" has the unit of something else (kg); it must be a value in kg*m^2, such as "1 kg*m^2"',
        ),
        (
            "gears.belt.housing=tble",
            'key gears.belt.housing: "tble" is no shaft; did you mean table?',
        ),
        (
            "gears.belt.housing=worm",
            "key gears.belt: has its housing on shaft 'worm', which it joins as well; give the housing a shaft of its own",
        ),
        (
            "gears.worm.housing=motor",
            "key gears.worm: has a housing that turns and losses that depend on the direction of its motion, which are "
            "solved against the frame only; leave one of them out",
        ),
        ("gears.belt.output=motor", "key gears.belt: joins shaft 'motor' with itself; give it another output"),
        (
            "shafts.idle.inertia=1",
            "key shafts.idle: is turned by nothing: no motor, gear or load torque acts on it; join it to the train",
        ),
        (
            "command.m2=1",
            "key command.m2: is no motor, brake or friction clutch of this train; those with a command are m1, hold",
        ),
        ("motor.rotor_inertia=1", "key motor: is not known; did you mean motors?"),
        ("initial.speeds.motr=1", "key initial.speeds.motr: is no shaft of this train; did you mean motor?"),
        (
            "initial.twists.belt=x",
            'key initial.twists.belt: "x" is not one number with one unit; write a value in rad, such as "1 rad"',
        ),
        (
            "gears.belt.gearbox=nix",
            'key gears.belt.gearbox: gearbox "nix" is not in the catalogue; `lostmotion catalogue` lists them',
        ),
        (
            "gears.belt.added_backlash=1",
            "key gears.belt.added_backlash: acts on a record; give gears.belt.gearbox, or leave it out",
        ),
        (
            "gears.belt.losses={kind='worm'}",
            "key gears.belt.losses: lacks lead_angle, or module, starts and diameter; add it",
        ),
        (
            "gears.belt.losses={kind='worm',lead_angle=0.1}",
            "key gears.belt.losses: lacks friction_angle and friction_coefficient; give one of them",
        ),
        (
            "shafts.table.breakaway_torque=0.1",
            "key shafts.table: has breakaway_torque = 0.1 N*m, less than its friction in motion, 0.5 N*m; give at least that, or leave it out",
        ),
        ("brakes.hold.torque=-1", "key brakes.hold.torque: -1.0 must be greater than 0"),
        (
            'brakes.second={shaft="worm",torque=1}',
            "key command.second: is missing; add a number from 0 (open) to 1 (full torque), or a signal",
        ),
        (
            'brakes.m1={shaft="worm",torque=1}',
            "keys motors.m1, brakes.m1: have a result variable of the same name, m1_command; rename one of them",
        ),
    ],
)
def test_what_is_wrong_with_a_train_is_said_in_one_line(file: Path, change: str, line: str) -> None:
    with pytest.raises(lm.InputError) as refused:
        lm.load(file, [change])
    assert str(refused.value) == f"{file}: {line}"


def test_rigid_gears_in_a_loop_are_refused_with_their_key() -> None:
    rigid = {"input": "motor", "output": "table", "ratio": 100.0}
    gears = {name: gear | {"stiffness": {"kind": "rigid"}} for name, gear in TRAIN["gears"].items()}
    with pytest.raises(lm.InputError, match=r"^key gears.direct: closes a loop of rigid gears with the same ratio"):
        lm.TrainScenario(**TRAIN | {"gears": gears | {"direct": rigid}})
    with pytest.raises(
        lm.InputError, match=r"^key gears.direct: closes a loop of rigid gears with another ratio: nothing"
    ):
        lm.TrainScenario(**TRAIN | {"gears": gears | {"direct": rigid | {"ratio": 90.0}}})


def test_rigid_gears_bind_the_speeds_at_the_start() -> None:
    gears = {"gears.belt.stiffness": {"kind": "rigid"}}
    assert train(**gears, **{"initial.speeds": {"motor": 4.0, "worm": 2.0}})
    with pytest.raises(lm.InputError, match="do not fit the rigid gear belt; their quotient must be its ratio, 2"):
        train(**gears, **{"initial.speeds": {"motor": 5.0, "worm": 2.0}})


def test_a_rigid_gear_on_a_housing_binds_three_speeds_at_the_start() -> None:
    planetary = {"input": "sun", "output": "carrier", "housing": "ring", "ratio": 4.0}
    tables: dict[str, Any] = {
        "shafts": {name: {"inertia": 1.0, "torque": 0.0} for name in ("sun", "carrier", "ring")},
        "gears": {"planetary": planetary},
        "simulation": {"duration": 1.0, "sample_interval": 0.1},
    }
    speeds = {"sun": 9.0, "carrier": 3.0, "ring": 1.0}
    result = lm.simulate(lm.TrainScenario(**tables, initial={"speeds": speeds}))
    assert {name: float(result[f"{name}_speed"][-1]) for name in speeds} == speeds
    assert {name: float(result[f"{name}_angle"][-1]) for name in speeds} == pytest.approx(speeds, rel=1e-14)
    with pytest.raises(lm.InputError, match=r"on the housing ring = 0.5 rad/s; relative to it their quotient must be"):
        lm.TrainScenario(**tables, initial={"speeds": speeds | {"ring": 0.5}})


def test_angles_at_the_start_follow_through_the_gears() -> None:
    scenario = train(**{"initial.angles": {"worm": 10.0}, "initial.twists": {"belt": 0.1, "worm": 0.02}})
    start = start_values(scenario.train(), scenario.initial)
    assert start["motor_angle"] == pytest.approx(2.0 * (10.0 + 0.1), rel=1e-14)
    assert start["table_angle"] == pytest.approx(10.0 / 50.0 - 0.02, rel=1e-14)
    with pytest.raises(
        lm.InputError, match=r"initial.angles.table: 0.2 rad does not fit motor = 1.0 rad through the gear"
    ):
        train(**{"initial.angles": {"motor": 1.0, "table": 0.2}})


def test_gravity_and_a_torque_over_angle_need_names_of_their_own() -> None:
    torques = {
        "gravity": {"arm": {"shaft": "table", "mass": 1.0, "radius": 0.1}},
        "angle_torques": {"arm": {"kind": "sine", "shaft": "table", "amplitude": 0.1}},
    }
    with pytest.raises(lm.InputError, match=r"^keys gravity.arm, angle_torques.arm: have the same name; rename one"):
        lm.TrainScenario(**TRAIN | torques)


def test_a_name_that_no_variable_can_have_is_refused() -> None:
    with pytest.raises(lm.InputError, match='key shafts: must not have the name "my shaft"; a name is made of'):
        lm.TrainScenario(**TRAIN | {"shafts": TRAIN["shafts"] | {"my shaft": {"inertia": 1}}})


def test_records_of_the_catalogue_fit_at_any_place(file: Path) -> None:
    text = file.read_text() + '\n[gears.last]\ninput = "table"\noutput = "arm"\ngearbox = "schaeffler-rt1-h-20-100"\n'
    text += (
        'loss_factor = 1.5\n[shafts.arm]\ninertia = 1\n[motors.servo]\nshaft = "table"\nfrom = "maxon-ec-i-52-606793"\n'
    )
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
    changed.write_text(
        'base = "train.toml"\n[gears.belt]\nratio = 3\n[gears.worm]\ngearbox = "schaeffler-rt1-h-20-100"\n'
    )
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
    text = file.read_text().replace(
        '[shafts.table.torque]\nmean = "20 N*m"', '[shafts.table.torque.samples]\nfile = "torque.csv"'
    )
    file.write_text(text)
    samples = lm.load(file).shafts["table"].torque.samples
    assert samples.times == pytest.approx((0.0, 0.1))
    assert samples.values == pytest.approx((0.0, 0.5))


def test_the_schema_knows_every_table() -> None:
    assert set(lm.TrainScenario.model_fields) < set(train_schema()["properties"])


def test_the_schema_of_files_holds_both_forms() -> None:
    schema = file_schema()
    assert [form["title"] for form in schema["anyOf"]] == ["Scenario", "TrainScenario"]
    named = set(re.findall(r'"#/\$defs/([^"]*)"', json.dumps(schema)))
    assert named <= set(schema["$defs"])
    assert {"Motor", "train_ShaftMotor"} <= named


# --- elements ---


def test_a_worm_follows_from_its_drawing() -> None:
    # m = 2 mm, one thread, d = 22.4 mm: tan g = 0.0892857; mu = 0.1: tan r = 0.1
    worm = lm.WormMesh(module="2 mm", starts=1, diameter="22.4 mm", friction_coefficient=0.1)
    tan_g, tan_r = 2.0 / 22.4, 0.1
    forward = tan_g * (1.0 - tan_g * tan_r) / (tan_g + tan_r)
    backward = (tan_g - tan_r) / (1.0 + tan_g * tan_r) / tan_g
    assert worm.efficiencies() == pytest.approx((forward, backward), rel=1e-13)
    assert backward < 0.0


def test_gravity_is_a_sine_to_the_stated_error() -> None:
    arm = lm.Gravity(shaft="s", mass="2 kg", radius="300 mm", angle=0.3, error=0.01)
    torque = arm.core()
    for phi in np.linspace(-7.0, 7.0, 1000):
        assert abs(torque(float(phi)) + 2.0 * 9.80665 * 0.3 * math.sin(phi + 0.3)) <= 0.01 * (1.0 + 1e-9)


def test_a_transmission_error_shifts_the_angles_at_the_start() -> None:
    error = {"kind": "sine", "amplitude": 1e-3, "order": 3}
    scenario = train(
        **{"gears.belt.transmission_error": error, "initial.angles": {"table": 0.2}, "initial.twists": {"belt": 1e-3}}
    )
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
    with pytest.raises(lm.InputError, match="frozen"):
        scenario.shafts.clear()
    assert lm.TrainScenario.from_json(scenario.to_json()) == scenario
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
    long = in_long_form(lm.load(path))
    assert long.train() == of_it
    assert lm.TrainScenario.from_json(long.to_json()) == long


@pytest.mark.parametrize("path", TRAINS, ids=lambda p: p.stem)
def test_shipped_trains_load_and_survive_json(path: Path) -> None:
    scenario = lm.load(path)
    assert isinstance(scenario, lm.TrainScenario)
    assert lm.TrainScenario.from_json(scenario.to_json()) == scenario
    assert lm.load(path.stem) == scenario


def test_what_takes_a_drive_alone_says_so() -> None:
    with pytest.raises(
        lm.InputError, match=r"drive: .* is a drive train, and this is defined for one motor, one gearbox"
    ):
        lm.rigid_constants(train())
    with pytest.raises(
        lm.InputError, match=r"gearbox: .* the test rig measures one gear; give one, such as scenario.gears"
    ):
        lm.TestRig(train())


# --- runs ---

SHARED = {
    "command": "motor_command",
    "load_torque": "load_load_torque",
    "motor_torque": "motor_torque",
    "motor_speed": "motor_speed",
    "load_speed": "load_speed",
    "load_angle": "load_angle",
    "twist": "gearbox_twist",
    "output_torque": "gearbox_output_torque",
    "input_contact": "motor_contact",
    "twist_contact": "gearbox_twist_contact",
    "load_contact": "load_contact",
}


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda p: p.stem)
def test_the_short_and_the_long_form_give_the_same_bits(path: Path) -> None:
    short = lm.load(path)
    a, b = lm.simulate(short), lm.simulate(in_long_form(short))
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
    result = lm.simulate(scenario)
    ledger = lm.energy_of(result)
    assert abs(ledger["residual"]) <= 1e-9 * ledger["turned_over"]
    for name in result:
        assert result[name].attrs["units"]
        assert result[name].attrs["long_name"]
    for shaft in scenario.shafts:
        assert {f"{shaft}_speed", f"{shaft}_angle"} <= set(result)
    for name, gear in scenario.gears.items():
        twist = result[f"{gear.input}_angle"] / gear.ratio - result[f"{gear.output}_angle"]
        size = float(abs(result[f"{gear.output}_angle"]).max()) + 1e-3
        assert np.allclose(twist, result[f"{name}_twist"], atol=1e-9 * size)


@pytest.mark.parametrize("ending", [".nc", ".csv", ".parquet"])
def test_a_saved_result_of_a_train_is_read_back_and_run_again(tmp_path: Path, ending: str) -> None:
    result = lm.simulate(train())
    path = tmp_path / f"run{ending}"
    lm.save(result, path)
    back = lm.open_result(path)
    assert back.identical(result)
    assert lm.switchings_of(back).identical(lm.switchings_of(result))
    assert lm.scenario_of(back) == train()
    assert lm.simulate(lm.load(path)).identical(result)
    halved = lm.load(path, ["gears.belt.ratio=1"])
    assert halved.gears["belt"].ratio == 1.0


def two_shafts(**tables: Any) -> lm.TrainScenario:
    """Two shafts, a torque source on the first, and these tables."""
    base: dict[str, Any] = {
        "shafts": {"a": {"inertia": 1e-3}, "b": {"inertia": 2e-3, "torque": 0.0}},
        "motors": {"m": {"shaft": "a", "kind": "torque_source", "rotor_inertia": 1e-4}},
        "command": {"m": {"mean": 0.3, "amplitude": 1.0, "frequency": 2.0}},
        "simulation": {"duration": 0.6, "sample_interval": 1e-3},
    }
    return lm.TrainScenario(**base | {name: {**base.get(name, {}), **table} for name, table in tables.items()})


SOFT = {"input": "a", "output": "b", "ratio": 2.0, "stiffness": {"kind": "linear", "stiffness": 50.0}}
STIFF = {"input": "a", "output": "b", "ratio": 2.0}
STRIBECK = {"friction_torque": 0.1, "breakaway_torque": 0.2, "stribeck_speed": 1.0, "friction_error": 0.002}
FAN = {"kind": "quadratic", "coefficient": 1e-5, "max_speed": 300.0, "error": 0.005}
GAP = {"kind": "curve", "backlash": 0.1, "slopes": [100.0]}
PIVOT = {"kind": "linear", "stiffness": 5.0}
STOPS = {"kind": "curve", "backlash": 0.4, "slopes": [20.0, 80.0], "breaks": [0.05]}
ERROR = {"kind": "sine", "amplitude": 1e-3, "order": 5, "error": 1e-5}
ELEMENTS = {
    "brake": two_shafts(
        gears={"g": SOFT},
        brakes={"k": {"shaft": "b", "torque": 3.0}},
        command={"k": {"steps": [{"height": 1.0, "time": 0.2}, {"height": -1.0, "time": 0.4}]}},
    ),
    "clutch": two_shafts(
        clutches={"c": {"input": "a", "output": "b", "torque": 0.6}},
        command={"c": {"ramps": [{"rise": 1.0, "duration": 0.3, "begin": 0.1}]}},
    ),
    "safety clutch": two_shafts(clutches={"c": {"kind": "safety", "input": "a", "output": "b", "torque": 0.6}}),
    "freewheel": two_shafts(freewheels={"f": {"input": "a", "output": "b"}}),
    "gravity": two_shafts(gears={"g": SOFT}, gravity={"arm": {"shaft": "b", "mass": 0.5, "radius": 0.2}}),
    "cogging": two_shafts(
        gears={"g": STIFF},
        angle_torques={"cog": {"kind": "sine", "shaft": "a", "amplitude": 0.02, "order": 12, "error": 0.001}},
    ),
    "spring": two_shafts(gears={"g": SOFT}, springs={"pivot": {"shaft": "b", "stiffness": PIVOT, "rest_angle": 0.3}}),
    "end stops": two_shafts(gears={"g": SOFT}, springs={"stops": {"shaft": "b", "stiffness": STOPS}}),
    "transmission error": two_shafts(gears={"g": SOFT | {"mesh_damping": 0.01, "transmission_error": ERROR}}),
    "housing": two_shafts(
        gears={
            "g": SOFT | {"housing": "h", "stiffness": GAP, "mesh_damping": 0.01},
            "support": SOFT | {"input": "h", "output": "b", "ratio": 1.5},
        },
        shafts={"h": {"inertia": 4e-3, "friction_torque": 0.02}},
    ),
    "planetary gear": two_shafts(
        gears={"g": STIFF | {"ratio": 4.0, "housing": "ring"}},
        shafts={"ring": {"inertia": 4e-3, "friction_torque": 0.1}},
    ),
    "friction over speed": two_shafts(gears={"g": SOFT}, shafts={"b": {"inertia": 2e-3, "torque": 0.0, **STRIBECK}}),
    "drag": two_shafts(gears={"g": STIFF}, shafts={"b": {"inertia": 2e-3, "torque": 0.0, "drag": FAN}}),
    "damped play": two_shafts(gears={"g": SOFT | {"stiffness": GAP, "mesh_damping": 0.2}}),
    "torque limit": two_shafts(
        gears={"g": STIFF},
        motors={"m": {"shaft": "a", "kind": "torque_source", "rotor_inertia": 1e-4, "torque_limit": 0.5}},
    ),
    "worm and brake": train(),
}


def chords(scenario: lm.TrainScenario) -> float:
    """By how much chords in place of sines move a speed [rad/s] at most: their error over the smallest inertia."""
    smooth: dict[str, Any] = {**scenario.gravity, **scenario.angle_torques}
    if not smooth:
        return 0.0
    error = sum(element.error or 1e-3 * 9.80665 * element.mass * element.radius for element in smooth.values())
    return error * scenario.simulation.duration / min(shaft.inertia for shaft in scenario.shafts.values())


@pytest.mark.parametrize("scenario", ELEMENTS.values(), ids=ELEMENTS)
def test_both_solvers_agree_on_every_element(scenario: lm.TrainScenario) -> None:
    """The adaptive solver takes sines as they are, the exact one by chords."""
    exact = lm.simulate(scenario)
    coarse, fine = (
        lm.simulate(scenario, solver="dormand-prince", relative_tolerance=tolerance) for tolerance in (1e-8, 1e-10)
    )
    for name in exact:
        if str(name).endswith(("_speed", "_angle", "_twist")):
            size = float(abs(exact[name]).max()) or 1.0
            open_by = float(abs(coarse[name] - fine[name]).max()) / size  # what the tolerance leaves open
            sines = chords(scenario) * (1.0 if str(name).endswith("_speed") else scenario.simulation.duration)
            assert float(abs(exact[name] - fine[name]).max()) <= (2.0 * open_by + 1e-9) * size + sines, name
    ledger = lm.energy_of(exact)
    assert abs(ledger["residual"]) <= 1e-9 * ledger["turned_over"]


def test_a_pendulum_swings_with_its_period() -> None:
    small = 0.02  # rad; the period of a pendulum is longer by small^2/16
    scenario = lm.TrainScenario(
        shafts={"arm": {"inertia": 2.0 * 0.3**2}},
        gravity={"mass": {"shaft": "arm", "mass": 2.0, "radius": 0.3, "error": 1e-7}},
        initial={"angles": {"arm": small}},
        simulation={"duration": 3.0, "sample_interval": 1e-3},
    )
    result = lm.simulate(scenario)
    expected = small * np.cos(math.sqrt(9.80665 / 0.3) * result["time"].values)
    phase = math.sqrt(9.80665 / 0.3) * 3.0  # by a small^2/16th of which it lags at the end
    assert float(abs(result["arm_angle"] - expected).max()) < 1.5 * small * phase * small**2 / 16.0


@pytest.mark.parametrize(
    ("elements", "where"),
    [
        (
            {"angle_torques": {"cog": {"kind": "sine", "shaft": "a", "amplitude": 1.0, "error": 1e-9}}},
            "angle_torques.cog:",
        ),
        (
            {"gears": {"g": SOFT | {"transmission_error": ERROR | {"error": 1e-12}}}},
            "gears.g: with its transmission error",
        ),
        ({"shafts": {"b": {"inertia": 2e-3, "drag": FAN | {"error": 1e-12}}}}, "shafts.b: with its drag"),
    ],
)
def test_errors_that_ask_for_too_many_lines_are_refused(elements: dict[str, Any], where: str) -> None:
    with pytest.raises(lm.InputError, match=rf"key {where} would take \d+ straight lines; at most 30000 are possible"):
        two_shafts(**({"gears": {"g": SOFT}} | elements)).train()


def test_a_loss_map_too_fine_to_count_is_refused() -> None:
    n = 140
    fine = {"kind": "map", "speeds": [float(k) for k in range(n)], "loads": [k - 0.5 * n for k in range(n)]}
    losses = fine | {"values": [[0.1] * n] * n}
    rated = {"rated_input_speed": 100.0, "rated_output_torque": 10.0}
    with pytest.raises(lm.InputError, match=r"key gears.g: has a loss map of some \d+ triangles; at most 30000 are"):
        two_shafts(gears={"g": SOFT | rated | {"losses": losses}}).train()


def test_a_spring_balances_an_arm() -> None:
    # An arm that gravity would turn at m g r = 6 N m, held level by a spring of 10 N m/rad that is wound up by 0.6 rad:
    # there it stands, and swings about it with sqrt(k/J).
    mgr, k, J, small = 6.0, 10.0, 0.2, 1e-3
    scenario = lm.TrainScenario(
        shafts={"arm": {"inertia": J}},
        gravity={"weight": {"shaft": "arm", "mass": mgr / 9.80665, "radius": 1.0, "angle": math.pi / 2, "error": 1e-7}},
        springs={
            "balance": {"shaft": "arm", "stiffness": {"kind": "linear", "stiffness": k}, "rest_angle": mgr / k},
        },
        initial={"angles": {"arm": small}},
        simulation={"duration": 2.0, "sample_interval": 1e-3},
    )
    result = lm.simulate(scenario)
    expected = small * np.cos(math.sqrt(k / J) * result["time"].values)
    # What the cosine of gravity leaves: m g r phi^2/2 and the chords, over J, for the two seconds.
    assert float(abs(result["arm_angle"] - expected).max()) < (mgr * small**2 / 2 + 1e-7) / J * 2.0**2 / 2
    assert "balance: spring" in lm.energy_of(result)


def test_friction_that_jams_ends_in_one_line() -> None:
    worm = {"losses": {"kind": "mesh_efficiency", "drive_efficiency": 0.5, "backdrive_efficiency": -0.2}}
    scenario = lm.TrainScenario(
        shafts={"worm": {"inertia": 1e-4}, "drum": {"inertia": 2.0, "torque": 20.0}},
        gears={"g": {"input": "worm", "output": "drum", "ratio": 50.0, **worm}},
        initial={"speeds": {"worm": -100.0, "drum": -2.0}},
        simulation={"duration": 0.1, "sample_interval": 1e-3},
    )
    with pytest.raises(lm.SolverError, match="the friction jams"):
        lm.simulate(scenario)


def test_a_self_locking_worm_holds_lowers_smoothly_or_chatters() -> None:
    """Efficiencies of its drawing: eta_b = tan(g - r)/tan g with g = 4 deg, tan r = 0.084; i = 50, load 20 N m."""
    tan_g = math.tan(math.radians(4.0))
    eta_b = (tan_g - 0.084) / (1.0 + 0.084 * tan_g) / tan_g
    smooth = lm.simulate(lm.load("worm-lowering", {"shafts.drum.inertia": 0.5}))
    held = smooth.sel(time=slice(0.0, 0.099))
    assert float(abs(held["drum_speed"]).max()) < 1e-12  # the motor is off
    # What the motor has left turns the worm against 1e-3 N m s/rad of oil.
    speed = (0.15 - 0.01 - 20.0 * abs(eta_b) / 50.0) / 1e-3
    assert float(smooth["worm_speed"].sel(time=1.19, method="nearest")) == pytest.approx(-speed, rel=1e-5)
    assert not np.any(smooth["worm_contact"].sel(time=slice(0.11, 1.19)) == 0)
    # The paradox of rigid friction, |eta_b| J_2 > J_1 i^2, is chatter of the compliant mesh: the worm locks while the motor pushes.
    assert abs(eta_b) * 2.0 > 1e-4 * 50.0**2 > abs(eta_b) * 0.5
    chatter = lm.simulate(lm.load("worm-lowering"))
    locked = chatter["worm_contact"].sel(time=slice(0.11, 1.19)).values == 0
    assert np.count_nonzero(np.diff(locked.astype(int)) == 1) >= 2


def test_a_bias_above_half_the_torque_of_the_ring_keeps_the_backlash_closed() -> None:
    biased = lm.simulate(lm.load("two-motors-one-ring"))
    settled = biased.sel(time=slice(1.0, None))  # the flanks have met
    gap = 0.5 * 4.0 * math.pi / 10800.0
    assert np.all(settled["first_gear_twist"] > gap)
    assert np.all(settled["second_gear_twist"] < -gap)
    changes = {f"command.{name}_motor.mean": 0.0 for name in ("first", "second")}
    loose = lm.simulate(lm.load("two-motors-one-ring", changes)).sel(time=slice(1.0, None))
    for name in ("first", "second"):
        assert float(loose[f"{name}_gear_twist"].min()) < -gap
        assert float(loose[f"{name}_gear_twist"].max()) > gap


def braked(command: Any, **delays: float) -> lm.TrainScenario:
    """A flywheel of 2 kg·m² at 10 rad/s and a brake of 4 N·m."""
    return lm.TrainScenario(
        shafts={"wheel": {"inertia": 2.0, "torque": 0.0}},
        brakes={"b": {"shaft": "wheel", "torque": 4.0, **delays}},
        command={"b": command},
        initial={"speeds": {"wheel": 10.0}},
        simulation={"duration": 2.0, "sample_interval": 0.001},
    )


def test_a_brake_acts_after_its_delays() -> None:
    command = {"steps": [{"height": 1, "time": 0.5}, {"height": -1, "time": 1.0}]}
    speed = lm.simulate(braked(command, engagement_delay=0.03, release_delay=0.1)).wheel_speed
    # 2 rad/s^2 from 0.53 s to 1.1 s
    assert float(speed.sel(time=0.53, method="nearest")) == 10.0
    assert float(speed[-1]) == pytest.approx(10.0 - 2.0 * (1.1 - 0.53), abs=1e-12)
    assert float(speed.sel(time=0.8, method="nearest")) == pytest.approx(10.0 - 2.0 * 0.27, abs=1e-12)


@pytest.mark.parametrize(
    ("command", "delays", "message"),
    [
        (
            {"ramps": [{"rise": 1, "duration": 0.1}]},
            {"engagement_delay": 0.03},
            "key command.b: is not made of steps; with an engagement or release delay, give mean and steps alone",
        ),
        (
            {"steps": [{"height": 1, "time": 0.5}, {"height": -1, "time": 0.51}]},
            {"engagement_delay": 0.03},
            "key command.b: steps at 0.5 s and at 0.51 s, which after the delays would act in reverse order; leave more time "
            "between them",
        ),
    ],
)
def test_a_command_that_delays_cannot_shift_is_refused(command: Any, delays: dict[str, float], message: str) -> None:
    with pytest.raises(lm.InputError) as refused:
        braked(command, **delays)
    assert message in str(refused.value)


@pytest.mark.parametrize(
    ("command", "reached"),
    [
        (8.0, "8"),
        ({"steps": [{"height": 1}, {"height": 1, "time": 0.5}]}, "2"),
        ({"mean": 0.2, "ramps": [{"rise": 1, "duration": 0.1}]}, "1.2"),
        ({"mean": 0.5, "amplitude": 0.6, "frequency": 1}, "1.1"),
        ({"samples": {"times": [0, 0.1, 0.2], "values": [0, 1.5, 0]}}, "1.5"),
    ],
)
def test_a_brake_is_commanded_up_to_its_full_torque(command: Any, reached: str) -> None:
    """Such as a torque of 8 N·m in the place of a share."""
    with pytest.raises(lm.InputError) as refused:
        braked(command)
    message = f"key command.b: may reach {reached}; it is a share, and 1 is the full torque, 4 N*m"
    assert message in str(refused.value)


def test_a_brake_may_swing_from_open_to_full_torque() -> None:
    tenths = {"steps": [{"height": 0.1, "time": 0.1 * k} for k in range(10)]}  # their sum is 1 up to rounding
    for command in ({"mean": 0.5, "amplitude": 0.5, "frequency": 1}, tenths):
        assert float(lm.simulate(braked(command)).wheel_speed[-1]) < 10.0
    simulation = lm.Simulation(braked(1.0))
    with pytest.raises(lm.InputError, match=r"b_command 2\.0 is a share, and 1 is the full torque"):
        simulation.advance(0.1, b_command=2.0)
    simulation.advance(0.1, b_command=(1.0, 0.0))


def test_a_safety_clutch_has_no_delays() -> None:
    clutch = {"kind": "safety", "input": "a", "output": "b", "torque": 1.0, "release_delay": 0.1}
    with pytest.raises(lm.InputError, match="is a safety clutch, which has no command; remove engagement_delay"):
        lm.DriveTrain(
            shafts={"a": {"inertia": 1.0}, "b": {"inertia": 1.0}},
            motors={
                "m": {
                    "shaft": "a",
                    "kind": "torque_source",
                    "rotor_inertia": 0.1,
                    "rated_speed": 100.0,
                    "rated_torque": 1.0,
                }
            },
            clutches={"c": clutch},
        )


@pytest.mark.parametrize("stiffness", [1e40, 1e60, 1e100, 1e200, 1e300])
def test_a_stiffness_without_measure_ends_in_one_line(stiffness: float) -> None:
    spring = {"kind": "linear", "stiffness": stiffness}
    to_frame = two_shafts(gears={"g": STIFF}, springs={"s": {"shaft": "b", "stiffness": spring}})
    between = two_shafts(gears={"g": SOFT | {"stiffness": spring}})
    for scenario in (to_frame, between):
        with pytest.raises(lm.SolverError, match="left the range that can be computed at t = 0"):
            lm.simulate(scenario)
