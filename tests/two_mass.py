"""The linear two-mass drive of the tests of controllers: its scenario, and its matrices from the differential equations."""

from typing import Any

import numpy as np

import lostmotion as lm

T = 125e-6
J_M, J_L, k, C_M, C_L = 2e-3, 5e-3, 700.0, 0.01, 0.02  # inertias, stiffness, viscous frictions
A = np.array([[-C_M / J_M, 0, -k / J_M, 0], [0, -C_L / J_L, k / J_L, 0], [1, -1, 0, 0], [1, 0, 0, 0]], float)
"""of the speeds of motor and load, the twist, the angle of the motor"""
B = np.array([[1.0 / J_M], [0], [0], [0]])
"""of the torque of the motor"""


def two_mass(speed: dict[str, Any], **more: Any) -> lm.Scenario:
    """Under torque control of the motor, with this speed loop and other keys of the controller."""
    axis = {"sample_time": T, "reference": {"kind": "speed", "mean": 3.0}, "encoder": {"ideal": True}, "speed": speed}
    return lm.Scenario(
        shafts={"motor": {"inertia": J_M, "viscous_friction": C_M}, "load": {"inertia": J_L, "viscous_friction": C_L, "torque": 0.0}},
        motors={"m": {"shaft": "motor", "kind": "torque_source", "rotor_inertia": 0.0, "rated_torque": 2.0}},
        gears={"coupling": {"input": "motor", "output": "load", "ratio": 1.0, "stiffness": {"kind": "linear", "stiffness": k}}},
        controllers={"m": axis | more},
        simulation={"duration": 0.1, "sample_interval": T},
    )  # fmt: skip
