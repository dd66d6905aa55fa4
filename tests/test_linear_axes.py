"""Linear motion: slides, and the screws, racks and belts that move them, against the same drive in units of rotation."""

import math
import re
import tomllib

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline
from scipy.special import ellipk

import lostmotion as lm
from conftest import ROOT
from lostmotion.inputs.schema import unit_in_schema
from lostmotion.live_page.description import describe
from lostmotion.portable import fmu_export, model_description
from lostmotion.portable.derivation import derivation_of
from lostmotion.portable.scenario_as_numbers import numbers_of
from lostmotion.reports.page import render
from lostmotion.reports.run import summary
from lostmotion.reports.servo import servo_report
from lostmotion.simulation.forms.set_by_dotted_key import set_values
from lostmotion.simulation.forms.train_tables import train_schema
from refusals import refusals_of, refused

SCREW = """
title = "Ball-screw axis"
shafts.motor = { inertia = "2e-4 kg m^2", friction_torque = "0.05 N m" }
motors.drive = { shaft = "motor", kind = "torque_source", rated_torque = "1 N m", rotor_inertia = "1e-4 kg m^2" }
command.drive = { amplitude = 0.8, frequency = "5 Hz" }
simulation = { duration = "1 s", sample_interval = "1 ms" }
[slides.table]
mass = "20 kg"
friction_force = "30 N"
breakaway_force = "45 N"
viscous_friction = "50 N s/m"
force = { mean = "100 N" }
[screws.screw]
input = "motor"
output = "table"
lead = "10 mm"
efficiency = 0.9
backdriving_efficiency = 0.8
stiffness_curve = { slopes = ["100 N/um", "200 N/um"], breaks = ["1 um"] }
backlash = "2 um"
hysteresis = { efficiency = 0.9 }
inertia = "1e-5 kg m^2"
drag_torque = "0.02 N m"
"""

ROTARY = """
shafts.motor = { inertia = 2e-4, friction_torque = 0.07 }
motors.drive = { shaft = "motor", kind = "torque_source", rated_torque = 1.0, rotor_inertia = 1e-4 }
command.drive = { amplitude = 0.8, frequency = 5.0 }
simulation = { duration = 1.0, sample_interval = 1e-3 }
[shafts.table]
inertia = 20.0
friction_torque = 30.0
breakaway_torque = 45.0
viscous_friction = 50.0
torque = 100.0
[gears.screw]
input = "motor"
output = "table"
ratio = 1.0
inertia = 1e-5
stiffness = { kind = "curve", slopes = [1e8, 2e8], breaks = [1e-6], backlash = 2e-6 }
hysteresis = { efficiency = 0.9 }
losses = { kind = "mesh_efficiency", drive_efficiency = 0.9, backdrive_efficiency = 0.8 }
"""

# Of the slide and its screw: the names that the same variables have in units of rotation.
NAMES = {
    "table_position": "table_angle",
    "table_load_force": "table_load_torque",
    "table_contact_force": "table_contact_torque",
    "screw_deflection": "screw_twist",
    "screw_output_force": "screw_output_torque",
    "screw_deflection_contact": "screw_twist_contact",
    "screw_deflection_contact_force": "screw_twist_contact_torque",
}


def screw(**changes):
    scenario = lm.Scenario.model_validate(tomllib.loads(SCREW))
    return scenario.replace(**changes) if changes else scenario


def test_screw_axis_equals_the_rotary_train_bit_for_bit():
    """Of all variables, switching instants and energies: only names and units differ."""
    linear = lm.simulate(screw())
    rotary = lm.simulate(lm.Scenario.model_validate(tomllib.loads(ROTARY)).replace(**{"gears.screw.ratio": 2.0 * math.pi / 0.01}))
    assert {NAMES.get(name, name) for name in linear} == set(rotary)
    for name in linear:
        assert linear[name].values.tobytes() == rotary[NAMES.get(name, name)].values.tobytes(), name
    assert lm.energy_of(linear) == lm.energy_of(rotary)
    one, other = lm.switchings_of(linear), lm.switchings_of(rotary)
    assert one["instant"].values.tobytes() == other["instant"].values.tobytes()
    assert len(one["instant"]) > 10
    assert linear.attrs["steps"] == rotary.attrs["steps"]
    assert {name: v.attrs["units"] for name, v in linear.items() if "table" in name or "screw" in name} == (
        dict.fromkeys(("screw_output_force", "table_load_force", "table_contact_force", "screw_deflection_contact_force"), "N")
        | {"table_speed": "m/s", "table_position": "m", "screw_deflection": "m", "screw_input_torque": "N*m"}
        | {"table_contact": "1", "screw_deflection_contact": "1"}
    )


