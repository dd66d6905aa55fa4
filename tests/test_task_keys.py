"""Keys of tasks: each is judged, named as not judged, or refused, for every form of task; and any key with a number varies."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from lostmotion.model.angle_torques import STANDARD_GRAVITY as G
from lostmotion.model.process_loads import Supply
from lostmotion.model.task import Task
from lostmotion.sizing.axis_task.axis_task import AxisTask
from lostmotion.sizing.finding import TASK_RULES
from lostmotion.studies.runs.candidate_rows import Axes
from lostmotion.studies.selection.task_file import task_of
from lostmotion.studies.study.study_files import from_json, to_json
from refusals import refused
from tables import rated_gearbox

LIMITS = {"continuous_torque": "5 N m", "peak_torque": "25 N m", "max_speed": "4000 rpm", "resistance": "1 ohm"}
LIMITS |= {"torque_constant": "0.5 N m/A", "max_voltage": "400 V", "max_current": "60 A"}
MOTOR: dict[str, Any] = {"kind": "torque_source", "rotor_inertia": "3e-4 kg m^2", "rated_torque": "5 N m", "limits": LIMITS}
GEARBOX: dict[str, Any] = rated_gearbox(2, "3000 rpm", "20 N m", {"kind": "rigid"}, 0.95, inertia="4e-5 kg m^2")
MOVES = {"kind": "position", "speed": "200 mm/s", "acceleration": "2 m/s^2", "jerk": "100 m/s^3"}
SLIDE: dict[str, Any] = {
    "task": {"cycle": "2 s", "hold_without_power": False},
    "slide": {"mass": "100 kg", "friction_coefficient": 0.05},
    "controller": {
        "encoder": {"bits": 20},
        "position_encoder": {"grating_period": "20 um", "bits": 10},
        "reference": MOVES | {"moves": [{"to": "100 mm", "dwell": "0.3 s"}, {"to": "0 mm"}]},
    },
}
SCREW = {"lead": "10 mm", "inertia": "1e-4 kg m^2", "efficiency": 0.9, "stiffness": "200 N/um", "damping": "40 kN s/m"}
RACK = {"module": "2 mm", "teeth": 20, "stiffness": "50 N/um", "damping": "20 kN s/m"}
BELT = {"teeth": 20, "pitch": "5 mm", "stiffness": "5 N/um", "damping": "10 kN s/m"}
TURNS = [{"to": "2 rad", "dwell": "0.3 s"}, {"to": "0 rad"}]


FORMS: dict[str, dict[str, Any]] = {
    "gearbox": {
        "task": SLIDE["task"],
        "load": {"inertia": "0.02 kg m^2", "friction_torque": "0.1 N m"},
        "controller": {
            "encoder": {"bits": 20},
            "reference": {"kind": "position", "speed": "10 rad/s", "acceleration": "100 rad/s^2", "moves": TURNS},
        },
        "motor": MOTOR,
        "gearbox": GEARBOX,
    },
    "screw": {**SLIDE, "screw": SCREW, "motor": MOTOR},
    "screw behind gearbox": {**SLIDE, "screw": SCREW, "motor": MOTOR, "gearbox": GEARBOX},
    "rack behind gearbox": {**SLIDE, "rack": RACK, "motor": MOTOR, "gearbox": GEARBOX},
    "rack": {**SLIDE, "rack": RACK, "motor": MOTOR},
    "belt": {**SLIDE, "belt": BELT, "motor": MOTOR},
    "belt behind gearbox": {**SLIDE, "belt": BELT, "motor": MOTOR, "gearbox": GEARBOX},
    "linear motor": {**SLIDE, "candidates": {"linear_motor": ["own.toml"]}},
}
FORMS["actuator"] = {
    **{key: table for key, table in FORMS["gearbox"].items() if key not in ("motor", "gearbox")},
    "candidates": {"actuator": ["t-motor-ak80-6"]},
}
OF_SHAFTS = ("gearbox", "actuator")
SHEET = """
[[linear_motor]]
name = "own"
kind = "ironless"
mass = "4 kg"
rated_force = "300 N"
peak_force = "900 N"
"""

# What each key of a task does: a rule that judges it or says why not, a limit of a column, or what it changes.
RULE_OF: dict[str, tuple[Any, str]] = {
    "max_lost_motion": ("1 arcmin", "lost_motion"),
    "brake": ({"torque": "2 N m"}, "holding_brake"),
    "amplifier": ({"continuous_current": "10 A"}, "amplifier_current"),
    "supply": ({"max_voltage": "320 V"}, "bus_voltage"),
    "max_inertia_ratio": (7.0, "inertia_ratio"),
    "max_mass": ("3 kg", "mass"),
    "max_length": ("0.1 m", "length"),
    "max_price": (10.0, "price"),
    "max_lead_time": ("3 days", "lead_time"),
    "emergency_stop": ("5 m/s^2", "emergency_stop"),
    "radial_force": ("100 N", "output_bearing"),
    "axial_force": ("100 N", "output_bearing"),
    "life": ("20000 h", "gearbox_life screw_life"),
    "safety_factors": ({"holding": 2.0}, "holding"),
    "ambient_temperature": ("55 degC", "winding_temperature"),
}
COLUMN_OF = {"max_tracking_error": "tracking_error_peak", "max_reversal_error": "reversal_error", "max_settling_time": "settling_time"}
ELSEWHERE = {  # each has a test of its own; linear, current, whole and pairs are no keys of files
    "cycle", "hold_without_power", "max_cycles", "settling_window", "altitude", "gravity", "payload",
    "process", "linear", "current", "whole", "pairs", "microsteps", "steppers",
}  # fmt: skip


@pytest.fixture(autouse=True)
def sheet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "own.toml").write_text(SHEET)
    monkeypatch.chdir(tmp_path)


def changed(form: str, **changes: Any) -> dict[str, Any]:
    tables = FORMS[form]
    return {**tables, **{key: tables[key] | value for key, value in changes.items()}}


def findings_of(tables: dict[str, Any], rule: str | None = None) -> Any:
    """Findings of the first pair of a task: all, or those of a rule."""
    study = task_of(tables)
    found = Axes(study).judged(study.parameters(0, 1)[0])
    return found if rule is None else [f for f in found if f.rule == rule]


def judged(form: str, **task: Any) -> list[Any] | lm.InputError:
    try:
        return findings_of(changed(form, task=task))
    except lm.InputError as error:
        return error


def texts(findings: list[Any] | lm.InputError) -> set[tuple[str, ...]]:
    assert isinstance(findings, list), findings
    return {(f.rule, f.what, f.value, f.remark) for f in findings}


def found_of(findings: list[Any], rule: str) -> Any:
    return next(f for f in findings if f.rule == rule)


def test_every_key_of_a_task_is_covered_here() -> None:
    assert set(AxisTask.model_fields) == {*RULE_OF, *COLUMN_OF, *ELSEWHERE}
    assert set(Task.model_fields) == {*OF_SCENARIOS, "cycle"}
    of_keys = {rule for _, rules in RULE_OF.values() for rule in rules.split()}
    assert of_keys & set(TASK_RULES) == of_keys - {"lost_motion", "inertia_ratio", "holding", "winding_temperature"}
    for key in set(Supply.model_fields) - {"min_voltage", "returns_to_mains"}:
        value = {"voltage_limit": "400 V", "max_voltage": "320 V", "capacitance": "1 mF"}.get(key, 10.0)
        assert texts(judged("screw", supply={key: value})) - texts(judged("screw")), key


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("key", RULE_OF)
def test_a_key_of_a_task_is_judged_or_named(key: str, form: str) -> None:
    value, rules = RULE_OF[key]
    if form in OF_SHAFTS and key == "emergency_stop":
        value = "50 rad/s^2"
    if form not in OF_SHAFTS and key == "max_lost_motion":
        value = "1 um"
    found = judged(form, **{key: value})
    if isinstance(found, lm.InputError):  # a record lacks what the key needs
        assert f"task.{key}" in str(found)
        return
    assert key != "max_lost_motion" or form not in OF_SHAFTS or found_of(found, "lost_motion").value == "not known"
    findings = [f for f in found if f.rule in rules.split()]
    assert findings, "neither judged nor named"
    for f in findings:
        assert f.verdict != "unknown" or f.remark
        assert f.verdict == "unknown" or f.use is not None
    assert key == "max_inertia_ratio" or texts(findings) - texts(judged(form))


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("key", COLUMN_OF)
def test_a_key_of_the_run_limits_a_column(key: str, form: str) -> None:
    value = "1 s" if key == "max_settling_time" else "1 arcmin" if form in OF_SHAFTS else "1 um"
    window = {"settling_window": "1 arcmin" if form in OF_SHAFTS else "1 um"} if key == "max_settling_time" else {}
    study = task_of(changed(form, task={key: value, **window}))
    assert study.select is not None
    assert COLUMN_OF[key] in study.select.limits


@pytest.mark.parametrize("form", FORMS)
def test_microsteps_without_a_stepper_are_refused(form: str) -> None:
    refused(lambda: task_of(changed(form, task={"microsteps": 8})), "task.microsteps")


def test_the_force_of_an_emergency_stop() -> None:
    """|m g sin + m a| of a vertical slide that comes down, with the ratings of the screw, the rack, the belt and the linear motor."""
    force = 100.0 * (G + 5.0)
    given = {
        "screw": ({"static_capacity": "20 kN"}, 20e3),
        "rack behind gearbox": ({"peak_force": "8 kN"}, 8e3),
        "belt": ({"rated_force": "5 kN", "pretension": "1 kN"}, 5e3),
    }
    for form, (ratings, limit) in given.items():
        table = form.split()[0]
        tables = changed(form, task={"emergency_stop": "5 m/s^2"}, slide={"inclination": "90 deg"}, **{table: ratings})
        found = [f for f in findings_of(tables, "emergency_stop") if f.use]
        right = force + 1e3 if table == "belt" else force
        assert limit * found[-1].use == pytest.approx(right, rel=1e-9), form
    tables = changed("linear motor", task={"emergency_stop": "5 m/s^2"}, slide={"inclination": "90 deg"})
    (found,) = findings_of(tables, "emergency_stop")
    assert 900.0 * found.use == pytest.approx(104.0 * (G + 5.0), rel=1e-9)


def test_the_inertia_ratio_has_all_that_is_not_the_rotor_and_the_limit_of_the_manufacturer() -> None:
    """(m s²/i² + J_screw/i² + J_gear)/(J_rotor + J_brake); the manufacturer's limit takes the place of 10, and the smaller one counts."""
    s = 0.01 / (2.0 * math.pi)
    right = ((100.0 * s**2 + 1e-4) / 4.0 + 4e-5) / (3e-4 + 5e-5)

    def found(limits: dict[str, Any], **task: Any) -> Any:
        tables = changed("screw behind gearbox", task={"brake": {"torque": 2.0, "inertia": 5e-5}, **task})
        (one,) = findings_of({**tables, "motor": MOTOR | {"limits": MOTOR["limits"] | limits}}, "inertia_ratio")
        return one

    assert 10.0 * found({}).use == pytest.approx(right, rel=1e-9)
    assert 5.0 * found({"max_inertia_ratio": 5}).use == pytest.approx(right, rel=1e-9)
    assert 3.0 * found({"max_inertia_ratio": 5}, max_inertia_ratio=3).use == pytest.approx(right, rel=1e-9)
    assert "manufacturer" in found({"max_inertia_ratio": 0.1}).remark


