"""Tasks with gravity, payloads, process forces and slides: demands against arithmetic by hand, runs against the long form."""

import math
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from conftest import ROOT
from lostmotion.model.process_loads import ArmGravity, Duty, Payload, Process, Supply
from lostmotion.model.screw import RatedScrew
from lostmotion.simulation.forms.drive_tables import LoadTable
from lostmotion.sizing.axis_rules import derated, emergency_stop, gearbox_life, holding_brake, output_bearing, with_safety
from lostmotion.sizing.catalogue_formulas import derating
from lostmotion.sizing.finding import TASK_RULES, within
from lostmotion.sizing.linear_stage_demands import at_input, stage_of, together
from lostmotion.sizing.required_motion import duty_torque, input_demand, required_motion
from lostmotion.sizing.supply import electrical_power, returned, supply_rules
from lostmotion.studies.runs.candidate_rows import Axes
from lostmotion.studies.selection.task_file import task_of
from refusals import refusals_of, refused

G = 9.80665
LIMITS = {"continuous_torque": 0.5, "resistance": 1.0, "torque_constant": 0.1, "max_current": 20.0}
MOTOR: dict[str, Any] = {"rotor_inertia": 1e-5, "rated_torque": 0.4, "rated_speed": 400.0, "rated_voltage": 48.0, "voltage_limit": 48.0}
MOTOR |= {"electrical_time_constant": 5e-4, "armature_voltage_constant": 10.0, "limits": LIMITS}
GEARBOX: dict[str, Any] = {"ratio": 100.0, "inertia": 2e-6, "rated_input_speed": 300.0, "rated_output_torque": 40.0}
GEARBOX |= {"stiffness": {"kind": "linear", "stiffness": 2e4}, "losses": {"kind": "constant_efficiency", "efficiency": 0.8}}
REFERENCE = {"kind": "position", "speed": 1.0, "acceleration": 5.0, "moves": [{"to": 1.2, "dwell": 0.6}, {"to": 0.0}]}
ARM: dict[str, Any] = {
    "task": {"cycle": "4 s", "gravity": {"mass": 2.0, "radius": 0.5}, "hold_without_power": False},
    "load": {"inertia": 0.8, "friction_torque": 0.2},
    "controller": {"encoder": {"bits": 20}, "reference": REFERENCE},
    "motor": MOTOR,
    "gearbox": GEARBOX,
    "vary": [{"key": "gearbox.ratio", "values": [100.0]}],
}
SLIDE: dict[str, Any] = {
    "task": {"cycle": "2 s", "settling_window": "0.02 mm", "brake": {"torque": "2 N m"}},
    "slide": {"mass": "12 kg", "friction_force": "30 N", "inclination": "90 deg"},
    "screw": {"lead": "10 mm", "efficiency": 0.9, "inertia": "3e-5 kg m^2", "stiffness": "90 N/um", "drag_torque": "0.03 N m"},
    "controller": {
        "encoder": {"bits": 20},
        "reference": {"kind": "position", "speed": "300 mm/s", "acceleration": "3 m/s^2"}
        | {"moves": [{"to": "200 mm", "dwell": "0.2 s"}, {"to": "0 mm"}]},
    },
    "motor": MOTOR | {"limits": MOTOR["limits"] | {"max_current": 40.0}},
    "vary": [{"key": "motor.rotor_inertia", "values": [2e-5]}],
}


def changed(tables: dict[str, Any], **changes: Any) -> dict[str, Any]:
    return {**tables, **{key: tables[key] | value for key, value in changes.items()}}


def motion_of(duty: Duty, **load: Any) -> Any:
    reference = lm.PositionReference(**{k: v for k, v in REFERENCE.items() if k != "kind"})
    return required_motion(reference, LoadTable(**{"inertia": 0.8} | load), 4.0, duty)


def at(motion: Any, time: float, values: np.ndarray) -> float:
    return float(np.interp(time, motion.time, values))