def test_weight_of_an_inclined_slide_is_a_load():
    """m g sin(inclination), beside the force that is given, also of what a linear motor adds to the mass."""
    g = 9.80665
    vertical = screw(**{"slides.table.inclination": "90 deg"})
    assert vertical.loads()["table"].mean == 100.0 + 20.0 * g
    sloping = screw(**{"slides.table.inclination": "30 deg"})
    assert sloping.loads()["table"].mean == pytest.approx(100.0 + 10.0 * g, rel=1e-15)
    falling = lm.simulate(
        lm.Scenario(
            slides={"ram": {"mass": "3 kg", "inclination": "90 deg"}},
            linear_motors={"lifter": {"slide": "ram", "rated_force": "10 N", "mass": "1 kg"}},
            command={"lifter": 0.0},
            simulation={"duration": "1 s", "sample_interval": "0.1 s"},
        )
    )
    t = falling["time"].values
    np.testing.assert_allclose(falling["ram_position"], -0.5 * g * t**2, rtol=1e-13, atol=0.0)
    assert falling["lifter_force"].attrs["units"] == "N"


@pytest.mark.parametrize(("drive", "travel"), [
    (lm.model.Screw(input="a", output="b", lead="10 mm"), 0.01),
    (lm.model.Screw(input="a", output="b", pitch="5 mm", starts=4), 0.02),
    (lm.model.Rack(input="a", output="b", module="2 mm", teeth=20), math.pi * 0.04),
    (lm.model.Rack(input="a", output="b", module="2 mm", teeth=20, helix_angle="19.5283 deg"), math.pi * 0.04 / 0.94247),
    (lm.model.Belt(input="a", output="b", teeth=20, pitch="5 mm"), 0.1),
    (lm.model.Belt(input="a", output="b", pulley_diameter="31.83098862 mm"), 0.1),
])  # fmt: skip
def test_travel_to_one_turn(drive, travel):
    """Of catalogues: a rack of module 2 with a helix angle of 19.5283 degrees has 133.33 mm to 20 teeth."""
    assert drive.travel() == pytest.approx(travel, rel=1e-5)
    assert drive.gear("a", "b").ratio == 2.0 * math.pi / drive.travel()


def test_efficiency_inertia_and_stiffness_of_a_screw_follow_from_its_drawing():
    """tan(g)/tan(g + r) and tan(g - r)/tan(g) of the friction angle r, as textbooks have it; compliances in series."""

    def part(**more):
        return lm.model.Screw(input="a", output="b", lead="10 mm", **more)

    g, r = math.atan(10.0 / (25.0 * math.pi)), math.atan(0.1)
    rubbing = part(mean_diameter="25 mm", friction_coefficient=0.1)
    assert rubbing.efficiencies() == pytest.approx((math.tan(g) / math.tan(g + r), math.tan(g - r) / math.tan(g)), rel=1e-14)
    assert part(efficiency=0.8).efficiencies() == (0.8, 2.0 - 1.0 / 0.8)
    mass = 7850.0 * math.pi / 4.0 * 0.025**2
    assert part(diameter="25 mm", length="1 m").gear("a", "b").inertia == pytest.approx(mass * 0.025**2 / 8.0, rel=1e-14)
    shank = {"supported_length": "800 mm", "core_diameter": "22 mm", "support": "both ends"}
    soft = part(nut_stiffness="400 N/um", bearing_stiffness="600 N/um", **shank).gear("a", "b").stiffness.stiffness
    assert soft == pytest.approx(1.0 / (1 / 4e8 + 1 / 6e8 + 0.8 / (4.0 * 206e9 * math.pi / 4.0 * 0.022**2)), rel=1e-14)


