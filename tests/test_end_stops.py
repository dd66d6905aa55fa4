"""End stops: elastic, damped and rigid ones, of slides and shafts, in each form of a scenario."""

import math
import tomllib
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import lostmotion as lm
from lostmotion.reports.panels import Contacts
from lostmotion.reports.run import summary
from lostmotion.reports.run_charts import run_charts
from refusals import refusals_of

G = 9.80665


def ball(stops: dict[str, Any], height: float = 10.0, speed: float = 0.0, duration: float = 20.0) -> lm.Scenario:
    """1 kg that falls on the lower of two stops."""
    return lm.Scenario(
        slides={"ball": {"mass": 1.0, "inclination": "90 deg", "end_stops": {"lower": 0.0, "upper": 100.0, **stops}}},
        initial={"positions": {"ball": height}, "slide_speeds": {"ball": speed}},
        simulation={"duration": duration, "sample_interval": 1e-2},
    )


@pytest.mark.parametrize("e", [0.0, 0.3, 0.8, 0.95])
def test_bounces_end_where_the_geometric_series_does(e: float) -> None:
    """Fall from 10 m in t_1: parabolas from bounce to bounce, at rest at t_1 (1 + e)/(1 - e), the weight on the stop from then on."""
    first = math.sqrt(2.0 * 10.0 / G)
    rest = first * (1.0 + e) / (1.0 - e)
    result = lm.simulate(ball({"restitution": e}, duration=1.2 * rest))
    t, x, w = (np.asarray(result[name]) for name in ("time", "ball_position", "ball_speed"))
    begin, v = first, e * G * first
    while v > 1e-3:
        end = begin + 2.0 * v / G
        flies = (t > begin) & (t < end)
        s = t[flies] - begin
        assert x[flies] == pytest.approx(v * s - 0.5 * G * s**2, abs=1e-11)
        begin, v = end, e * v
    rests = t > rest
    assert np.all(x[rests] == 0.0)
    assert np.all(w[rests] == 0.0)
    assert np.all(np.asarray(result["ball_end_stop_force"])[rests] == pytest.approx(-G, rel=1e-12))
    instants = np.asarray(lm.switchings_of(result)["instant"])
    assert instants[-1] == pytest.approx(rest, rel=1e-9)
    energy = lm.energy_of(result)
    assert energy["ball_end_stop: impacts"] == pytest.approx(10.0 * G, rel=1e-12)
    assert abs(energy["residual"]) < 1e-13 * energy["turned_over"]


def test_elastic_bounces_keep_the_energy() -> None:
    """The contact lasts (pi + 2 atan(g/(w v)))/w; height 10 m each time."""
    result = lm.simulate(ball({"stiffness": 1e6}))
    first = math.sqrt(20.0 / G)
    v, w = G * first, 1000.0
    contact = (math.pi + 2.0 * math.atan(G / (w * v))) / w
    bounces = (20.0 - first) // (2.0 * first + contact)
    s = 20.0 - first - bounces * (2.0 * first + contact) - contact
    assert float(result["ball_position"][-1]) == pytest.approx(v * s - 0.5 * G * s**2, abs=1e-9)


def test_damped_stops_let_go_where_their_force_vanishes() -> None:
    """m x'' = -k x - c x' from x = 0 with the speed v until x'' = 0, at tan(w_d t) = 2 s w_d/(s^2 - w_d^2)."""
    k, c, m, v = 4e4, 80.0, 2.0, 0.5
    scenario = lm.Scenario(
        slides={
            "table": {"mass": m, "end_stops": {"lower": -1.0, "upper": 0.0, "stiffness": k, "damping": c}},
            "other": {"mass": m, "force": 0.0},
        },
        initial={"positions": {"table": -0.1}, "slide_speeds": {"table": v}},
        simulation={"duration": 0.5, "sample_interval": 1e-5},
    )
    result = lm.simulate(scenario)
    s, w = c / (2.0 * m), math.sqrt(k / m - (c / (2.0 * m)) ** 2)
    lets_go = math.atan2(2.0 * s * w, s**2 - w**2) / w
    left = v * math.exp(-s * lets_go) * (math.cos(w * lets_go) - s / w * math.sin(w * lets_go))
    assert float(result["table_speed"][-1]) == pytest.approx(left, rel=1e-12)
    t = np.asarray(result["time"]) - 0.2
    at = t[(t > 0.0) & (t < lets_go)]
    x, dx = v / w * np.exp(-s * at) * np.sin(w * at), v * np.exp(-s * at) * (np.cos(w * at) - s / w * np.sin(w * at))
    force = np.asarray(result["table_end_stop_force"])
    assert force[(t > 0.0) & (t < lets_go)] == pytest.approx(k * x + c * dx, abs=1e-8)
    assert np.all(force[t > lets_go] == 0.0)
    assert np.all(force >= 0.0)
    energy = lm.energy_of(result)
    assert energy["table_end_stop: end stop"] == pytest.approx(0.5 * m * (v**2 - left**2), rel=1e-10)
    assert abs(energy["residual"]) < 1e-13


