"""The linear sample step of a controller: its loops against transfer functions in z, derived by hand, on a rigid inertia.

Over a tick with the torque M held, the speed gains T M/J and the angle T w + T^2 M/(2 J): w/M = T/(J (z - 1)) and
phi/M = T^2 (z + 1)/(2 J (z - 1)^2).
"""

import math
from collections.abc import Callable
from typing import Any

import control
import numpy as np
import pytest

import lostmotion as lm
from test_servo import sampled

T, J = 125e-6, 3e-3
K_P, K_I, K_V, K_VI = 2.0, 300.0, 120.0, 900.0
TAU, OMEGA, DAMPING = 4e-4, 2.0 * math.pi * 250.0, 0.8
F = np.geomspace(1.0, 0.49 / T, 40)
Z = np.exp(2j * math.pi * F * T)

Curve = np.ndarray
SPEED, ANGLE = T / (J * (Z - 1.0)), T * T * (Z + 1.0) / (2.0 * J * (Z - 1.0) ** 2)
PI = K_P + K_I * T / (Z - 1.0)
DIFFERENCE = (1.0 - 1.0 / Z) / T


def rigid(reference: str, **controller: Any) -> lm.Scenario:
    """A motor with an inertia that gives the torque that is asked for."""
    axis = {"sample_time": T, "reference": {"kind": reference, "mean": 3.0}, "encoder": {"ideal": True}} | controller
    return lm.Scenario(
        shafts={"motor": {"inertia": J}},
        motors={"m": {"shaft": "motor", "kind": "torque_source", "rotor_inertia": 0.0, "rated_torque": 2.0}},
        controllers={"m": axis},
        simulation={"duration": 0.1, "sample_interval": T},
    )


def tustin(numerator: list[float], denominator: list[float], frequency: float) -> Curve:
    """A filter in s/w, by the rule of Tustin with w prewarped, as python-control has it."""
    w = 2.0 * math.pi * frequency
    powers = [[c / w ** (len(p) - 1 - k) for k, c in enumerate(p)] for p in (numerator, denominator)]
    return np.asarray(control.c2d(control.tf(*powers), T, "tustin", prewarp_frequency=w)(Z))


def observer(inertia: float | None) -> tuple[Curve, Curve]:
    """The estimate over the angle that is read, and over the torque that was asked for at the sample before."""
    w, b = OMEGA, 0.0 if inertia is None else 1.0 / inertia
    A = [[1.0 - 2.0 * T * DAMPING * w, T], [-T * w * w, 1.0]]
    B = [[2.0 * T * DAMPING * w, 0.5 * T * T * b], [T * w * w, T * b]]
    system = control.ss(A, B, [[0.0, 1.0]], [[0.0, 0.0]], T)
    found = np.array([np.ravel(system(z)) for z in Z])
    return found[:, 0], found[:, 1]