def test_a_preloaded_belt_loses_half_of_its_stiffness_where_a_strand_goes_slack():
    """Each of two strands of 1e6 N/0.5 m: 2 MN/m. 100 N of preload are used up at 50 um, by a force of 200 N."""
    belt = {"input": "a", "output": "b", "teeth": 20, "pitch": "5 mm", "specific_stiffness": "1e6 N"}
    made = lm.model.Belt(**belt, free_lengths=["500 mm", "500 mm"], preload="100 N")
    curve = made.gear("a", "b").stiffness
    for deflection, force in ((20e-6, 80.0), (50e-6, 200.0), (90e-6, 280.0), (-90e-6, -280.0)):
        assert float(curve.torque(deflection)) == pytest.approx(force, rel=1e-12)
    assert "a preload takes two strands of" in refused(lambda: lm.model.Belt(**belt, free_lengths=["500 mm", "400 mm"], preload="100 N"))


def test_end_stops_hold_the_slide_within_its_travel():
    """Pressed against a stop, the slide comes to rest where the spring carries the force: F/k beyond the stop."""
    stops = {"lower": "-10 mm", "upper": "20 mm", "stiffness": "100 N/um"}
    scenario = lm.Scenario(
        slides={"ram": {"mass": "3 kg", "viscous_friction": "2000 N s/m", "end_stops": stops}},
        linear_motors={"m": {"slide": "ram", "force_constant": "50 N/A", "rated_current": "4 A"}},
        command={"m": 0.5},
        simulation={"duration": "3 s", "sample_interval": "10 ms"},
    )
    result = lm.simulate(scenario)
    assert float(result["ram_position"][-1]) == pytest.approx(0.02 + 100.0 / 1e8, rel=1e-12)
    begun = lm.simulate(screw(**{"initial.positions": {"table": "20 mm"}, "initial.slide_speeds": {"table": "5 mm/s"}}))
    assert (float(begun["table_position"][0]), float(begun["table_speed"][0])) == (0.02, 0.005)


def test_cogging_of_a_linear_motor_has_its_pole_pitch():
    """A slide that is moved slowly against much viscous friction meets F_c sin(2 pi x/tau)."""
    motor = lm.model.LinearMotor(slide="ram", rated_force="200 N", cogging_force="8 N", pole_pitch="24 mm")
    curve = motor.cogging().core()
    for x in np.linspace(-0.05, 0.05, 101):
        assert curve(x) == pytest.approx(8.0 * math.sin(2.0 * math.pi * x / 0.024), abs=8e-3)


def test_cogging_swings_as_a_pendulum():
    """m x'' = F sin(2 pi x/tau): the period of a pendulum, by the elliptic integral, from chords as fine as they are told, and from the sine."""
    force, mass, tau, begin = 30.0, 4.0, 0.024, 0.3 * 0.024
    omega = math.sqrt(force / mass * 2.0 * math.pi / tau)
    period = 4.0 * ellipk(math.sin((math.pi - 2.0 * math.pi * begin / tau) / 2.0) ** 2) / omega
    for solver, error, within in (("exact", None, 1e-3), ("exact", 3e-5, 1e-6), ("dormand-prince", None, 1e-8)):
        motor = {"slide": "x", "rated_force": 100.0, "cogging_force": force, "cogging_error": error, "pole_pitch": tau}
        swinging = lm.Scenario(
            slides={"x": {"mass": mass}},
            linear_motors={"coil": motor},
            initial={"positions": {"x": begin}},
            simulation={"duration": 20.0 * period, "sample_interval": period / 200.0},
        )
        options = {} if solver == "exact" else {"relative_tolerance": 1e-12}
        result = lm.simulate(swinging, solver=solver, **options)
        course = CubicHermiteSpline(result.time, result["x_position"] - 0.5 * tau, result["x_speed"])
        crossings = course.roots(extrapolate=False)[::2]
        # The cubics between samples err by (2 pi/200)^4/384 of the amplitude, alike in each period.
        found = (crossings[-1] - crossings[0]) / (len(crossings) - 1)
        assert found == pytest.approx(period, rel=within)
    assert "cogging_error" in refused(lambda: lm.model.LinearMotor(slide="x", rated_force=1.0, cogging_error=0.1))


