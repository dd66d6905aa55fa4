"""Chains of shafts with rigid flanks between them, from event to event by parabolas: all torques are constant.

Nothing here is the core's. Gaps are kept from their nearer end, so that the smallest of them have all digits, and each
impact is followed until the flanks part by a 1e-12th of the speeds of the chain.
"""

import itertools
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

import lostmotion as lm

Vector = NDArray[np.float64]


@dataclass
class Chain:
    """Gear k joins shafts k and k + 1. Friction [N·m] is dry, gaps are from one end to the other."""

    inertias: Vector
    torques: Vector
    friction: Vector
    ratios: Vector
    backlash: Vector
    restitution: Vector
    speeds: Vector
    twists: Vector
    negligible: float = 1e-12
    lost: float = 0.0
    impacts: int = 0
    touches: list[bool] = field(default_factory=list)
    end: Vector = field(default_factory=lambda: np.zeros(0))  # what `run` has returned

    def scenario(self, duration: float, intervals: int = 200) -> lm.Scenario:
        """The same for the core."""
        n = len(self.inertias)
        return lm.Scenario(
            shafts={
                f"s{k}": {
                    "inertia": float(self.inertias[k]),
                    "torque": float(-self.torques[k]),
                    **({"friction_torque": float(self.friction[k])} if self.friction[k] > 0.0 else {}),
                }
                for k in range(n)
            },
            gears={
                f"g{k}": {
                    "input": f"s{k}",
                    "output": f"s{k + 1}",
                    "ratio": float(self.ratios[k]),
                    "stiffness": {"kind": "rigid", "backlash": float(self.backlash[k]), "restitution": float(self.restitution[k])},
                }
                for k in range(n - 1)
            },
            initial={
                "speeds": {f"s{k}": float(w) for k, w in enumerate(self.speeds)},
                "twists": {f"g{k}": float(d) for k, d in enumerate(self.twists)},
            },
            simulation={"duration": duration, "sample_interval": duration / intervals},
        )

    def run(self, duration: float) -> Vector:
        """Speeds and twists at the end."""
        n = len(self.inertias)
        self.speeds = self.speeds.copy()
        self.G = np.zeros((n - 1, n))  # rates of the twists
        for k in range(n - 1):
            self.G[k, k], self.G[k, k + 1] = 1.0 / self.ratios[k], -1.0
        self.mobility = self.G @ (self.G / self.inertias).T
        self.side = np.where(self.twists >= 0.0, 1.0, -1.0)
        self.gap = 0.5 * self.backlash - np.abs(self.twists)
        self.touches = [False] * (n - 1)
        self.size = float(np.abs(self.speeds).max())
        self.rubbed = [s for s in range(n) if self.friction[s] > 0.0]
        t = 0.0
        while t < duration:
            a = self.accelerations()
            left, what, index = duration - t, "end", 0
            for s in self.rubbed:
                if self.speeds[s] * a[s] < 0.0 and -self.speeds[s] / a[s] < left:
                    left, what, index = -self.speeds[s] / a[s], "stops", s
            u, b = self.approach(self.speeds).tolist(), self.approach(a).tolist()
            for k in range(n - 1):
                if self.touches[k]:
                    continue
                near = float(self.gap[k])
                speed = 0.0 if near <= 0.0 and abs(u[k]) <= 1e-13 * self.size else u[k]  # rounding
                # At the nearer end, and at the other.
                h = min(flight(near, speed, b[k]), flight(float(self.backlash[k]) - near, -u[k], -b[k]))
                if h < left:
                    left, what, index = h, "strikes", k
            self.fly(a, left, u, b)
            t += left
            self.size = max(self.size, float(np.abs(self.speeds).max()))
            if what == "stops":
                self.stop(index)
            elif what != "end":
                self.gap[index] = 0.0
                self.strike()
        self.end = np.array([*self.speeds, *(self.side * (0.5 * self.backlash - self.gap))])
        return self.end

    def approach(self, a: Vector) -> Vector:
        return self.side * (self.G @ a)

    def fly(self, a: Vector, h: float, u: list[float], b: list[float]) -> None:
        for k in range(len(self.gap)):
            if not self.touches[k]:
                self.gap[k] -= h * (u[k] + 0.5 * h * b[k])
                if self.gap[k] > 0.5 * self.backlash[k]:
                    self.gap[k] = self.backlash[k] - self.gap[k]
                    self.side[k] *= -1.0
        self.speeds = self.speeds + h * a

    def stop(self, shaft: int) -> None:
        """A shaft, and all that touch it."""
        self.speeds[shaft] = 0.0
        for k in range(shaft, len(self.gap)):
            if not self.touches[k]:
                break
            self.speeds[k + 1] = 0.0
        for k in range(shaft - 1, -1, -1):
            if not self.touches[k]:
                break
            self.speeds[k] = 0.0

    def accelerations(self) -> Vector:
        """By all combinations of pressing, sticking and slipping: the one that is consistent."""
        n = len(self.inertias)
        u = self.approach(self.speeds)
        self.touches = [on or (self.gap[k] <= 0.0 and abs(u[k]) <= 1e-13 * self.size) for k, on in enumerate(self.touches)]
        near = [k for k in range(n - 1) if self.touches[k]]
        still = [s for s in self.rubbed if self.speeds[s] == 0.0]
        force = self.torques - self.friction * np.sign(self.speeds)
        if not near and not still:
            return np.asarray(force / self.inertias, dtype=np.float64)
        best, chosen = math.inf, None
        for presses in itertools.product((True, False), repeat=len(near)):
            for ways in itertools.product((0, 1, -1), repeat=len(still)):
                rows = [self.side[k] * self.G[k] for k, on in zip(near, presses, strict=True) if on]
                rows += [np.eye(n)[s] for s, way in zip(still, ways, strict=True) if way == 0]
                F = force.copy()
                for s, way in zip(still, ways, strict=True):
                    F[s] -= way * self.friction[s]
                C = np.array(rows).reshape(-1, n)
                K = C @ (C / self.inertias).T
                held: NDArray[Any] = np.zeros(0)
                if len(rows) > 1 and np.linalg.matrix_rank(K, tol=1e-12 * np.abs(K).max()) < len(rows):
                    # Rest leaves torques open: any that are allowed.
                    limits = [(0.0, None)] * sum(presses)
                    limits += [(-self.friction[s], self.friction[s]) for s, way in zip(still, ways, strict=True) if way == 0]
                    one = linprog(np.zeros(len(rows)), A_eq=K, b_eq=C @ (F / self.inertias), bounds=limits)
                    if one.status != 0:
                        continue
                    held = np.asarray(one.x)
                elif len(rows):
                    held = np.linalg.solve(K, C @ (F / self.inertias))
                a = (F - C.T @ held) / self.inertias
                bad = 0.0
                torques = iter(held)
                for k, on in zip(near, presses, strict=True):
                    b = self.approach(a)[k]
                    bad = max(bad, -next(torques) / np.abs(F).max() if on else b / max(np.abs(a).max(), 1e-300))
                for s, way in zip(still, ways, strict=True):
                    bad = max(bad, (abs(next(torques)) / self.friction[s] - 1.0) if way == 0 else -way * a[s] / max(abs(a).max(), 1e-300))
                if bad < best - 1e-12:
                    best, chosen = bad, (a, dict(zip(near, presses, strict=True)), dict(zip(still, ways, strict=True)))
                if bad <= 1e-12:
                    break
            if best <= 1e-12:
                break
        assert chosen is not None and best < 1e-9, best
        a, presses_of, ways_of = chosen
        for s, way in ways_of.items():
            if way == 0:
                a[s] = 0.0
        for k, on in presses_of.items():
            self.touches[k] = on
        return np.asarray(a, dtype=np.float64)

    def strike(self) -> None:
        """All that approach each other without a gap and all that touch, together."""
        tiny = 1e-13 * self.size
        u = self.approach(self.speeds)
        some = [k for k in range(len(self.gap)) if self.touches[k] or (self.gap[k] <= 0.0 and u[k] > tiny)]
        self.impacts += 1
        rebound = np.where(self.touches, 0.0, self.restitution * np.maximum(u, 0.0))
        rebound[rebound < self.negligible * self.size] = 0.0
        before = np.where(self.touches, 0.0, u)
        W = self.mobility * np.outer(self.side, self.side)
        for number in range(2 ** len(some) - 1, -1, -1):
            of = [k for j, k in enumerate(some) if number >> j & 1]
            P = np.zeros(len(u))
            if of:
                P[of] = np.linalg.solve(W[of][:, of], (before + rebound)[of])
            after = before - W @ P
            if all(P[k] >= 0.0 for k in of) and all(after[k] <= -rebound[k] + 2e-14 * self.size for k in some):
                break
        else:
            raise AssertionError("no impulses")
        self.lost += 0.5 * float(P @ (before + after))
        self.speeds = self.speeds - (self.side[:, None] * self.G).T @ P / self.inertias
        for k in some:
            self.touches[k] = bool((self.touches[k] or P[k] > 0.0) and abs(after[k]) <= tiny)
            if self.touches[k]:
                self.gap[k] = 0.0


