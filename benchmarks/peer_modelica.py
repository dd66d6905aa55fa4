"""The linear two-mass drive in Modelica, by Rumoca. (The Modelica Standard Library does not come with it: plain equations.)"""

from __future__ import annotations

from typing import Any

import numpy as np
import rumoca

TEXT = """
model TwoMassDrive
  Real M_D(start=0, fixed=true) "motor torque";
  Real w_M(start=0, fixed=true) "motor speed";
  Real w(start=0, fixed=true) "load speed";
  Real d(start=0, fixed=true) "twist";
  Real T_2 "output torque";
equation
  {tau}*der(M_D) + M_D = {M_DR}*({k_N}*{amplitude}*sin(2*{pi}*{frequency}*time) - ({k_N} - 1)*w_M/{w_DR});
  {J_1}*der(w_M) + {b_1}*w_M = M_D - T_2/({i}*{eta});
  {J_2}*der(w) + {b_2}*w = T_2;
  der(d) = w_M/{i} - w;
  T_2 = {k}*d;
end TwoMassDrive;
"""


def model_of(scenario: Any) -> rumoca.Model:
    """A scenario with linear stiffness, constant efficiency and no dry friction."""
    m, g, load = scenario.motor, scenario.gearbox, scenario.load
    numbers = {
        "pi": np.pi,
        "tau": m.electrical_time_constant,
        "M_DR": m.rated_torque,
        "k_N": m.armature_voltage_constant,
        "w_DR": m.rated_speed,
        "amplitude": scenario.command.amplitude,
        "frequency": scenario.command.frequency,
        "J_1": m.rotor_inertia + g.inertia,
        "b_1": g.viscous_friction,
        "i": g.ratio,
        "eta": g.losses.efficiency,
        "J_2": load.inertia,
        "b_2": load.viscous_friction,
        "k": g.stiffness.stiffness,
    }
    text = TEXT.format(**{k: repr(float(v)) for k, v in numbers.items()})
    return rumoca.Session().loads(text, model="TwoMassDrive")


def run(
    model: rumoca.Model, duration: float, interval: float, solver: str, rtol: float
) -> tuple[np.ndarray, np.ndarray]:
    """Load speed and twist at k * interval."""
    config = rumoca.SimConfig(solver=solver, rtol=rtol, atol=rtol * 1e-4, dt=interval)
    result = model.simulate(t=(0.0, duration), config=config)
    return np.asarray(result["w"]), np.asarray(result["d"])