test_bad_input_is_refused = refusals_of(
    lambda changes: screw(**changes),
    ({"slides.table.mass": "20 kg m^2"}, "slides.table.mass"),
    ({"slides.table.friction_force": "3 N m"}, "slides.table.friction_force"),
    ({"screws.screw.backlash": "3 arcmin"}, "screws.screw.backlash"),
    ({"screws.screw.output": "motor"}, "screws.screw.output: is a shaft; give the name of a slide"),
    ({"screws.screw.input": "table"}, "screws.screw.input: is a slide; give the name of a shaft"),
    ({"screws.screw.output": "tabel"}, "screws.screw.output: did you mean table"),
    ({"motors.drive.shaft": "table"}, "motors.drive.shaft: write it in [linear_motors]"),
    ({"gears.g": {"input": "motor", "output": "table", "ratio": 2}}, "gears.g.output: [screws], [racks] and [belts]"),
    ({"initial.angles": {"table": 1.0}}, "initial.angles.table: give initial.positions.table"),
    ({"initial.positions": {"motor": 1.0}}, "initial.positions.motor: give initial.angles.motor"),
    ({"screws.screw.pitch": "5 mm"}, "screws.screw: lead and pitch, which say the same"),
    ({"shafts.table": {"inertia": 1.0}}, "shafts.table, slides.table: have the same name"),
    ({"shafts.motor.domain": "translation"}, "shafts.motor.domain: write the slide as [slides.motor]"),
    ({"screws.screw.stiffness": "200 N/um"}, "screws.screw: stiffness and stiffness_curve"),
    ({"slides.table.inclination": "100 deg"}, "slides.table.inclination"),
    ({"screws.screw.damping": "1 N s/m", "screws.screw.stiffness_curve": None, "screws.screw.hysteresis": None}, "screws.screw"),
    ({"slides.alone": {"mass": "1 kg"}}, "slides.alone"),
    ({"shafts.alone": {"inertia": "1 kg m^2"}}, "shafts.alone"),
)


def test_parts_of_slides_and_linear_motors_have_their_keys():
    stops = {"lower": "-0.1 m", "upper": "0.1 m", "stiffness": "1 kN/mm"}
    coil = {"slide": "table", "rated_force": "200 N", "cogging_force": "8 N", "pole_pitch": "24 mm"}
    moved = screw(**{"slides.table.end_stops": stops, "linear_motors.coil": coil})
    assert moved.key_of("end_stops", "table_end_stop") == "slides.table.end_stops"
    assert moved.key_of("angle_torques", "coil_cogging") == "linear_motors.coil.cogging_force"
    assert moved.key_of("gears", "screw") == "screws.screw"


AXIS = """
title = "Axis"
axis.motor = { kind = "torque_source", rotor_inertia = "3 kg cm^2", rated_torque = "2.4 N m", torque_limit = "7 N m" }
axis.screw = { lead = "10 mm", efficiency = 0.9, stiffness = "150 N/um", backlash = "2 um" }
axis.slide = { mass = "20 kg", friction_force = "30 N" }
controller.sample_time = "125 us"
controller.encoder = { bits = 20 }
controller.position_encoder = { resolution = "50 nm" }
controller.position = { gain = "1.5 (m/min)/mm", feedforward = 1.0, speed_limit = "500 mm/s" }
controller.speed = { gain = 0.4, integral_time = "20 ms" }
simulation = { duration = "0.6 s", sample_interval = "1 ms" }
[controller.reference]
kind = "position"
speed = "300 mm/s"
acceleration = "3 m/s^2"
moves = [{ to = "100 mm" }]
"""


def axis(**changes):
    tables = tomllib.loads(AXIS)
    set_values(tables, changes.items())
    return lm.Scenario.model_validate(tables)


