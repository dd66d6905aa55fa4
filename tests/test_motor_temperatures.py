"""Temperatures of winding and case, and the current of a run: closed forms and another solver."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import lostmotion as lm
from lostmotion.data_sheets.components import motor_table
from lostmotion.sizing.drive_check import check_drive
from lostmotion.sizing.winding_temperature import COPPER, TwoBodies, mean_square
from refusals import refusals_of, refused
from tables import run_of

THERMAL = {
    "thermal_resistance_winding_case": "0.8 K/W",
    "thermal_resistance_case_ambient": "2.4 K/W",
    "thermal_time_constant_winding": "12 s",
    "thermal_time_constant_motor": "300 s",
    "max_winding_temperature": "155 degC",
}
R_WC, R_CA, C_W, C_C = 0.8, 2.4, 12.0 / 0.8, 300.0 / 2.4
LOSS = 0.3 / 0.06**2  # resistance 0.3 ohm, torque constant 0.06 N·m/A
NETWORK = np.array([[-1 / (R_WC * C_W), 1 / (R_WC * C_W)], [1 / (R_WC * C_C), -(1 / R_WC + 1 / R_CA) / C_C]])


def run(command, duration: float = 60.0, interval: float = 0.05, **limits) -> lm.Scenario:
    limits = {"resistance": 0.3, "torque_constant": 0.06, **THERMAL, **limits}
    rigid = {"stiffness": {"kind": "rigid"}, "losses": {"kind": "constant_efficiency", "efficiency": 1.0}}
    return lm.Scenario(
        command=command,
        motor={"kind": "torque_source", "rotor_inertia": 1e-4, "rated_torque": 1.0, "limits": limits},
        gearbox={"ratio": 50.0, "rated_input_speed": 300.0, "rated_output_torque": 20.0, **rigid},
        load={"inertia": 5.0, "viscous_friction": 10.0},
        task={"ambient_temperature": "40 degC"},
        simulation={"duration": duration, "sample_interval": interval},
    )


def test_a_step_of_loss_into_two_bodies() -> None:
    """x(t) = A^-1 (e^(A t) - 1) b, with constant resistance; the slow and the fast mode, and what the case is told."""
    result = lm.simulate(run(0.5))
    found = lm.sizing.temperatures(result, constant_resistance=True)
    b = np.array([LOSS * 0.25 / C_W, 0.0])
    inverse = np.linalg.inv(NETWORK)
    expected = np.array([40.0 + inverse @ (expm(NETWORK * t) - np.eye(2)) @ b for t in result["time"].values])
    assert found["winding_temperature"].values == pytest.approx(expected[:, 0], abs=1e-9)
    assert found["case_temperature"].values == pytest.approx(expected[:, 1], abs=1e-9)
    assert float(found["rms_torque"]) == pytest.approx(0.5, rel=1e-12)
    assert found["copper_loss"].values == pytest.approx(LOSS * 0.25, rel=1e-12)
    assert float(found["headroom"]) == pytest.approx(155.0 - expected[:, 0].max(), abs=1e-9)
    assert found.attrs["error_bound"] == pytest.approx(0.0, abs=1e-12)  # the torque is constant


@pytest.mark.parametrize("interval", [0.01, 0.1, 1.0])  # of the last one all samples of the torque are 0
def test_the_temperature_follows_the_full_equations_within_the_stated_error(interval: float) -> None:
    """A sine of torque and copper that gets warm, integrated by another solver."""
    result = lm.simulate(run({"amplitude": 0.6, "frequency": 0.5}, duration=20.0, interval=interval))
    found = lm.sizing.temperatures(result, winding="50 degC")
    t = result["time"].values

    def rates(now: float, x: np.ndarray) -> np.ndarray:
        heat = LOSS * (0.6 * math.sin(math.pi * now)) ** 2 * (1.0 + COPPER * (x[0] - 25.0))
        return NETWORK @ (x - 40.0) + np.array([heat / C_W, 0.0])

    full = solve_ivp(rates, (0.0, t[-1]), [50.0, 40.0], "DOP853", t, rtol=1e-11, atol=1e-11, max_step=interval)
    error = np.abs(found["winding_temperature"].values - full.y[0]).max()
    bound = found.attrs["error_bound"]
    assert error <= bound
    assert interval == 1.0 or bound < 0.6 * interval  # K: it falls with the interval
    assert np.abs(found["case_temperature"].values - full.y[1]).max() <= bound


@pytest.mark.parametrize("pause", [0.0, 1e6])
def test_steps_of_all_lengths_are_exact(pause: float) -> None:
    """From a microsecond to days, with copper: against the matrix exponential of each step, in series and divided difference."""
    bodies = TwoBodies(R_WC, R_CA, 12.0, 300.0, LOSS, 25.0, 40.0)
    time = np.cumsum([0.0, 1e-6, 1e-3, 0.5, 1.3, 2.0, 40.0, 3000.0, pause + 1.0])
    torque = np.full(len(time), 0.4)
    A = NETWORK + np.array([[COPPER * LOSS * 0.16 / C_W, 0.0], [0.0, 0.0]])
    b = np.array([LOSS * 0.16 * (1.0 + COPPER * 15.0) / C_W, 0.0])
    augmented = np.zeros((3, 3))
    augmented[:2, :2], augmented[:2, 2] = A, b
    for (F, g), h in zip(zip(*bodies.steps(time, mean_square(torque)), strict=True), np.diff(time), strict=True):
        expected = expm(augmented * h)
        assert pytest.approx(expected[:2, :2], rel=1e-10, abs=1e-14) == F  # 1 + A times something: rounding of 1
        assert g == pytest.approx(expected[:2, 2], rel=1e-9, abs=1e-15)


def test_a_cycle_repeated_for_ever_ends_as_it_began_and_as_many_cycles_do() -> None:
    result = lm.simulate(run({"amplitude": 0.5, "frequency": 0.1}, duration=20.0))
    found = lm.sizing.temperatures(result, repeated=True)
    for name in ("winding_temperature", "case_temperature"):
        assert float(found[name][-1]) == pytest.approx(float(found[name][0]), abs=1e-9)
    ends = (40.0, 40.0)
    for _ in range(500):  # 10,000 s, 26 of the slowest time constant
        one = lm.sizing.temperatures(result, winding=ends[0], case=ends[1])
        ends = float(one["winding_temperature"][-1]), float(one["case_temperature"][-1])
    assert ends[0] == pytest.approx(float(found["winding_temperature"][0]), abs=1e-6)
    # A constant torque heats by R_th P/(1 - alpha R_th P) at 25 °C, with the heat of 40 °C here.
    steady = lm.sizing.temperatures(lm.simulate(run(0.3, interval=1.0)), repeated=True)
    cold = (R_WC + R_CA) * LOSS * 0.09
    assert float(steady["winding_temperature"][0]) == pytest.approx(40 + cold * (1 + COPPER * 15) / (1 - COPPER * cold), abs=1e-9)


@pytest.mark.parametrize("interval", [0.01, 0.1, 0.5, 2.0])
def test_the_heat_of_a_ripple_does_not_depend_on_the_samples(interval: float) -> None:
    """A standing motor under 0.3 N m of 1 Hz: the mean rise of the repeated cycle is p A²/2 (R_1 + R_2)."""
    held = lm.Scenario(
        shafts={"s": {"inertia": 1.0, "friction_torque": 1e12}},
        motors={"m": {"shaft": "s", "kind": "torque_source", "rotor_inertia": 1e-3, "limits": run(0.0).motor.limits}},
        command={"m": {"amplitude": 0.3, "frequency": 1.0}},
        simulation={"duration": 10.0, "sample_interval": interval},
    )
    found = lm.sizing.temperatures(lm.simulate(held), repeated=True, constant_resistance=True)
    mean = float(found["winding_temperature"].values[:-1].mean()) - 25.0
    right = LOSS * 0.3**2 / 2.0 * (R_WC + R_CA)
    # Samples in the same phase of the ripple see the top or the bottom of the temperature, as the bound says.
    assert abs(mean - right) <= (1e-9 if interval in (0.01, 0.1) else found.attrs["error_bound"])
    assert float(found["rms_torque"]) == pytest.approx(0.3 / math.sqrt(2.0), rel=1e-12)
    assert found.attrs["error_bound"] <= 2.0 * LOSS * 0.3**2 / 2.0 * interval / C_W


@pytest.mark.parametrize("seed", range(4))
def test_the_error_bound_holds_for_random_runs_that_are_sampled_coarsely(seed: int) -> None:
    """Steps, sines, friction and backlash under a DC motor, against 200 times as many samples."""
    random = np.random.default_rng(seed)
    times = np.sort(random.uniform(0.0, 10.0, 8))
    command = {
        "steps": [{"time": float(t), "height": float(random.normal(0.0, 0.3))} for t in times],
        "amplitude": float(random.uniform(0.0, 0.5)),
        "frequency": float(random.uniform(0.2, 8.0)),
    }
    scenario = lm.load("paper-2dof-nl-small").replace(
        **{"motor.limits": {"resistance": 0.3, "torque_constant": 0.06, **THERMAL}, "command": command, "simulation": run_of(10.0, 1.0)}
    )
    coarse, fine = (lm.sizing.temperatures(lm.simulate(scenario, sample_interval=h), winding="40 degC") for h in (1.0, 5e-3))
    bounds = [found.attrs["error_bound"] for found in (coarse, fine)]
    for body in ("winding_temperature", "case_temperature"):
        assert float(abs(coarse[body] - fine[body].sel(time=coarse["time"], method="nearest")).max()) <= sum(bounds)
    assert float(coarse["rms_torque"]) == pytest.approx(float(fine["rms_torque"]), rel=1e-9)
    torque = lm.simulate(scenario, sample_interval=1e-4)["motor_torque"].values
    assert float(coarse["rms_torque"]) == pytest.approx(float(np.sqrt(np.mean(torque**2))), rel=1e-3)
    assert bounds[1] < 0.05 * bounds[0]


def test_rms_torque_is_that_of_the_run() -> None:
    result = lm.simulate(run({"ramps": [{"rise": 0.9, "duration": 60.0}]}, interval=30.0))
    assert float(lm.sizing.temperatures(result)["rms_torque"]) == pytest.approx(0.9 / math.sqrt(3.0), rel=1e-12)
    limits = {key: value for key, value in THERMAL.items() if key.startswith("thermal")}
    spindle = lm.load("field-weakening").replace(**{"motors.m.limits": limits})  # under field orientation
    torque = lm.simulate(spindle, sample_interval=2e-5)["m_torque"].values
    coarse = lm.sizing.temperatures(lm.simulate(spindle, sample_interval=0.05))
    assert float(coarse["rms_torque"]) == pytest.approx(float(np.sqrt(np.mean(torque**2))), rel=1e-4)


def test_the_drive_check_takes_the_peak_of_the_repeated_cycle() -> None:
    """A sine of 0.02 Hz heats and cools the winding within each period: the peak lies above that of the mean loss."""
    scenario = run({"amplitude": 0.4, "frequency": 0.02}, duration=50.0)
    parts = {f"motor.limits.{key}": None for key in THERMAL if key.startswith("thermal")}
    mean_only = scenario.replace(**parts, **{"motor.limits.thermal_resistance": 3.2})
    uses = [next(f.use for f in check_drive(s) if f.rule == "winding_temperature") for s in (scenario, mean_only)]
    result = lm.simulate(scenario, sample_interval=0.025)
    peak = float(lm.sizing.temperatures(result, repeated=True)["winding_temperature"].max())
    assert uses[0] == pytest.approx((peak - 40.0) / 115.0, rel=1e-3)  # the check samples as finely
    assert uses[0] > 1.05 * uses[1]


def test_current_and_voltage_of_a_synchronous_motor() -> None:
    """i = M/(1.5 p psi); |u|² = u_q² + (p w L_q i)², the second by the decoupling."""
    motor = lm.Motor(**motor_table("siemens-1ft7044-ak7", {"dc_voltage": "600 V", "friction_torque": 0.0}))
    scenario = run(0.9, duration=0.5, interval=1e-3)
    result = lm.simulate(lm.Scenario(**{**scenario.model_dump(), "motor": motor, "command": 1.3}))
    found = lm.sizing.motor_current(result)
    torque, speed = result["motor_torque"].values, result["motor_speed"].values
    assert found["current_rms"].values == pytest.approx(abs(torque) / 0.88, rel=1e-12)
    assert found["current"].values == pytest.approx(torque / 0.88 * math.sqrt(2.0), rel=1e-12)
    u_q, u_d = 600.0 / math.sqrt(3.0), 3.0 * speed * 4.2e-3 * found["current"].values
    assert found["voltage"].values == pytest.approx(np.hypot(u_q, u_d), rel=1e-12)
    assert found.attrs["voltage_limit"] == u_q
    check = {f.rule: f for f in check_drive(lm.simulation.scenario_of(result))}
    assert check["current"].use == pytest.approx(float(found["current_rms"].max()) / 30.0, rel=0.02)  # finer samples
    assert check["voltage"].verdict == "warning"
    heat = motor.copper_loss()[0] * torque**2
    assert heat == pytest.approx(3.0 * 0.61 * found["current_rms"].values ** 2, rel=1e-12)
    source = lm.simulate(scenario)
    assert lm.sizing.motor_current(source)["current"].values == pytest.approx(source["motor_torque"].values / 0.06)


@pytest.mark.parametrize("tau", [0.0, 2e-3])
def test_voltage_under_a_current_loop_is_what_torque_and_speed_need(tau: float) -> None:
    """u_q = R i_q + L_q i_q' + p psi w, of first order with i_q' = i_q*/tau e^(-t/tau); none of it is the torque's command."""
    motor = lm.Motor(**motor_table("siemens-1ft7044-ak7", {"dc_voltage": "600 V", "friction_torque": 0.0}))
    current = {"kind": "first_order", "time_constant": tau} if tau else {"kind": "ideal"}
    controller = {"sample_time": 1e-3, "delay": 0, "reference": {"kind": "torque", "mean": 4.0}, "current": current}
    scenario = run(0.0, duration=0.02, interval=1e-3)
    result = lm.simulate(lm.Scenario(**{**scenario.model_dump(), "command": 0.0, "motor": motor, "controller": controller}))
    found, phase = lm.sizing.motor_current(result), motor.winding.phase_values()
    decay = np.exp(-result["time"].values / tau) if tau else np.zeros(result.sizes["time"])
    i, speed = 4.0 / phase.torque_constant * (1.0 - decay), result["motor_speed"].values
    rise = 4.0 / phase.torque_constant * decay / tau if tau else 0.0
    u_q = phase.resistance * i + phase.inductance_q * rise + phase.pole_pairs * phase.flux_linkage * speed
    u_d = phase.pole_pairs * speed * phase.inductance_q * i
    assert speed[-1] > 10.0
    assert found["current"].values == pytest.approx(i, rel=1e-9)
    assert found["voltage"].values == pytest.approx(np.hypot(u_q, u_d), rel=1e-9)
    use = next(f.use for f in check_drive(lm.simulation.scenario_of(result)) if f.rule == "voltage")
    assert use == pytest.approx(float(found["voltage"].max()) / found.attrs["voltage_limit"], rel=1e-3)


