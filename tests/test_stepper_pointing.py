"""Axes that point by a stepper without a loop: errors by cause and by order."""

import math
from pathlib import Path

import numpy as np
import pytest

import lostmotion as lm
from conftest import ROOT
from lostmotion.data_sheets.records import find
from refusals import refused
from tables import gear_between, rated_gearbox, run_of, stepper

ARCSEC = math.pi / 648_000.0
STEPS, T_H, J, RATIO = 400, 0.44, 68e-7, 144.0
FULL_STEP = 2.0 * math.pi / STEPS
SPEED = 0.02  # of the axis [rad/s]


def reference(duration: float, speed: float = SPEED) -> dict:
    return {"ramps": [{"duration": 2.0 * duration, "rise": 2.0 * duration * speed}]}


def mount(
    duration: float = 5.0, microsteps: int = 16, table_error: float = 0.0, detent: float = 0.0, worm: float = 0.0, **gear
) -> lm.Scenario:
    """A motor with damping near the critical one, and a light axis behind a worm."""
    error = {"transmission_error": {"kind": "sine", "amplitude": worm, "order": 1}} if worm else {}
    return lm.Scenario(
        shafts={"motor": {"viscous_friction": 0.02}, "axis": {"inertia": 1e-3}},
        motors={"ra": stepper(J, STEPS, T_H, "motor", detent_torque=detent)},
        gears={"worm": gear_between("motor", "axis", RATIO, 2e4, mesh_damping=20.0, **error, **gear)},
        command={"ra": {"stepping": {"microsteps": microsteps, "table_error": table_error, "reference": reference(duration)}}},
        simulation=run_of(duration, 1e-3),
    )


def carried(order: float) -> float:
    """How much of a swing of the field at an order of the motor the axis makes: rotor in its field, then axis on its mesh."""
    s, k = 1j * SPEED * RATIO * order, STEPS / 4 * T_H
    rotor = 1.0 / (1.0 + s * 0.02 / k + s * s * (J + 1e-3 / RATIO**2) / k)
    return abs(rotor * (1.0 + s * 20.0 / 2e4) / (1.0 + s * 20.0 / 2e4 + s * s * 1e-3 / 2e4))


def line(found: lm.response.Spectrum, cause: str):
    return next(one for one in found.lines if cause in one.cause)


# The first harmonic of a sawtooth of the height q is q/pi; a sine that is held over sixteenths of its period has sinc(1/16) of its
# amplitude; T_D sin(4 n phi) bends the field by T_D/(n T_H), at full steps and slow speed.
LINES = {
    "transmission error of worm": ({"worm": 10.0 * ARCSEC}, 1.0, 10.0 * ARCSEC, 2e-3),
    "microsteps of ra": ({"microsteps": 4}, 4 * STEPS, FULL_STEP / 4 / RATIO / math.pi * carried(4 * STEPS), 0.02),
    "sine table": ({"table_error": 0.05}, STEPS, 0.05 * FULL_STEP / RATIO * carried(STEPS) * float(np.sinc(1.0 / 16.0)), 0.01),
    "detents": ({"detent": 0.02 * T_H}, STEPS, 0.02 / (STEPS / 4) / RATIO, 0.1),
}


@pytest.mark.parametrize("cause", LINES)
def test_each_cause_is_a_line_of_its_amplitude_at_its_order(cause: str):
    made, order, amplitude, rel = LINES[cause]
    found = line(lm.spectrum(mount(**made)), cause)
    assert found.order == pytest.approx(order, rel=1e-9)
    assert found.amplitude == pytest.approx(amplitude, rel=rel)
    assert cause != "transmission error of worm" or found.orders["axis"] == pytest.approx(RATIO, rel=1e-9)