NOTCH = {"kind": "notch", "frequency": 600.0, "depth": 0.1, "width": 0.6, "pole_frequency": 700.0}
LOW_PASS = {"kind": "low_pass", "frequency": 900.0}
SHARE = -math.expm1(-T / TAU)
SMOOTHED = SHARE * Z / (Z - 1.0 + SHARE) * (1.0 - Z**-3.0) / (3.0 * T)
OBSERVED, PREDICTED = observer(J), observer(None)[0]
SPEED_LOOPS: dict[str, tuple[dict[str, Any], dict[str, Any], Curve]] = {
    "P": ({"gain": K_P, "estimate": {"kind": "exact"}}, {}, K_P * SPEED / Z),
    "PI": ({"gain": K_P, "integral_gain": K_I}, {}, PI * DIFFERENCE * ANGLE / Z),
    "PI that acts at once": ({"gain": K_P, "integral_time": K_P / K_I}, {"delay": 0}, PI * DIFFERENCE * ANGLE),
    "slow encoder": (
        {"gain": K_P, "integral_gain": K_I},
        {"encoder": {"ideal": True, "delay": 3}},
        PI * DIFFERENCE * ANGLE * Z**-4.0,
    ),
    "smoothed difference": (
        {"gain": K_P, "integral_gain": K_I, "estimate": {"kind": "difference", "span": 3, "time_constant": TAU}},
        {},
        PI * SMOOTHED * ANGLE / Z,
    ),
    "observer": (
        {"gain": K_P, "integral_gain": K_I, "estimate": {"kind": "observer", "bandwidth": 250.0, "damping": DAMPING}},
        {},
        PI * PREDICTED * ANGLE / Z,
    ),
    "observer that knows the torque": (
        {"gain": K_P, "estimate": {"kind": "observer", "bandwidth": 250.0, "damping": DAMPING, "inertia": J}},
        {},
        K_P * (OBSERVED[0] * ANGLE + OBSERVED[1]) / Z,
    ),
    "filters": (
        {"gain": K_P, "integral_gain": K_I, "torque_filters": [LOW_PASS, NOTCH]},
        {},
        PI * DIFFERENCE * ANGLE / Z * tustin([1.0], [1.0, 1.0], 900.0)
        * tustin([1.0, 0.2, 1.0], [(6.0 / 7.0) ** 2, 1.2 * 6.0 / 7.0, 1.0], 600.0),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", SPEED_LOOPS)
def test_an_open_speed_loop_is_its_transfer_function_in_z(name: str) -> None:
    loop, more, expected = SPEED_LOOPS[name]
    found = sampled(rigid("speed", speed=loop, **more), "speed", True).open_loop(F)
    assert found == pytest.approx(expected, rel=1e-9)


def test_a_closed_speed_loop_of_two_degrees_of_freedom_is_its_transfer_function_in_z() -> None:
    """The reference by way of its filter, the weight 0.6 of its gain, and the feedforward of the inertia that it has."""
    loop = {"gain": K_P, "integral_gain": K_I, "reference_weight": 0.6, "reference_filters": [LOW_PASS]}
    scenario = rigid("speed", speed=loop, feedforward={"inertia": 0.5 * J, "viscous_friction": 0.01})
    known = 0.5 * J * 2j * math.pi * F
    asked = (0.6 * K_P + K_I * T / (Z - 1.0)) * tustin([1.0], [1.0, 1.0], 900.0) + 0.01
    plant = DIFFERENCE * ANGLE / Z
    closed = sampled(scenario, "speed", False)
    assert closed.response(F, feedforward=False) == pytest.approx(asked * plant / (1.0 + PI * plant), rel=1e-9)
    assert closed.response(F) == pytest.approx((asked + known) * plant / (1.0 + PI * plant), rel=1e-9)
    torque = closed.response(F, feedforward=False, signal="torque_reference")
    assert torque == pytest.approx(asked / (1.0 + PI * plant), rel=1e-9)


POSITION_LOOPS: dict[str, tuple[dict[str, float], dict[str, float], Callable[[Curve], Curve]]] = {
    "P around PI": ({"gain": K_V}, {"gain": K_P, "integral_gain": K_I}, lambda z: K_V + 0.0 * z),
    "PID": ({"gain": K_V, "integral_gain": K_VI}, {"gain": K_P}, lambda z: K_V + K_VI * T / (z - 1.0)),
}


@pytest.mark.parametrize("name", POSITION_LOOPS)
def test_a_cascade_is_its_transfer_function_in_z(name: str) -> None:
    position, speed, gain = POSITION_LOOPS[name]
    scenario = rigid("position", position=position | {"feedforward": 0.7}, speed=speed)
    inner = K_P + speed.get("integral_gain", 0.0) * T / (Z - 1.0)
    follows = inner * ANGLE / Z / (1.0 + inner * DIFFERENCE * ANGLE / Z)  # angle over the speed that is asked for
    open_loop = gain(Z) * follows
    assert sampled(scenario, "position", True).open_loop(F) == pytest.approx(open_loop, rel=1e-9)
    fed = (gain(Z) + 0.7 * 2j * math.pi * F) * follows / (1.0 + open_loop)
    assert sampled(scenario, "position", False).response(F) == pytest.approx(fed, rel=1e-9)
    # The inner loop with the outer one open.
    assert sampled(scenario, "speed", True).open_loop(F) == pytest.approx(inner * DIFFERENCE * ANGLE / Z, rel=1e-9)


@pytest.mark.parametrize("phase", [0, 1, 2])
def test_a_slow_position_loop_with_a_phase_answers_as_its_recursion(phase: int) -> None:
    """The position loop samples every fourth tick, `phase` ticks after the speed loop, which samples every second one."""
    scenario = rigid(
        "position",
        phase=phase * T,
        position={"gain": K_V, "sample_time": 4 * T},
        speed={"gain": K_P, "sample_time": 2 * T, "estimate": {"kind": "exact"}},
    )
    frequency, n = 20.0, 4000  # the tick k of the sine that counts: a whole number of its periods lies behind
    angle = speed = asked = computed = 0.0
    read, wanted = [], []
    for k in range(n + phase):
        if k % 4 == phase % 4 and k >= phase:
            wanted.append(math.sin(2.0 * math.pi * frequency * k * T))
            read.append(angle)
            asked = K_V * (wanted[-1] - angle)
        acting = computed
        if k % 2 == 0:
            computed = K_P * (asked - speed)
        angle, speed = angle + T * speed + 0.5 * T * T * acting / J, speed + T * acting / J
    t = (np.arange(len(read)) * 4 + phase) * T
    base = np.exp(2j * math.pi * frequency * t)
    kept = slice(len(read) // 2, None)  # settled: 100 1/s over 0.25 s
    amplitude = np.linalg.lstsq(np.array([base.real, base.imag]).T[kept], np.array(read)[kept], rcond=None)[0]
    expected = complex(amplitude[1], amplitude[0])  # in phase with the sine, and ahead of it
    found = sampled(scenario, "position", False).response(frequency, feedforward=False)[0]
    assert found == pytest.approx(expected, rel=1e-7)
