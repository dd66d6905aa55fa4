"""The two-mass example of motulator 0.5 in a closed loop: by motulator, by PathSim, and exactly."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

import lostmotion as lm

TICK, DURATION = 250e-6, 1.0
J, STIFFNESS, DAMPING = 0.005, 700.0, 0.01  # of both masses [kg m2], of the shaft [N m/rad, N m s/rad]
PAIRS, R, L_D, L_Q, FLUX, DC_VOLTAGE, CURRENT = 3, 3.6, 0.036, 0.051, 0.545, 540.0, 6.45
SPEED, GAIN, INTEGRAL, TORQUE = 2.0 * math.pi * 60.0, 0.25, 1.5, 14.0
LOAD = {"steps": [{"time": 0.15, "height": 5.0}]}


def by_motulator(rtol: float | None) -> Any:
    """A simulation of motulator's own loops on its own drive, ready to run; its solver's tolerances are 1e-3 and 1e-6 if not given."""
    from motulator.common.model import _simulation
    from motulator.drive import control, model
    from motulator.drive.control import sm
    from motulator.drive.utils import SynchronousMachinePars, TwoMassMechanicalSystemPars
    from scipy.integrate import solve_ivp

    par = SynchronousMachinePars(n_p=PAIRS, R_s=R, L_d=L_D, L_q=L_Q, psi_f=FLUX)
    shafts = TwoMassMechanicalSystemPars(J_M=J, J_L=J, K_S=STIFFNESS, C_S=DAMPING, B_L=0.0)
    plant = model.Drive(
        model.VoltageSourceConverter(u_dc=DC_VOLTAGE),
        model.SynchronousMachine(par),
        model.TwoMassMechanicalSystem(shafts, tau_L=lambda t: (t > 0.15) * 5.0),
    )
    reference = sm.CurrentReferenceCfg(par, nom_w_m=2.0 * math.pi * 75.0, max_i_s=math.sqrt(2.0) * CURRENT)
    controller = sm.CurrentVectorControl(par, reference, T_s=TICK, J=2.0 * J, sensorless=False)
    controller.ref.w_m = lambda t: (t > 0.02) * SPEED
    controller.speed_ctrl = control.SpeedController(2.0 * J, 2.0 * math.pi * 4.0)
    if rtol is None:
        _simulation.solve_ivp = solve_ivp
    else:
        _simulation.solve_ivp = lambda *a, max_step: solve_ivp(*a, method="DOP853", rtol=rtol, atol=0.1 * rtol)
    simulation = _simulation.Simulation(plant, controller)
    return lambda: simulation._simulation_loop(DURATION, math.inf)


def axis(*, torque_source: bool = False) -> lm.Scenario:
    """The same drive under sampled field-oriented control, or its mechanics with the torque as the speed loop asks for it."""
    motor: dict[str, Any] = {"shaft": "motor", "rotor_inertia": J, "rated_torque": TORQUE}
    if torque_source:
        motor["kind"] = "torque_source"
    else:
        motor |= {"kind": "synchronous", "dc_voltage": DC_VOLTAGE}
        motor["winding"] = {
            "pole_pairs": PAIRS,
            "resistance_phase": R,
            "inductance_d": L_D,
            "inductance_q": L_Q,
            "flux_linkage": FLUX,
            "max_current_rms": CURRENT,
        }
    controller: dict[str, Any] = {
        "sample_time": TICK,
        "encoder": {"ideal": True},
        "shaft": "motor",
        "reference": {"kind": "speed", "steps": [{"time": 0.02, "height": SPEED}]},
        "speed": {"gain": GAIN, "integral_gain": INTEGRAL, "torque_limit": TORQUE, "estimate": {"kind": "exact"}},
    }
    if not torque_source:
        controller["current"] = {"kind": "field_oriented"}
    coupling = {"input": "motor", "output": "load", "ratio": 1.0}
    return lm.Scenario(
        shafts={"motor": {}, "load": {"inertia": J, "torque": LOAD}},
        motors={"m": motor},
        gears={"shaft": coupling | {"stiffness": {"kind": "linear", "stiffness": STIFFNESS}}},
        controllers={"m": controller},
        simulation={"duration": DURATION, "sample_interval": TICK},
    )


def by_pathsim(rtol: float) -> np.ndarray:
    """Speeds of the motor at the ticks: the mechanics without damping as one block, the speed loop as a scheduled event."""
    from pathsim import Simulation
    from pathsim.blocks import ODE
    from pathsim.events import Schedule
    from pathsim.solvers import RKDP54

    torque, pending, integral, speeds = [0.0], 0.0, 0.0, []

    def rates(x: np.ndarray, _: Any, t: float) -> np.ndarray:
        M = STIFFNESS * x[2]
        return np.array([(torque[0] - M) / J, (M - (5.0 if t >= 0.15 else 0.0)) / J, x[0] - x[1]])

    block = ODE(rates, initial_value=np.zeros(3))

    def tick(t: float) -> None:
        nonlocal pending, integral
        w = float(block.engine.get()[0])
        speeds.append(w)
        torque[0] = pending
        wanted = SPEED if t > 0.02 - 0.5 * TICK else 0.0
        M = GAIN * (wanted - w) + integral
        pending = min(max(M, -TORQUE), TORQUE)
        integral += TICK * INTEGRAL / GAIN * (pending - integral)

    simulation = Simulation(
        [block],
        events=[Schedule(t_start=0.0, t_period=TICK, func_act=tick)],
        Solver=RKDP54,
        dt=0.1 * TICK,
        dt_max=TICK,
        log=False,
        tolerance_lte_rel=rtol,
        tolerance_lte_abs=rtol,
    )
    simulation.run(DURATION, adaptive=True)
    return np.array(speeds)
