"""The paper's drive under a servo cascade at 8 kHz: in C++, from Python, and with laws of the user's own."""

from __future__ import annotations

import math
from typing import Any

from report import Report, best

import lostmotion as lm

TICK = 125e-6


def section(report: Report, programs: dict[str, list[list[str]]]) -> None:
    report.section(
        "Closed loops",
        "The paper's drive, current and speed loop every 125 us, position loop every 1 ms, reference a sine of 1 Hz; 1 s, without\n"
        "samples in C++, with all variables at 1 kHz from Python.",
    )
    name = next(name for name in programs if name.startswith("bench_control"))
    report.table(
        ("C++: exact, same drive again", "ticks", "switchings", "event checks", "time [ms]", "us per tick"),
        [
            (case, ticks, switchings, checks, f"{float(ms):.3f}", f"{1e3 * float(ms) / int(ticks):.3f}")
            for case, ticks, switchings, checks, ms in programs[name]
        ],
    )
    cascade = axis()
    law = axis(law=True)
    rows: list[tuple[str, Any]] = [
        ("Python to dataset, loops of the core", lambda: lm.simulate(cascade, energy=False)),
        ("Python to dataset, a law compiled by numba", lambda: lm.simulate(law, energy=False, law=compiled_law())),
        (
            "Python to dataset, a law in Python",
            lambda: lm.simulate(law, energy=False, law=lm.control.Law(python_law, states=1)),
        ),
    ]
    report.table(("", "time [ms]"), [(name, f"{best(5, work):.2f}") for name, work in rows])
    compared = [row for row in programs.get("peer_cvode", []) if row[0] == "cascade"]
    if compared:
        exact = next(float(row[4]) for row in programs[name] if row[0] == "sine of 0.2 rad")
        report.add(
            "",
            "The sine without encoder lines by CVODE, restarted at each tick, with the same controllers and contact logic:",
            "",
        )
        report.table(
            ("", "time [ms]", "ratio to the exact solver", "largest error"),
            [(case, f"{float(ms):.1f}", f"{float(ms) / exact:.0f}", gap) for _, case, ms, gap in compared],
        )

    two_masses(report)


def two_masses(report: Report) -> None:
    """Sampled field-oriented control against motulator, a sampled speed loop against PathSim."""
    import two_mass
    from lostmotion.simulation.scenario.field_oriented_motors import errors_of

    oriented, mechanics = two_mass.axis(), two_mass.axis(torque_source=True)
    ours = best(5, lambda: lm.simulate(oriented, energy=False))
    bounds = errors_of(lm.simulate(oriented, energy=False))
    rows = [
        (
            "lostmotion, Python to dataset, with its error bound",
            f"{ours:.1f}",
            "",
            f"{bounds['m_quadrature_current']:.0e}",
        )
    ]
    for name, rtol in (("motulator as it comes", None), ("motulator, DOP853 at 1e-7", 1e-7)):
        time = best(2, lambda rtol=rtol: two_mass.by_motulator(rtol)())  # type: ignore[misc]
        rows.append((name, f"{time:.0f}", f"{time / ours:.0f}", ""))
    report.add(
        "", "motulator's two-mass drive with a salient synchronous motor, 1 s at 4 kHz, each under its own loops:", ""
    )
    report.table(("", "time [ms]", "ratio to lostmotion", "error of i_q at most [A]"), rows)
    exact = lm.simulate(mechanics, energy=False)["motor_speed"].values
    ours = best(5, lambda: lm.simulate(mechanics, energy=False))
    rows = [("lostmotion, Python to dataset", f"{ours:.1f}", "", "exact")]
    for rtol in (1e-4, 1e-8):
        time = best(1, lambda rtol=rtol: two_mass.by_pathsim(rtol))  # type: ignore[misc]
        speeds = two_mass.by_pathsim(rtol)
        n = min(len(speeds), len(exact))
        gap = abs(speeds[:n] - exact[:n]).max() / abs(exact).max()
        rows.append((f"PathSim at {rtol:.0e}", f"{time:.0f}", f"{time / ours:.0f}", f"{gap:.0e}"))
    report.add("", "The same two masses under a sampled speed loop alone:", "")
    report.table(("", "time [ms]", "ratio to lostmotion", "largest error of the speed"), rows)


def axis(**changes: Any) -> lm.Scenario:
    """The cascade as a scenario; with law = true its loops are given to `simulate`."""
    s = lm.load("position-axis")
    assert isinstance(s, lm.Scenario)
    controller: dict[str, Any] = {
        "sample_time": TICK,
        "encoder": {"lines": 2048},
        "reference": {"kind": "position", "amplitude": 0.2, "frequency": 1.0},
    }
    if changes:
        controller |= changes
    else:
        controller |= {
            "position": {"gain": 10.0, "feedforward": 1.0, "sample_time": 1e-3},
            "speed": {"gain": 8.29e-3, "integral_gain": 0.1266, "torque_limit": 1.5},
            "current": {"kind": "pi"},
        }
    return s.replace(controller=controller, **{"simulation.duration": 1.0})


def python_law(_time: float, measured: Any, reference: Any, state: Any) -> float:
    """Position and speed loop of the cascade, both at every tick, as a torque."""
    wanted = 90.0 * (10.0 * (reference[0] - measured[0]) + reference[1])
    torque = min(max(8.29e-3 * (wanted - measured[1]) + state[0], -1.5), 1.5)
    state[0] += TICK * (0.1266 / 8.29e-3) * (torque - state[0])
    return torque / 0.521  # type: ignore[no-any-return]


_kept: list[Any] = []


def compiled_law() -> lm.control.Law:
    """The same, compiled."""
    if not _kept:
        import numba

        @numba.cfunc(
            "int32(float64, CPointer(float64), CPointer(float64), CPointer(float64), CPointer(float64), voidptr)"
        )  # type: ignore[untyped-decorator]
        def law(_time, measured, reference, state, command, _data):  # type: ignore[no-untyped-def]
            wanted = 90.0 * (10.0 * (reference[0] - measured[0]) + reference[1])
            torque = 8.29e-3 * (wanted - measured[1]) + state[0]
            torque = min(max(torque, -1.5), 1.5)
            state[0] += TICK * (0.1266 / 8.29e-3) * (torque - state[0])
            command[0] = torque / 0.521
            return 0 if math.isfinite(torque) else 1

        _kept.append(law)
    return lm.control.Law(_kept[0], states=1)
