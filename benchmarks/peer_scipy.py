"""The paper's run by scipy's solve_ivp, with events; the right-hand side in Python or compiled by numba."""

from __future__ import annotations

import numpy as np
from contact_drive import ContactDrive, tolerances
from scipy.integrate import solve_ivp


def run(drive: ContactDrive, duration: float, times: np.ndarray, method: str, rtol: float) -> np.ndarray:
    """States at the times, shape (len(times), 5)."""
    x, t = np.zeros(5), 0.0
    out = np.zeros((len(times), 5))
    drive.rest()

    def input_guard(_: float, x: np.ndarray) -> float:
        return drive.input_guard(x)

    def twist_guard(_: float, x: np.ndarray) -> float:
        return drive.twist_guard(x)

    for guard in (input_guard, twist_guard):
        guard.terminal, guard.direction = True, -1  # type: ignore[attr-defined]
    while t < duration:
        done = solve_ivp(
            drive.rates,
            (t, duration),
            x,
            method,
            events=(input_guard, twist_guard),
            rtol=rtol,
            atol=tolerances(rtol),
            dense_output=True,
            max_step=0.05,
        )
        inside = (times >= t) & (times <= done.t[-1])
        out[inside] = done.sol(times[inside]).T
        t = done.t[-1]
        fired = [len(e) > 0 for e in done.t_events]
        if not any(fired):
            break
        x = drive.switch(t, done.y[:, -1], input_fired=fired[0], twist_fired=fired[1])
    return out
