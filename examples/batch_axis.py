"""Learn to position an axis with backlash: a batch of drives with parameters of their own, and evolution strategies in NumPy.

`Axes` is a vectorised environment of gymnasium where gymnasium is installed (`pip install gymnasium`), and has the same methods
without it. Two policies are learned: one with drives that have nearly no gap, one with gaps, friction and efficiency drawn
at random. Both are then tried on drives with gaps that neither has met.

python examples/batch_axis.py GENERATIONS [DEVICE]: with a device of Warp, such as cuda:0 or cpu, policies learn with the drives of
`lm.warp`. They are always tried with those of `lm.SimulationBatch`.
"""

import sys
from typing import Any

import numpy as np

import lostmotion as lm

try:
    import gymnasium
    from gymnasium import spaces
    from gymnasium.vector import AutoresetMode, VectorEnv
except ImportError:
    gymnasium = spaces = AutoresetMode = None
    VectorEnv = object

STEP, HELD, STEPS = 1e-3, 4, 150  # [s]; steps under one action; actions of an episode
REACH = 0.05  # [rad], targets lie within
SCALES = np.array([0.02, 1.0, 1.0, 2e-3])  # of error [rad], speeds of motor and load at the load [rad/s], twist [rad]
RATIO, TORQUE = 50.0, 0.5  # torque of the motor [N·m] at an action of 1
NEARLY_NO_GAP, GAPS, FRICTION, EFFICIENCY = (1e-6, 2e-6), (1e-3, 6e-3), (0.01, 0.04), (0.65, 0.9)


class Axes(VectorEnv):
    """Observations: error, speed of the motor, speed of the load, twist, in `SCALES`. Actions: torque / `TORQUE`."""

    def __init__(
        self, num_envs: int, gaps: tuple[float, float], seed: int = 0, threads: int | None = None, device: str = ""
    ) -> None:
        drive = lm.Drive(
            motor=lm.Motor(kind="torque_source", rotor_inertia=1e-4, friction_torque=0.02),
            gearbox=lm.Gearbox(
                ratio=RATIO,
                stiffness=lm.model.TorsionCurve(slopes=[1e4], backlash=1e-3),
                losses=lm.model.ConstantEfficiency(efficiency=0.8),
                rated_input_speed=400.0,
                rated_output_torque=50.0,
            ),
            load=lm.Load(inertia=0.5, viscous_friction=1.0),
        )
        ranges = {
            "gearbox.stiffness.backlash": gaps,
            "motor.friction_torque": FRICTION,
            "gearbox.losses.efficiency": EFFICIENCY,
        }
        vary = {key: (lambda generator, n, of=of: generator.uniform(*of, n)) for key, of in ranges.items()}
        self.on_device = bool(device)
        self.batch: Any = (
            lm.warp.Drives(drive, num_envs, vary=vary, seed=seed, device=device)
            if device
            else lm.SimulationBatch(drive, STEP, count=num_envs, vary=vary, seed=seed, threads=threads)
        )
        self.num_envs, self.steps = num_envs, 0
        self.random = np.random.default_rng(seed)
        self.target = np.zeros(num_envs)
        if spaces is not None:
            self.single_observation_space = spaces.Box(-np.inf, np.inf, (4,), np.float64)
            self.single_action_space = spaces.Box(-1.0, 1.0, (1,), np.float64)
            self.observation_space = spaces.Box(-np.inf, np.inf, (num_envs, 4), np.float64)
            self.action_space = spaces.Box(-1.0, 1.0, (num_envs, 1), np.float64)
            self.metadata = {"autoreset_mode": AutoresetMode.DISABLED}

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[np.ndarray, dict]:
        """All at rest, with new targets; options {"targets": array} sets them."""
        if seed is not None:
            self.random = np.random.default_rng(seed)
        targets = (options or {}).get("targets")
        self.target = self.random.uniform(-REACH, REACH, self.num_envs) if targets is None else np.asarray(targets)
        self.batch.reset()
        self.steps = 0
        return self.observe(), {}

    def step(self, actions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict]:
        """`HELD` steps under constant torques. The reward is what is lost by error and torque; all episodes end together."""
        torque = TORQUE * np.clip(np.asarray(actions, dtype=float).reshape(self.num_envs), -1.0, 1.0)
        for _ in range(HELD):
            self.batch.step(torque, 0.0, **({"step": STEP} if self.on_device else {}))
        self.steps += 1
        seen = self.observe()
        reward = -np.abs(seen[:, 0]) - 0.02 * np.abs(torque / TORQUE) - 0.02 * np.abs(seen[:, 1])
        ended = np.full(self.num_envs, self.steps >= STEPS)
        return seen, reward, np.zeros(self.num_envs, dtype=bool), ended, {}

    def observe(self) -> np.ndarray:
        names = ("load_angle", "motor_speed", "load_speed", "twist")
        angle, motor, load, twist = (self.batch[name].numpy() if self.on_device else self.batch[name] for name in names)
        return np.stack([self.target - angle, motor / RATIO, load, twist], axis=1) / SCALES