def test_a_brushless_motor_of_the_catalogue_with_field_orientation() -> None:
    """The same magnets, K_M = (3 sqrt(3)/pi) p psi: with a sine 9/pi² of the heat to the same torque, since all three phases
    carry it, and 3/pi of the no-load speed, since a phase ends at u_dc/sqrt(3)."""
    block = lm.motor("maxon-ec-i-52-606793")
    sine = lm.Motor(**motor_table("maxon-ec-i-52-606793", {"kind": "synchronous"}))
    phase = sine.winding.phase_values()
    assert phase.pole_pairs == 8
    assert pytest.approx(3.0 * math.sqrt(3.0) / math.pi * phase.voltage_constant, rel=1e-14) == 0.068
    assert sine.copper_loss()[0] / block.copper_loss()[0] == pytest.approx(9.0 / math.pi**2, rel=1e-14)
    assert sine.unloaded_speed == pytest.approx(3.0 / math.pi * 24.0 / 0.068, rel=1e-14)
    assert sine.limits.winding_to_ambient == pytest.approx(4.55, rel=1e-15)


def test_synchronous_records_follow_from_their_sheets() -> None:
    """Printed constants that were not used: T_el = L/R, T_mech = 3 R J/k_T² (Siemens, configuration manual, table 4-8)."""
    motor = lm.Motor(**motor_table("siemens-1ft7044-ak7", {"dc_voltage": 600, "friction_torque": 0.0}))
    phase = motor.winding.phase_values()
    assert motor.as_dc().electrical_time_constant == pytest.approx(7e-3, rel=0.02)
    assert 3.0 * phase.resistance * motor.rotor_inertia / 0.88**2 == pytest.approx(1.3e-3, rel=0.02)
    # Rated point: 2 N·m at 6000 rpm within 380 V rms between the lines, sqrt(2/3) of which is an amplitude of a phase.
    u_q = phase.resistance * 2.0 / phase.torque_constant + phase.voltage_constant * 628.3
    assert phase.voltage(u_q, 2.0, 628.3) < 380.0 * math.sqrt(2.0 / 3.0)