def test_the_short_form_and_the_axis_have_the_same_lines_as_the_train():
    motor = {"kind": "stepper", "rotor_inertia": J, "steps_per_revolution": STEPS, "holding_torque": T_H}
    short = lm.Scenario(
        motor=motor,
        gearbox=rated_gearbox(RATIO, 100.0, 10.0, 2e4, 1.0, inertia=0.0, viscous_friction=0.02, mesh_damping=20.0),
        load={"inertia": 1e-3},
        command={"stepping": {"microsteps": 4, "reference": reference(5.0)}},
        simulation=run_of(5.0, 1e-3),
    )
    axis = lm.Scenario(
        axis={
            "motor": motor,
            "belt": {"travel_per_turn": 2.0 * math.pi / RATIO, "stiffness": 2e8, "damping": 2e4},
            "slide": {"mass": 1e-3, "viscous_friction": 0.02 * RATIO**2},
        },
        command={"stepping": {"microsteps": 4, "travel": reference(5.0)}},
        simulation={"duration": 5.0, "sample_interval": 1e-3},
    )
    wanted = line(lm.spectrum(mount(microsteps=4)), "microsteps")
    for scenario, rel in ((short, 1e-3), (axis, 0.02)):  # the friction of the axis is behind its spring
        found = line(lm.spectrum(scenario), "microsteps")
        assert found.order == pytest.approx(wanted.order, rel=1e-9)
        assert found.amplitude == pytest.approx(wanted.amplitude, rel=rel)


def test_microsteps_worm_and_detents_are_causes_with_their_shares():
    """The rms of the worm is 10 arcsec/sqrt(2), that of the first harmonic of microsteps q/pi/sqrt(2) as the axis makes it."""
    budget = lm.pointing_budget(mount(microsteps=16, detent=0.02 * T_H, worm=10.0 * ARCSEC), after=1.0, robustness=False)
    assert {"microsteps", "detents", "transmission error"} <= set(budget.without)
    alone = budget.alone["microsteps"]["ra"]
    spread = math.sqrt(alone.rms**2 - alone.mean**2)
    assert spread == pytest.approx(FULL_STEP / 16 / RATIO / math.pi * carried(16 * STEPS) / math.sqrt(2.0), rel=0.1)
    assert budget.contributions("ra")["transmission error"] == pytest.approx(0.5 * (10.0 * ARCSEC) ** 2, rel=0.2)
    assert budget.units == {"ra": "rad"}


def test_a_slow_axis_has_the_rounding_of_its_microsteps_exactly():
    """At 1/20 of that speed the rotor follows each step at once."""
    scenario = mount(duration=20.0, microsteps=4).replace(**{"command.ra.stepping.reference": reference(20.0, SPEED / 20.0)})
    budget = lm.pointing_budget(scenario, after=2.0, robustness=False)
    error = budget.whole["ra"]
    assert math.sqrt(error.rms**2 - error.mean**2) == pytest.approx(FULL_STEP / 4 / RATIO / math.sqrt(12.0), rel=0.02)


def test_the_driver_counts_what_its_field_turns():
    """What the driver believes is the reference rounded to microsteps: the measured error is what is between field and axis."""
    budget = lm.pointing_budget(mount(microsteps=4), after=1.0, robustness=False)
    assert float(np.abs(budget.errors["ra"] + budget.measured["ra"]).max()) == pytest.approx(0.5 * FULL_STEP / 4 / RATIO, rel=0.01)


def test_a_mount_that_loses_steps_does_not_fit():
    from lostmotion.reports.pointing import verdict_of

    fast = mount(duration=0.5, microsteps=1).replace(**{"command.ra.stepping.reference": reference(0.5, 3.0)})
    budget = lm.pointing_budget(fast, robustness=False)
    verdict = verdict_of(budget)
    assert verdict is not None
    assert verdict.state == "does not fit"
    assert "full steps lost" in str(verdict)


def test_the_report_of_a_mount_is_in_arcsec_and_lists_its_orders(tmp_path):
    from lostmotion.reports.pointing import header, order_rows, pointing_report
    from lostmotion.reports.written_files import write_report

    budget = lm.pointing_budget(mount(worm=10.0 * ARCSEC), after=1.0, robustness=False)
    assert "rms [arcsec]" in header(budget)
    first = order_rows(budget)[0]
    assert float(first[1]) == pytest.approx(10.0, rel=2e-3)
    page = write_report(tmp_path / "track", pointing_report("mount", budget), ())
    assert "Error at constant speed by order" in page.read_text()


