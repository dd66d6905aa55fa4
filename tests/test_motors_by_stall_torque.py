"""Motors known by stall torque and no-load speed, without electrical time constant; drag curves that fall."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.integrate
from scipy.linalg import expm

import lostmotion as lm
from lostmotion.model.losses import LossMap
from lostmotion.reproducible import interpolate
from lostmotion.sizing.winding_temperature import COPPER, TwoBodies
from refusals import refusals, refusals_of
from tables import run_of

SERVO: dict[str, Any] = {
    "shafts": {"joint": {"inertia": 0.02, "friction_torque": 1.03}},
    "motors": {"m": {"shaft": "joint", "rotor_inertia": 0.005, "stall_torque": 3.1, "no_load_speed": 7.02}},
    "command": {"m": {"ramps": [{"rise": 1.0, "duration": 1.0}]}},
    "simulation": {"duration": 2.0, "sample_interval": 1e-3},
}


def scenario(**changes: Any) -> lm.Scenario:
    data = {key: dict(value) for key, value in SERVO.items()}
    for table, values in changes.items():
        data[table] = values
    return lm.Scenario(**data)


def motor(**changes: Any) -> dict[str, Any]:
    return {"m": {**SERVO["motors"]["m"], **changes}}


def test_a_hobby_servo_starts_and_ends_where_its_line_says() -> None:
    """Torque M = M_S (u - w/w_0): break-away at u = 1.03/3.1, then J w' = M - T, steady at w_0 (1 - T/M_S)."""
    result = lm.simulate(scenario())
    assert float(lm.switchings_of(result)["instant"][0]) == pytest.approx(1.03 / 3.1, abs=1e-12)
    b, J, T = 3.1 / 7.02, 0.025, 1.03

    def speed(t: float, w: np.ndarray) -> np.ndarray:
        return np.asarray((3.1 * min(t, 1.0) - b * w - T) / J)

    begin = T / 3.1
    for end in (0.9, 1.0):
        run = scipy.integrate.solve_ivp(speed, (begin, end), [0.0], method="DOP853", rtol=1e-12, atol=1e-14)
        assert float(result["joint_speed"].sel(time=end)) == pytest.approx(run.y[0, -1], rel=1e-10)
    w_1, w_end = float(result["joint_speed"].sel(time=1.0)), 7.02 * (1.0 - T / 3.1)
    assert w_end == pytest.approx(4.6875, abs=1e-4)
    assert float(result["joint_speed"][-1]) == pytest.approx(w_end + (w_1 - w_end) * math.exp(-b / J), rel=1e-12)
    assert abs(lm.energy_of(result)["residual"]) < 1e-10


def test_it_is_the_limit_of_a_short_time_constant() -> None:
    """The difference falls in proportion to the time constant."""
    line = lm.simulate(scenario())["joint_speed"]
    off = [
        float(abs(lm.simulate(scenario(motors=motor(electrical_time_constant=tau)))["joint_speed"] - line).max()) for tau in (1e-4, 1e-5)
    ]
    assert off[0] / off[1] == pytest.approx(10.0, rel=0.05)


def test_both_solvers_agree_with_a_voltage_limit_that_acts() -> None:
    limited = scenario(motors=motor(rated_voltage=14.8, voltage_limit=9.0), command={"m": {"amplitude": 1.5, "frequency": 0.7}})
    exact = lm.simulate(limited)
    other = lm.simulate(limited, solver="dormand-prince", relative_tolerance=1e-10)
    assert float(abs(exact["joint_speed"] - other["joint_speed"]).max()) < 1e-8
    assert float(exact["m_torque"].max()) <= 3.1 * 9.0 / 14.8 * 2.0


