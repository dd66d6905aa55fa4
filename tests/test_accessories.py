"""Actuators, holding brakes and amplifiers of the catalogue, in tasks and in the drive check: against arithmetic by hand."""

import math
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

import lostmotion as lm
from lostmotion.model.angle_torques import STANDARD_GRAVITY as G
from lostmotion.model.process_loads import Amplifier
from lostmotion.reports.catalogue_text import list_records, record_text, template
from lostmotion.simulation.forms.drive_tables import drive_schema
from lostmotion.sizing.supply import amplifier_rules, longest_above
from lostmotion.studies.runs.candidate_rows import Axes
from lostmotion.studies.selection.nearest_misses import not_judged
from lostmotion.studies.selection.ranking import RankedCandidate
from lostmotion.studies.selection.task_file import task_of
from lostmotion.studies.study.study_definition import Study
from refusals import refusals_of, refused

ARM: dict[str, Any] = {
    "task": {"cycle": "2 s", "gravity": {"mass": 2.0, "radius": 0.2}, "hold_without_power": False},
    "load": {"inertia": 0.08, "friction_torque": 0.1},
    "controller": {
        "encoder": {"bits": 16},
        "current": {"kind": "first_order", "time_constant": "0.5 ms"},
        "reference": {"kind": "position", "speed": 4.0, "acceleration": 30.0, "moves": [{"to": 1.0, "dwell": 0.3}, {"to": 0.0}]},
    },
    "candidates": {"actuator": ["myactuator-rmd-x8v2"]},
}  # fmt: skip
JOINT = {
    "gearbox": {"from": "bonfiglioli-lc070p-2-20"},
    "motor": {"from": "yaskawa-sgm7a-15a"},
    "candidates": {"motor": ["yaskawa-sgm7a-15a", "yaskawa-sgmsh-10aa"]},
}


def rules(study: Study, row: int = 0) -> dict[str, Any]:
    found = Axes(study).judged(study.parameters(row, row + 1)[0])
    assert not isinstance(found, lm.InputError), str(found)
    return {f.rule: f for f in found}


def task(**changes: Any) -> dict[str, Any]:
    return {**ARM, "task": ARM["task"] | changes}


# --- actuators ---
def test_an_actuator_is_judged_at_its_output():
    """RMD-X8V2: 9 : 1, 9 N m, 215 rpm, 2.6 kg cm2. The efficiency of a planetary stage, 0.97, is on both sides."""
    found = rules(task_of(ARM))
    # Largest: accelerating away from hanging, or braking at the end, 1 rad up: the second.
    rise = 2.0 * G * 0.2 * np.sin(np.linspace(0.0, 4.0**2 / 60.0, 1000))
    starts = 0.08 * 30.0 + rise.max() + 0.1
    back = 2.0 * G * 0.2 * math.sin(1.0) - 0.08 * 30.0 - 0.1
    peak = max(starts, abs(back))
    assert found["max_motor_speed"].use == pytest.approx(4.0 * 60.0 / (2.0 * math.pi) / 215.0, rel=1e-9)
    motor = task_of(ARM).part("motor", np.array([0.0]))
    assert motor.rated_torque == pytest.approx(9.0 / (9.0 * 0.97))
    assert motor.rotor_inertia == pytest.approx(2.6e-4)
    gearbox = task_of(ARM).part("gearbox", np.array([0.0]))
    assert 1.0 + gearbox.losses.core()(1.0, 1.0) == pytest.approx(1.0 / 0.97, rel=1e-9)
    assert np.abs(Axes(task_of(ARM)).motion(np.zeros(1)).torque).max() == pytest.approx(peak, rel=1e-4)
    assert found["inertia_ratio"].use == pytest.approx(0.08 / (81.0 * 2.6e-4) / 10.0, rel=1e-9)
    study = task_of({**ARM, "actuator": {"efficiency": 0.8, "rotor_inertia": "1e-4 kg m^2"}})  # printed, and a value beside
    assert study.part("gearbox", np.array([0.0])).loss_range is None
    motor = study.part("motor", np.array([0.0]))
    assert (motor.rated_torque, motor.rotor_inertia) == pytest.approx((9.0 / (9.0 * 0.8), 1e-4))