def test_short_form_of_an_axis_is_a_train():
    """The same scenario as written out with shafts, slides and screws: the same results."""
    short = axis()
    assert list(short.train().shafts) == ["motor", "slide"]
    tables = tomllib.loads(AXIS)
    parts = tables.pop("axis")
    tables["controllers"] = {"motor": tables.pop("controller")}
    tables["controllers"]["motor"]["position_encoder"]["shaft"] = "slide"
    tables |= {"shafts": {"motor": {}}, "slides": {"slide": parts["slide"]}}
    tables |= {"motors": {"motor": {"shaft": "motor", **parts["motor"]}}}
    tables |= {"screws": {"screw": {"input": "motor", "output": "slide", **parts["screw"]}}}
    assert lm.Scenario.model_validate(tables) == short
    behind = axis(**{"axis.gearbox": {"ratio": 3.0}})
    assert list(behind.train().shafts) == ["motor", "screw", "slide"]
    assert behind.screws["screw"].input == "screw"


def test_references_and_encoders_of_slides_are_in_metres():
    controller = axis().controllers["motor"]
    assert controller.reference.moves[0].to == 0.1
    assert controller.reference.speed == 0.3
    assert controller.position_encoder.resolution == 5e-8
    assert controller.position.speed_limit == 0.5
    assert controller.position.gain == pytest.approx(25.0, rel=1e-15)  # 1.5 (m/min)/mm
    result = lm.simulate(axis())
    # The play of 2 um, and what 30 N bend of 150 N/um; the rest is the integrator's.
    assert float(result["slide_position"][-1]) == pytest.approx(0.1, abs=5e-6)
    assert result["motor_position_reference"].attrs["units"] == "m"
    assert result["motor_measured_position"].attrs["units"] == "m"
    assert result["motor_speed_reference"].attrs["units"] == "rad/s"


def test_linear_scale_reads_its_grating_in_steps():
    """Within half of p/2^bits, and with the period p of its error: at whole periods the error is sin(phase)."""
    scale = lm.control.Encoder(grating_period=2e-5, bits=4, error=1e-7)
    assert scale.step == 2e-5 / 16
    result = lm.simulate(axis(**{"controller.position_encoder": {"grating_period": "20 um", "bits": 4}}))
    step = 2e-5 / 16
    read = result["motor_measured_position"].values / step
    np.testing.assert_allclose(read, np.round(read), rtol=0.0, atol=1e-6)


test_bad_input_in_the_short_form_is_refused_with_its_keys = refusals_of(
    lambda changes: axis(**changes),
    ({"controller.reference.moves": [{"to": "1 rad"}]}, "controller.reference.moves.0.to"),
    ({"controller.position.speed_limit": "3 rad/s"}, "controller.position.speed_limit"),
    ({"controller.encoder.resolution": "1 um", "controller.encoder.bits": 3}, "controller.encoder.resolution"),
    ({"controller.position_encoder": {"bits": 20}}, "controller.position_encoder.bits: counts a turn"),
    ({"controller.encoder": {"grating_period": 2e-5}}, "controller.encoder.grating_period: is that of a linear scale"),
    ({"axis.belt": {"teeth": 20, "pitch": "5 mm"}}, ": has screw and belt"),
    ({"axis.screw.leed": 1.0}, "axis.screw.leed"),
    ({"axis.slide.mass": "3 N"}, "axis.slide.mass"),
    ({"axis.sled": {}}, "axis.sled"),
    ({"load": {}}, ": is not allowed beside [axis]"),
    ({"command": 1.0}, ": both turn the motor"),
    ({"axis.gearbox": {"ratio": 3.0, "stiffness": {"kind": "linear", "stiffness": 1e4}, "mesh_damping": 10.0}}, "axis.screw"),
)


# What measures a turn or a torque.
ROTARY_UNITS = re.compile(r"\b(m?rad|rpm|deg|arcmin|mrad)\b|N[·*]m|°")
SLIDES = ("slide", "deflection", "output_force")


def rotary(lines, names=SLIDES):
    """Lines about slides or what moves them that have a unit of rotation."""
    return [line for line in lines if any(name in line for name in names) and ROTARY_UNITS.search(line)]


