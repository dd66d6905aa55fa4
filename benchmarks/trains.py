"""Runs of drive trains, each in the narrowest kernel that holds it, against the paper's drive and against CVODE."""

from __future__ import annotations

import math

from report import Report


def section(report: Report, programs: dict[str, list[list[str]]]) -> None:
    name = next(name for name in programs if name.startswith("bench_trains"))
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


def per_switching(switchings: float, ms: float) -> float:
    """[us]"""
    return 1e3 * ms / switchings
