"""Torques of steppers over the step rate: closed forms, an own integration, all forms of scenarios, the command line."""

import csv
import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from typer.testing import CliRunner

import lostmotion as lm
from conftest import ROOT
from lostmotion.cli import app
from lostmotion.sizing.pull_out_curves import _Axis
from refusals import refusals_of, refused
from tables import gear_between, rated_gearbox, stepper

J, T_H, N = 5e-6, 0.3, 50
STEP = 2.0 * math.pi / (4 * N)
MOTOR = {"kind": "stepper", "steps_per_revolution": 4 * N, "holding_torque": T_H, "rotor_inertia": J}
RESOLUTION = 1.05 * T_H / 2**8


def rotor(viscous: float = 0.0, microsteps: int | None = None, **motor) -> lm.Scenario:
    """A rotor alone; without microsteps its field turns evenly."""
    stepping = {"stepping": {"reference": 0.0, "microsteps": microsteps}} if microsteps else {}
    return lm.Scenario(
        shafts={"motor": {"inertia": 0.0, "viscous_friction": viscous}},
        motors={"m": {"shaft": "motor", **MOTOR, **motor}},
        command={"m": stepping},
        simulation={"duration": 1.0, "sample_interval": 1e-3},
    )


def test_a_rotor_in_step_holds_its_holding_torque() -> None:
    """The load takes 30 periods to rise, and swings the rotor by less than 1 %."""
    curves = lm.sizing.stepper_curves(rotor(), [200.0, 3000.0])
    assert curves.pull_out_torque_of_runs.values == pytest.approx(T_H, abs=0.01 * T_H)
    assert curves.pull_out_torque.values.tolist() == [T_H, T_H]


def test_the_pull_in_torque_of_runs_is_that_of_the_pendulum() -> None:
    """Without damping the energy decides; without a load up to 2 sqrt(T_H/(N J)), 2205 steps a second."""
    most = 2.0 * math.sqrt(T_H / (N * J)) / STEP
    curves = lm.sizing.stepper_curves(rotor(), [900.0, 0.99 * most, 1.01 * most])
    assert curves.pull_in_torque_of_runs.values == pytest.approx(curves.pull_in_torque.values, abs=RESOLUTION)
    assert curves.pull_in_torque.values[1] > 0.0
    assert curves.pull_in_torque.values[2] == curves.pull_in_torque_of_runs.values[2] == 0.0


@pytest.mark.parametrize("rate", [300.0, 1200.0])
def test_the_pull_in_torque_of_full_steps_is_that_of_an_integration(rate: float) -> None:
    """DOP853 to 1e-12 from step to step, with friction that brakes and holds; halved as the function does."""
    viscous, period = 1e-4, 2.0 * math.pi / math.sqrt(N * T_H / J)

    def slips(friction: float) -> bool:
        until, x, t, count = max(20.0 * period, 40.0 / rate), np.zeros(2), 0.0, 0
        while t < until:
            end = min((count + 0.5) / rate, until)  # a step comes where the reference is half of one ahead
            while t < end:
                drive = -T_H * math.sin(N * (x[0] - count * STEP))
                way = math.copysign(1.0, x[1] if x[1] != 0.0 else drive)
                if x[1] == 0.0 and abs(drive) <= friction:
                    break
                x[1] = x[1] or way * 1e-9  # past the event that has ended its motion

                def rate_of(_, y, goal=count * STEP, way=way):
                    return [y[1], (-T_H * math.sin(N * (y[0] - goal)) - viscous * y[1] - way * friction) / J]

                def stops(_, y, way=way):
                    return way * y[1] if friction > 0.0 else 1.0

                stops.terminal, stops.direction = True, -1.0
                found = solve_ivp(rate_of, (t, end), x, "DOP853", rtol=1e-12, atol=1e-12, events=stops)
                t, x = float(found.t[-1]), found.y[:, -1].copy()
                if abs(N * (x[0] - count * STEP)) > math.pi:
                    return True
                if found.status == 1:
                    x[1] = 0.0
            t, count = end, count + 1
            if abs(N * (x[0] - count * STEP)) > math.pi:
                return True
        return False

    low, high = 0.0, 1.05 * T_H
    for _ in range(0 if slips(0.0) else 8):  # 300 steps a second are near the 276 Hz of the rotor
        middle = 0.5 * (low + high)
        low, high = (low, middle) if slips(middle) else (middle, high)
    found = lm.sizing.stepper_curves(rotor(viscous, microsteps=1, torque_error=1e-5 * T_H), [rate])
    assert float(found.pull_in_torque_of_runs[0]) == pytest.approx(low, abs=1.01 * RESOLUTION)