def test_a_short_run_says_why_it_has_no_orders():
    budget = lm.pointing_budget(lm.load(ROOT / "scenarios" / "stepper-equatorial-mount.toml"), robustness=False)
    assert "whole one is needed" in str(budget.orders["stepper"])
    assert budget.alone["transmission error"]["stepper"].peak < budget.alone["backlash"]["stepper"].peak


def test_a_stepper_under_pulses_has_no_reference_to_point_by():
    scenario = mount().replace(**{"command.ra.stepping": {"pulses": {"times": [0.1, 0.2], "values": [1, 1]}, "microsteps": 4}})
    assert "command.stepping" in refused(lambda: lm.pointing_budget(scenario))


# --- steppers on the doors of the tool ---
STEPPERS = [record for record in lm.catalogue() if record.kind == "stepper"]

# Rated voltage of a phase, R I, as the manuals of Trinamic print it beside both [V].
RATED_VOLTAGES = {
    "2818-32-07-006": 3.8, "2818-51-07-012": 6.2, "4218-35-10-027": 5.3, "4218-41-10-035": 4.5, "4218-51-10-049": 5.0,
    "4218-47-28-040": 1.4, "5718-41-28-055": 2.0, "5718-51-28-101": 2.3, "5718-56-28-126": 2.5, "5718-76-28-189": 3.2,
    "6018-45-28-110": 2.1, "6018-56-28-165": 2.52, "6018-65-28-210": 3.36, "6018-86-28-310": 4.17,
    "8618-65-59-340-parallel": 1.65, "8618-65-59-340-series": 3.42, "8618-80-55-460": 2.3, "8618-96-55-700": 2.56, "8618-118-60-870": 2.7,
}  # fmt: skip


def test_records_of_steppers_are_enough_and_of_all_sizes():
    """T_H/J of hybrid steppers is near 60,000 rad/s²; a wrong unit would be ten times off."""
    assert len([record for record in STEPPERS if not record.missing()]) >= 30
    assert {record.steps_per_revolution for record in STEPPERS} == {200.0, 400.0}
    torques = [record.holding_torque for record in STEPPERS]
    assert min(torques) < 0.02
    assert max(torques) > 10.0
    assert [r.name for r in STEPPERS if not 1.5e4 < r.holding_torque / r.rotor_inertia < 2.5e5] == []


@pytest.mark.parametrize(("name", "volts"), RATED_VOLTAGES.items())
def test_resistance_and_current_make_the_rated_voltage_that_is_printed(name: str, volts: float):
    record = find(f"trinamic-qsh{name}", "motor")
    assert record.resistance_phase * record.rated_current == pytest.approx(volts, rel=0.04)  # volts have two digits


MOVE = 'moves = [{ to = "0.5 UNIT" }], speed = "2 UNIT/s", acceleration = "20 UNIT/s^2"'
FORMS = {
    "short": f"""
        motor.from = "trinamic-qsh4218-51-10-049"
        [gearbox]
        ratio = 3
        inertia = 0.0
        rated_output_torque = "5 N m"
        rated_input_speed = "1000 rpm"
        stiffness.kind = "rigid"
        losses = {{ kind = "constant_efficiency", efficiency = 1.0 }}
        [load]
        inertia = "1e-4 kg m^2"
        viscous_friction = "0.01 N m s/rad"
        [command.stepping]
        microsteps = 16
        reference = {{ {MOVE.replace("UNIT", "rad")} }}""",
    "axis": f"""
        axis.motor.from = "trinamic-qsh4218-51-10-049"
        axis.belt = {{ travel_per_turn = "2.0943951023931953 m", stiffness = "1e5 N/m", damping = "100 N s/m" }}
        axis.slide = {{ mass = "1 g", viscous_friction = "0.05 N s/m" }}
        command.stepping = {{ microsteps = 16, travel = {{ {MOVE.replace("UNIT", "m")} }} }}""",
    "train": f"""
        shafts.motor = {{}}
        shafts.load = {{ inertia = "1e-4 kg m^2", viscous_friction = "0.01 N m s/rad" }}
        motors.m = {{ from = "trinamic-qsh4218-51-10-049", shaft = "motor" }}
        gears.g = {{ input = "motor", output = "load", ratio = 3, stiffness = {{ kind = "rigid" }} }}
        command.m.stepping = {{ microsteps = 16, reference = {{ {MOVE.replace("UNIT", "rad")} }} }}""",
}


