"""Random linear axes of all their elements: exact against adaptive solver, and the energy that is turned over."""

import random
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from conftest import some
from tables import gear_between

TRAVEL = {"screws": ("lead", 0.005, 0.03), "racks": ("travel_per_turn", 0.05, 0.2), "belts": ("travel_per_turn", 0.05, 0.2)}  # fmt: skip


def random_slide(r: random.Random) -> dict[str, Any]:
    slide: dict[str, Any] = {"mass": 10.0 ** r.uniform(0.3, 1.7), "viscous_friction": r.uniform(0.0, 50.0)}
    if r.random() < 0.7:
        slide["friction_force"] = r.uniform(1.0, 40.0)
        if r.random() < 0.4:
            slide["breakaway_force"] = 1.4 * slide["friction_force"]
    if r.random() < 0.5:
        slide["inclination"] = r.uniform(-1.0, 1.5)
    if r.random() < 0.4:
        stops = {"lower": -r.uniform(0.01, 0.05), "upper": r.uniform(0.01, 0.05)}
        slide["end_stops"] = stops | {"stiffness": 10.0 ** r.uniform(5.0, 6.0)}
    return slide


def random_drive(r: random.Random, kind: str) -> dict[str, Any]:
    """A screw, a rack or a belt: compliant, with play or without, lossy, or with flanks that strike."""
    key, low, high = TRAVEL[kind]
    drive: dict[str, Any] = {"input": "shaft", "output": "slide", key: r.uniform(low, high)}
    if r.random() < 0.6:
        drive["efficiency"] = r.uniform(0.5, 0.95)
        if r.random() < 0.5:
            drive["backdriving_efficiency"] = r.uniform(0.2, 0.9)
    if r.random() < 0.8:
        drive["stiffness"] = 10.0 ** r.uniform(5.5, 7.0)
        drive["damping"] = r.choice([0.0, 10.0 ** r.uniform(2.5, 3.5)])
        drive["backlash"] = r.choice([0.0, 10.0 ** r.uniform(-5.0, -3.5)])
        drive["drag_torque"] = r.choice([0.0, r.uniform(0.0, 0.05)])
    elif "efficiency" not in drive:
        drive |= {"backlash": 10.0 ** r.uniform(-4.0, -3.0), "restitution": r.uniform(0.0, 0.8)}
    return drive


def random_axis(seed: int) -> lm.Scenario:
    """A motor, a gear that may reverse, and a slide, which a mass matrix may couple to another one."""
    r = random.Random(f"axis {seed}")
    slides: dict[str, Any] = {"slide": random_slide(r)}
    matrices: dict[str, Any] = {}
    if r.random() < 0.3:
        own, other = slides["slide"].pop("mass"), r.uniform(0.5, 5.0)
        slides["slide"].pop("inclination", None)
        slides["other"] = {"friction_force": r.uniform(0.0, 5.0), "force": {"amplitude": r.uniform(0.0, 5.0), "frequency": 2.0}}
        between = r.uniform(-0.8, 0.8) * float(np.sqrt(own * other))
        matrices["both"] = {"shafts": ["slide", "other"], "matrix": [[own, between], [between, other]]}
    kind = r.choice(list(TRAVEL))
    gear = gear_between("rotor", "shaft", r.choice([-3.0, 1.0, 2.5, -1.5]), 10.0 ** r.uniform(2.0, 3.3), mesh_damping=r.uniform(0.0, 0.5))
    command = {"mean": r.uniform(-0.2, 0.2), "amplitude": r.uniform(0.2, 1.0), "frequency": r.uniform(1.0, 5.0)}
    return lm.Scenario(
        shafts={"rotor": {}, "shaft": {"inertia": 10.0 ** r.uniform(-4.0, -3.0), "friction_torque": r.uniform(0.0, 0.1)}},
        slides=slides,
        mass_matrices=matrices,
        motors={"m": {"shaft": "rotor", "kind": "torque_source", "rotor_inertia": 3e-4, "rated_torque": 1.0}},
        gears={"gear": gear},
        command={"m": command},
        simulation={"duration": 0.8, "sample_interval": 5e-3},
        **{kind: {"drive": random_drive(r, kind)}},
    )


def gap(a: Any, b: Any) -> float:
    """Largest difference of speeds, positions and deflections, each in units of its largest value."""
    names = [name for name in a if str(name).endswith(("_speed", "_position", "_deflection"))]
    return max(float(np.abs(a[n].values - b[n].values).max() / max(1e-3, np.abs(a[n].values).max())) for n in names)


@pytest.mark.parametrize("block", range(some(6, 1)))
def test_both_solvers_agree_on_random_linear_axes(block: int) -> None:
    compared = struck = 0
    for seed in range(50 * block, 50 * block + 50):
        scenario = random_axis(seed)
        exact = lm.simulate(scenario)
        ledger = lm.energy_of(exact)
        assert abs(ledger["residual"]) <= 1e-9 * max(1.0, ledger["turned_over"]), seed
        fine, coarse = (lm.simulate(scenario, solver="dormand-prince", relative_tolerance=tolerance) for tolerance in (1e-11, 1e-9))
        own = gap(fine, coarse)
        if own > 1e-5:  # a grazing contact: the adaptive runs differ from each other
            continue
        assert gap(exact, fine) <= max(2e-7, 2.0 * own), seed
        compared += 1
        struck += ledger.get("drive: impacts", 0.0) > 0.0
    assert compared >= 47
    assert struck >= 1