def flight(gap: float, speed: float, rate: float) -> float:
    """How long until a gap closes; infinite if it does not."""
    if gap <= 0.0:
        return 0.0 if speed > 0.0 else -2.0 * speed / rate if rate > 0.0 else math.inf
    root = speed * speed + 2.0 * rate * gap
    if root < 0.0:
        return math.inf
    root = math.sqrt(root)
    if speed + root > 0.0 and speed > 0.0:
        return 2.0 * gap / (speed + root)
    return (root - speed) / rate if rate > 0.0 else math.inf


def random_chain(draw: np.random.Generator, *, friction: bool = False) -> tuple[dict[str, Any], float]:
    """What a chain is made of, and how long it is to run."""
    n = int(draw.integers(3, 7))
    inertias = 10.0 ** draw.uniform(-2.5, 0.0, n)
    torques = draw.uniform(-1.0, 1.0, n)
    backlash = 10.0 ** draw.uniform(-3.0, -1.5, n - 1)
    unit = math.sqrt(float(backlash.max() * inertias.sum() / n))
    return {
        "inertias": inertias,
        "torques": torques,
        "friction": draw.uniform(0.0, 0.4, n) * draw.integers(0, 2, n) if friction else np.zeros(n),
        "ratios": draw.choice([1.0, 1.0, 2.0, -1.5, 0.5], n - 1),
        "backlash": backlash,
        "restitution": np.where(draw.random(n - 1) < 0.4, 0.0, draw.uniform(0.0, 0.9, n - 1)),
        "speeds": draw.uniform(-1.0, 1.0, n) * unit,
        "twists": draw.uniform(-0.49, 0.49, n - 1) * backlash,
    }, float(draw.uniform(2.0, 12.0) * unit)