CRASH = """
slides.table = { mass = "50 kg", end_stops = { lower = "-1 m", upper = "10 mm", stiffness = "5 N/um" } }
shafts.motor = { inertia = "5e-4 kg m^2" }
screws.screw = { input = "motor", output = "table", lead = "10 mm", stiffness = "100 N/um" }
initial.slide_speeds = { table = "0.5 m/s" }
initial.speeds = { motor = "314.159265359 rad/s" }
simulation = { duration = "0.1 s", sample_interval = "0.02 ms" }
"""


def test_force_of_a_crash_is_that_of_an_own_integration() -> None:
    M, m, K, k = 5e-4 * (2.0 * math.pi / 0.01) ** 2, 50.0, 1e8, 5e6

    def rates(_: float, y: np.ndarray) -> list[float]:
        between = K * (y[2] - y[0])
        return [y[1], (between - k * max(y[0] - 0.01, 0.0)) / m, y[3], -between / M]

    s = solve_ivp(rates, (0.0, 0.1), [0.0, 0.5, 0.0, 0.5], method="DOP853", rtol=1e-11, atol=1e-14, max_step=1e-5)
    result = lm.simulate(lm.Scenario.model_validate(tomllib.loads(CRASH)))
    assert float(result["table_end_stop_force"].max()) == pytest.approx(k * np.maximum(s.y[0] - 0.01, 0.0).max(), rel=1e-4)
    assert float(result["screw_output_force"].max()) == pytest.approx(K * np.abs(s.y[2] - s.y[0]).max(), rel=1e-4)


def test_what_is_rigid_behind_a_stop_strikes_as_one_mass() -> None:
    """With a rigid screw, the rotor strikes as well: both reverse, at e of their speed, and the impact takes (1 - e^2) of the energy."""
    scenario = lm.Scenario.model_validate(tomllib.loads(CRASH)).replace(
        **{"screws.screw.stiffness": None, "slides.table.end_stops": {"lower": "-1 m", "upper": "10 mm", "restitution": 0.25}}
    )
    result = lm.simulate(scenario)
    assert float(result["table_speed"][-1]) == pytest.approx(-0.125, rel=1e-10)
    assert float(result["motor_speed"][-1]) == pytest.approx(-0.25 * 314.159265359, rel=1e-10)
    mass = 50.0 + 5e-4 * (2.0 * math.pi / 0.01) ** 2
    lost = lm.energy_of(result)["table_end_stop: impacts"]
    assert lost == pytest.approx(0.5 * mass * 0.25 * (1.0 - 0.25**2), rel=1e-10)


AXIS = """
    [axis.motor]
    rotor_inertia = "5e-4 kg m^2"
    kind = "torque_source"
    rated_torque = "3 N m"
    [axis.screw]
    lead = "10 mm"
    stiffness = "100 N/um"
    [axis.slide]
    mass = "50 kg"
    end_stops = { lower = "-1 m", upper = "20 mm", STOPS }
    [command]
    mean = 0.5
    [simulation]
    duration = "0.2 s"
    sample_interval = "0.1 ms"
"""
DRIVE = """
    [motor]
    rotor_inertia = "1e-4 kg m^2"
    kind = "torque_source"
    rated_torque = "1 N m"
    [gearbox]
    ratio = 50
    rated_input_speed = "3000 rpm"
    rated_output_torque = "50 N m"
    stiffness = { kind = "linear", stiffness = "1e4 N m/rad" }
    losses = { kind = "constant_efficiency", efficiency = 1.0 }
    [load]
    inertia = "0.3 kg m^2"
    end_stops = { lower = "-90 deg", upper = "5 deg", STOPS }
    [command]
    mean = 0.2
    [simulation]
    duration = "0.6 s"
    sample_interval = "0.1 ms"
"""
STOPS = {
    "elastic": ('stiffness = "5 N/um"', 'stiffness = "1e4 N m/rad"'),
    "damped": ('stiffness = "5 N/um", damping = "10 kN s/m"', 'stiffness = "1e4 N m/rad", damping = "30 N m s/rad"'),
    "rigid": ("restitution = 0.4", "restitution = 0.4"),
}


@pytest.mark.parametrize("kind", STOPS)
@pytest.mark.parametrize("form", ["axis", "drive"])
def test_each_form_takes_each_kind_and_both_solvers_agree(form: str, kind: str) -> None:
    text, stops = (AXIS, STOPS[kind][0]) if form == "axis" else (DRIVE, STOPS[kind][1])
    scenario = lm.Scenario.model_validate(tomllib.loads(text.replace("STOPS", stops)))
    exact, adaptive = lm.simulate(scenario), lm.simulate(scenario, solver="dormand-prince", relative_tolerance=1e-11)
    place, pressing, end = (
        ("slide_position", "slide_end_stop_force", 0.02) if form == "axis" else ("load_angle", "load_end_stop_torque", math.radians(5.0))
    )
    assert float(exact[place].max()) >= end
    assert float(exact[pressing].max()) > 0.0 or kind == "rigid"
    assert np.asarray(exact[place]) == pytest.approx(np.asarray(adaptive[place]), abs=1e-6 * end)
    energy = lm.energy_of(exact)
    assert abs(energy["residual"]) < 1e-10 * energy["turned_over"]