def test_currents_put_the_friction_into_the_line() -> None:
    """k_M I_0 = T and k_M I_S = M_S + T: with friction the motor stalls at M_S and runs without load at w_0, as its sheet says."""
    own = lm.ShaftMotor(shaft="s", rotor_inertia=1e-3, stall_torque=2.0, no_load_speed=50.0, stall_current=10.0, no_load_current=0.5)
    T = 2.0 * 0.5 / 9.5
    assert own.friction_torque == pytest.approx(T, rel=1e-15)
    assert own.armature_voltage_constant is not None
    assert own.rated_torque * own.armature_voltage_constant - T == pytest.approx(2.0, rel=1e-15)
    free = lm.Scenario(shafts={"s": {}}, motors={"m": own}, command={"m": {"mean": 1.0}}, simulation=run_of(20.0, 0.1))
    assert float(lm.simulate(free)["s_speed"][-1]) == pytest.approx(50.0, rel=1e-9)


def test_the_short_form_and_the_rated_point_give_the_same_bits() -> None:
    drive = lm.load("voltage-limited-start")
    assert isinstance(drive, lm.Scenario)
    data = drive.model_dump(exclude_none=True)
    for key in ("rated_torque", "rated_speed", "armature_voltage_constant", "electrical_time_constant"):
        data["motor"].pop(key, None)
    line = lm.Scenario(**data | {"motor": data["motor"] | {"stall_torque": 4.0, "no_load_speed": 300.0}})
    point = {"rated_torque": 2.0, "rated_speed": 150.0, "armature_voltage_constant": 2.0, "electrical_time_constant": 0.0}
    same = lm.Scenario(**data | {"motor": data["motor"] | point})
    assert np.array_equal(lm.simulate(line)["load_speed"], lm.simulate(same)["load_speed"])
    assert lm.Scenario(**line.model_dump(exclude_none=True)) == line


test_a_line_that_contradicts_itself_is_refused = refusals_of(
    lambda changes: lm.ShaftMotor(**{key: value for key, value in motor(**changes)["m"].items() if value is not None}),
    ({"no_load_speed": None}, ": has stall_torque without no_load_speed; give both"),
    ({"rated_speed": 3.0}, ": has rated_speed, which stall_torque and no_load_speed say; leave it out"),
    ({"rated_torque": 3.2}, ": has a rated_torque of 3.2 N*m, which must be below its stall_torque of 3.1 N*m"),
    ({"stall_current": 2.0}, ": has stall_current without no_load_current; give both"),
    ({"stall_current": 2.0, "no_load_current": 2.0}, ": no_load_current of 2 A, which must be below its stall_current"),
    ({"stall_current": 2.0, "no_load_current": 0.1, "friction_torque": 0.1}, ": which say the same; give one of them"),
    ({"kind": "torque_source"}, ": has stall_torque, no_load_speed, of no use to a torque_source; leave them out"),
)  # fmt: skip


@pytest.mark.parametrize("current", ["ideal", "pi"])
def test_a_controlled_motor_keeps_to_its_line(tmp_path: Path, current: str) -> None:
    """A reversal at the voltage limit is followed: torque is the request clipped to 40 (1 -+ w/30) N m."""
    axis = lm.Scenario(
        shafts={"joint": {"inertia": 0.3}},
        motors={
            "m": {
                "shaft": "joint", "rotor_inertia": 0.02, "stall_torque": 40.0, "no_load_speed": 30.0, "rated_voltage": 24.0,
                "voltage_limit": 24.0,
            }
        },
        controllers={
            "m": {
                "sample_time": 5e-4, "encoder": {"ideal": True}, "current": {"kind": current},
                "reference": {"kind": "torque", "mean": 23.7, "steps": [{"time": 0.4, "height": -47.4}]},
            }
        },
        simulation={"duration": 1.0, "sample_interval": 1e-3},
    )  # fmt: skip
    result = lm.simulate(axis)
    line = 40.0 / 30.0
    # Between two samples the speed changes by at most 80 rad/s^2 * 0.5 ms, and the torque along the line.
    within = line * 80.0 * 5e-4
    assert float(result["m_torque"].sel(time=0.5)) == pytest.approx(-23.7, abs=within)
    top = 40.0 - line * result["joint_speed"]
    assert float((result["m_torque"] - top).max()) < within
    assert float(result["joint_speed"][-1]) == pytest.approx(-19.2, abs=0.2)


DISC: dict[str, Any] = {
    "motors": {"m": {"kind": "torque_source", "shaft": "disc", "rotor_inertia": 0.0}},
    "command": {"m": {"mean": 0.0}},
    "initial": {"speeds": {"disc": 80.0}},
    "simulation": {"duration": 5.0, "sample_interval": 0.01},
}