@pytest.mark.parametrize(("form", "text"), FORMS.items())
def test_a_record_of_a_stepper_runs_in_each_form(form: str, text: str, tmp_path: Path):
    """Where it ends, 1/3 of the angle of the motor or on a belt with 1/3 m to a radian, it is off by half a microstep and its detents."""
    path = tmp_path / "s.toml"
    path.write_text(text + '\n[simulation]\nduration = "1 s"\nsample_interval = "5 ms"\n')
    scenario = lm.load(path)
    (motor,) = scenario.train().motors.values()
    assert (motor.kind, motor.holding_torque, motor.rotor_inertia) == ("stepper", 0.49, pytest.approx(68e-7))
    found = lm.simulate(scenario)
    half_a_microstep, detents = math.pi / 3200 / 3, 0.028 / 0.49 / 50 / 3
    end = float(found["slide_position" if form == "axis" else "load_angle"][-1])
    assert end == pytest.approx(0.5, abs=half_a_microstep + detents)


def test_what_a_record_of_a_stepper_lacks_is_said_and_given_beside_it():
    motor = lm.motor("sanyo-denki-sh1424-5041")
    assert set(motor.note) == {"friction_torque", "detent_torque"}
    from lostmotion.data_sheets.components import motor_table

    table = motor_table("sanyo-denki-sh1424-5041", {"detent_torque": "20 mN m", "supply_voltage": "24 V"})
    assert lm.Motor(**table).detent_torque == 0.02
    assert set(table["note"]) == {"friction_torque"}


@pytest.mark.parametrize("key", ["steps", "steps_per_rev", "steps_per_turn", "step_per_revolution"])
def test_a_misspelt_number_of_steps_points_to_its_key(key: str):
    refused(lambda: lm.Motor(kind="stepper", rotor_inertia=1e-6, holding_torque=0.1, **{key: 48}), key)
    rated = {"rated_voltage": 24.0, "kind": "brushless", "holding_torque": 1.0}
    refused(lambda: lm.data_sheets.MotorSheet(name="m", **rated), reason="holding_torque")
    refused(lambda: lm.data_sheets.MotorSheet(name="m", kind="stepper", rated_torque=1.0), reason="rated_torque")


TASK = """
[task]
cycle = "1 s"
microsteps = 16
supply = {{ min_voltage = "24 V" }}
settling_window = "0.5 deg"
[load]
inertia = "{inertia} kg m^2"
friction_torque = "0.2 N m"
[gearbox]
ratio = 5
inertia = 0.0
rated_output_torque = "20 N m"
rated_input_speed = "2000 rpm"
stiffness = {{ kind = "linear", stiffness = "2000 N m/rad" }}
mesh_damping = "2 N m s/rad"
losses = {{ kind = "constant_efficiency", efficiency = 1.0 }}
[controller.reference]
kind = "position"
speed = "10 rad/s"
acceleration = "{acceleration} rad/s^2"
dwell = "0.1 s"
moves = [{{ to = "1 rad" }}, {{ to = "0 rad" }}]
[candidates]
motor = ["trinamic-qsh5718-76-28-189", "maxon-ec-i-52-606793"]
"""


def chosen(tmp_path: Path, inertia: float = 1e-3, acceleration: float = 100.0):
    (tmp_path / "task.toml").write_text(TASK.format(inertia=inertia, acceleration=acceleration))
    return lm.select(tmp_path / "task.toml").set_index(pair="motor")