@pytest.mark.parametrize("share", [0.5, 0.97, 1.3])
def test_the_swing_is_that_of_a_linear_rotor_under_the_steps(share: float) -> None:
    """Microsteps of 1/16 are a sawtooth of harmonics step/(16 pi k); the rotor answers each by w0^2/(w0^2 - k^2 w^2 + i k w b/J)."""
    viscous, w0 = 1e-3, math.sqrt(N * T_H / J)
    w = share * w0  # of the microsteps
    t = np.linspace(0.0, 2.0 * math.pi / w, 4001)
    k = np.arange(1, 2000)[:, None]
    answer = w0**2 / (w0**2 - (k * w) ** 2 + 1j * k * w * viscous / J)
    swing = np.imag(answer * np.exp(1j * k * w * t) / (16.0 * math.pi * k)).sum(0)
    found = _Axis.of(rotor(viscous, microsteps=16), "m").swing(w / (2.0 * math.pi * 16.0))  # without the other curves
    assert found == pytest.approx(0.5 * (swing.max() - swing.min()), rel=0.03)


FORMS = {
    "short": {"motor": MOTOR, "gearbox": rated_gearbox(10, 300.0, 3.0, 500.0, 1.0), "load": {"inertia": 3e-4}},
    "axis": {"axis": {"motor": MOTOR, "screw": {"lead": "10 mm", "stiffness": "50 N/um"}, "slide": {"mass": 1.0}}},
    "long": {
        "shafts": {"rotor": {"inertia": 0.0}, "load": {"inertia": 3e-4}},
        "motors": {"m": {"shaft": "rotor", **MOTOR}},
        "gears": {"g": gear_between("rotor", "load", 10)},
    },
}


@pytest.mark.parametrize("form", FORMS)
def test_curves_are_made_of_every_form(form: str) -> None:
    scenario = lm.Scenario(**FORMS[form], simulation={"duration": 1.0, "sample_interval": 1e-3})
    curves = lm.sizing.stepper_curves(scenario, 400.0)
    assert float(curves.pull_out_torque_of_runs[0]) == pytest.approx(T_H, rel=0.03)
    assert float(curves.pull_in_torque_of_runs[0]) == pytest.approx(float(curves.pull_in_torque[0]), rel=0.1)


def test_the_command_prints_the_curves_and_writes_them(tmp_path: Path) -> None:
    table, figure = tmp_path / "curves.csv", tmp_path / "curves.png"
    words = ["steps", str(ROOT / "scenarios" / "stepper-belt-axis.toml"), "--rates", "300.0,900.0"]
    done = CliRunner().invoke(app, [*words, "-o", str(table), "--plot", str(figure)])
    assert done.exit_code == 0, done.output
    names, units, *rows = csv.reader(table.read_text().splitlines())
    assert names[0] == "step_rate"
    assert units == ["Hz", "N*m", "N*m", "N*m", "N*m", "1"]
    assert [float(row[0]) for row in rows] == [300.0, 900.0]
    assert figure.read_bytes()[:4] == b"\x89PNG"


test_curves_that_make_no_sense_are_refused = refusals_of(
    lambda scenario, rates: lm.sizing.stepper_curves(lm.load(ROOT / "scenarios" / f"{scenario}.toml"), rates),
    ("paper-2dof-nl-small", [100.0], ': no motor of kind "stepper"'),
    ("stepper-belt-axis", [0.0], ": must lie between 10 and 1e"),
    ("stepper-belt-axis", "fast", ": must be numbers"),
)


# --- steppers with a winding ---
NEMA_17 = stepper(54e-7, 200, 0.44, rated_current=1.7, resistance_phase=1.5, inductance_phase=2.8e-3, supply_voltage=24.0)
REGULATION = 1e5  # [1/s], as docs/steppers.md states it
DURATION = 0.02