def test_no_output_has_a_unit_of_rotation_on_a_slide(tmp_path):
    """Of all that is written of a ball-screw axis."""
    scenario = lm.load("ball-screw-axis").replace(**{"simulation.duration": 0.4})
    result = lm.simulate(scenario)
    assert rotary(f"{name} {v.attrs['units']}" for name, v in result.data_vars.items()) == []
    lm.save(result, tmp_path / "run.csv")
    head = next(line for line in (tmp_path / "run.csv").read_text().splitlines() if line.startswith("time"))
    assert "slide_position [m]" in head
    assert rotary(head.split(",")) == []
    text = summary(result)
    assert "slide: " in text
    assert rotary(text.splitlines()) == []
    open_loop = scenario.replace(controllers={}, command={"motor": 0.1})
    assert rotary(str(lm.explain(open_loop, 0.1)).splitlines(), ("slide_contact", "deflection")) == []


def test_no_unit_of_rotation_on_a_slide_in_an_fmu_or_the_live_page():
    scenario = lm.load("ball-screw-axis").replace(**{"simulation.duration": 0.2})
    parameters = derivation_of(scenario, numbers_of).parameters
    turning = ("inertia", "drag_torque", "screw.viscous_friction")
    of_slides = [f"{p.key} {p.unit}" for p in parameters if p.key.startswith(("slides", "screws"))]
    assert [line for line in rotary(of_slides, ("",)) if not any(key in line for key in turning)] == []
    units = {p.key: p.unit for p in parameters if p.key.startswith("controllers.motor.position_encoder")}
    assert units.pop("controllers.motor.position_encoder.error_phase") == "rad"  # of its sine
    assert set(units.values()) == {"m"}
    for version in (2, 3):
        model = fmu_export._model(scenario, parameters, "0" * 32, True, ())
        described = model_description.model_description(model, version).decode()
        assert rotary(re.findall(r"<\w+[^>]*name=\"[^>]*>", described)) == []
        assert 'unit="m/s"' in described
    page = describe(scenario, "axis")
    assert rotary(f"{s['key']} {s['unit']}" for s in page["sliders"] if "slides" in s["key"] or "reference" in s["key"]) == []
    assert [figure["unit"] for figure in page["figures"]] == ["m", "m"]
    assert [shaft["slide"] for shaft in page["shafts"]] == [False, True]


def test_no_unit_of_rotation_in_the_servo_report_and_the_schema_of_a_slide():
    """But for the motor's own: its torque, its speed, its gains."""
    report = lm.commission(lm.load("ball-screw-axis").replace(**{"simulation.duration": 0.4}))
    rows = [f"{what}: {value}" for what, value in report.motion_rows()]
    assert rotary([row for row in rows if "at the motor" not in row], ("",)) == []
    assert any("N/µm" in row for row in rows)
    html = render(servo_report("axis", report))
    assert "N·m/rad" not in html
    assert "mrad" not in html or report.limit_cycle.whole.cycles
    schema = train_schema()["$defs"]
    for part in ("SlideTable", "EndStops", "ForceCurve", "StiffnessCurve", "LinearMotor", "ForceSignal"):
        units = {key: unit_in_schema(node) for key, node in schema[part]["properties"].items()}
        assert {k: u for k, u in units.items() if u and ROTARY_UNITS.search(u)} in ({}, {"inclination": "rad"}, {"phase": "rad"}), part


def test_the_tutorial_prints_what_the_run_prints(tmp_path):
    page = (ROOT / "docs" / "ball-screw-axis.md").read_text()
    (tmp_path / "my-axis.toml").write_text(re.findall(r"```toml\n(.*?)```", page, re.S)[0])
    *shown, dots = re.findall(r"```text\n(.*?)\n```", page, re.S)[0].splitlines()
    assert dots.strip() == "..."
    result = lm.simulate(lm.load(tmp_path / "my-axis.toml"))
    assert summary(result).splitlines()[: len(shown)] == shown
    error = result["motor_position_reference"] - result["slide_position"]
    assert f"# {1e6 * float(abs(error).max()):.1f} µm" in page
    on_motor = {"controller.position_encoder": {"shaft": "motor", "bits": 20}}
    beside = lm.simulate(lm.load(tmp_path / "my-axis.toml", on_motor))["slide_position"][-1]
    assert float(beside) == pytest.approx(1e-6 + 40.0 / 100e6, abs=0.1e-6)


