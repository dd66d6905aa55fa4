"""Feedforward by the model of the drive, its adaptation, and the load observer."""

from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from lostmotion import _core
from refusals import refusals_of, refused

AXIS = lm.load("position-axis-load-encoder")
CONTROLLER = AXIS.controller.model_dump(exclude_none=True)
IDEAL = {"ideal": True}


def sine_axis(peak_speed: float, *, load_encoder: bool = True, **model: object) -> lm.Scenario:
    """The paper's drive, which follows a sine of 0.25 Hz from its lower end, with ideal encoders."""
    amplitude = peak_speed / (0.5 * np.pi)
    reference = {"kind": "position", "amplitude": amplitude, "frequency": 0.25, "phase": -0.5 * np.pi}
    speed = {k: v for k, v in CONTROLLER["speed"].items() if k != "torque_limit"}
    controller = CONTROLLER | {"reference": reference, "speed": speed, "encoder": IDEAL}
    if load_encoder:
        controller["position_encoder"] = IDEAL | {"shaft": "load"}
    else:
        del controller["position_encoder"]
    if model:
        controller["inverse_model"] = {"twist_rate": 0.5} | model
    start = {"initial.load_angle": -amplitude, "simulation.duration": 12.0, "simulation.sample_interval": 2e-3}
    return AXIS.replace(controller=controller, **start)


def peak_error(scenario: lm.Scenario) -> float:
    """Of the load, once the start is over [rad]."""
    result = lm.simulate(scenario)
    wanted, *_ = scenario.controller.reference.at(result.time.values)
    return float(np.abs(result.load_angle.values - wanted)[result.time.values > 6.0].max())


@pytest.mark.parametrize("peak_speed", [0.005, 2.0])
def test_small_motions_need_the_map(peak_speed: float) -> None:
    # A loss in proportion to the load is nearly nothing at small amplitude: what the motor lacks there is the loss
    # that does not vanish with the load.
    plain = peak_error(sine_axis(peak_speed))
    constant = peak_error(sine_axis(peak_speed, efficiency=0.9, friction_torque=0.0))
    table = peak_error(sine_axis(peak_speed, loss_factor=1.0))
    if peak_speed < 0.01:
        assert constant > 0.95 * plain
        assert table < 0.005 * constant
    else:
        assert constant < 0.6 * plain
        assert table < 0.5 * constant


@pytest.mark.parametrize("factor", [0.6, 1.5])
def test_a_wrong_map_is_still_better_than_none(factor: float) -> None:
    for load_encoder in (True, False):
        wrong = peak_error(sine_axis(0.05, load_encoder=load_encoder, loss_factor=factor))
        assert wrong < 0.4 * peak_error(sine_axis(0.05, load_encoder=load_encoder))


def test_losses_are_those_of_the_map_and_their_inverse_returns_the_load() -> None:
    gearbox = AXIS.gearbox
    table = gearbox.losses.core()
    rated = {"rated_torque": gearbox.rated_output_torque, "rated_speed": gearbox.rated_input_speed}
    losses = _core.GearLosses({"kind": "loss_map", "map": table, "ratio": gearbox.ratio, **rated})
    random = np.random.default_rng(5)
    for _ in range(2000):
        T_2, w, s = random.uniform(-80.0, 80.0), random.uniform(0.0, 400.0), random.choice((-1.0, 1.0))
        loss = losses(T_2, s, w)
        scale = gearbox.rated_output_torque / gearbox.ratio
        assert loss == pytest.approx(table(s * T_2 / 51.6, w / gearbox.rated_input_speed) * scale, rel=1e-12)
        factor = random.uniform(0.5, 1.5)
        T_1 = T_2 / gearbox.ratio + s * factor * loss
        assert losses.output_torque(T_1, s, w, factor) == pytest.approx(T_2, abs=1e-10)