def test_a_selection_compares_the_torque_of_the_motion_with_the_pull_out_curve(tmp_path: Path):
    """At the end of the ramp the motor turns at 50 rad/s and gives J a i + (J_L a + T_f)/i, compared with 2/3 of the curve there."""
    pairs = chosen(tmp_path)
    row = pairs.sel(pair="trinamic-qsh5718-76-28-189")
    motor = lm.motor("trinamic-qsh5718-76-28-189").model_copy(update={"supply_voltage": 24.0})
    torque = 480e-7 * 100.0 * 5.0 + (1e-3 * 100.0 + 0.2) / 5.0
    share = 1.5 * torque / float(lm.sizing.pull_out_torque(motor, 50.0))
    assert bool(row.fits)
    assert float(row.inertia_ratio) == pytest.approx(1e-3 / 25.0 / 480e-7, rel=1e-12)
    assert float(row.cycles) >= 2
    assert float(row.settling_time) < 0.2
    assert math.isnan(float(row.position_gain))
    assert float(pairs.sel(pair="maxon-ec-i-52-606793").position_gain) > 0.0
    from lostmotion.studies.runs.candidate_rows import Axes

    study = lm.studies.load_task(tmp_path / "task.toml")
    (finding,) = (f for f in Axes(study).judged(study.parameters(0, 1)[0]) if f.rule == "stepper_torque")
    assert finding.use == pytest.approx(share, rel=1e-6)


@pytest.mark.parametrize(("standstill", "share"), [(None, 1.0), (0.5, 0.7)])
def test_the_energy_of_a_stepper_is_the_heat_of_its_phases_and_the_work_on_its_shaft(standstill, share, tmp_path: Path):
    """2 R I² all the time, or the square of the standstill current of it 0.1 s after each move of 0.2 s, for 0.4 s of the second; and 2 rad against 0.2 N·m."""
    name = "trinamic-qsh5718-76-28-189"
    task = TASK.format(inertia=1e-3, acceleration=100.0).replace(', "maxon-ec-i-52-606793"', "")
    reduced = "" if standstill is None else f"[motor]\nstandstill_current = {standstill}\n"
    (tmp_path / "task.toml").write_text(task + reduced)
    row = lm.select(tmp_path / "task.toml").set_index(pair="motor").sel(pair=name)
    motor = lm.motor(name)
    heat = 2.0 * motor.resistance_phase * motor.rated_current**2
    assert float(row.energy) == pytest.approx(share * heat + 0.4, rel=0.01)
    assert float(row.energy_returned) == 0.0
    assert float(row.current_rms) == pytest.approx(math.sqrt(share) * motor.rated_current, rel=0.01)


def test_a_selection_refuses_a_stepper_that_would_fall_out_of_step(tmp_path: Path):
    row = chosen(tmp_path, acceleration=8000.0).sel(pair="trinamic-qsh5718-76-28-189")
    assert not bool(row.fits)
    assert "stepper_torque" in str(row.violated.values)
    heavy = chosen(tmp_path, inertia=1.3e-2).sel(pair="trinamic-qsh5718-76-28-189")
    assert str(heavy.violated.values) == "inertia_ratio"
    assert lm.studies.load_task(ROOT / "examples" / "select-axis.toml").axis.steppers == {}  # without steppers it has none of their tables


def test_the_run_of_a_chosen_stepper_is_that_of_the_long_form(tmp_path: Path):
    """Tracking error of the pair by a scenario of its own, written as a train with the same steps."""
    row = chosen(tmp_path).sel(pair="trinamic-qsh5718-76-28-189")
    record = find("trinamic-qsh5718-76-28-189", "motor")
    moves = [{"to": 1.0, "dwell": 0.1}, {"to": 0.0, "dwell": 0.5}, {"to": 1.0, "dwell": 0.1}, {"to": 0.0}]
    mesh = {"ratio": 5, "stiffness": {"kind": "linear", "stiffness": 2000.0}, "mesh_damping": 2.0}
    train = lm.Scenario(
        shafts={"m": {}, "load": {"inertia": 1e-3, "friction_torque": 0.2}},
        motors={"m": {**record.motor().model_dump(exclude_none=True, exclude={"note"}), "shaft": "m", "supply_voltage": 24.0}},
        gears={"g": {"input": "m", "output": "load", **mesh}},
        command={"m": {"stepping": {"microsteps": 16, "reference": {"speed": 10.0, "acceleration": 100.0, "moves": moves}}}},
        simulation={"duration": 2.0, "sample_interval": 125e-6},
    )
    found = lm.simulate(train)
    reference = train.tables.command["m"].stepping.reference.at(found.time.values)[0]
    error = abs(found.load_angle.values - reference)[found.time.values >= 1.0].max()
    assert float(row.tracking_error_peak) == pytest.approx(float(error), rel=0.05)


