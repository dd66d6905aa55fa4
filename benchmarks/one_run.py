"""The paper's run by lostmotion and by its peers, and what the peers can hold of it that cannot hold it all."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import peer_modelica
import peer_mujoco
import peer_pathsim
import peer_scipy
from contact_drive import ContactDrive
from report import VECTORS, Report, best
from xarray import Dataset

import lostmotion as lm
from lostmotion.paper import paper_scenario

Row = tuple[str, float, str]  # name, [ms], largest error


def error_of(load_speed: np.ndarray, twist: np.ndarray, exact: Dataset) -> float:
    """Of load speed and twist, relative to the largest of each."""
    pairs = ((load_speed, exact["load_speed"].values), (twist, exact["twist"].values))
    return max(float(np.max(np.abs(x - y)) / np.max(np.abs(y))) for x, y in pairs)


def timed(name: str, work: Callable[[], tuple[np.ndarray, np.ndarray]], exact: Dataset, repeats: int = 1) -> Row:
    found = work()
    return name, best(repeats, work), f"{error_of(*found, exact):.2g}"


def add_table(report: Report, rows: list[Row]) -> None:
    reference = rows[0][1]
    report.table(
        ("", "time [ms]", "ratio", "largest error"), [(n, f"{ms:.4f}", f"{ms / reference:.1f}", e) for n, ms, e in rows]
    )


def section(report: Report, scenario: lm.Scenario, programs: dict[str, list[list[str]]]) -> None:
    """programs: output of each C++ program, line by line, split into cells."""
    exact = lm.simulate(scenario)
    times = exact["time"].values

    widest = next(iter(programs))

    def compiled(loss_map: str) -> list[Row]:
        """All cases in the build for the widest vectors, the exact solver alone in the others, CVODE."""
        rows = [
            (f"C++: {cells[1]}{VECTORS.get(program.rsplit('_', 1)[1], '')}", float(cells[2]), cells[3])
            for program, lines in programs.items()
            if program.startswith(("bench_run", "peer_cvode"))
            for cells in lines
            if cells[0] == loss_map and (program in (widest, "peer_cvode") or "exact" in cells[1])
        ]
        return sorted(rows, key=lambda row: "same drive again" not in row[0])

    rows = compiled("table")
    rows.append(("Python to dataset, no ledger", best(100, lambda: lm.simulate(scenario, energy=False)), "0"))
    rows.append(("Python to dataset, with ledger", best(100, lambda: lm.simulate(scenario, energy=True)), "0"))
    for is_compiled, what in ((False, "in Python"), (True, "compiled by numba")):
        drive = ContactDrive(scenario, compiled=is_compiled)
        peer_scipy.run(drive, 0.1, times[:101], "LSODA", 1e-6)  # numba compiles now
        for method in ("LSODA", "Radau"):
            for rtol in (1e-6, 1e-8):
                begin = time.perf_counter()
                states = peer_scipy.run(drive, 2.0, times, method, rtol)
                spent = 1e3 * (time.perf_counter() - begin)
                error = error_of(states[:, 2], states[:, 3], exact)
                rows.append((f"scipy {method}, rtol {rtol:g}, right-hand side {what}", spent, f"{error:.2g}"))
    drive = ContactDrive(scenario)
    begin = time.perf_counter()
    states = peer_pathsim.run(drive, times, 1e-6)
    spent = 1e3 * (time.perf_counter() - begin)
    rows.append(("PathSim RKDP54, rtol 1e-06, in Python", spent, f"{error_of(states[:, 2], states[:, 3], exact):.2g}"))
    report.section(
        "One run",
        "2-DOF-NL, E_CA = 1.0275, 1 Hz, 2 s from rest, load speed and twist sampled at 1 kHz (where it says so, and in Python,\n"
        "all channels), stand-in loss table. CVODE has the same regimes and contact logic as the exact solver and differs in the\n"
        "integrator alone; scipy and PathSim have them written in Python. Errors are of load speed and twist against the exact\n"
        "run, relative to the largest of each.",
    )
    add_table(report, rows)
    report.section("The same on a plane loss map", "m_2B = 0.02 + 0.04 v + 0.06 mu: fewer switchings.")
    add_table(report, compiled("plane"))
    sub_problems(report)


def sub_problems(report: Report) -> None:
    base = paper_scenario("2-DOF-L", "large")
    report.section(
        "What other tools can hold of it",
        "Two masses and a linear spring. MuJoCo has no losses in a tendon and no motor with a time constant: here a torque source\n"
        "(amplitude 0.1), efficiency 1, dry friction of the motor, which it regularises. Rumoca compiles Modelica; the Modelica\n"
        "Standard Library does not come with it, so the drive is written in equations, without dry friction.",
    )
    stuck = base.replace(**{"motor.kind": "torque_source", "gearbox.losses.efficiency": 1.0, "command.amplitude": 0.1})
    exact = lm.simulate(stuck)
    rows: list[Row] = [
        (
            "lostmotion, Python to dataset: torque source, friction",
            best(100, lambda: lm.simulate(stuck, energy=False)),
            "0",
        )
    ]
    for step in (1e-4, 1e-5):
        model = peer_mujoco.model_of(stuck.drive(), step)

        def by_mujoco(model=model):
            return peer_mujoco.run(model, stuck.command.amplitude, stuck.command.frequency, len(exact["time"]), 1e-3)

        rows.append(timed(f"MuJoCo, steps of {step:g} s", by_mujoco, exact))
    add_table(report, rows)
    smooth = base.replace(**{"motor.friction_torque": 0.0})
    exact_smooth = lm.simulate(smooth)
    rows = [
        ("lostmotion, Python to dataset: motor, no friction", best(100, lambda: lm.simulate(smooth, energy=False)), "0")
    ]
    modelica = peer_modelica.model_of(smooth)
    for solver in ("rk-like", "bdf"):
        for rtol in (1e-6, 1e-8):

            def by_modelica(solver=solver, rtol=rtol):
                return peer_modelica.run(modelica, 2.0, 1e-3, solver, rtol)

            rows.append(timed(f"Rumoca, solver {solver}, rtol {rtol:g}", by_modelica, exact_smooth, 5))
    report.add("")
    add_table(report, rows)