@pytest.mark.parametrize("slides", [False, True])
def test_a_measured_motion_comes_from_a_file(tmp_path, slides: bool):
    """A cosine of 45 degrees, or of 45 mm, sampled 100 times: its acceleration is A (2 pi/T)^2 at the turning points."""
    rows = [f"{0.02 * k:.2f},{45.0 * (1.0 - math.cos(0.02 * math.pi * k))}" for k in range(101)]
    (tmp_path / "profile.csv").write_text("\n".join([f"time [s],position [{'mm' if slides else 'deg'}]", *rows]))
    load = '[slide]\nmass = 2\n[screw]\nlead = "10 mm"\nefficiency = 0.9' if slides else "[load]\ninertia = 2"
    given = '[motor]\nfrom = "maxon-ec-i-52-606793"\n'
    given += "" if slides else '[gearbox]\nfrom = "bonfiglioli-tr060-2-36"\n'
    file = tmp_path / "task.toml"
    file.write_text(
        f'[task]\ncycle = "2 s"\n{load}\n[controller.reference]\nkind = "position"\n{given}[[vary]]\nkey = "motor.rotor_inertia"\nvalues = [1e-5]\n'.replace(
            'kind = "position"\n', 'kind = "position"\nsamples = { file = "profile.csv", interpolation = "cubic" }\n'
        )
    )
    motion = Axes(lm.studies.load_task(file)).motion(np.zeros(1))
    amplitude = 0.045 if slides else math.radians(45.0)
    assert motion.position.max() == pytest.approx(2.0 * amplitude, rel=1e-4)
    assert at(motion, 1.0, motion.torque) == pytest.approx(-2.0 * amplitude * math.pi**2, rel=2e-3)


# --- demands by hand ---
def test_gravity_of_an_arm():
    """Hanging at 0, so that 2 kg at 0.5 m pull with m g r sin(1.2) at the end of the move, and nothing at its start."""
    motion = motion_of(Duty(gravity=ArmGravity(mass=2.0, radius=0.5)))
    assert at(motion, 1.7, motion.torque) == pytest.approx(2.0 * G * 0.5 * math.sin(1.2), rel=1e-9)
    assert at(motion, 0.0, motion.holding) == pytest.approx(0.0, abs=1e-9)
    assert float(motion.torque[motion.time < 0.2][-1]) == pytest.approx(0.8 * 5.0 + 2.0 * G * 0.5 * math.sin(0.1), rel=1e-6)


def test_a_payload_adds_inertia_and_weight_while_it_is_carried():
    duty = Duty(gravity=ArmGravity(mass=2.0, radius=0.5), payload=(Payload(begin=1.5, end=3.5, mass=1.0, radius=0.7, inertia=0.01),))
    motion = motion_of(duty)
    assert float(motion.inertia.max() - 0.8) == pytest.approx(0.01 + 0.49, rel=1e-12)
    carried = motion.inertia > 0.8
    assert motion.time[carried].min() == pytest.approx(1.5)
    assert motion.time[carried].max() == pytest.approx(3.5)
    weight = (2.0 * 0.5 + 1.0 * 0.7) * G * math.sin(1.2)
    assert at(motion, 1.7, motion.torque) == pytest.approx(weight, rel=1e-9)


def test_process_torques_over_time_and_position():
    over_time = motion_of(Duty(process=(Process(times=(0.0, 1.0), torques=(0.0, 6.0)),)))
    assert at(over_time, 0.5, over_time.holding) == pytest.approx(3.0, rel=1e-6)
    assert at(over_time, 3.9, over_time.holding) == pytest.approx(6.0)
    over_position = motion_of(Duty(process=(Process(positions=(0.0, 1.2), torques=(1.0, 13.0)),)))
    assert at(over_position, 1.7, over_position.holding) == pytest.approx(13.0)
    assert at(over_position, 0.2, over_position.holding) == pytest.approx(1.0 + 10.0 * 0.1, rel=1e-6)


def test_lines_of_the_duty_depart_by_a_thousandth():
    motion = motion_of(Duty(gravity=ArmGravity(mass=2.0, radius=0.5)))
    times, torques = duty_torque(motion, LoadTable(inertia=0.8))
    off = np.abs(np.interp(motion.time, times, torques) - motion.holding)
    assert off.max() <= 1.001e-3 * np.abs(motion.holding).max()
    assert len(times) < 100


def test_emergency_stop_with_the_load_behind():
    """|T_hold - J a| is largest going down: holding and braking add up."""
    motion = motion_of(Duty(gravity=ArmGravity(mass=2.0, radius=0.5)))
    gearbox = lm.Gearbox(**GEARBOX | {"limits": {"momentary_output_torque": 50.0}})
    found = emergency_stop(motion, gearbox, 20.0)
    assert 50.0 * found.use == pytest.approx(2.0 * G * 0.5 * math.sin(1.2) + 0.8 * 20.0, rel=1e-4)
    assert emergency_stop(motion, lm.Gearbox(**GEARBOX), 20.0).verdict == "unknown"