def rigid(losses: dict[str, object], controller: dict[str, object], **changes: Any) -> lm.Scenario:
    """A rigid drive by a torque source, whose motor is read without error and commanded without delay."""
    data = AXIS.model_dump(exclude_none=True)
    data["gearbox"] |= {"stiffness": {"kind": "rigid"}, "losses": losses}
    data["gearbox"].pop("hysteresis", None)
    data["gearbox"]["viscous_friction"] = data["load"]["viscous_friction"] = 0.0
    data["motor"] = {"kind": "torque_source", "rotor_inertia": 8e-6, "rated_torque": 0.5, "friction_torque": 0.016}
    data["controller"] = {"sample_time": 5e-5, "delay": 0, "encoder": IDEAL} | controller
    if "initial.load_speed" in changes:
        changes["initial.motor_speed"] = data["gearbox"]["ratio"] * changes["initial.load_speed"]
    return lm.Scenario(**data).replace(**changes)


CONSTANT_LOSS = {
    "kind": "map", "speeds": (0.0, 1.0), "loads": (-1.0, 0.0, 1.0), "values": ((0.05, 0.05),) * 3,
}  # fmt: skip


@pytest.mark.parametrize("adapted", ["losses", "friction"])
def test_the_lyapunov_function_of_the_adaptation_never_rises(adapted: str) -> None:
    # J e' = -k_p e + (true - adapted) Y, so V = J e^2/2 + (true - adapted)^2/(2 g) falls by k_p e^2.
    rate = {"losses": 300.0, "friction": 0.05}[adapted]
    model: dict[str, object] = (
        {"loss_factor": 0.5, "loss_adaptation": {"rate": rate}}
        if adapted == "losses"
        else {"friction_torque": 0.002, "friction_adaptation": {"rate": rate, "limits": (0.0, 0.1)}}
    )
    k_p = 1e-2
    s = rigid(
        CONSTANT_LOSS,
        {"reference": {"kind": "speed", "mean": 0.5}, "speed": {"gain": k_p, "estimate": {"kind": "exact"}}, "inverse_model": model},
        **{"simulation.duration": 3.0, "simulation.sample_interval": 5e-5, "initial.load_speed": 0.3},
    )
    r = lm.simulate(s)
    i, g = s.gearbox.ratio, s.gearbox
    J = s.motor.rotor_inertia + g.inertia + s.load.inertia / i**2
    e = i * s.controller.reference.at(r.time.values)[0] - r.motor_speed.values
    missing = 1.0 - r.model_loss_factor.values if adapted == "losses" else s.motor.friction_torque - r.model_friction_torque.values
    e, missing = e[1:], missing[:-1]  # a tick shows what it has adapted, and acts by what it found
    V = 0.5 * J * e**2 + 0.5 * missing**2 / rate
    # dV/dt = -k_p e^2, and of second order in the tick what it holds.
    T, Y = 5e-5, {"losses": 0.05 * g.rated_output_torque / i, "friction": 1.0}[adapted]
    fall = -T * k_p * e[:-1] ** 2 + 0.5 * J * np.diff(e) ** 2 + 0.5 * rate * (T * e[:-1] * Y) ** 2
    np.testing.assert_allclose(np.diff(V), fall, rtol=1e-6, atol=1e-16)
    assert np.diff(V).clip(min=0.0).sum() < 1e-3 * V[0]
    assert V[-1] < 1e-3 * V[0]
    assert abs(missing[-1]) < 0.05 * abs(missing[0])


def test_the_observer_finds_the_load_through_the_losses() -> None:
    model = {"load_observer": {"input_time": 2e-3, "load_time": 2e-2}, "min_speed": 1.0}
    controller = {
        "reference": {"kind": "speed", "mean": 0.5},
        "speed": {"gain": 8e-3, "integral_gain": 0.1, "estimate": {"kind": "exact"}},
        "inverse_model": model,
    }
    start = {"simulation.duration": 2.0, "initial.load_speed": 0.5}
    for load in (12.0, -7.0):
        s = rigid(dict(AXIS.gearbox.losses.model_dump()), controller, **start, **{"load.torque": {"mean": load}})
        r = lm.simulate(s)
        assert r.observed_load_torque.values[-1] == pytest.approx(load, rel=1e-6)
        assert r.load_speed.values[-1] == pytest.approx(0.5, rel=1e-9)


