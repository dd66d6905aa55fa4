"""The short form with a given motion of the load and with flanks that strike: the results of the long form, to the last bit."""

import math
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

import lostmotion as lm
from lostmotion.simulation.forms.axis_form import file_schema
from lostmotion.simulation.forms.key_aliases import DRIVE
from refusals import file_of, refusals_of, refused
from tables import rated_gearbox, run_of, torque_source

MOVES = {"moves": [{"to": "90 deg"}], "speed": "3 rad/s", "acceleration": "20 rad/s^2", "jerk": "800 rad/s^3"}
FLANKS = {"kind": "rigid", "backlash": "2 mrad", "restitution": 0.4}
SHORT: dict[str, Any] = {
    "motor": torque_source(1e-4, rated_torque=1.0),
    "gearbox": rated_gearbox(10.0, "3000 rpm", 8.0, {"kind": "curve", "backlash": "2 mrad", "slopes": [2000.0]}, 1.0),
    "load": {"inertia": 0.02, "friction_torque": 0.1, "torque": {"mean": 0.5}},
    "command": {"amplitude": 0.5, "frequency": 3.0},
    "simulation": run_of(1.0, 2e-3),
}


def short(load: dict[str, Any] | None = None, **gearbox: Any) -> dict[str, Any]:
    return SHORT | {"load": SHORT["load"] | (load or {}), "gearbox": SHORT["gearbox"] | gearbox}


def long(load: dict[str, Any] | None = None, **gear: Any) -> lm.Scenario:
    rated = {key: value for key, value in SHORT["gearbox"].items() if key != "stiffness"}
    return lm.Scenario(
        shafts={"motor": {}, "load": SHORT["load"] | (load or {})},
        motors={"motor": {"shaft": "motor", **SHORT["motor"]}},
        gears={"gearbox": {"input": "motor", "output": "load", **rated, "stiffness": SHORT["gearbox"]["stiffness"], **gear}},
        command={"motor": SHORT["command"]},
        simulation=SHORT["simulation"],
    )  # fmt: skip


@pytest.mark.parametrize(("load", "gearbox"), [
    ({"speed": {"amplitude": "20 rpm", "frequency": 2.0}}, {}),
    ({"motion": MOVES}, {}),
    ({"motion": MOVES}, {"stiffness": {"kind": "rigid"}}),
    ({}, {"stiffness": FLANKS}),
], ids=["speed", "moves", "moves of a rigid gear", "flanks"])  # fmt: skip
def test_the_short_form_has_the_bits_of_the_long_form(load: dict[str, Any], gearbox: dict[str, Any]) -> None:
    tables = short(load, **gearbox)
    jsonschema.validate(tables, file_schema())
    one, other = lm.simulate(lm.Scenario.model_validate(tables)), lm.simulate(long(load, **gearbox))
    assert list(one) == list(other)
    for name in one:
        assert one[name].values.tobytes() == other[name].values.tobytes(), name
    assert lm.energy_of(one) == lm.energy_of(other)
    assert lm.switchings_of(one).sizes["switching"] > 2


@pytest.mark.parametrize("wider", [
    {"stiffness": FLANKS},
    {"stiffness": {"kind": "rigid"}, "load": {"end_stops": {"lower": "-20 deg", "upper": "20 deg", "restitution": 0.4}}},
    {"load": {"motion": MOVES}},
], ids=["flanks", "end stops", "moves"])  # fmt: skip
def test_replace_takes_the_keys_of_the_file_for_what_only_drive_trains_have(wider: dict[str, Any], tmp_path: Path) -> None:
    """As written into the file; twice, by the long form, and named so where a value cannot be used."""
    tables = short(**wider)
    scenario, changes = (
        lm.Scenario(**tables),
        {"load.torque": 0.3, "gearbox.ratio": 5.0, "command.amplitude": 0.2, "motor.rotor_inertia": 2e-4},
    )
    written = tables | {"load": tables["load"] | {"torque": {"mean": 0.3}}, "gearbox": tables["gearbox"] | {"ratio": 5.0}}
    written |= {"command": SHORT["command"] | {"amplitude": 0.2}, "motor": SHORT["motor"] | {"rotor_inertia": 2e-4}}
    once = scenario.replace(**changes)
    assert once == lm.Scenario(**written)
    assert once.replace(**{"load.torque": 0.5}) == scenario.replace(**{**changes, "shafts.load.torque": 0.5})
    refused(lambda: once.replace(**{"gearbox.ratio": 0.0}), "gearbox.ratio")


def test_the_drive_torque_of_a_given_load_by_hand() -> None:
    """Rigid: (J + i^2 J_m) a + friction + load torque - i M while it turns forward."""
    result = lm.simulate(lm.Scenario.model_validate(short({"motion": MOVES}, stiffness={"kind": "rigid"})))
    moving = result["load_speed"].values > 1e-6
    t = result["time"].values[moving]
    expected = (0.02 + 1e-2) * result["load_acceleration"].values[moving] + 0.1 + 0.5
    expected -= 10.0 * 0.5 * np.sin(6.0 * math.pi * t)
    assert np.abs(result["load_drive_torque"].values[moving] - expected).max() < 1e-12
    assert float(result["load_angle"][-1]) == pytest.approx(0.5 * math.pi, rel=1e-13)