@pytest.mark.parametrize("kind", STOPS)
def test_a_motor_presses_with_what_its_ratio_makes_of_its_torque(kind: str) -> None:
    scenario = lm.Scenario.model_validate(tomllib.loads(DRIVE.replace("STOPS", STOPS[kind][1])))
    damped = {"gears.gearbox.viscous_friction": "0.02 N m s/rad", "simulation.duration": "30 s"}
    soft = {"kind": "linear", "stiffness": "1e4 N m/rad"}
    scenario = scenario.replace(**damped, **{"gears.gearbox.stiffness": soft, "gears.gearbox.mesh_damping": "20 N m s/rad"})
    result = lm.simulate(scenario)
    assert float(result["load_end_stop_torque"][-1]) == pytest.approx(0.2 * 50.0, rel=1e-9)
    assert "load_end_stop" in str(lm.explain(scenario, 30.0)) or kind != "rigid"


test_what_is_no_stop_is_refused = refusals_of(
    ball,
    ({"lower": 1.0, "upper": 1.0, "stiffness": 1e6}, "slides.ball.end_stops"),
    ({}, "slides.ball.end_stops"),
    ({"stiffness": 1e6, "restitution": 0.5}, "slides.ball.end_stops"),
    ({"restitution": 0.5, "damping": 1.0}, "slides.ball.end_stops"),
    ({"restitution": 1.5}, "slides.ball.end_stops.restitution"),
    ({"restitution": 0.5}, -0.1, "initial.positions.ball"),
    ({"restitution": 0.5}, 0.0, -1.0, "initial.positions.ball"),
)


def test_a_run_begins_between_rigid_stops() -> None:
    for speed in (0.0, 1.0):
        assert np.isfinite(lm.simulate(ball({"restitution": 0.5}, 0.0, speed, duration=0.01))["ball_position"][-1])


def test_a_run_goes_on_from_a_stop_that_it_rests_on() -> None:
    scenario = ball({"restitution": 0.5}, duration=10.0)
    end = lm.simulate(scenario).attrs["end_state"]
    assert '"ball_position": 0.0' in end
    again = lm.simulate(scenario.replace(**{"initial.positions.ball": 0.0}))
    assert np.all(np.asarray(again["ball_position"]) == 0.0)


def test_friction_and_a_stop_share_what_rest_leaves_open() -> None:
    """The ram comes to the stop against 30 N of friction: what they hold together is the force of the motor."""
    scenario = lm.Scenario(
        slides={"ram": {"mass": 3.0, "friction_force": 30.0, "end_stops": {"lower": -0.01, "upper": 0.02, "restitution": 0.0}}},
        linear_motors={"m": {"slide": "ram", "rated_force": 100.0}},
        command={"m": 1.0},
        simulation={"duration": 1.0, "sample_interval": 0.01},
    )
    result = lm.simulate(scenario)
    stop, friction = (float(result[name][-1]) for name in ("ram_end_stop_force", "ram_contact_force"))
    assert stop + friction == pytest.approx(100.0, rel=1e-12)
    assert abs(friction) <= 30.0
    assert stop > 0.0


# --- figures and summary ---
def test_figures_show_where_the_stops_are_and_what_presses_on_them() -> None:
    result = lm.simulate(ball({"restitution": 0.3}, duration=4.0))
    panels = {chart.title: chart for chart in run_charts(result)}
    position, force = panels["Position of ball"], panels["Force on end stops: ball"]
    assert [curve.label for curve in position.curves] == ["ball", "lower stop"]  # the upper one is 90 m away
    assert np.array_equal(position.curves[0].y, 1e3 * result["ball_position"].values)
    assert position.curves[1].y.tolist() == [0.0, 0.0]
    assert force.curves[0].y[-1] == pytest.approx(-G, rel=1e-12)
    assert "Contacts" not in panels  # the ball touches or parts, and has no friction that sticks or slips


def test_a_summary_says_what_presses_on_a_stop_and_how_often_it_is_touched() -> None:
    rigid, elastic = (summary(lm.simulate(ball(s, duration=4.0))) for s in ({"restitution": 0.3}, {"stiffness": 1e6}))
    assert f"  end stop ball: {-G:.4g} N, peak {G:.4g}; between impacts" in rigid
    assert "ball end stop touches 1" in rigid
    assert "stuck" not in rigid + elastic and "sticks" not in rigid + elastic
    peak = float(np.abs(lm.simulate(ball({"stiffness": 1e6}, duration=4.0))["ball_end_stop_force"]).max())
    assert f"  end stop ball: 0 N, peak {peak:.4g}" in elastic


def test_labels_of_figures_fit_beside_their_axes() -> None:
    """An axis of 2.7 inch has room for 24 letters beside it."""
    stops = {"lower": -1.0, "upper": 1.0, "stiffness": 1e6}
    scenario = lm.load("rack-axis-with-play").replace(**{"slides.slide.end_stops": stops})
    for chart in run_charts(lm.simulate(scenario, duration=0.1)):
        assert isinstance(chart, Contacts) or len(chart.y_label) <= 24