# --- one speed of what is tied together ---
FALLING = {
    "shafts": {"motor": {"inertia": 1e-4}, "screw": {}},
    "slides": {"head": {"mass": 30.0, "inclination": "90 deg"}},
    "gears": {"gear": {"input": "motor", "output": "screw", "ratio": 2.0, "stiffness": {"kind": "rigid"}}},
    "screws": {"spindle": {"input": "screw", "output": "head", "lead": "20 mm", "efficiency": 0.9}},
    "motors": {"servo": {"shaft": "motor", "kind": "torque_source", "rotor_inertia": 6e-4, "rated_torque": 1.0}},
    "simulation": {"duration": 0.1, "sample_interval": 0.01},
}
TRAVEL = 0.02 / (2.0 * math.pi)


@pytest.mark.parametrize("initial", [
    {"slide_speeds": {"head": -0.3}},
    {"speeds": {"motor": -2.0 * 0.3 / TRAVEL}},
    {"speeds": {"screw": -0.3 / TRAVEL}, "slide_speeds": {"head": -0.3}},
])  # fmt: skip
def test_one_speed_of_a_rigid_train_says_the_others(initial):
    """30 kg fall behind a screw that gives back 2 - 1/0.9 of the force: a = g/(1 + J (i/s)²/(m eta_b))."""
    result = lm.simulate(lm.Scenario(**FALLING, initial=initial))
    back = 2.0 - 1.0 / 0.9
    a = 9.80665 / (1.0 + 7e-4 * (2.0 / TRAVEL) ** 2 / (30.0 * back))
    t = result["time"].values
    assert result["head_speed"].values == pytest.approx(-0.3 - a * t, rel=1e-9)
    assert result["motor_speed"].values == pytest.approx((-0.3 - a * t) * 2.0 / TRAVEL, rel=1e-9)
    both = {"speeds": {"motor": 5.0}, "slide_speeds": {"head": -0.3}}
    refused(lambda: lm.Scenario(**FALLING, initial=both), "initial.slide_speeds.head", match=re.escape(f"{5.0 * TRAVEL / 2.0:.10g} m/s"))


def test_one_speed_of_a_rigid_drive_says_the_other():
    drive = lm.load("lossy-rigid-gear")
    for key in ("motor_speed", "load_speed"):
        result = lm.simulate(drive.replace(**{f"initial.{key}": 7.0}))
        assert float(result[key][0]) == 7.0
        assert float(result["motor_speed"][0]) == drive.gearbox.ratio * float(result["load_speed"][0])
    refused(lambda: drive.replace(**{"initial.motor_speed": 7.0, "initial.load_speed": 6.0}), "initial.load_speed")


@pytest.mark.parametrize("stiffness", [None, "100 N/um"])
def test_a_share_that_statics_leave_open_is_said_to_be_so(stiffness: str | None) -> None:
    """Two equal screws hold one slide, each by the friction of its shaft: soft ones the same each, rigid ones any share."""
    screws = {
        name: {"input": f"m_{name}", "output": "ram", "lead": "10 mm"} | ({"stiffness": stiffness} if stiffness else {})
        for name in ("left", "right")
    }
    scenario = lm.Scenario(
        shafts={f"m_{name}": {"inertia": 1e-3, "friction_torque": 5.0} for name in screws},
        slides={"ram": {"mass": 100.0, "inclination": "90 deg"}},
        screws=screws,
        simulation={"duration": 0.1, "sample_interval": 0.01},
    )
    explanation = lm.explain(scenario, 0.05)
    assert {contact.determined for contact in explanation.contacts} == {stiffness is not None}
    assert ("not determined" in str(explanation)) is (stiffness is None)
    result = lm.simulate(scenario)
    forces = [float(result[f"{name}_output_force"][-1]) for name in screws]
    if stiffness is None:
        assert sum(forces) == pytest.approx(980.665, rel=1e-12)
    else:
        assert forces[0] == pytest.approx(forces[1], rel=1e-12)
