"""Runs of drive trains, each in the smallest kernel that holds it, against the paper's drive and against CVODE."""

from __future__ import annotations

import math

from report import Report


def section(report: Report, programs: dict[str, list[list[str]]]) -> None:
    name = next(name for name in programs if name.startswith("bench_trains") and not name.endswith("size"))
    by_cvode: dict[str, list[tuple[str, float, str]]] = {}
    for train, method, ms, error in programs.get("peer_cvode", []):
        if not math.isnan(float(ms)):
            by_cvode.setdefault(train, []).append((method, float(ms), error))
    trains = [(train, *map(float, cells)) for train, *cells in programs[name]]
    reference = per_switching(trains[0][2], trains[0][4])
    report.section(
        "Drive trains",
        f"Exact solver in C++ ({name.rsplit('_', 1)[1]} build), without samples. The stiffer a train, the more event checks from one\n"
        "switching to the next; the last column but one sets its time per switching in relation to that of the paper's drive.",
    )
    report.table(
        (
            *("", "coupled states", "switchings", "event checks", "time [ms]", "us per event check"),
            *("us per switching", "ratio", "new train [ms]"),
        ),
        [
            (
                *(train, f"{states:.0f}", f"{switchings:.0f}", f"{checks:.0f}", f"{again:.4f}"),
                f"{1e3 * again / checks:.3f}",
                f"{per_switching(switchings, again):.3f}",
                f"{per_switching(switchings, again) / reference:.2f}",
                f"{first:.4f}",
            )
            for train, states, switchings, checks, again, first in trains
        ],
    )
    rows = [
        (f"{train}: {method}", f"{ms:.4f}", f"{ms / again:.0f}", error)
        for train, _, _, _, again, _ in trains
        for method, ms, error in by_cvode.get(train, [])
    ]
    report.add("", "The same by CVODE with the same regimes and contact logic, kept from run to run as well:", "")
    if rows:
        report.table(("", "time [ms]", "ratio to the exact solver", "largest error"), rows)
    else:
        report.add("Not measured: SUNDIALS is not installed.")


def sizes(report: Report, programs: dict[str, list[list[str]]]) -> None:
    """Chains of 8 to 128 masses: what a train costs that is twice as large."""
    measured = next(
        rows for name, rows in programs.items() if name.startswith("bench_trains") and name.endswith("size")
    )
    by_cvode = {(chain, method): float(ms) for chain, method, ms in programs.get("peer_cvode size", [])}
    report.section(
        "Size",
        "Chains of masses of 1e-3 kg m2 and gears of 500 N m/rad, driven by 3 N m at 2 Hz for 1 s, without samples: with two dry\n"
        "frictions and two gaps, and with friction on every mass and a gap at every third. CVODE has the Jacobian of each regime.",
    )
    methods = ("CVODE BDF, 1e-6", "CVODE Adams, 1e-9")
    report.table(
        (
            *("chain, masses", "coupled states", "switchings", "event checks", "again [ms]", "new [ms]"),
            *(heading for method in methods for heading in (f"{method} [ms]", "over new")),
        ),
        [
            (
                *(chain, states, switchings, checks, f"{float(again):.3f}", f"{float(new):.3f}"),
                *(
                    text
                    for method in methods
                    for text in (
                        f"{by_cvode.get((chain, method), math.nan):.1f}",
                        f"{by_cvode.get((chain, method), math.nan) / float(new):.0f}",
                    )
                ),
            )
            for chain, states, switchings, checks, again, new in measured
        ],
    )
    few = [
        (int(chain.split()[-1]), float(again), float(new))
        for chain, _, _, _, again, new in measured
        if chain.startswith("few")
    ]
    for k, what in ((1, "again"), (2, "new")):
        # Least squares over the logarithms.
        points = [(math.log(row[0]), math.log(row[k])) for row in few]
        x, y = (sum(p[j] for p in points) / len(points) for j in (0, 1))
        slope = sum((p - x) * (q - y) for p, q in points) / sum((p - x) ** 2 for p, _ in points)
        report.add(
            "",
            f"With few contacts the time of a train {what} grows with the number of masses to the power {slope:.2f}.",
        )


def per_switching(switchings: float, ms: float) -> float:
    """[us]"""
    return 1e3 * ms / switchings