test_bad_input_is_refused_with_the_keys_of_the_short_form = refusals_of(
    lm.Scenario.model_validate,
    (short({"speed": 1.0, "motion": MOVES}), "load.speed, load.motion: both give the motion"),
    (short({"speed": "1 m/s"}), "load.speed.mean"),
    (short({"motion": {"moves": [{"to": "1 m"}], "speed": 1.0, "acceleration": 1.0}}), "load.motion.moves[0].to"),
    (short({"speed": 1.0}) | {"initial": {"load_speed": 1.0}}, "load.speed, initial.load_speed: both say"),
    (short({"motion": MOVES}, stiffness=FLANKS), "gearbox: has rigid flanks, and the motion of shaft 'load' is given"),
    (short(stiffness={"kind": "rigid", "backlash": "2 mrad"}), "gearbox.stiffness: has rigid flanks with backlash"),
    (short({"sped": 1.0}, stiffness=FLANKS), "load.sped"),
)  # fmt: skip


def test_a_rigid_gear_without_backlash_stays_in_the_short_form() -> None:
    """Also with the values that are left out, as a scenario's own tables have them."""
    scenario = lm.Scenario.model_validate(short(stiffness={"kind": "rigid"}))
    assert scenario.form == DRIVE
    assert lm.Scenario.model_validate(scenario.model_dump()) == scenario


def test_the_constructor_reads_what_files_have() -> None:
    moved = lm.Scenario(**short({"speed": 1.0}))
    assert moved.given() == ["load"]
    assert moved.train() == long().train()
    flanks = lm.Scenario(**short(stiffness=FLANKS))
    assert list(flanks.gears) == ["gearbox"]
    assert flanks.form != DRIVE


AXIS = """
[axis.motor]
kind = "torque_source"
rotor_inertia = "1 kg cm^2"
rated_torque = "1 N m"
[axis.rack]
travel_per_turn = "100 mm"
backlash = "0.5 mm"
RIGID
[axis.slide]
mass = "20 kg"
friction_force = "10 N"
MOVED
[command]
amplitude = 0.4
frequency = 3.0
[simulation]
duration = "0.8 s"
sample_interval = "1 ms"
"""


def test_flanks_of_a_rack_strike_as_those_of_the_gear_of_its_ratio(tmp_path: Path) -> None:
    path = tmp_path / "axis.toml"
    path.write_text(AXIS.replace("RIGID", "restitution = 0.5").replace("MOVED", ""))
    result = lm.simulate(lm.load(path))
    gear = lm.Scenario(
        shafts={"motor": {}, "slide": {"inertia": 20.0, "friction_torque": 10.0}},
        motors={"motor": {"shaft": "motor", "kind": "torque_source", "rotor_inertia": 1e-4, "rated_torque": 1.0}},
        gears={"rack": {"input": "motor", "output": "slide", "ratio": 2.0 * math.pi / 0.1,
                        "stiffness": {"kind": "rigid", "backlash": 5e-4, "restitution": 0.5}}},
        command={"motor": {"amplitude": 0.4, "frequency": 3.0}},
        simulation={"duration": 0.8, "sample_interval": 1e-3},
    )  # fmt: skip
    other = lm.simulate(gear)
    assert result["slide_speed"].values.tobytes() == other["slide_speed"].values.tobytes()
    assert result["rack_deflection"].values.tobytes() == other["rack_twist"].values.tobytes()
    assert lm.energy_of(result)["rack: impacts"] == lm.energy_of(other)["rack: impacts"] > 0.0


def test_a_slide_of_an_axis_moves_as_it_is_given(tmp_path: Path) -> None:
    """On the flank the screw turns with it: F = (m + J (2 pi/s)^2) a + friction while it goes forward."""
    path = tmp_path / "axis.toml"
    moved = 'motion = { moves = [{ to = "100 mm" }], speed = "300 mm/s", acceleration = "3 m/s^2", jerk = "100 m/s^3" }'
    rigid = AXIS.replace("RIGID", "").replace('backlash = "0.5 mm"', "").replace("amplitude = 0.4", "amplitude = 0.0")
    path.write_text(rigid.replace("MOVED", moved))
    result = lm.simulate(lm.load(path))
    moving = result["slide_speed"].values > 1e-9
    expected = (20.0 + 1e-4 * (2.0 * math.pi / 0.1) ** 2) * result["slide_acceleration"].values[moving] + 10.0
    assert np.abs(result["slide_drive_force"].values[moving] - expected).max() < 1e-10
    assert result["slide_drive_force"].attrs["units"] == "N"


test_what_flanks_of_a_rack_need_is_said = refusals_of(
    lambda keys, *, tmp_path: lm.load(file_of(tmp_path / "axis.toml", AXIS.replace("RIGID", keys).replace("MOVED", ""))),
    ("", 'axis.rack: has backlash but is rigid; give it a stiffness, such as "200 N/um", or the restitution of its flanks, 0 to 1'),
    ('restitution = 0.5\nstiffness = "100 N/um"', "axis.rack: has a restitution and a stiffness"),
    ("restitution = 1.5", "axis.rack.restitution"),
)  # fmt: skip
