"""Random axes turned by steppers."""

import math

import numpy as np

import lostmotion as lm


def random_axis(seed: int, error: float = 1e-6) -> lm.Scenario:
    """A stepper that moves a load through a gear, by random data of the sizes that catalogues have.

    Parameters
    ----------
    error
        Of the straight lines, as a share of the holding torque.
    """
    draw = np.random.default_rng(seed)
    steps = int(draw.choice([200, 400]))
    T_H = float(10.0 ** draw.uniform(-1.0, 0.7))
    J = 1.2e-5 * T_H * float(draw.uniform(0.5, 2.0))
    ratio = float(draw.choice([1.0, 3.0, 10.0, 50.0]))
    inertia = J * ratio**2 * float(draw.uniform(0.3, 8.0))
    k = 0.25 * steps * T_H  # stiffness of the field
    gear = {
        "input": "motor",
        "output": "load",
        "ratio": ratio,
        "stiffness": {"kind": "linear", "stiffness": k * ratio**2 * float(draw.uniform(0.5, 20.0))},
        "mesh_damping": math.sqrt(k * J) * ratio**2 * float(draw.uniform(0.02, 0.5)),
    }
    motor = {
        "shaft": "motor",
        "kind": "stepper",
        "steps_per_revolution": steps,
        "holding_torque": T_H,
        "detent_torque": T_H * float(draw.choice([0.0, 0.02, 0.06])),
        "rotor_inertia": J,
        "friction_torque": T_H * float(draw.choice([0.0, 0.02])),
        "torque_error": error * T_H,
    }
    if draw.random() < 0.5:
        motor["standstill_current"] = 0.5
    acceleration = float(draw.uniform(0.1, 0.6)) * T_H / (J + inertia / ratio**2)
    speed = float(draw.uniform(2.0, 20.0))
    there = float(draw.uniform(0.3, 1.5)) / ratio
    stepping = {
        "reference": {"moves": [{"to": there}, {"to": 0.0}], "speed": speed / ratio, "acceleration": acceleration / ratio},
        "microsteps": int(draw.choice([1, 2, 4, 16, 64])),
        "table_error": float(draw.choice([0.0, 0.02])),
        "standstill_delay": 0.01,
    }
    return lm.Scenario(
        shafts={
            "motor": {"inertia": 0.0, "viscous_friction": 0.1 * math.sqrt(k * J)},
            "load": {"inertia": inertia, "friction_torque": T_H * ratio * float(draw.choice([0.0, 0.1]))},
        },
        motors={"m": motor},
        gears={"gear": gear},
        command={"m": {"stepping": stepping}},
        simulation={"duration": 0.3, "sample_interval": 1e-3},
    )


def departure(seed: int, error: float = 1e-6) -> float:
    """Largest difference of the motor's angle between the exact solver and the adaptive one, in steps of 2 pi/N error."""
    scenario = random_axis(seed, error)
    exact = lm.simulate(scenario).motor_angle
    smooth = lm.simulate(scenario, solver="dormand-prince", relative_tolerance=1e-10).motor_angle
    return float(abs(exact - smooth).max()) * 0.25 * float(scenario.motors["m"].steps_per_revolution)
