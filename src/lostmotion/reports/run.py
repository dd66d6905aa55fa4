"""A run as text and as a page."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ..errors import visible
from ..model.end_stops import END_STOP
from ..simulation.runs.lost_steps import LostSteps, found_in
from ..simulation.runs.results import RunArrays, energy_of, recorded_variables, whole
from ..simulation.runs.sample_means import weights
from ..simulation.runs.switchings import ATTRIBUTE as SWITCHINGS
from ..simulation.runs.switchings import MESH_STEP, names_in, unpacked
from ..simulation.scenario.field_oriented_motors import errors_of
from ..simulation.scenario.scenario import Scenario
from ..units.practical import charted, counted, part_of_whole, printed
from ..verdict import Point, Verdict
from .panels import shown_energies
from .run_loops import lines_of, loop_errors, points_of

if TYPE_CHECKING:
    import xarray

    from .page import Report, Table

# Of more elements than `MANY`, a summary shows the elements that move, carry or lose most; the page has all.
MANY, SHOWN = 12, 6
FEWEST = 20.0  # samples in the period of a sine, with which a peak of it is missed by 1.2 % at most


def summary(result: xarray.Dataset | RunArrays) -> str:
    """A run in a few lines: each element at the end and at its peak, which contacts are stuck, and the energy."""
    scenario = Scenario.from_json(result.attrs["scenario"])
    train = scenario.train()

    def titled(kind: str, name: str) -> str:
        return name if kind == name else f"{kind} {name}"

    def end_and_peak(name: str, unit: str, *, small: bool = False) -> str:
        shown, factor = charted(unit, small=small)
        values = factor * np.asarray(result[name])
        return f"{_end(values):.4g} {shown}, peak {np.max(np.abs(values)):.4g}"

    time = float(np.asarray(result["time"])[-1])
    lines = [
        visible(result.attrs["title"]) or "(no title)",
        f"  {time:g} s, {counted(result.attrs['switching_count'], 'event')}, solver {result.attrs['solver']}; at the end:",
    ]
    for name in train.motors:
        unit = train.torque_unit(train.motors[name].shaft)
        lines.append(f"  {titled('motor', name)}: {end_and_peak(train.variable(name, 'torque'), unit)}")
    alike: dict[tuple[str, str], list[tuple[float, str]]] = {}  # lines of elements by kind and unit

    def element(kind: str, name: str, variable: str, unit: str, more: str) -> None:
        peak = float(np.max(np.abs(np.asarray(result[variable]))))
        line = f"  {titled(kind, name)}: {end_and_peak(variable, unit)}{more}"
        alike.setdefault((kind, unit), []).append((peak, line))

    for name in train.shafts:
        angle, (unit, factor) = train.variable(name, "angle"), charted(train.angle_unit(name))
        at = f"; at {factor * float(np.asarray(result[angle])[-1]):.4g} {unit}" if angle in result else ""
        element(
            "slide" if train.is_slide(name) else "shaft",
            name,
            train.variable(name, "speed"),
            train.speed_unit(name),
            at,
        )
    for name, gear in train.gears.items():
        twist, unit = train.variable(name, "twist"), train.angle_unit(gear.output)
        bends = twist.removeprefix(f"{name}_")
        bent = "" if gear.stiffness.kind == "rigid" else f"; {bends} {end_and_peak(twist, unit, small=True)}"
        element(
            scenario.kind_of(name), name, train.variable(name, "output_torque"), train.torque_unit(gear.output), bent
        )
    for name, shaft in train.shafts.items():
        if (stops := shaft.end_stops) is not None:
            more = "" if stops.stiffness is not None else "; between impacts"
            element("end stop", name, train.variable(name + END_STOP, "torque"), train.torque_unit(name), more)
    for (kind, unit), rows in alike.items():
        shown, others = _most(rows)
        lines += shown
        if others:
            name, factor = charted(unit)
            lines.append(f"  {counted(len(others), f'other {kind}')}: peaks up to {factor * max(others):.4g} {name}")
    stuck, _ = _most([(share, text) for share, text in _stuck(result) if share > 0.0])
    lines += [f"  contacts stuck: {', '.join(stuck)} of the time"] if stuck else []
    if "energy" in result.attrs:
        found = [(abs(v), f"{name} {v:.4g}") for name, v in shown_energies(energy_of(result)).items()]
        parts, others = _most(found)
        parts += [f"{counted(len(others), 'other')} of up to {max(others):.4g} each"] if others else []
        lines.append(f"  energy [J]: {', '.join(parts) or 'none'}")
    return "\n".join([*lines, *_of_samples(scenario), *_last_lines(result)])


def _of_samples(scenario: Scenario) -> Iterator[str]:
    """A line where peaks may lie between the samples of a sine, whose largest one is then up to 1 % or more below its amplitude."""
    fastest = max((f for s in scenario.signals().values() for _, f, _ in s.sine_list()), default=0.0)
    period = math.inf if fastest == 0.0 else 1.0 / (fastest * scenario.simulation.sample_interval)
    if period < FEWEST:
        yield f"  peaks are those of the samples, {period:.3g} in a period of {fastest:g} Hz; a shorter sample_interval finds higher ones"


def _last_lines(result: xarray.Dataset | RunArrays) -> Iterator[str]:
    """Lines of any run: its loops, how far its energy balance closes, its contacts and meshes, its bounds, warning and note."""
    yield from (f"  {line}" for line in lines_of(loop_errors(result)))
    if "energy" in result.attrs and energy_of(result)["turned_over"] > 0.0:
        yield f"  energy balance closes to {closes_to(result)}"
    yield from (f"  {found}" for found in steps_of(result))
    yield from (*contact_lines(result), *mesh_lines(result), *error_lines(result))
    yield from (f"  {kind}: {result.attrs[kind]}" for kind in ("warning", "note") if kind in result.attrs)


def steps_of(result: xarray.Dataset | RunArrays) -> tuple[LostSteps, ...]:
    """Steps that the steppers of a run have lost."""
    if "scenario" not in result.attrs or '"stepper"' not in result.attrs["scenario"]:
        return ()
    return found_in(Scenario.from_json(result.attrs["scenario"]), result)


def contact_lines(result: xarray.Dataset | RunArrays) -> list[str]:
    """Number of stops, break-aways and reversals of each contact, among the switchings that the result keeps."""
    if not result.attrs.get(SWITCHINGS):
        return []
    names = names_in(result.attrs)
    modes = unpacked(result.attrs)
    flanks = Scenario.from_json(result.attrs["scenario"]).train().flanks() if "scenario" in result.attrs else {}
    found = []
    for name in (n.removesuffix("_before") for n in names if n.endswith("_contact_before")):
        before, after = (modes[:, names.index(f"{name}_{when}")] for when in ("before", "after"))
        begins, ends = ("touches", "parts") if name in flanks else ("sticks", "slips")
        counts = {
            begins: (before != 0) & (after == 0),
            ends: (before == 0) & (after != 0),
            "turns around": (before != 0) & (after == -before),
        }
        parts = [f"{what} {n}" for what, rows in counts.items() if (n := int(rows.sum()))]
        if parts:
            times = float(sum(rows.sum() for rows in counts.values()))
            found.append((times, f"{name.removesuffix('_contact').replace('_', ' ')} {', '.join(parts)}"))
    shown, others = _most(found)
    more = [f"{counted(len(others), 'other')}, each up to {counted(int(max(others)), 'time')}"] if others else []
    return [f"  contacts [times]: {'; '.join([*shown, *more])}"] if found else []


def mesh_lines(result: xarray.Dataset | RunArrays) -> list[str]:
    """Number of events at which the stiffness of a mesh has stepped, and how many of them one turn of its input shaft has."""
    gears = Scenario.from_json(result.attrs["scenario"]).gears_by_key().items()
    meshes = {key.removeprefix("gears."): gear.mesh_stiffness for key, gear in gears if gear.mesh_stiffness is not None}
    if not meshes or not result.attrs.get(SWITCHINGS):
        return []
    causes = unpacked(result.attrs)[:, names_in(result.attrs).index("cause")]
    count = int(np.sum(causes == MESH_STEP))
    each = ", ".join(f"{name} {mesh.teeth * mesh.steps():g}" for name, mesh in meshes.items())
    return [f"  steps of the mesh stiffness: {counted(count, 'event')}; in a turn of the input shaft {each}"]


def error_lines(result: xarray.Dataset | RunArrays) -> list[str]:
    """Bounds on the errors of currents, torques and speeds of motors under field-oriented control, and their largest values."""
    bounds = errors_of(result)
    if not bounds:
        return []
    shown = (
        f"{name.replace('_', ' ')} {bound:.1e} of {np.max(np.abs(np.asarray(result[name]))):.4g} {unit}"
        for (name, bound), unit in zip(bounds.items(), ("A peak", "A peak", "N·m", "rad/s") * len(bounds), strict=False)
    )
    return [f"  error of the field-oriented control at most: {', '.join(shown)}"]


def _most(rows: list[tuple[float, str]]) -> tuple[list[str], list[float]]:
    """Texts in their order; of too many, the texts with the largest values; and the values of the others."""
    least = sorted(rows)[: -SHOWN if len(rows) > MANY else 0]
    return [text for value, text in rows if (value, text) not in least], [value for value, _ in least]


def _end(values: np.ndarray) -> float:
    """The last value; 0 where it is no more than the rounding of the largest."""
    return float(values[-1]) if abs(values[-1]) > 1e-12 * np.max(np.abs(values)) else 0.0


def closes_to(result: xarray.Dataset | RunArrays) -> str:
    """Error of the energy balance relative to the energy that was turned over."""
    share = float(result.attrs["energy_residual"])
    return "rounding" if share < 1e-12 else f"{share:.1e}"


# --- the page ---


def run_report(name: str, result: xarray.Dataset) -> Report:
    """The page of a run.

    Raises InputError: the dataset is no run.
    """
    from .page import Prose, Report
    from .panels import Flows, Group
    from .run_charts import gear_charts, run_charts

    result = whole(result)
    charts = run_charts(result)
    _, *lines = (line.strip() for line in summary(result).splitlines())
    told = [line for line in lines if line.startswith(("warning:", "note:"))]
    others = [line for line in lines if line not in told]
    e = energy_of(result) if "energy" in result.attrs else {}
    closes = f"; the energy balance closes to {closes_to(result)}" if e.get("turned_over") else ""
    last = float(result["time"][-1])
    first = f"{last:g} s with {counted(result.attrs['switching_count'], 'switching')}, by the {result.attrs['solver']} solver{closes}."
    flows = [Flows("Energy of the whole run", e)] if e else []
    found = verdict_of(result)
    shown = (first, *_motion_lines(result), *told)[:3]
    return Report(
        title=result.attrs.get("title") or name,
        lead=f"Run of `{name}`.",
        verdict=shown if found is None else Verdict(found.state, (*found.lines, *shown)[:3]),
        main=Group("run", "The run", "Drag over a chart to zoom, double-click to see all of it.", tuple(charts)),
        parts=(
            Group("gears", "Torsion, losses and energy", "", (*gear_charts(result), *flows)),
            _variables(result),
            Prose("Summary", [line for line in (*others, *told) if not line.endswith("at the end:")], listed=True),
        ),
    )


def verdict_of(result: xarray.Dataset | RunArrays) -> Verdict | None:
    """Verdict on a run whose loops do not work, or that warns; None where nothing is judged."""
    points = points_of(loop_errors(result))
    points += [Point("does not fit", str(found)) for found in steps_of(result) if found.times]
    points += [Point("fits with a reservation", result.attrs["warning"])] if "warning" in result.attrs else []
    return Verdict.of(points) if points else None


def _motion_lines(result: xarray.Dataset) -> list[str]:
    """Errors of controlled axes, and which contacts are stuck."""
    errors = [line for found in loop_errors(result) for line in found.lines()]
    stuck = [text for _, text in _stuck(result)]
    lines = [f"{'; '.join(errors)}."] if errors else []
    return lines + ([f"Share of the time in which contacts are stuck: {', '.join(stuck)}."] if stuck else [])


def _stuck(result: xarray.Dataset | RunArrays) -> list[tuple[float, str]]:
    """Share of the time for which each sticking contact is stuck, and the same in words."""
    train = Scenario.from_json(result.attrs["scenario"]).train()
    turned = {*(gear.input for gear in train.gears.values()), *(motor.shaft for motor in train.motors.values())}
    # A load without dry friction is at rest where all before it is stuck, and holds nothing by itself.
    free = {
        train.variable(name, "contact")
        for name, shaft in train.shafts.items()
        if name not in turned and not any(map(np.any, shaft.friction().values()))
    }
    passed = free.union(train.flanks())
    share, found = weights(np.asarray(result["time"])), []
    names = (v.name for v in recorded_variables(result.attrs))
    for name in (n for n in names if n.endswith("_contact") and n in result and n not in passed):
        stuck = float(np.average(np.asarray(result[name]) == 0, weights=share))
        found.append((stuck, f"{name.removesuffix('_contact').replace('_', ' ')} {part_of_whole(stuck)}"))
    return found


def _variables(result: xarray.Dataset) -> Table:
    """Each variable at the end, and what it reaches."""
    from .page import Table

    rows, share = [], weights(result["time"].values)
    for name in map(str, result):
        values = result[name].values.astype(float)
        if values.ndim != 1 or name.endswith("_contact"):
            continue
        here = np.isfinite(values)
        known = values[here]
        if len(known):
            numbers = (
                float(values[-1]),
                float(known.min()),
                float(known.max()),
                float(np.sqrt(np.average(known**2, weights=None if share is None else share[here]))),
            )
            unit = printed(str(result[name].attrs.get("units", "")))
            size = max(map(abs, numbers[1:3]))
            rows.append([name, *(_digits(v, size) for v in numbers), "" if unit == "1" else unit])
    note = "A blank value means that the variable is not defined at the end; a blank unit, that it is a plain number."
    return Table("Variables", ("variable", "at the end", "least", "largest", "rms", "unit"), rows, note)


def _digits(value: float, size: float) -> str:
    """A value with sensible digits: blank if it is none, 0 if it is rounding beside the size of its variable."""
    if not np.isfinite(value):
        return ""
    return f"{value:.5g}" if abs(value) > 1e-12 * size else "0"