# --- tasks of scenarios ---
VERTICAL: dict[str, Any] = {
    "axis": {
        "motor": {"kind": "torque_source", "rotor_inertia": 3e-4, "rated_torque": 2.4, "limits": {"torque_constant": 0.4}},
        "gearbox": {"ratio": 2.0, "inertia": 1e-5, "stiffness": {"kind": "rigid"}},
        "screw": {"lead": "20 mm", "inertia": 2e-5, "efficiency": 0.9, "stiffness": "100 N/um"},
        "slide": {"mass": "30 kg", "inclination": "30 deg"},
    },
    "command": 0.0,
    "initial": {"speeds": {"motor": 1.0}},
    "simulation": {"duration": 0.02, "sample_interval": 0.001},
}
SCENARIOS = {
    "drive": lambda task: lm.load("catalogue-robot-joint").replace(**{f"task.{key}": v for key, v in task.items()}),
    "axis": lambda task: lm.Scenario(**VERTICAL, task=task),
    "train": lambda task: lm.Scenario(**lm.Scenario(**VERTICAL).model_dump() | {"task": task}),
}
OF_SCENARIOS = {
    "supply": ({"max_voltage": 320.0}, "bus_voltage"),
    "amplifier": ({"continuous_current": 10.0}, "amplifier_current"),
    "brake": ({"torque": 2.0}, "holding_brake"),
    "max_lost_motion": (1e-4, "lost_motion"),
    "hold_without_power": (False, "holding"),
    "ambient_temperature": (55.0, "winding_temperature"),
}


