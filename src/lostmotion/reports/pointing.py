"""The pointing report: errors over time, their causes, robustness."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ..pointing.budget import Errors, PointingBudget, PointingError
from ..units.practical import ROUNDING as ROUNDED
from ..units.practical import excess, told_apart
from ..verdict import Point, Verdict
from .figure_style import FAINT, look
from .page import Prose, Report, Table
from .panels import Bars, Curve, Group, Panel
from .written_files import table_csv

NUMBERS = ("rms", "peak", "probable", "mean", "measured, rms")
ARCSEC = 648_000.0 / math.pi
FARTHEST = 20.0  # times the peak of an error: a limit beyond it is not drawn, as it would flatten the error
MEASURED: dict[str, Any] = look(1) | {"linestyle": "-", "linewidth": 0.7}  # steps of an encoder fill a band
ROUNDING = 1e-12  # [rad, m], below which an error is rounding


def header(budget: PointingBudget) -> list[str]:
    """Header of the table; with pixels if there are any."""
    units = [f"{name} [{_unit(budget)[1]}]" for name in NUMBERS]
    return ["axis", "run", *units, *(["rms [px]", "peak [px]"] if budget.pixels else [])]


def budget_rows(budget: PointingBudget) -> list[list[str]]:
    """The table of all runs but those at other speeds, as text."""
    runs = [("as it is", budget.whole)]
    runs += [(f"without {name}", found) for name, found in budget.without.items()]
    runs += [(f"{name} alone", found) for name, found in budget.alone.items()]
    runs += [("none of these", budget.ideal), *budget.variants.items(), *budget.robustness.items()]
    return [[axis, name, *_numbers(budget, axis, found)] for axis in budget.whole for name, found in runs]


def _numbers(budget: PointingBudget, axis: str, found: Errors) -> list[str]:
    e = found[axis]
    factor, _ = _unit(budget)
    every = (e.rms, e.peak, e.probable, e.mean, e.measured_rms)
    numbers = [f"{factor * value:.4g}" if abs(value) > ROUNDING else "0" for value in every]
    if budget.pixels:
        pixel = budget.pixels.get(axis)
        numbers += [f"{value / pixel:.3g}" if pixel else "" for value in (e.rms, e.peak)]
    return numbers


def contribution_header(budget: PointingBudget) -> tuple[str, ...]:
    """Header of the contributions."""
    return ("axis", "cause", _falls(budget), "share [%]", f"remaining rms [{_unit(budget)[1]}]")


def contribution_rows(budget: PointingBudget) -> list[list[str]]:
    """Contribution of each cause as all causes are removed one after another; the sum is their total."""
    rows = []
    factor, _ = _unit(budget)
    for axis, whole in budget.whole.items():
        total = whole.rms**2 - budget.ideal[axis].rms ** 2
        for name, part in budget.contributions(axis).items():
            left = budget.successive[name][axis].rms
            rows.append([axis, name, *_share(part, whole), f"{factor * left:.4g}"])
        rows.append([axis, "all causes", *_share(total, whole), f"{factor * budget.ideal[axis].rms:.4g}"])
    return rows


def _share(part: float, whole: PointingError) -> list[str]:
    share = f"{100.0 * part / whole.rms**2 + 0.0:.2f}" if whole.rms > 0.0 else ""
    share = "0.00" if share == "-0.00" else share
    return ["0" if share == "0.00" else f"{1e12 * part:.3g}", share]


def view_line(budget: PointingBudget) -> str:
    """Share of the time in which the target is in view, or nothing."""
    if budget.view is None:
        return ""
    return f"in view {100.0 * budget.view.share:.4g} % of the time, with probability {100.0 * budget.view.probability:.6g} %"


def _dotted(k: int) -> dict[str, Any]:
    return look(k) | {"marker": "o", "markersize": 5.0}


def _unit(budget: PointingBudget, axis: str | None = None) -> tuple[float, str]:
    """Factor from rad or m to the unit in which errors are shown, and this unit, for an axis or for all."""
    if budget.orders and set(_units(budget, axis)) == {"rad"}:  # axes of steppers belong to mounts
        return ARCSEC, "arcsec"
    factor, prefix = (1e6, "µ") if max(e.peak for e in budget.whole.values()) < 5e-5 else (1e3, "m")
    return factor, " or ".join(f"{prefix}{unit}" for unit in _units(budget, axis))


def _units(budget: PointingBudget, axis: str | None) -> list[str]:
    return [budget.units[axis]] if axis is not None else sorted(set(budget.units.values()), reverse=True)


def _falls(budget: PointingBudget, axis: str | None = None) -> str:
    return f"mean square falls by [{' or '.join(f'µ{unit}²' for unit in _units(budget, axis))}]"


def error_panels(budget: PointingBudget) -> list[Panel]:
    """Error of each axis and of the measured direction over time, from the instant at which they count."""
    kept = budget.time >= budget.after
    time = budget.time[kept]
    factor, _ = _unit(budget)

    def limits(axis: str) -> list[Curve]:
        most = budget.limits.get(axis, math.inf)
        if most > FARTHEST * budget.whole[axis].peak:
            return []
        return [
            Curve(name, time[[0, -1]], np.full(2, sign * factor * most), FAINT, legend)
            for name, sign, legend in (("limit", 1.0, "limit"), ("limit, below", -1.0, "_"))
        ]

    return [
        Panel(
            f"Error of {axis}",
            "time [s]",
            f"error [{_unit(budget, axis)[1]}]",
            (
                Curve("measured direction", time, factor * budget.measured[axis][kept], MEASURED),
                Curve("true direction: reference less load", time, factor * error[kept], look(0), "true direction"),
                *limits(axis),
            ),
        )
        for axis, error in budget.errors.items()
    ]


def speed_panels(budget: PointingBudget) -> list[Panel]:
    """Error over the speed of the targets; none where they have no speed."""
    if not budget.speeds:
        return []
    factors = np.array(list(budget.speeds))

    factor, _ = _unit(budget)

    def curve(axis: str, name: str, style: dict[str, Any]) -> Curve:
        values = np.array([factor * getattr(found[axis], name) for found in budget.speeds.values()])
        return Curve(name, factors, values, style)

    return [
        Panel(
            f"Error of {axis}",
            "speed of the target, times that of the scenario",
            f"error [{_unit(budget, axis)[1]}]",
            (curve(axis, "rms", _dotted(0)), curve(axis, "peak", _dotted(1))),
            y_range=(0.0, 1.1 * factor * max(found[axis].peak for found in budget.speeds.values()) or 1.0),
        )
        for axis in budget.whole
    ]


def robustness_panels(budget: PointingBudget) -> list[Panel]:
    """Rms error over wrong losses, temperature and wear, of all axes."""
    kinds: Mapping[str, tuple[str, str, float]] = {
        "losses in the controller": ("losses in the controller", "factor", 1.0),
        " K": ("temperature", "change of temperature [K]", 0.0),
        "arcmin": ("wear", "added backlash [arcmin]", 0.0),
        "µm": ("wear", "added axial backlash [µm]", 0.0),
    }
    panels = []
    factor, unit = _unit(budget)
    for sign, (title, label, nominal) in kinds.items():
        found = {_number(name): errors for name, errors in budget.robustness.items() if sign in name}
        if found:
            points = dict(sorted((found | {nominal: budget.whole}).items()))
            curves = tuple(
                Curve(
                    axis, np.array(list(points)), np.array([factor * e[axis].rms for e in points.values()]), _dotted(k)
                )
                for k, axis in enumerate(budget.whole)
            )
            top = 1.1 * max(float(c.y.max()) for c in curves) or 1.0
            panels.append(Panel(title, label, f"rms error [{unit}]", curves, y_range=(0.0, top)))
    return panels


def _number(name: str) -> float:
    """The one that the name of a run has."""
    return next(float(word) for word in name.split() if word.lstrip("+-").replace(".", "").isdigit())


def _bars(budget: PointingBudget) -> Group:
    """Contributions of the causes to the mean square error of each axis."""
    charts = tuple(
        Bars(
            f"Error of {axis}",
            _falls(budget, axis),
            {n: (1e12 * part,) for n, part in budget.contributions(axis).items()},
        )
        for axis in budget.whole
    )
    return Group("contributions", "Contributions of the causes", CONTRIBUTED, charts, max(1, len(charts)))


def verdict_of(budget: PointingBudget) -> Verdict | None:
    """Whether errors keep their limits and the target stays in view, where there are limits or an angle of view."""
    points = [Point("does not fit", f"{lost}") for lost in budget.lost if lost.times]
    points += [_limit_point(budget, axis, limit) for axis, limit in budget.limits.items()]
    if budget.view is not None and budget.view.share < 1.0:
        points.append(
            Point("does not fit", f"the target is out of view for {excess(1.0 - budget.view.share)} of the time")
        )
    elif budget.view is not None:
        points.append(Point("fits", "the target is in view all the time"))
    return Verdict.of(points) if points else None


def _limit_point(budget: PointingBudget, axis: str, limit: float) -> Point:
    factor, unit = _unit(budget, axis)
    misses = budget.whole[axis].peak > limit * (1.0 + ROUNDED)
    peak, most = told_apart(factor * budget.whole[axis].peak, factor * limit, misses)
    if misses:
        over = excess(budget.whole[axis].peak / limit - 1.0)
        return Point("does not fit", f"{axis}: peak error {peak} {unit}, {over} above its limit of {most} {unit}")
    return Point("fits", f"{axis}: peak error {peak} {unit}, within its limit of {most} {unit}")


def order_header(budget: PointingBudget) -> tuple[str, ...]:
    """Header of the errors by order."""
    return ("axis", f"amplitude [{_unit(budget)[1]}]", "order of its shafts", "cause")


def order_rows(budget: PointingBudget) -> list[list[str]]:
    """Periodic errors of steppers at constant speed, the largest first; or why there are none."""
    rows, (factor, _) = [], _unit(budget)
    for axis, found in budget.orders.items():
        if isinstance(found, str):
            rows.append([axis, "", "", f"none by order: {found}"])
            continue
        for line in found.lines:
            orders = ", ".join(f"{order:.6g} of {shaft}" for shaft, order in line.orders.items())
            rows.append([axis, f"{factor * line.amplitude:.4g}", orders, line.cause])
    return rows


def _verdict(budget: PointingBudget) -> Verdict | tuple[str, ...]:
    """Verdict on limits and view; the error of each axis, and its largest cause."""
    errors, causes = [], []
    for axis, e in budget.whole.items():
        factor, unit = _unit(budget, axis)
        pixel = budget.pixels.get(axis)
        pixels = f" ({e.rms / pixel:.3g} px)" if pixel else ""
        errors.append(f"{axis}: rms {factor * e.rms:.4g} {unit}{pixels}, peak {factor * e.peak:.4g} {unit}")
        parts = budget.contributions(axis)
        if parts and e.rms > 0.0:
            name, part = max(parts.items(), key=lambda pair: pair[1])
            causes.append(
                f"{axis}: {name}, {100.0 * part / e.rms**2:.3g} % of the mean square; without any cause "
                f"{factor * budget.ideal[axis].rms:.4g} {unit} rms remain"
            )
    lines = [f"Error, {'; '.join(errors)}; {budget.after_line}."]
    lines += [f"Largest contribution, {'; '.join(causes)}."] if causes else []
    found = verdict_of(budget)
    if found is None:
        return *lines, 'No limit was given; `--limit "MOTOR=ANGLE"` asks for a verdict.'
    return replace(found, lines=(*found.lines, *lines))


BUDGET = (
    "Each row is a run: “without” removes one cause, “alone” keeps only that one, “none of these” removes all. The rows below "
    "change one thing: the place of the encoders, the losses that the controller assumes, the temperature, the wear."
)
CONTRIBUTED = (
    "The causes are removed one after another, in this order. The mean square error falls by these contributions, which add up to the error by all causes. "
    "A negative contribution belongs to a cause that hides another one. Another order gives other contributions."
)


ROBUSTNESS = "Error with wrong losses in the controller, at other temperatures, and with wear."


def _computed(budget: PointingBudget) -> Prose:
    return Prose(
        "Method",
        (
            f"Each line is an exact simulation of the whole run; {budget.after_line}. The probable error is 0.6745 standard deviations; “measured” is the error of the "
            "measured direction; px stands for pixels. A blank cell means that the axis has no camera.",
            "The axis is not linear: the error by one cause alone differs from the gain by removing it, so both are listed. With a camera, the measured direction is the "
            "one in which its tracker expects the target. Without a camera, it is the encoder's value.",
            "A controller with an inverse model has the parameters of the drive in each run, except in the runs with other temperatures or other losses in the controller. "
            "Changes of temperature are relative to the data: friction and losses by exp(-0.015/K), copper of DC motors by 0.39 %/K, their magnets by -0.2 %/K.",
        ),
    )


def pointing_report(name: str, budget: PointingBudget) -> Report:
    """The page of a pointing budget."""
    errors, speed = error_panels(budget), speed_panels(budget)
    main = Group(
        "errors",
        "Errors over time",
        "Errors of the true and of the measured direction.",
        tuple(errors),
        min(2, len(errors)),
    )
    rows, parts = budget_rows(budget), contribution_rows(budget)
    as_it_is = frozenset(k for k, row in enumerate(rows) if row[1] == "as it is")
    return Report(
        title=budget.scenario.title or name,
        lead=f"Pointing report of the axes of `{name}`: errors against the direction that they follow, and their causes.",
        verdict=_verdict(budget),
        main=main,
        parts=(
            Table("Budget", header(budget), rows, BUDGET, chosen=as_it_is),
            _bars(budget),
            Table("Contributions", contribution_header(budget), parts),
            Table("Error at constant speed by order", order_header(budget), order_rows(budget)),
            Group("speed", "Error over target speed", "", tuple(speed), min(2, len(speed))),
            Group("robustness", "Robustness", ROBUSTNESS, tuple(robustness_panels(budget)), 3),
            _computed(budget),
        ),
        file="track.html",
        tables={
            "budget.csv": table_csv(header(budget), rows),
            "contributions.csv": table_csv(contribution_header(budget), parts),
        },
    )