@pytest.mark.parametrize(("speed", "friction"), [(60.0, 0.02), (-60.0, 0.03)])
def test_a_drag_that_differs_by_direction_slows_the_shaft_down_as_its_side_does(speed: float, friction: float) -> None:
    """J w' = -b w, with 1.5 times the viscous friction backward: w = w_0 exp(-b t/J)."""
    drag = {"kind": "curve", "speeds": [0.0, 100.0], "torques": [0.0, 2.0], "backward": 1.5}
    data = DISC | {"initial": {"speeds": {"disc": speed}}, "simulation": {"duration": 0.5, "sample_interval": 0.05}}
    result = lm.simulate(lm.Scenario(shafts={"disc": {"inertia": 0.01, "drag": drag}}, **data))
    assert result["disc_speed"].values == pytest.approx(speed * np.exp(-friction * result["time"].values / 0.01), rel=1e-12)
    lost = 0.5 * 0.01 * (speed**2 - float(result["disc_speed"][-1]) ** 2)
    assert lm.energy_of(result)["disc: drag"] == pytest.approx(lost, rel=1e-9)


def test_a_falling_drag_curve_holds_its_last_torque() -> None:
    """From 120 rad/s at a constant 12.3 N m to 80 rad/s at t = 40/12.3 s, then along the curve, by scipy."""
    speeds, torques = [0, 5, 10, 20, 40, 80], [0, 40, 50, 40, 23.5, 12.3]
    data = DISC | {"initial": {"speeds": {"disc": 120.0}}, "simulation": {"duration": 8.0, "sample_interval": 0.01}}
    drag = {"kind": "curve", "speeds": speeds, "torques": torques, "beyond": "hold"}
    result = lm.simulate(lm.Scenario(shafts={"disc": {"inertia": 1.0, "drag": drag}}, **data))
    w = result["disc_speed"]
    assert float(w.sel(time=3.0)) == pytest.approx(120.0 - 12.3 * 3.0, rel=1e-13)
    begin = 40.0 / 12.3
    # In each piece w' = -(a + b w) has a closed form.
    t, at = begin, 80.0
    for (w_0, T_0), (w_1, T_1) in zip(
        list(zip(speeds, torques, strict=True))[-2::-1], list(zip(speeds, torques, strict=True))[:0:-1], strict=True
    ):
        b = (T_1 - T_0) / (w_1 - w_0)
        a = T_1 - b * w_1
        if T_0 == 0.0:
            break
        lasts = math.log((a + b * at) / (a + b * w_0)) / b
        if t + lasts > 8.0:
            break
        t, at = t + lasts, float(w_0)
        nearest = float(w.interp(time=t))
        assert nearest == pytest.approx(at, abs=0.5 * 50.0 * 50.0 * 0.01**2)  # interpolation over one sample
    assert at <= 10.0


test_what_cannot_be_is_refused = refusals(
    (lambda: lm.model.DragCurve(speeds=(0.0, 1.0, 2.0), torques=(0.0, 2.0, 1.0)), ': give beyond = "hold", which keeps'),
    (lambda: lm.sizing.warm_up(lm.load("position-axis"), update="10 ms"), "controller"),
)


def test_an_eddy_current_brake_slows_down_as_its_law_says() -> None:
    """J w' = -2 M s/(1 + s^2): ln s + s^2/2 falls by 2 M t/(J w_k), down to half the critical speed."""
    M, w_k = 50.0, 10.0
    drag = {"kind": "eddy_current", "peak_torque": M, "critical_speed": w_k, "max_speed": 80.0, "error": 0.05}
    result = lm.simulate(lm.Scenario(shafts={"disc": {"inertia": 1.0, "drag": drag}}, **DISC))
    w = result["disc_speed"].to_numpy()
    w, t = w[w > 5.0], result["time"].to_numpy()[w > 5.0]
    measure = np.log(w) + 0.5 * (w / w_k) ** 2
    expected = w_k / (2.0 * M) * (measure[0] - measure)
    # An error e of the torque T changes the time by the integral of J e/T^2 over the speed; T falls to 12.3 N m at most.
    assert len(w) > 200
    assert np.all(np.abs(t - expected) <= 0.05 / 12.3**2 * (80.0 - w) + 1e-12)