def test_actuators_stand_beside_pairs_and_run():
    study = task_of({**ARM, "gearbox": JOINT["gearbox"], "candidates": {"motor": ["yaskawa-sgmah-04a"], "actuator": ["myactuator-rmd-x8v2", "myactuator-rmd-x4-3"]}})  # fmt: skip
    assert study.total == 3
    pairs = lm.select(study)
    names = [str(a) or str(m) for a, m in zip(pairs["actuator"].values, pairs["motor"].values, strict=True)]
    assert sorted(names) == ["myactuator-rmd-x4-3", "myactuator-rmd-x8v2", "yaskawa-sgmah-04a"]
    own = pairs.isel(pair=names.index("myactuator-rmd-x8v2"))
    assert bool(own["fits"]), str(own["why"].values)
    assert "holds" in str(own["estimated losses"].values)
    assert "rotor_inertia" in str(pairs["why"].values[names.index("myactuator-rmd-x4-3")])
    assert 0.0 < float(own["motor_torque_rms"]) < 9.0 / (9.0 * 0.97)


def test_other_threads_may_add_parts_while_the_range_of_losses_is_judged():
    """As where several pairs are judged at once: the parts that are kept grow while they are read."""

    class Growing(dict[Any, Any]):
        def items(self) -> Any:
            for pair in super().items():
                self[("other", len(self))] = None
                yield pair

    study = task_of(ARM)
    axes, row = Axes(study), study.parameters(0, 1)[0]
    axes.judged(row)
    study._kept = Growing(study._kept)
    with pytest.raises(RuntimeError):
        list(study.kept.items())
    assert "holds" in axes.verdict_at_ends(row, ())


# --- brakes ---
def test_the_brake_of_the_motor():
    """SGM7A-15A: 7.84 N m, 2.5e-5 kg m2; the SGMSH-10AA has none in the catalogue."""
    study = task_of({**task(brake="of the motor"), **JOINT})
    assert study.part("motor", np.array([0.0])).rotor_inertia == pytest.approx(2.0e-4 + 2.5e-5)
    held = 2.0 * G * 0.2 * math.sin(1.0) / 20.0
    assert 7.84 * rules(study)["holding_brake"].use == pytest.approx(held, rel=1e-9)
    refused(lambda: Axes(study).judged(study.parameters(1, 2)[0]), match='"yaskawa-sgmsh-10aa": the catalogue has no brake of this motor')


@pytest.mark.parametrize("brake", ["yaskawa-sgmah-02-brake", {"from": "yaskawa-sgmah-02-brake", "torque": "0.1 N m"}])
def test_a_brake_by_name(brake: Any):
    study = task_of({**task(brake=brake), **JOINT})
    torque = 1.5 if isinstance(brake, str) else 0.1
    assert torque * rules(study, 1)["holding_brake"].use == pytest.approx(2.0 * G * 0.2 * math.sin(1.0) / 20.0, rel=1e-9)
    assert study.part("motor", np.array([1.0])).rotor_inertia == pytest.approx(1.74e-4 + 5.8e-6)
    schema = drive_schema()  # for editors
    table = {"properties": {"task": schema["properties"]["task"]}, "$defs": schema["$defs"]}
    for of_task, valid in ((brake, True), ("of the motor", True), ({"torque": 1.0}, True), (3, False)):
        assert jsonschema.Draft202012Validator(table).is_valid({"task": {"brake": of_task}}) == valid


