"""Chains of masses, as long as a test needs them."""

from typing import Any

import lostmotion as lm
from tables import gear_between, linear, run_of, torque_source


def chain(n: int, *, friction: float = 0.0, gaps: tuple[int, ...] = (), **law: Any) -> lm.Scenario:
    """Masses on springs, all alike, turned by a motor on the first one under a sine."""
    curve = {"kind": "curve", "backlash": 2e-3, "slopes": [800.0]}
    return lm.Scenario(
        shafts={f"m{k}": {"inertia": 1e-3, "friction_torque": friction, "viscous_friction": 1e-3} for k in range(n)},
        gears={
            f"g{k}": gear_between(f"m{k}", f"m{k + 1}", 1.0, curve if k in gaps else linear(800.0), mesh_damping=0.0 if k in gaps else 0.02)
            for k in range(n - 1)
        },
        motors={"drive": torque_source(1e-4, "m0", rated_torque=1.0)},
        command={"drive": law or {"mean": 0.1, "amplitude": 3.0, "frequency": 20.0}},
        simulation=run_of(0.1, 1e-3),
    )