@pytest.mark.parametrize("error", [0.5, 0.05])
def test_the_straight_lines_of_an_eddy_current_brake_keep_to_their_error(error: float) -> None:
    drag = lm.model.EddyCurrentDrag(kind="eddy_current", peak_torque=50.0, critical_speed=10.0, max_speed=300.0, error=error)
    w = np.linspace(0.0, 300.0, 20001)
    core = drag.core()
    curve = np.array([core.torque(x) for x in w.tolist()])
    law = 100.0 * (w / 10.0) / (1.0 + (w / 10.0) ** 2)
    assert np.max(np.abs(curve - law)) <= error


# --- temperature as a slow parameter ---
BODIES = TwoBodies(2.0, 5.0, 20.0, 300.0, loss=4.0, reference=25.0, ambient=20.0)
LIMITS = {
    "resistance": 1.5,
    "torque_constant": 0.05,
    "thermal_resistance_winding_case": 2.0,
    "thermal_resistance_case_ambient": 5.0,
    "thermal_time_constant_winding": 20.0,
    "thermal_time_constant_motor": 300.0,
}
OIL = lm.data_sheets.Lubricant(viscosity_40="220 mm^2/s", viscosity_100="19 mm^2/s")


def warming_axis(**changes: Any) -> lm.Scenario:
    """A torque source that turns a fan through a gear with viscous friction and a loss map."""
    losses = {"kind": "map", "speeds": [0.0, 1.0], "loads": [0.0, 1.0], "values": [[0.02, 0.05], [0.06, 0.1]], "mirrored": True}
    gear = {
        "input": "rotor",
        "output": "fan",
        "ratio": 5.0,
        "viscous_friction": 2e-5,
        "losses": losses,
        "rated_input_speed": "3000 rpm",
        "rated_output_torque": 1.0,
        "stiffness": {"kind": "linear", "stiffness": 500.0},
        "mesh_damping": 0.5,
    }
    return lm.Scenario(
        shafts={"rotor": {"inertia": 1e-5}, "fan": {"inertia": 1e-3, "viscous_friction": 5e-3}},
        motors={"motor": {"shaft": "rotor", "kind": "torque_source", "rotor_inertia": 1e-5, "limits": LIMITS}},
        gears={"gear": gear},
        command={"motor": {"mean": 0.1, "amplitude": 0.03, "frequency": 0.3}},
        simulation={"duration": 16.0, "sample_interval": 0.02},
    ).replace(**changes)


def test_constant_heat_in_both_bodies_has_the_closed_form_and_no_joule_is_lost() -> None:
    square, losses, start = 0.9, 3.0, np.array([10.0, 4.0])
    C = np.array([20.0 / 2.0, 300.0 / 5.0])
    A = np.array(
        [[(COPPER * BODIES.loss * square - 1.0 / 2.0) / C[0], 1.0 / 2.0 / C[0]], [1.0 / 2.0 / C[1], -(1.0 / 2.0 + 1.0 / 5.0) / C[1]]]
    )
    b = np.array([BODIES.loss * square * (1.0 + COPPER * (20.0 - 25.0)), losses]) / C
    times = np.array([0.1, 7.0, 90.0, 2000.0])
    F, g = BODIES.response(times, square, losses)
    steady = np.linalg.solve(A, -b)
    for k, t in enumerate(times):
        assert np.allclose(F[k] @ start + g[k], steady + expm(A * t) @ (start - steady), rtol=1e-12, atol=1e-12)
    # Without a winding that grows with the temperature: the steady rises are heat times resistance.
    cold = TwoBodies(2.0, 5.0, 20.0, 300.0, loss=4.0, reference=25.0, ambient=20.0, alpha=0.0)
    F, g = cold.response(np.array([1e5]), square, losses)
    assert g[0] == pytest.approx([3.6 * 2.0 + 6.6 * 5.0, 6.6 * 5.0], rel=1e-12)


