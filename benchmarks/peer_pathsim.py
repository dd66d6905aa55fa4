"""The paper's run in PathSim: the drive with its contacts as one block, its guards as zero-crossing events."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from contact_drive import ContactDrive, tolerances
from pathsim import Simulation
from pathsim.blocks import ODE
from pathsim.events import ZeroCrossingDown
from pathsim.solvers import RKDP54


def run(drive: ContactDrive, times: np.ndarray, rtol: float) -> np.ndarray:
    """States at the times, which must begin at 0; shape (len(times), 5)."""
    drive.rest()
    block = ODE(lambda x, _, t: np.array(drive.rates(t, x)), initial_value=np.zeros(5))

    def switched(*, input_fired: bool, twist_fired: bool):
        def act(t: float) -> None:
            block.engine.set(drive.switch(t, block.engine.get(), input_fired=input_fired, twist_fired=twist_fired))

        return act

    events = [
        ZeroCrossingDown(
            lambda _: drive.input_guard(block.engine.get()),
            switched(input_fired=True, twist_fired=False),
            tolerance=1e-10,
        ),
        ZeroCrossingDown(
            lambda _: drive.twist_guard(block.engine.get()),
            switched(input_fired=False, twist_fired=True),
            tolerance=1e-10,
        ),
    ]
    simulation = Simulation(
        [block],
        events=events,
        Solver=RKDP54,
        dt=1e-5,
        log=False,
        tolerance_lte_rel=rtol,
        tolerance_lte_abs=tolerances(rtol),
    )
    out = np.zeros((len(times), 5))
    for k, (before, t) in enumerate(pairwise(times), start=1):
        simulation.run(t - before, reset=False, adaptive=True)
        out[k] = block.engine.get()
    return out