def random_case(seed: int) -> lm.Scenario:
    """A rotor with a load torque, whose field starts at once in microsteps; many run into the supply."""
    draw = np.random.default_rng(seed)
    T_H = float(10.0 ** draw.uniform(-1.0, 0.5))
    steps = int(draw.choice([200, 400]))
    J = 1.2e-5 * T_H * float(draw.uniform(0.5, 4.0))
    motor = stepper(
        J,
        steps,
        T_H,
        "motor",
        detent_torque=T_H * float(draw.choice([0.0, 0.04])),
        rated_current=float(draw.uniform(0.5, 4.0)),
        resistance_phase=float(draw.uniform(0.3, 5.0)),
        inductance_phase=float(draw.uniform(0.5e-3, 8e-3)),
        supply_voltage=float(draw.uniform(12.0, 60.0)),
        standstill_current=float(draw.choice([1.0, 0.5])),
    )
    speed = float(draw.uniform(2.0, 20.0))
    stepping = {
        "reference": {"ramps": [{"duration": 0.7 * DURATION, "rise": 0.7 * speed * DURATION}]},
        "microsteps": int(draw.choice([1, 2, 4, 16])),
        "standstill_delay": 1e-3,
    }
    viscous = math.sqrt(0.25 * steps * T_H * J) * float(draw.uniform(0.02, 0.5))
    return lm.Scenario(
        shafts={"motor": {"inertia": 0.0, "viscous_friction": viscous, "torque": T_H * float(draw.uniform(0.0, 0.3))}},
        motors={"m": motor},
        command={"m": {"stepping": stepping}},
        simulation={"duration": DURATION, "sample_interval": 1e-4},
    )


def integrated(scenario: lm.Scenario) -> np.ndarray:
    """Both currents, angle and speed at the samples, by DOP853 to 1e-12 from one change of an input to the next."""
    motor, shaft = scenario.motors["m"], scenario.shafts["motor"]
    N, T_H, T_D, J = 0.25 * motor.steps_per_revolution, motor.holding_torque, motor.detent_torque, motor.rotor_inertia
    R, L, U, size = (motor.resistance_phase, motor.inductance_phase, motor.supply_voltage, math.sqrt(2.0) * motor.rated_current)
    K, b, T = T_H / size, shaft.viscous_friction, shaft.torque.mean
    signals = scenario.signals()
    field = signals["m_command"].breakpoint_list()
    level = signals["m_current_command"].breakpoint_list() if "m_current_command" in signals else [(0.0, 1.0, 0.0)]
    times = scenario.simulation.sample_interval * np.arange(round(DURATION / scenario.simulation.sample_interval) + 1)

    def held(points: list, t: float) -> float:
        return [value for begin, value, _ in points if begin <= t][-1]

    def rates(want: tuple[float, float]):
        def rate(_: float, x: np.ndarray) -> list[float]:
            a, c, phi, w = x
            sin, cos = math.sin(N * phi), math.cos(N * phi)
            e = (-K * w * sin, K * w * cos)
            u = [R * want[k] + e[k] + REGULATION * L * (want[k] - x[k]) for k in (0, 1)]
            share = min(1.0, U / max(math.hypot(*u), 1e-300))
            currents = [(share * u[k] - R * x[k] - e[k]) / L for k in (0, 1)]
            torque = K * (c * cos - a * sin) - T_D * math.sin(4.0 * N * phi) - T - b * w
            return [*currents, w, torque / J]

        return rate

    x = np.array([size * math.cos(N * held(field, 0.0)), size * math.sin(N * held(field, 0.0)), 0.0, 0.0])
    if held(level, 0.0) < 0.5:
        x *= motor.standstill_current
    # Steps end at samples: between its own ends a step of 60 us does not resolve the 10 us of the driver.
    ends = sorted({t for t, *_ in [*field, *level] if 0.0 < t < DURATION} | set(times.tolist()))
    found = [x]
    for begin, end in itertools.pairwise(ends):
        amplitude = size * (motor.standstill_current if held(level, begin) < 0.5 else 1.0)
        angle = N * held(field, begin)
        want = (amplitude * math.cos(angle), amplitude * math.sin(angle))
        x = solve_ivp(rates(want), (begin, end), x, "DOP853", t_eval=[end], rtol=1e-12, atol=1e-12).y[:, -1]
        found += [x] if end in times else []
    return np.array(found).T