@pytest.mark.parametrize("form", SCENARIOS)
@pytest.mark.parametrize("key", OF_SCENARIOS)
def test_a_key_of_the_task_of_a_scenario_is_judged_or_refused(key: str, form: str) -> None:
    value, rule = OF_SCENARIOS[key]
    try:
        scenario = SCENARIOS[form]({key: value})
    except lm.InputError as error:
        assert form != "drive"
        assert f"task.{key}" in str(error)
        return
    assert [f for f in lm.check_drive(scenario) if f.rule == rule]


@pytest.mark.parametrize("form", ["axis", "train"])
@pytest.mark.parametrize("brake", [{"torque": 0.2}, {"force": 100.0}])
def test_an_axis_is_judged_by_the_rules_of_drives(form: str, brake: dict[str, float]) -> None:
    """m g sin s/i at the motor; (m s²/i² + J_screw/i² + J_gear)/J_rotor; two masses on the stiffness of the screw."""
    found = {f.rule: f for f in lm.check_drive(SCENARIOS[form]({"brake": brake}))}
    s, weight = 0.02 / (2.0 * math.pi), 30.0 * G * 0.5
    need = weight * s / 2.0 / 0.2 if "torque" in brake else weight / 100.0
    assert found["holding_brake"].use == pytest.approx(need, rel=1e-9)
    assert found["holding"].verdict == found["holding_brake"].verdict == "warning"
    ratio = (30.0 * s**2 / 4.0 + 2e-5 / 4.0 + 1e-5) / 3e-4
    assert 10.0 * found["inertia_ratio"].use == pytest.approx(ratio, rel=1e-9)
    before = (3e-4 + 1e-5 + 2e-5 / 4.0) * (2.0 / s) ** 2
    resonance = math.sqrt(1e8 * (1.0 / before + 1.0 / 30.0)) / (2.0 * math.pi)
    assert found["resonance"].value.startswith(f"{resonance:.4g} Hz, anti-resonance {math.sqrt(1e8 / 30.0) / 2.0 / math.pi:.4g}")
    assert found["lost_motion"].remark