def test_the_drive_check_judges_a_brake_and_an_amplifier():
    plain = lm.load("catalogue-robot-joint")
    brake = {"torque": "0.5 N m", "inertia": "1e-6 kg m^2"}
    amplifier = {"continuous_current": "2 A", "peak_current": "3 A", "peak_time": "1 s"}
    scenario = plain.replace(**{"task.brake": brake, "task.amplifier": amplifier})
    findings = {f.what: f for f in lm.check_drive(scenario)}
    loads = [abs(float(x)) for x in (lm.simulate(scenario)["load_torque"].max(), lm.simulate(scenario)["load_torque"].min())]
    brake = findings["torque that the holding brake carries"]
    assert 0.5 * brake.use == pytest.approx(max(loads) / scenario.gearbox.ratio, rel=1e-9)
    assert "not in the run" in brake.remark
    result = lm.simulate(scenario)
    current = np.abs(result["motor_torque"].values).max() / scenario.motor.limits.torque_constant
    assert 3.0 * findings["current of the amplifier, largest"].use == pytest.approx(current, rel=1e-3)
    assert {f.rule for f in lm.check_drive(plain)}.isdisjoint({"holding_brake", "amplifier_current"})


def test_the_drive_check_of_an_axis_names_the_keys_of_its_file():
    """A file with [axis] knows neither motors.motor nor screws.screw; it takes a task."""
    findings = lm.check_drive(lm.load("ball-screw-axis", {"task.amplifier": {"continuous_current": "5 A"}}))
    said = " ".join(f.remark for f in findings)
    assert "axis.motor.limits.torque_constant" in said
    assert "axis.screw.dynamic_capacity" in said
    assert "motors." not in said
    assert "screws." not in said
    assert next(f for f in findings if f.rule == "amplifier_current").verdict == "unknown"


# --- amplifiers ---
def test_the_rules_of_an_amplifier_by_hand():
    """6 A for 0.5 s over the end of the cycle, 1 A for 1.5 s: rms of sqrt((18 + 1.5)/2), above 3 A for 0.5 s."""
    time = np.array([0.0, 0.2, 0.2, 1.7, 1.7, 2.0])
    current = np.array([6.0, 6.0, 1.0, 1.0, -6.0, -6.0])
    assert longest_above(time, np.abs(current), 3.0) == pytest.approx(0.5)
    amplifier = Amplifier(continuous_current=3.0, peak_current=5.0, peak_time=1.0, max_dc_voltage=60.0)
    motor = lm.load("catalogue-robot-joint").motor
    rms, peak, longest, bus = amplifier_rules(time, current, 2.0, amplifier, 48.0, motor)
    assert rms.use == pytest.approx(math.sqrt((36.0 * 0.5 + 1.5) / 2.0) / 3.0)
    assert (peak.use, peak.verdict) == (pytest.approx(1.2), "warning")
    assert longest.use == pytest.approx(0.5)
    assert bus.use == pytest.approx(0.8)
    assert amplifier_rules(time, current, 2.0, amplifier, None, motor)[3].verdict == "unknown"
    assert amplifier_rules(time, current * math.nan, 2.0, amplifier, 48.0, motor)[0].verdict == "unknown"


def test_the_peak_current_of_the_amplifier_limits_the_loops():
    """maxon EC-i 52: 0.0649 N m/A and 3 A."""
    tables = {**task(amplifier={"continuous_current": "2 A", "peak_current": "3 A"}), **JOINT}
    tables |= {"motor": {}, "candidates": {"motor": ["maxon-ec-i-52-606793"]}}
    study = task_of(tables)
    row = study.parameters(0, 1)[0]
    motor = study.part("motor", row)
    limit = study.axis_at(row, 2).controller.speed.torque_limit
    assert limit == pytest.approx(3.0 * motor.limits.torque_constant, rel=1e-9)
    torque = Axes(study).gearbox(row)[0].motor_torque(motor)
    peak = np.abs(torque).max() / motor.limits.torque_constant
    assert rules(study)["amplifier_peak"].use == pytest.approx(peak / 3.0, rel=1e-9)
    tables = {**task(amplifier="tg-drives-tgz-s-400-7-15", supply={"max_voltage": "565 V"}), **JOINT}
    amplifier = task_of(tables).axis.amplifier
    assert (amplifier.continuous_current, amplifier.peak_current, amplifier.peak_time) == (7.0, 15.0, 5.0)
    older = task_of({**task(supply={"continuous_current": "4 A"}), **JOINT})
    assert older.axis.amplifier_of_task().continuous_current == 4.0