@pytest.mark.parametrize("seed", [*range(4), *(pytest.param(k, marks=pytest.mark.slow) for k in range(4, 50))])
def test_a_run_with_a_winding_is_that_of_an_integration_of_the_circuit(seed: int) -> None:
    """Electrical angle and currents of 50 random rotors; the errors of their tolerances that docs/theory.md tables, amplified in 0.02 s."""
    scenario = random_case(seed)
    exact = integrated(scenario)
    N, rated = 0.25 * scenario.motors["m"].steps_per_revolution, scenario.motors["m"].rated_current
    names = ("m_phase_a_current", "m_phase_b_current", "motor_angle")
    for tolerance, bound in ((1e-8, 1e-4), (None, 1e-6), (1e-12, 1e-8)):
        result = lm.simulate(scenario, relative_tolerance=tolerance)
        assert result.attrs["solver"].startswith("dormand-prince")
        for row, name, size in zip(exact, names, (rated, rated, 1.0 / N), strict=False):
            assert np.abs(result[name].values - row).max() < bound * size, (tolerance, name)


def slip(speed: float, torque: float) -> float:
    """Load at which a rotor slips, damped against a shaft that turns as its field: only static pull-out is left."""
    up, rise, steps = 0.1, 1.0, 100
    field = [{"begin": up * k / steps, "duration": up / steps, "rise": speed * (k + 0.5) / steps * up / steps} for k in range(steps)]
    scenario = lm.Scenario(
        shafts={
            "motor": {"inertia": 0.0, "torque": {"ramps": [{"begin": up, "duration": rise, "rise": torque}]}},
            "field": {"inertia": 1.0, "speed": {"ramps": [{"duration": up, "rise": speed}]}},
        },
        motors={"m": {"shaft": "motor", **NEMA_17}},
        command={"m": {"ramps": [*field, {"begin": up, "duration": rise, "rise": speed * rise}]}},
        dampers={"d": {"input": "motor", "output": "field", "viscous_friction": 3e-3}},
        simulation={"duration": up + rise, "sample_interval": 1e-3},
    )
    (found,) = lm.simulation.lost_steps(lm.simulate(scenario))
    return (found.times[0] - up) / rise * torque


@pytest.mark.parametrize("speed", [5.0, 60.0, 100.0, 200.0])
def test_the_pull_out_torque_of_a_run_is_the_closed_form_of_the_circuit(speed: float) -> None:
    """The load rises by 1.2 of it in a second, and the rotor needs about 10 ms to slip: 3 %."""
    expected = float(lm.sizing.pull_out_torque(lm.Motor(**NEMA_17), speed))
    assert slip(speed, 1.2 * expected) == pytest.approx(expected, rel=0.03)


def test_at_rest_a_winding_holds_as_an_ideal_current_does() -> None:
    """asin(T/T_H)/N, whatever the winding."""
    load = {"ramps": [{"rise": 0.3, "duration": 0.05}]}
    shafts = {"motor": {"inertia": 0.0, "viscous_friction": 2e-3, "torque": load}}
    simulation = {"duration": 0.2, "sample_interval": 1e-2}
    scenario = lm.Scenario(shafts=shafts, motors={"m": {"shaft": "motor", **NEMA_17}}, simulation=simulation)
    end = lm.simulate(scenario, relative_tolerance=1e-10).motor_angle[-1]
    assert float(end) == pytest.approx(-math.asin(0.3 / 0.44) / 50, rel=1e-8)


def test_a_winding_is_refused_by_name_where_regimes_are_linear() -> None:
    scenario = lm.load(ROOT / "scenarios" / "stepper-belt-axis.toml", {"axis.motor.supply_voltage": "24 V"})
    for use in (
        lambda: lm.simulate(scenario, solver="exact"),
        lambda: lm.simulate(scenario, sensitivities=["axis.motor.holding_torque"]),
        lambda: lm.linearize(scenario),
        lambda: lm.Simulation(scenario, step=1e-3),
        lambda: lm.portable.description(scenario),
    ):
        assert "supply_voltage" in refused(use)


def test_the_check_runs_a_winding_and_compares_it_with_its_pull_out_curve() -> None:
    short = ["--set", 'axis.motor.supply_voltage="24 V"', "--set", 'simulation.duration="0.1 s"']
    answer = CliRunner().invoke(app, ["check", "stepper-belt-axis", *short])
    assert answer.exit_code == 0, answer.exception
    assert "safety" in answer.output


@pytest.mark.parametrize("key", ["rated_current", "resistance_phase", "inductance_phase"])
def test_a_supply_without_the_rest_of_the_winding_is_refused(key: str) -> None:
    refused(lambda: lm.Motor(**{k: v for k, v in NEMA_17.items() if k != key}), match=f"lacks {key}, which its supply_voltage needs")