test_what_lacks_or_contradicts_is_named = refusals_of(
    lambda call: call(lm.simulate(run(0.1, duration=2.0))),
    (lambda r: lm.sizing.temperatures(lm.simulate(run(0.1, thermal_time_constant_motor=None))), ": lacks motor.limits.thermal_time_constant_motor; data"),
    (lambda r: lm.sizing.temperatures(lm.simulate(run(0.1, resistance=None))), ": lacks motor.limits.resistance, motor.limits.torque_constant"),
    (lambda r: lm.sizing.temperatures(r, "m1"), 'motor: "m1" is none of the motors;'),
    (lambda r: lm.sizing.temperatures(r, ambient="3 V"), ": ambient"),
    (lambda r: lm.sizing.temperatures(r, repeated=True, winding=30.0), ": has no beginning; leave winding and case out"),
    (lambda r: lm.sizing.temperatures(lm.simulate(run(3.0, duration=2.0)), repeated=True), ": no end to its heat"),
    (lambda r: lm.sizing.temperatures(r.drop_vars("motor_torque")), ": the result lacks motor_torque"),
    (lambda r: lm.sizing.temperatures(r.drop_attrs()), ": carries no scenario"),
    (lambda r: lm.sizing.motor_current(lm.simulate(run(0.1, torque_constant=None))), ": lacks motor.limits.torque_constant; give it, or a winding"),
    (lambda r: run(0.1, thermal_resistance=3.2), "motor.limits: has thermal_resistance and both of its parts"),
)  # fmt: skip


def test_a_motor_of_a_train_is_chosen_by_name() -> None:
    single = run(0.5)
    scenario = lm.Scenario(
        shafts={"a": {}, "b": {"inertia": 5.0, "viscous_friction": 10.0}},
        motors={name: {"shaft": "a", **single.motor.model_dump()} for name in ("one", "two")},
        gears={"g": {"input": "a", "output": "b", **single.gearbox.model_dump(exclude={"limits"})}},
        command={"one": 0.5, "two": 0.1},
        simulation={"duration": 60.0, "sample_interval": 0.05},
    )
    result = lm.simulate(scenario)
    of_one = lm.sizing.temperatures(result, "one", ambient=40.0)
    expected = lm.sizing.temperatures(lm.simulate(single))
    assert of_one["winding_temperature"].values == pytest.approx(expected["winding_temperature"].values, rel=1e-12)
    assert float(lm.sizing.motor_current(result, "two")["current"][0]) == pytest.approx(0.1 / 0.06)
    assert "motor: there are several motors; give one of one, two" in refused(lambda: lm.sizing.temperatures(result))
    assert 'motor: "onw" is none of the motors; the motors are one, two' in refused(lambda: lm.sizing.motor_current(result, "onw"))