# --- the catalogue ---
def test_the_catalogue_lists_and_filters_them():
    records = lm.catalogue()
    of = {kind: [r for r in records if isinstance(r, sheet)] for kind, sheet in (("actuator", lm.data_sheets.ActuatorSheet), ("brake", lm.data_sheets.BrakeSheet), ("amplifier", lm.data_sheets.AmplifierSheet))}  # fmt: skip
    assert {kind: len(found) for kind, found in of.items()} == {"actuator": 31, "brake": 22, "amplifier": 37}
    names = {r.name for found in of.values() for r in found}
    assert "tg-drives-tgz-d-48-13-26" not in names  # name and table contradict each other
    assert all(b.engage_time is None for b in of["brake"] if b.manufacturer == "Beckhoff")  # two sources exchange the times
    motors = {r.name for r in records if isinstance(r, lm.data_sheets.MotorSheet)}
    assert all(set(b.motors) <= motors for b in of["brake"])
    assert sum(a.level() is not None for a in of["actuator"]) == 13
    ten = list_records("amplifier", current="8..12")
    assert "tg-drives-tgz-s-400-10-20" in ten
    assert "tg-drives-tgz-s-400-7-15" not in ten
    assert "yaskawa-sgm7a-25a-brake" in list_records("brake", torque="9..11")
    assert "myactuator-rmd-x8v2" in list_records("actuator", ratio="9", torque="9")
    assert "built into" not in record_text("myactuator-rmd-x8v2")
    assert "yaskawa-sgm7a-20a" in record_text("yaskawa-sgm7a-15a-brake")


def test_own_sheets_from_templates(tmp_path: Path):
    for kind in ("actuator", "brake", "amplifier"):
        (tmp_path / f"{kind}.toml").write_text(template(kind))
    own = task(brake=str(tmp_path / "brake.toml"), amplifier=str(tmp_path / "amplifier.toml"))
    study = task_of({**own, "candidates": {"actuator": [str(tmp_path / "actuator.toml")]}})
    assert study.axis.brake.torque == 2.0
    assert study.axis.amplifier.peak_time == 5.0
    found = rules(study)
    assert found["amplifier_current"].verdict == "unknown"  # an actuator has no current
    assert 2.0 * found["holding_brake"].use == pytest.approx(2.0 * G * 0.2 * math.sin(1.0) / 9.0, rel=1e-9)


def test_records_that_cannot_be_judged_are_grouped_by_what_they_lack():
    lacks = "the record lacks rotor_inertia, see the manufacturer"
    errors = [lm.InputError(lacks, table="actuator", record=f"'a-{k}'") for k in range(3)]
    assert str(errors[1]) == "actuator from 'a-1': the record lacks rotor_inertia, see the manufacturer"
    missing = [(error.problems[0].of_any_record(),) for error in errors]
    ranked = [RankedCandidate(k, f"a-{k}", ("data",), str(errors[k]), "", {}, missing=missing[k]) for k in range(3)]
    (group,) = not_judged(ranked)
    assert group.datum == "actuator: the record lacks rotor_inertia, see the manufacturer"
    assert len(group.candidates) == 3


test_wrong_accessories_are_refused = refusals_of(
    lambda changes: task_of({**task(**changes), **JOINT}),
    ({"brake": "yaskawa-sgm7a-15a"}, ": is a motor; a brake is wanted here"),
    ({"amplifier": "tgz"}, ': amplifier "tgz" is not in the catalogue'),
    ({"amplifier": {"continuous_current": 5.0, "peak_current": 3.0}}, "task.amplifier: exchange them"),
    ({"amplifier": {"continuous_current": 5.0}, "supply": {"continuous_current": 4.0}}, "task.supply.continuous_current: says the same"),
)