def test_a_holding_brake_carries_the_weight():
    motion = motion_of(Duty(gravity=ArmGravity(mass=2.0, radius=0.5)))
    demand = input_demand(motion, lm.Gearbox(**GEARBOX))
    need = 2.0 * G * 0.5 * math.sin(1.2) / 100.0
    task = task_of(changed(ARM, task={"brake": {"torque": 2.0 * need, "inertia": 3e-6}}))
    assert holding_brake(demand, task.axis.brake).use == pytest.approx(0.5, rel=1e-9)
    assert task.part("motor", task.parameters(0, 1)[0]).rotor_inertia == pytest.approx(1.3e-5)
    assert holding_brake(demand, None).verdict == "unknown"


def test_life_of_a_gearbox_under_a_constant_torque():
    """At half the rated torque and a mean speed of a tenth of the rated one: 8 x 10 times the rated life."""
    reference = lm.PositionReference(samples={"times": [0.0, 1.0], "values": [0.0, 0.3]})
    motion = required_motion(reference, LoadTable(inertia=1.0, torque=20.0), 1.0)
    limits = {"rated_life": "7000 h"}
    found = gearbox_life(input_demand(motion, lm.Gearbox(**GEARBOX | {"limits": limits})), 1e6 * 3600.0)
    assert 1e6 / found.use == pytest.approx(7000.0 * 10.0 * 8.0, rel=1e-6)
    steep = {"rated_life": "7000 h", "life_exponent": 10.0 / 3.0}
    found = gearbox_life(input_demand(motion, lm.Gearbox(**GEARBOX | {"limits": steep})), 1e6 * 3600.0)
    assert 1e6 / found.use == pytest.approx(70000.0 * 2.0 ** (10.0 / 3.0), rel=1e-6)
    assert gearbox_life(input_demand(motion, lm.Gearbox(**GEARBOX)), 3600.0).remark.endswith("rated_life is missing")


def test_braking_returns_kinetic_energy_less_copper_loss():
    """A lossless gear brakes 0.8 kg m2 from 1 rad/s: J w^2/2, less R (M/k)^2 t."""
    gearbox = lm.Gearbox(**GEARBOX | {"inertia": 0.0, "losses": {"kind": "constant_efficiency", "efficiency": 1.0}})
    motor = lm.Motor(**MOTOR | {"rotor_inertia": 0.0})
    motion = motion_of(Duty())
    demand = input_demand(motion, gearbox)
    back = returned(motion.time, electrical_power(demand, motor), 4.0)
    torque = 0.8 * 5.0 / 100.0
    heat = (torque / 0.1) ** 2
    power = torque * 100.0  # at 1 rad/s of the load
    # From the power M w = power less the heat down to where both are equal.
    energy = (power - heat) ** 2 / (2.0 * torque * 500.0)
    assert len(back.each) == 2
    assert back.largest == pytest.approx(energy, rel=1e-4)
    supply = Supply(max_voltage=48.0, voltage_limit=60.0, capacitance="2000 uF")
    (found,) = supply_rules(back, supply)
    assert 60.0 * found.use == pytest.approx(math.sqrt(48.0**2 + 2.0 * energy / 2e-3), rel=1e-4)


def test_derating_and_safety_factors_tighten_a_limit():
    found = within("motor_torque", "rms", 0.8, 1.0, "N·m", "continuous torque")
    high = derating(3000.0, 25.0, None)
    assert high == pytest.approx(0.8)
    (found,) = derated([found], high)
    assert found.use == pytest.approx(1.0)
    assert found.verdict == "ok"
    (found,) = with_safety([found], {"motor_torque": 1.1})
    assert found.verdict == "warning"
    assert "safety factor 1.1" in found.remark


def test_forces_on_the_output_bearing():
    gearbox = lm.Gearbox(**GEARBOX | {"limits": {"max_radial_force": "500 N"}})
    radial, axial = output_bearing(gearbox, 400.0, 100.0)
    assert radial.use == pytest.approx(0.8)
    assert axial.verdict == "unknown"