def test_a_fast_sine_between_the_samples_heats_the_motor() -> None:
    """A command of 0.3 at 400 Hz, of which samples at every second period are 0: rms 0.3/sqrt(2) of the rated torque."""
    still = lm.Scenario(
        shafts={"s": {"inertia": 1.0, "friction_torque": 1e12}},
        motors={"m": {"shaft": "s", "kind": "torque_source", "rotor_inertia": 1e-3, "rated_torque": 1.0, "limits": {"continuous_torque": 0.1}}},
        command={"m": {"amplitude": 0.3, "frequency": 400.0}},
        simulation={"duration": 100.0, "sample_interval": 5e-3},
    )  # fmt: skip
    (found,) = [f for f in lm.check_drive(still) if f.rule == "motor_torque"]
    assert 0.1 * (found.use or 0.0) == pytest.approx(0.3 / math.sqrt(2.0), rel=0.01)


def test_lost_motion_without_a_gearbox_is_under_the_rated_torque_of_the_motor() -> None:
    """Backlash and what ±3 % of 5 N m through the screw deflect 200 N/um by."""
    (found,) = findings_of(changed("screw", task={"max_lost_motion": "20 um"}, screw={"backlash": "10 um"}), "lost_motion")
    force = 0.03 * 5.0 * 2.0 * math.pi / 0.01
    assert 20e-6 * found.use == pytest.approx(10e-6 + 2.0 * force / 200e6, rel=0.02)


# --- varied keys ---
VARIED: list[tuple[str, str, list[Any], str]] = [
    ("screw", "slide.mass", ["50 kg", "100 kg"], "motor_torque_rms"),
    ("screw", "slide.inclination", ["0 deg", "30 deg"], "motor_torque_rms"),
    ("screw", "slide.friction_coefficient", [0.05, 0.2], "motor_torque_rms"),
    ("screw", "screw.lead", ["10 mm", "20 mm"], "input_speed_peak"),
    ("screw", "screw.efficiency", [0.9, 0.8], "motor_torque_rms"),
    ("screw", "screw.inertia", ["1e-4 kg m^2", "2e-4 kg m^2"], "inertia_ratio"),
    ("screw", "screw.backlash", ["0 um", "30 um"], "tracking_error_peak"),
    ("screw", "motor.rotor_inertia", ["2e-4 kg m^2", "3e-4 kg m^2"], "inertia_ratio"),
    ("screw", "task.cycle", ["2 s", "2.5 s"], "motor_torque_rms"),
    ("screw", "controller.reference.acceleration", ["2 m/s^2", "1 m/s^2"], "motor_torque_peak"),
    ("screw behind gearbox", "gearbox.ratio", [2, 3], "input_speed_peak"),
    ("rack behind gearbox", "rack.teeth", [20, 30], "input_speed_peak"),
    ("belt", "belt.teeth", [20, 24], "input_speed_peak"),
    ("gearbox", "load.inertia", ["0.02 kg m^2", "0.03 kg m^2"], "inertia_ratio"),
    ("linear motor", "slide.mass", ["50 kg", "100 kg"], "motor_force_rms"),
    ("linear motor", "linear_motor.mass", ["2 kg", "4 kg"], "motor_force_rms"),
]


