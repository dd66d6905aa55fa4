"""Verdicts of the certificate of hunting for random sampled axes with an encoder's resolution, against long exact runs."""

import argparse
import math
import random
from typing import Any

import numpy as np

import lostmotion as lm
from lostmotion.servo.hunting.sampled_stuck_contact import sampled_slip
from lostmotion.servo.linear_regimes import axis_of, regimes
from lostmotion.servo.margins import instability
from test_hunting_axes import geared

AXES = 5  # of the test, two that do not hunt and three that do; the script takes 500
SLIPS = 12  # that a run of an axis which hunts has about
SAMPLES = 400_000  # of a run at most


def log(rng: random.Random, low: float, high: float) -> float:
    """Evenly distributed in its logarithm."""
    return float(low * (high / low) ** rng.random())


def random_axis(rng: random.Random) -> lm.Scenario:
    """Motor and load with a rigid gear, friction at the load, a cascade by the poles of the rigid axis, and an encoder with steps."""
    inertia, w, ratio = log(rng, 0.01, 10.0), log(rng, 3.0, 60.0), rng.choice([1.0, 20.0, 100.0])
    tick, share = log(rng, 0.01, 0.1) / w, rng.uniform(0.2, 0.8)
    k_d, k_v = rng.uniform(1.5, 3.0) * inertia * w, rng.uniform(0.1, 0.4) * w
    travel = log(rng, 0.01, 1.0)
    sliding = k_d * k_v * travel * log(rng, 0.01, 0.6)
    breakaway = sliding * rng.choice([1.0, 1.0, 1.1, 1.3, 1.6, 2.0])
    step = sliding / (k_d * k_v) / log(rng, 100.0, 10_000.0)
    at_load = rng.random() < 0.4
    height = step * max(round(travel / step), 3) if rng.random() < 0.6 else travel
    estimate: dict[str, Any] = {"kind": "difference", "span": rng.choice([1, 1, 2])}
    if rng.random() < 0.3:
        estimate["time_constant"] = tick * log(rng, 0.5, 3.0)
    speed: dict[str, Any] = {"gain": k_d / ratio**2, "estimate": estimate}
    if rng.random() < 0.9:
        speed["integral_gain"] = log(rng, 0.03, 0.3) * k_d * w / ratio**2
    if rng.random() < 0.5:
        speed["torque_limit"] = log(rng, 0.7, 30.0) * breakaway / ratio
    controller: dict[str, Any] = {
        "sample_time": tick,
        "delay": rng.choice([0, 1, 1]),
        "encoder": {"shaft": "load" if at_load else "motor", "resolution": step if at_load else step * ratio},
        "reference": {"kind": "position", "steps": [{"time": 0.1, "height": height}]},
        "position": {"gain": k_v},
        "speed": speed,
    }
    if rng.random() < 0.3:
        controller["position"]["sample_time"] = tick * rng.choice([2, 4])
    if rng.random() < 0.3:
        controller["current"] = {"kind": "first_order", "time_constant": tick * log(rng, 0.3, 3.0)}
    load: dict[str, Any] = {"inertia": (1.0 - share) * inertia, "friction_torque": sliding, "breakaway_torque": breakaway}
    if rng.random() < 0.5:
        load["viscous_friction"] = log(rng, 0.01, 0.5) * k_d
    losses = {"kind": "constant_efficiency", "efficiency": 1.0}
    gear = {"ratio": ratio, "losses": losses, "stiffness": {"kind": "rigid"}}
    return geared(share * inertia, load, gear, controller, w)


def stable_axis(rng: random.Random) -> lm.Scenario:
    """One whose complete sampled loop is stable while the load slips."""
    while True:
        scenario = random_axis(rng)
        axis = axis_of(scenario)
        if all(instability(axis, regime) is None for regime in regimes(axis)):
            return scenario


def settled_errors(scenario: lm.Scenario, duration: float) -> np.ndarray:
    """Errors of the load in the stuck intervals of an exact run after its step that last until all but the integrator has settled."""
    of = sampled_slip(axis_of(scenario))
    count = min(math.ceil(duration / of.tick), SAMPLES)
    run = lm.simulate(scenario.replace(**{"simulation.duration": count * of.tick, "simulation.sample_interval": of.tick}))
    angle, mode = run["load_angle"].values, run["load_contact"].values
    time = run["time"].values
    ends = np.flatnonzero((mode[:-1] == 0) & (mode[1:] != 0))
    begins = np.flatnonzero((mode[:-1] != 0) & (mode[1:] == 0)) + 1
    to = scenario.controllers["m"].reference.steps[0].height
    found = []
    for end in ends[time[ends] > 0.1]:
        before = begins[begins <= end]
        begin = before[-1] if len(before) and time[before[-1]] > 0.1 else np.searchsorted(time, 0.1)
        if end - begin > of.ramp.ticks + 2:
            found.append(to - angle[end])
    return np.array(found)


def check_band(scenario: lm.Scenario, found: Any, told: str) -> int:
    """Once a settled stuck interval has an error within the band, all that follow have; the reference is as far from a reading as it was."""
    low, high = found.band
    of = sampled_slip(axis_of(scenario))
    c, friction, seen = scenario.controllers["m"], scenario.shafts["load"].breakaway_torque, 0
    ratio = scenario.gears["gear"].ratio
    for size in (low * 1.01, math.sqrt(low * high), high * 0.99):
        error = of.step * (round(size / of.step - of.offset) + of.offset)
        if c.speed.gain * ratio**2 * c.position.gain * error < 0.9 * friction:  # it is stuck until the integrator frees it
            begun = scenario.replace(**{"controllers.m.reference.steps": [{"time": 0.1, "height": error}]})
            period = 4.0 * friction / (c.speed.k_i * ratio**2 * c.position.gain * low)
            sizes = np.abs(settled_errors(begun, 0.1 + SLIPS * period))
            inside = (sizes >= low) & (sizes <= high)
            since = int(np.argmax(inside)) if inside.any() else len(sizes)
            seen += len(sizes) - since
            assert inside[since:].all(), f"{told}: {sizes}"
    return seen


def checked_axes(seed: int, axes: int) -> dict[str, int]:
    """Verdicts of random axes, each checked by exact runs."""
    rng, counts, seen = random.Random(seed), {"hunts": 0, "does not hunt": 0, "not decided": 0}, 0
    for k in range(axes):
        scenario = stable_axis(rng)
        found = lm.hunting_certificate(scenario)
        counts[found.verdict] += 1
        told = f"seed {seed}, axis {k}: {found}"
        if found.verdict == "not decided":
            print(told, flush=True)
        elif found.band is not None:
            seen += check_band(scenario, found, told)
        else:
            watched = lm.servo.limit_cycle(scenario, causes=False)
            assert watched.verdict in (("at rest",) if found.verdict == "does not hunt" else ("hunts", "not decided")), f"{told}: {watched}"
    print(counts, f"{seen} slips within bands", flush=True)
    return counts


def test_verdicts_of_random_sampled_axes_are_those_of_exact_runs() -> None:
    counts = checked_axes(20_261_140, AXES)
    assert counts["not decided"] < AXES, counts


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--axes", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    checked_axes(arguments.seed, arguments.axes)