# --- runs ---
def test_a_run_has_the_gravity_of_the_long_form():
    """Gravity along the reference in the short form, and over the angle of the shaft in the long one, under the same controller."""
    task = task_of(ARM)
    scenario = task.axis_at(task.parameters(0, 1)[0], 2)
    short = lm.simulate(scenario, energy=False)
    controller = scenario.controller.model_dump(exclude_none=True)
    train = lm.Scenario(
        shafts={"motor": {}, "load": {"inertia": 0.8, "friction_torque": 0.2}},
        motors={"motor": scenario.motor.model_dump(exclude_none=True) | {"shaft": "motor"}},
        gears={"gearbox": scenario.gearbox.model_dump(exclude_none=True) | {"input": "motor", "output": "load"}},
        gravity={"arm": {"shaft": "load", "mass": 2.0, "radius": 0.5, "error": 1e-3}},
        controllers={"motor": controller},
        simulation=scenario.simulation.model_dump(),
    )
    long = lm.simulate(train, energy=False)
    weight = 2.0 * G * 0.5
    torque = short["motor_torque"].values - long["motor_torque"].values
    # Both are lines within 0.1 % of the weight; the rest is the reference against the load, a thousandth of a radian.
    later = short["time"].values > 4.0
    assert np.abs(torque[later]).max() < 0.02 * weight / 100.0
    assert np.abs(long["motor_torque"].values).max() > 0.8 * weight / 100.0


def test_a_slide_runs_as_in_the_long_form():
    task = task_of(SLIDE)
    scenario = task.axis_at(task.parameters(0, 1)[0], 2)
    short = lm.simulate(scenario, energy=False)
    controller = scenario.controller.model_dump(exclude_none=True) | {"shaft": "slide"}
    motor = scenario.motor.model_dump(exclude_none=True)
    screw = {k: v for k, v in SLIDE["screw"].items() if k != "drag_torque"}
    train = lm.Scenario(
        shafts={"motor": {"friction_torque": 0.03}},
        slides={"slide": SLIDE["slide"]},
        motors={"motor": motor | {"shaft": "motor"}},
        screws={"screw": screw | {"input": "motor", "output": "slide"}},
        controllers={"motor": controller},
        simulation=scenario.simulation.model_dump(),
    )
    long = lm.simulate(train, energy=False)
    assert short["load_angle"].values == pytest.approx(long["slide_position"].values, abs=1e-9)
    assert short["motor_torque"].values == pytest.approx(long["motor_torque"].values, abs=1e-6)


def test_demands_of_a_slide():
    """Going up at constant speed: (m g + friction) p/(2 pi eta) + drag."""
    task = task_of(SLIDE)
    row = task.parameters(0, 1)[0]
    axes = Axes(task)
    demand, findings = axes.gearbox(row)[0], axes.judged(row)
    force = 12.0 * G + 30.0
    expected = force * 0.01 / (2.0 * math.pi * 0.9) + 0.03
    assert at(demand.motion, 0.3, demand.torque) == pytest.approx(expected, rel=1e-6)
    down = (12.0 * G - 30.0) * (2.0 - 1.0 / 0.9) * 0.01 / (2.0 * math.pi) - 0.03
    back = 2.0 / 3.0 + 0.1 + 0.2 + 0.3
    assert at(demand.motion, back, demand.torque) == pytest.approx(down, rel=1e-6)
    brake = next(f for f in findings if f.rule == "holding_brake")
    assert 2.0 * brake.use == pytest.approx(12.0 * G * 0.01 / (2.0 * math.pi), rel=1e-9)


def test_a_gearbox_and_a_screw_as_one():
    """Losses, inertia and stiffness of both in a row, as a chain of hand calculations."""
    gearbox = lm.Gearbox(**GEARBOX | {"ratio": 5.0, "losses": {"kind": "map", "speeds": [0.0, 1.0], "loads": [-1.0, 0.0, 1.0],
                                       "values": [[0.2, 0.2], [0.01, 0.01], [0.3, 0.3]], "mirrored": False}})  # fmt: skip
    screw = RatedScrew(lead=0.01, efficiency=0.9, stiffness=9e7, inertia=3e-5, drag_torque=0.1)
    both, ratio = together(gearbox, screw), 2.0 * math.pi / 0.01
    assert both.ratio == pytest.approx(5.0 * ratio)
    assert both.inertia == pytest.approx(2e-6 + 3e-5 / 25.0)
    k = 2e4 * ratio**2
    assert both.stiffness.stiffness == pytest.approx(1.0 / (1.0 / k + 1.0 / 9e7))
    for force in (4000.0, -4000.0, 12000.0):
        drives = force > 0.0
        inner = (force / ratio / 0.9 if drives else force / ratio * (2.0 - 1.0 / 0.9)) + 0.1
        lost = np.interp(inner / 40.0, [-1.0, 0.0, 1.0], [0.2, 0.01, 0.3]) * 40.0
        expected = (inner + lost) / 5.0
        law, rated = both.losses.core(), both.rated_output_torque
        found = (force + law(force / rated, 0.5) * rated) / both.ratio
        assert found == pytest.approx(expected, rel=1e-9)
    motion = required_motion(
        lm.PositionReference(samples={"times": [0.0, 1.0], "values": [0.0, 0.1]}), LoadTable(inertia=1.0, torque=4000.0), 1.0, Duty(), 0.0
    )
    of_both = input_demand(motion, both).torque
    assert input_demand(at_input(motion, screw), gearbox).torque == pytest.approx(of_both, rel=1e-9)