def test_scheduled_gains_are_those_of_the_inertia_that_the_motor_feels() -> None:
    # Constant efficiency: dm_2B/dmu = 1/eta - 1 while it drives, so J = J_MR + J_Z/(eta i^2).
    eta, bandwidth = 0.8, 30.0
    observer = {"input_time": 2e-3, "load_time": 2e-2, "speed_bandwidth": bandwidth}
    step = {"kind": "speed", "mean": 0.5, "steps": [{"time": 1.0, "height": 1e-3}]}
    controller = {
        "reference": step,
        "speed": {"gain": 1e-4, "integral_gain": 1e-6, "estimate": {"kind": "exact"}},
        "inverse_model": {"load_observer": observer, "min_speed": 1.0},
    }
    losses = {"kind": "constant_efficiency", "efficiency": eta}
    start = {"simulation.duration": 1.001, "simulation.sample_interval": 5e-5, "initial.load_speed": 0.5}
    s = rigid(losses, controller, **start, **{"load.torque": {"mean": 8.0}})
    r = lm.simulate(s)
    torque, before = r.torque_reference.values, round(1.0 / 5e-5) - 1
    i = s.gearbox.ratio
    J = s.motor.rotor_inertia + s.gearbox.inertia + s.load.inertia / (eta * i**2)
    jump = torque[before + 1] - torque[before]
    assert jump == pytest.approx(2.0 * np.pi * bandwidth * J * i * 1e-3, rel=1e-3)


def test_a_motor_encoder_errs_by_load_over_stiffness_unless_the_model_runs_ahead() -> None:
    data = AXIS.model_dump(exclude_none=True)
    k, b, w = 2e4, 40.0, 0.2
    data["gearbox"] |= {"stiffness": {"kind": "linear", "stiffness": k}}
    data["gearbox"].pop("hysteresis", None)
    data["load"]["viscous_friction"] = b
    reference = {"kind": "position", "ramps": [{"begin": 0.0, "rise": 6.0 * w, "duration": 6.0}]}
    for inverse, error in ((None, b * w / k), ({}, 0.0)):
        controller = {key: v for key, v in CONTROLLER.items() if key != "position_encoder"}
        controller |= {"reference": reference, "encoder": IDEAL}
        controller["speed"] = CONTROLLER["speed"] | {"integral_gain": 0.5}
        if inverse is not None:
            controller["inverse_model"] = inverse
        s = lm.Scenario(**data | {"controller": controller}).replace(**{"simulation.duration": 6.0})
        r = lm.simulate(s)
        wanted = s.controller.reference.at(r.time.values)[0]
        lag = (wanted - r.load_angle.values)[-1]
        # The voltage feedforward of the position loop leaves what the delay of its samples costs: w times a few ticks.
        assert lag == pytest.approx(error, abs=w * 2e-3 * 0.1)


test_what_does_not_fit_is_refused = refusals_of(
    lambda change: sine_axis(0.1, **change),
    ({"efficiency": 1.2}, "controller.inverse_model.efficiency"),
    ({"loss_factor": 7.0, "loss_adaptation": {"rate": 1.0}}, "controller.inverse_model: outside the limits"),
    ({"loss_adaptation": {"rate": 1.0, "limits": (2.0, 1.0)}}, "controller.inverse_model: which must rise"),
    ({"friction_adaptation": {"rate": 1.0, "limits": (0.1, 0.2)}}, "controller.inverse_model.friction_adaptation.limits: leave out the friction of the drive"),
    ({"loss_adaptation": {"rate": "1 N*m"}}, "controller.inverse_model.loss_adaptation.rate"),
    ({"load_observer": {"input_time": 0.0, "load_time": 1.0}}, "controller.inverse_model.load_observer.input_time"),
)  # fmt: skip


def test_a_gap_needs_a_rate_and_a_train_one_gear() -> None:
    s = sine_axis(0.1, load_encoder=False, twist_rate=None)
    refused(lambda: s.replace(**{"gearbox.stiffness.slopes": (0.0, 2e4, 3e4)}).control(), "controller.inverse_model")
    train = lm.load("belt-before-gearbox")
    motor = next(iter(train.motors))
    shaft = list(train.shafts)[-1]
    refused(lambda: lm.control.InverseModel().solver_fields(train.train(), motor, shaft, on_motor=True), "inverse_model")


def test_both_feedforwards_are_refused() -> None:
    refused(lambda: sine_axis(0.1, loss_factor=1.0).replace(**{"controller.feedforward": {"inertia": 1e-4}}), "controller")
