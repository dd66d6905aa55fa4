"""A sampled position controller around the exact drive: proportional-integral, encoder on the load, 1 kHz.

The integral and the sticking drive hunt: the load never rests at its target.
"""

import lostmotion as lm
from lostmotion.paper import paper_scenario

simulation = lm.Simulation(paper_scenario("2-DOF-NL", "small").drive(), step=1e-3)
target, integral, angles = 0.5e-3, 0.0, []  # [rad]
for _ in range(10_000):
    error = target - simulation["load_angle"]
    integral += 1e-3 * error
    simulation.advance(1e-3, command=60.0 * error + 120.0 * integral)
    angles.append(simulation["load_angle"])

late = angles[5000:]
print(
    f"target {1e3 * target:.3f} mrad; from 5 s on the load swings from {1e3 * min(late):.3f} to {1e3 * max(late):.3f} mrad"
)
print(lm.explain(simulation))