def test_heat_into_the_bodies_is_stored_or_leaves_them() -> None:
    hot = lm.sizing.warm_up(warming_axis(), update=2.0, lubricant=OIL, lubricant_temperature="40 degC")
    heat = json.loads(hot.attrs["heat"])
    assert heat["winding"] + heat["housing"] == pytest.approx(heat["stored"] + heat["ambient"], rel=1e-12)
    ledger = lm.energy_of(hot)
    assert heat["housing"] == pytest.approx(
        sum(ledger[f"gear: {loss}"] for loss in ("mesh", "hysteresis and damping"))
        + ledger["rotor: viscous friction"]
        + ledger.get("rotor: dry friction", 0.0)
    )
    square = float(np.mean(hot["motor_torque"].values ** 2))
    assert heat["winding"] == pytest.approx(1.5 / 0.05**2 * square * 16.0, rel=0.02)  # some kelvins above 25 °C
    stored = 10.0 * (hot["winding_temperature"][-1] - 25.0) + 60.0 * (hot["housing_temperature"][-1] - 25.0)
    assert float(stored) == pytest.approx(heat["stored"], rel=1e-12)
    assert abs(ledger["residual"]) <= 1e-9 * ledger["turned_over"]


def test_the_heat_of_a_ripple_does_not_depend_on_the_samples() -> None:
    """A sine of 0.3 Hz with a mean, over five periods: mean square 0.1² + 0.03²/2, whatever the samples."""
    fine, coarse = (lm.sizing.warm_up(warming_axis(**{"simulation.sample_interval": h}), update=4.0, winding=25.0) for h in (0.02, 2.0))
    heats = [json.loads(found.attrs["heat"])["winding"] for found in (fine, coarse)]
    assert heats[1] == pytest.approx(heats[0], rel=1e-9)
    t = 16.0 * 2.0 * math.pi * 0.3
    square = 0.1**2 + 0.03**2 * (0.5 - math.sin(2.0 * t) / (4.0 * t)) + 0.006 * (1.0 - math.cos(t)) / t
    assert heats[0] >= 1.5 / 0.05**2 * square * 16.0  # and what the winding's resistance grows by
    assert heats[0] == pytest.approx(1.5 / 0.05**2 * square * 16.0, rel=0.03)


def test_without_anything_that_depends_on_the_temperature_the_motion_is_that_of_one_run() -> None:
    plain, hot = lm.simulate(warming_axis()), lm.sizing.warm_up(warming_axis(), update=2.0)
    assert hot.sizes["time"] == plain.sizes["time"]
    for name in plain:
        size = float(abs(plain[name]).max()) or 1.0
        assert float(abs(plain[name] - hot[name]).max()) <= 1e-8 * size, name
    one = lm.sizing.temperatures(plain)["winding_temperature"]
    losses = json.loads(hot.attrs["heat"])["housing"]
    assert 0.0 < float(hot["winding_temperature"][-1] - one[-1]) < losses / 60.0  # which heat the housing alone


def test_the_error_of_freezing_is_stated_and_falls_linearly_with_the_interval() -> None:
    given: dict[str, Any] = {"lubricant": OIL, "lubricant_temperature": 40.0, "housing": 15.0}
    even = warming_axis(**{"command.motor": 0.1})
    # From the speed of the cold gear on, the heat changes with the temperatures alone.
    end = lm.sizing.warm_up(even.replace(**{"simulation.duration": 2.0}), update=0.04, **given).isel(time=-1)
    speeds = {shaft: float(end[f"{shaft}_speed"]) for shaft in ("rotor", "fan")}
    even = even.replace(**{"initial.speeds": speeds, "initial.twists": {"gear": float(end["gear_twist"])}})
    runs = {update: lm.sizing.warm_up(even, update=update, **given) for update in (4.0, 2.0, 1.0, 0.04)}
    exact = runs[0.04]
    errors = {update: float(abs(hot["housing_temperature"] - exact["housing_temperature"]).max()) for update, hot in runs.items()}
    assert errors[4.0] > 1e-3
    for update in (4.0, 2.0):
        assert errors[update] / errors[0.5 * update] == pytest.approx(2.0, rel=0.1)
        stated = json.loads(runs[update].attrs["freezing_error"])["housing"]
        assert stated == pytest.approx(errors[update], rel=0.3)