def written(tables: dict[str, Any], key: str, value: Any) -> dict[str, Any]:
    """The tables of a task that has the value itself."""
    table, *path, last = key.split(".")
    inner = {last: value}
    for name in reversed(path):
        inner = {name: tables[table].get(name, {}) | inner}
    return {**tables, table: tables.get(table, {}) | inner}


@pytest.mark.parametrize(("form", "key", "values", "column"), VARIED, ids=[f"{f}-{k}" for f, k, *_ in VARIED])
def test_a_varied_key_has_the_results_of_tasks_that_write_it(form: str, key: str, values: list[Any], column: str) -> None:
    energy = {"select": {"objectives": {"mechanical_energy": "least"}}}
    tables = {**FORMS[form], **energy}
    study = task_of({**tables, "vary": [{"key": key, "values": values}]})
    found = lm.select(from_json(to_json(study))).sortby(key)
    assert found.sizes["pair"] == 2
    alone = [lm.select(task_of(written(tables, key, value))) for value in values]
    assert all(one.sizes["pair"] == 1 for one in alone)
    expected = sorted(float(one[column][0]) for one in alone)
    assert sorted(found[column].values.tolist()) == expected
    assert expected[0] < expected[1]
    assert found[key].attrs["units"] or isinstance(values[0], int | float)


def test_own_keys_vary_beside_each_other_and_relative() -> None:
    vary = [
        {"key": "slide.mass", "values": [0.5, 1.0], "relative": True},
        {"key": "screw.lead", "values": ["10 mm", "20 mm"]},
        {"key": "motor.rotor_inertia", "values": [2e-4, 3e-4, 4e-4]},
    ]
    study = task_of({**FORMS["screw"], "vary": vary})
    assert study.total == 12
    for k in range(12):
        row = study.parameters(k, k + 1)[0]
        one, own = study.at(row)
        assert one.scenario.load.inertia == pytest.approx(100.0 * row[0])
        assert one.part("stage", own).travel() == pytest.approx(row[1])
        assert study.axis_at(row, 2).motor.rotor_inertia == pytest.approx(row[2])


@pytest.mark.parametrize(("vary", "key"), [
    ({"key": "screw.leed", "values": [1.0]}, "screw.leed"),
    ({"key": "slide.mass", "values": ["3 m"]}, "slide.mass"),
    ({"key": "slide.mass", "uniform": [1.0, 2.0]}, "slide.mass"),
    ({"key": "screw.inertia", "values": [1.0]}, None),
    ({"key": "task.life", "values": [2.0], "relative": True}, "task.life"),
    ({"keys": ["slide.mass", "motor.rotor_inertia"], "values": [1.0]}, "slide.mass"),
    ({"key": "belt.teeth", "values": [20]}, "belt"),
])  # fmt: skip
def test_keys_that_cannot_vary_are_refused_by_name(vary: dict[str, Any], key: str | None) -> None:
    tables = {**FORMS["screw"], "vary": [vary]}
    if key is None:
        assert task_of(tables).total == 1
        return
    refused(lambda: task_of(tables), match=key)


def test_a_refused_pair_shows_what_its_motion_requires() -> None:
    """100 kg on 10 mm, mu 0.05, eta 0.9: torque of the acceleration, of the speed and the ratio of inertias by hand."""
    tables = changed("screw", task={"max_inertia_ratio": 0.1})
    smooth = {key: value for key, value in tables["controller"]["reference"].items() if key != "jerk"}
    pair = lm.select(task_of({**tables, "controller": tables["controller"] | {"reference": smooth}})).isel(pair=0)
    s = 0.01 / (2.0 * math.pi)
    assert str(pair["violated"].values) == "inertia_ratio"
    assert math.isnan(float(pair["cycles"]))
    peak = 100.0 * (2.0 + 0.05 * G) * s / 0.9 + (3e-4 + 1e-4) * 2.0 / s
    assert float(pair["motor_torque_peak"]) == pytest.approx(peak, rel=1e-6)
    assert float(pair["inertia_ratio"]) == pytest.approx((100.0 * s**2 + 1e-4) / 3e-4, rel=1e-9)
    assert float(pair["input_speed_peak"]) == pytest.approx(0.2 / s, rel=1e-9)
    assert np.isfinite(float(pair["motor_torque_rms"]))