def test_a_slide_on_a_belt_is_chosen_with_steppers_alone(tmp_path: Path):
    """Force and mass alone: the belt carries (m a + F) and the rotor turns with a/r; the tightest limit is the torque at 47 rad/s."""
    (tmp_path / "task.toml").write_text("""
        task = { cycle = "1.2 s", supply = { min_voltage = "24 V" } }
        slide = { mass = "0.5 kg", friction_force = "2 N" }
        belt = { pitch = "2 mm", teeth = 20, stiffness = "100 N/mm", damping = "30 N s/m" }
        candidates.motor = ["sanyo-denki-sh1421-5041"]
        [controller.reference]
        kind = "position"
        speed = "0.3 m/s"
        acceleration = "5 m/s^2"
        dwell = "0.2 s"
        moves = [{ to = "60 mm" }, { to = "0 mm" }]
    """)
    pairs = lm.select(tmp_path / "task.toml")
    radius = 0.04 / (2.0 * math.pi)
    motor = lm.motor("sanyo-denki-sh1421-5041").model_copy(update={"supply_voltage": 24.0})
    torque = (0.5 * 5.0 + 2.0) * radius + 44e-7 * 5.0 / radius
    share = 1.5 * torque / float(lm.sizing.pull_out_torque(motor, 0.3 / radius))
    assert bool(pairs.fits[0])
    assert float(pairs.inertia_ratio[0]) == pytest.approx(0.5 * radius**2 / 44e-7, rel=1e-9)
    assert 1.5 * torque / 0.23 < share < 1.0
    assert float(pairs.rest_error[0]) < 0.04 / 400 / 16 + 2.0 / 1e5 + radius * math.asin(2.0 * radius / 0.23) / 100  # and friction


@pytest.mark.parametrize(("base", "key"), [("stepper-belt-axis", "motor_pointing_error"), ("stepper-short", "pointing_error")])
def test_a_study_over_steppers_has_their_pointing_error(base: str, key: str, tmp_path: Path):
    """Each row is a run of its own, with the error that the run has."""
    if base == "stepper-short":
        (tmp_path / "stepper-short.toml").write_text(FORMS["short"] + '\n[simulation]\nduration = "0.5 s"\nsample_interval = "1 ms"\n')
        base, vary = "stepper-short.toml", ("load.inertia", [1e-4, 2e-4])
    else:
        vary = ("axis.slide.mass", [0.4, 0.6])
    values = f'[[vary]]\nkey = "{vary[0]}"\nvalues = {vary[1]}\n'
    (tmp_path / "study.toml").write_text(f'title = "s"\nbase = "{base}"\n{values}[keep]\nworst = "peak({key})"\n')
    rows = lm.study(lm.studies.load_study(tmp_path / "study.toml"), tmp_path / "rows")
    from lostmotion.simulation.runs.pointing_error import pointing_errors
    from lostmotion.simulation.runs.run import run
    from lostmotion.studies.runs.read_table import read_table

    table = read_table(rows)
    start = tmp_path / base if base.endswith(".toml") else base
    for value, worst in zip(vary[1], table["worst"].to_pylist(), strict=True):
        scenario = lm.load(start, {vary[0]: value})
        (error,) = pointing_errors(scenario, run(scenario, energy=False)).values()
        assert worst == pytest.approx(float(abs(error).max()), rel=1e-9)