def test_a_screw_of_the_catalogue_varies():
    names = [r.name for r in lm.catalogue() if r.name.startswith("rexroth")][:2]
    tables = {key: value for key, value in SLIDE.items() if key != "screw"}
    tables["vary"] = [{"key": "screw", "values": names}, *SLIDE["vary"]]
    beside = {"diameter": "20 mm", "length": "700 mm", "efficiency": 0.9}
    task = task_of(tables | {"screw": beside})
    assert task.total == len(names) == 2
    stage = task.part("stage", task.parameters(1, 2)[0])
    assert stage.dynamic_capacity == stage_of("screw", {"from": names[1], **beside}).dynamic_capacity
    found = lm.select(task)
    assert set(found["screw"].values.tolist()) == set(names)


def test_units_of_a_slide_are_those_of_translation():
    found = lm.select(task_of(SLIDE))
    assert found["tracking_error_peak"].attrs["units"] == "m"
    assert found["output_torque_peak"].attrs["units"] == "N"
    assert found["motor_torque_peak"].attrs["units"] == "N*m"


test_bad_tasks_are_refused_in_one_line = refusals_of(
    lambda tables, changes: task_of(changed(tables, **changes)),
    (ARM, {"task": {"gravity": {"mass": 2.0}}}, "task.gravity.radius"),
    (ARM, {"task": {"payload": [{"begin": 1.0, "end": 0.5, "mass": 1.0}]}}, "task.payload[0]: not after begin"),
    (ARM, {"task": {"payload": [{"begin": 1.0, "end": 9.0, "mass": 1.0, "radius": 1.0}]}}, "task.payload[0].end: after its cycle"),
    (ARM, {"task": {"payload": [{"begin": 1.0, "end": 2.0, "mass": 1.0}]}}, "task.payload[0].radius"),
    (ARM, {"task": {"process": [{"times": [0.0, 1.0], "forces": [1.0, 2.0]}]}}, "task.process[0].torques"),
    (ARM, {"task": {"process": [{"times": [1.0, 0.0], "torques": [1.0, 2.0]}]}}, "task.process[0]: do not rise"),
    (ARM, {"task": {"safety_factors": {"motor_torqe": 1.2}}}, "task.safety_factors.motor_torqe: motor_torque"),
    (ARM, {"task": {"supply": {"min_voltage": "50 V", "max_voltage": "40 V"}}}, "task.supply: exchange"),
    (SLIDE, {"task": {"gravity": {"mass": 2.0, "radius": 1.0}}}, "task.gravity: inclination"),
    (SLIDE, {"task": {"max_tracking_error": "1 deg"}}, ": max_tracking_error"),
    (SLIDE, {"slide": {"breakaway_force": "3 N"}}, "slide.breakaway_force"),
    (SLIDE, {"screw": {"lead": "10 deg"}}, "screw.lead"),
)


def test_a_slide_needs_one_stage():
    refused(
        lambda: task_of({key: value for key, value in SLIDE.items() if key != "screw"}), "slide", match="lacks one of screw, rack, belt"
    )
    refused(lambda: task_of(SLIDE | {"belt": {}}), "slide", match="has screw and belt")
    refused(lambda: task_of(SLIDE | {"load": {"inertia": 1.0}}), "load", "slide")


def test_the_page_on_selection_names_every_rule():
    page = (ROOT / "docs" / "select.md").read_text()
    assert [rule for rule in TASK_RULES if f"`{rule}`" not in page] == []
