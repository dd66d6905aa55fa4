"""An environment for reinforcement learning around the exact drive: turn the load to a target and hold it there.

`Axis` is a gymnasium environment where gymnasium is installed (`pip install gymnasium`), and has the same methods without it.
"""

from typing import Any

import numpy as np

import lostmotion as lm

try:
    import gymnasium
    from gymnasium import spaces
except ImportError:
    gymnasium = spaces = None

STEP, STEPS = 2e-3, 500  # [s], of an episode
REACH = 0.2  # [rad], targets lie within
SCALES = np.array([REACH, 4.0, 4.0, 1e-2])  # of error [rad], speeds of motor and load at the load [rad/s], twist [rad]
BOUND = 100.0  # of an observation, in these

Observation = np.ndarray


class Axis(gymnasium.Env if gymnasium else object):
    """Observation: error, speed of the motor, speed of the load, twist, in `SCALES`. Action: voltage / rated voltage."""

    metadata = {"render_modes": []}  # noqa: RUF012

    def __init__(self) -> None:
        self.drive = lm.load("paper-2dof-nl-large").drive()
        self.simulation = lm.Simulation(self.drive, step=STEP)
        self.target, self.steps = 0.0, 0
        self.random = np.random.default_rng()
        if spaces is not None:
            self.observation_space = spaces.Box(-BOUND, BOUND, (4,), np.float64)
            self.action_space = spaces.Box(-1.0, 1.0, (1,), np.float64)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """At rest, with a new target; options {"target": rad} sets it."""
        if gymnasium is not None:
            super().reset(seed=seed)
            self.random = self.np_random
        elif seed is not None:
            self.random = np.random.default_rng(seed)
        self.target = float((options or {}).get("target", self.random.uniform(-REACH, REACH)))
        self.steps = 0
        self.simulation.reset()
        return self.observe(), {"target": self.target}

    def step(self, action: Any) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """One interval under a constant voltage. The reward is what is lost by error and voltage."""
        voltage = float(np.clip(np.asarray(action).ravel()[0], -1.0, 1.0))
        self.simulation.advance(STEP, command=voltage)
        self.steps += 1
        seen = self.observe()
        reward = -float(seen[0] ** 2 + 1e-3 * voltage**2)
        return seen, reward, False, self.steps >= STEPS, {"target": self.target}

    def observe(self) -> Observation:
        angle, motor, load, twist = self.simulation["load_angle", "motor_speed", "load_speed", "twist"]
        values = np.array([self.target - angle, motor / self.drive.gearbox.ratio, load, twist]) / SCALES
        return np.clip(values, -BOUND, BOUND)


def by_hand(observation: Observation) -> float:
    """A controller to compare with: proportional in the error, damped by the motor's speed."""
    error, motor, _, _ = observation * SCALES
    return float(np.clip(15.0 * error - 0.4 * motor, -1.0, 1.0))


def episode(axis: Axis, policy: Any, **reset: Any) -> tuple[float, float]:
    """Return and last error [rad]."""
    seen, _ = axis.reset(**reset)
    total, ended = 0.0, False
    while not ended:
        seen, reward, _, ended, _ = axis.step([policy(seen)])
        total += reward
    return total, float(seen[0] * SCALES[0])


if __name__ == "__main__":
    axis = Axis()
    for name, policy in (("by hand", by_hand), ("no action", lambda _: 0.0)):
        total, error = episode(axis, policy, seed=1, options={"target": 0.1})
        print(f"{name:>9}: return {total:8.3f}, last error {1e3 * error:.3f} mrad")