def test_gears_follow_the_viscosity_of_their_lubricant() -> None:
    """At constant speed the losses without load go with the viscosity to the power 2/3."""
    cold, warm = (
        lm.sizing.warm_up(warming_axis(), update=0.4, lubricant=OIL, lubricant_temperature=40.0, housing=housing, ambient=housing)
        for housing in (10.0, 70.0)
    )
    factor = (OIL.viscosity(10.0) / OIL.viscosity(40.0)) ** (2.0 / 3.0)
    law = warming_axis().gears["gear"].losses
    assert isinstance(law, LossMap)
    by_hand = warming_axis(
        **{
            "gears.gear.viscous_friction": 2e-5 * factor,
            "gears.gear.losses.values": [
                [m + (factor - 1.0) * m_0 for m, m_0 in zip(row, law.values[0], strict=True)] for row in law.values
            ],
        }
    )
    first = slice(0, 21)  # the first interval
    assert np.allclose(cold["rotor_speed"].values[first], lm.simulate(by_hand)["rotor_speed"].values[first], rtol=1e-12)
    assert float(cold["rotor_speed"][-1]) < float(warm["rotor_speed"][-1])
    assert interpolate(0.0, law.loads, [row[0] for row in law.values]) == law.values[0][0]


def test_a_dc_motor_has_the_line_of_its_warm_winding_and_magnets() -> None:
    motor = {
        "shaft": "rotor",
        "rotor_inertia": 1e-5,
        "rated_torque": 0.1,
        "rated_speed": "3000 rpm",
        "electrical_time_constant": "1 ms",
        "armature_voltage_constant": 4.0,
        "limits": LIMITS,
    }
    drive = lm.Scenario(shafts={"rotor": {"inertia": 1e-5}}, motors={"motor": motor}, command={"motor": 1.0}, simulation=run_of(0.4, 1e-3))
    hot = lm.sizing.warm_up(drive, update=0.1, winding=125.0, housing=65.0, magnet_coefficient=-0.002)
    resistance, magnets = 1.0 + COPPER * 100.0, 1.0 - 0.002 * 40.0
    no_load = lm.load("worm-lowering") and 2.0 * math.pi * 50.0 * 4.0 / 3.0
    assert float(hot["rotor_speed"][-1]) == pytest.approx(no_load / magnets, rel=2e-3)
    # A locked rotor: stall torque.
    locked = drive.replace(**{"shafts.rotor.friction_torque": 10.0})
    stalled = lm.sizing.warm_up(locked, update=0.1, winding=125.0, housing=65.0, magnet_coefficient=-0.002)
    assert float(stalled["motor_torque"][99]) == pytest.approx(0.1 * 4.0 * magnets / resistance, rel=1e-9)


test_what_cannot_be_used_is_said_in_one_line = refusals_of(
    lambda given: lm.sizing.warm_up(warming_axis(), **given),
    ({"update": 0.03}, ": even multiple"),
    ({"update": 0.02}, ": even multiple"),
    ({"update": 2.0, "motor": "mtor"}, "motor: did you mean motor"),
    ({"update": 2.0, "magnet_coefficient": -0.001}, ': acts on a motor of kind "dc"'),
    ({"update": 2.0, "heating": ["gear: mash"]}, ": is no entry of the ledger"),
)


def test_temperatures_reach_an_end_that_is_no_multiple_of_the_interval() -> None:
    """As with an interval that the duration is a multiple of: heat over the same intervals of frozen temperatures."""
    part, whole = (
        lm.sizing.warm_up(warming_axis(command={"motor": 0.1}, simulation=run_of(15.99, h)), update=0.4, lubricant=OIL)
        for h in (0.02, 0.01)
    )
    assert part.time.values[-2:].tolist() == [15.98, 15.99]
    for body in ("winding_temperature", "housing_temperature"):
        assert float(part[body][-1]) == pytest.approx(float(whole[body][-1]), abs=1e-5)