HIDDEN = 8
WEIGHTS = 4 * HIDDEN + HIDDEN + HIDDEN


def act(weights: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Actions of policies (policies x `WEIGHTS`), each for its own drives (policies x drives x 4): one hidden layer."""
    first = weights[:, : 4 * HIDDEN].reshape(-1, 4, HIDDEN)
    bias, last = weights[:, 4 * HIDDEN : 5 * HIDDEN], weights[:, 5 * HIDDEN :]
    hidden = np.tanh(seen @ first + bias[:, None, :])
    return np.tanh(np.einsum("pdh,ph->pd", hidden, last))


def returns(axes: Axes, weights: np.ndarray, targets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean return of each policy, and the mean error [rad] over the last fifth of the episodes of each."""
    policies = len(weights)
    seen, _ = axes.reset(options={"targets": np.tile(targets, policies)})
    total, late = np.zeros(policies), np.zeros(policies)
    for k in range(STEPS):
        actions = act(weights, seen.reshape(policies, -1, 4))
        seen, reward, _, _, _ = axes.step(actions)
        total += reward.reshape(policies, -1).mean(axis=1) / STEPS
        if k >= 0.8 * STEPS:
            late += np.abs(seen[:, 0]).reshape(policies, -1).mean(axis=1) * SCALES[0] / (0.2 * STEPS)
    return total, late


def learn(
    gaps: tuple[float, float], generations: int, policies: int = 32, drives: int = 32, seed: int = 0, device: str = ""
) -> np.ndarray:
    """Weights by evolution strategies: mirrored samples, ranks in place of returns, Adam."""
    axes = Axes(policies * drives, gaps, seed, device=device)
    random = np.random.default_rng(seed)
    weights = 0.1 * random.normal(size=WEIGHTS)
    weights[[0, HIDDEN, 2 * HIDDEN]] = 1.0, -0.5, -0.5  # about a proportional law with damping
    weights[5 * HIDDEN] = 1.0
    mean, square, spread = np.zeros(WEIGHTS), np.zeros(WEIGHTS), 0.1
    for k in range(1, generations + 1):
        half = random.normal(size=(policies // 2, WEIGHTS))
        noise = np.concatenate([half, -half])
        total, _ = returns(axes, weights + spread * noise, random.uniform(-REACH, REACH, drives))
        rank = np.argsort(np.argsort(total)) / (policies - 1) - 0.5
        gradient = rank @ noise / (policies * spread)
        mean = 0.9 * mean + 0.1 * gradient
        square = 0.99 * square + 0.01 * gradient**2
        weights = weights + 0.05 * (mean / (1 - 0.9**k)) / (np.sqrt(square / (1 - 0.99**k)) + 1e-8)
    return weights


def trial(weights: np.ndarray, gaps: tuple[float, float], drives: int = 512) -> tuple[float, float]:
    """Mean return and mean late error [rad] on drives that were not met."""
    axes = Axes(drives, gaps, seed=1234)
    total, late = returns(axes, weights[None, :], np.random.default_rng(99).uniform(-REACH, REACH, drives))
    return float(total[0]), float(late[0])


if __name__ == "__main__":
    generations = int(sys.argv[1]) if len(sys.argv) > 1 else 2
    device = sys.argv[2] if len(sys.argv) > 2 else ""
    for name, gaps in (("nearly no gap", NEARLY_NO_GAP), ("gaps at random", GAPS)):
        total, late = trial(learn(gaps, generations, device=device), GAPS)
        print(f"learned with {name:>14}: return {total:7.4f}, late error {1e3 * late:.3f} mrad")
