"""The page of an identification: overlays, residuals, correlations, profiles, friction; tables as CSV."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..identification.identify import IdentificationResult, residual_table
from ..identification.ladder import RungResult, free_on
from ..model.gear import Gear
from ..model.losses import LossMap, MeshEfficiency, WormMesh, efficiency_map
from ..simulation.train_scenario import TrainScenario
from ..units.conversion import si_factor
from . import plots
from .pages import embed, panels_csv, render_page, save_figure, table_csv, write_text
from .panels import Curve, Panel

if TYPE_CHECKING:
    from markupsafe import Markup

MEASURED: dict[str, Any] = {"color": "0.45", "linestyle": "-", "linewidth": 1.0}
COMPUTED: dict[str, Any] = {"color": "#d9730d", "linestyle": "--", "linewidth": 1.2}
DOTS: dict[str, Any] = {"color": "#0b3c5d", "linestyle": "", "marker": ".", "markersize": 1.5, "alpha": 0.35}
LINE: dict[str, Any] = {"color": "#0b3c5d", "linestyle": "-", "linewidth": 1.4}
COLUMNS = 4
PER_FIGURE = 24  # overlays
LOOPS = 3  # logs whose loops are drawn
PAIRS = 8  # of the strongest correlations, in words
MANY = 20_000  # points of a cloud of residuals


def write_identification(directory: Path, name: str, result: IdentificationResult) -> Path:
    """Figures (PNG, SVG), tables (CSV), the rig as a scenario, and ``identified.html`` in a directory, made if missing.

    Returns
    -------
    Path
        Of the page.
    """
    directory.mkdir(parents=True, exist_ok=True)
    figures = []
    for drawn, title, caption, panels, columns in _figures(result):
        rows = -(-len(panels) // columns)
        png = save_figure(plots.draw(panels, columns, (10.0, 0.6 + 2.4 * rows)), directory, drawn)
        write_text(directory / f"{drawn}.csv", panels_csv(panels))
        figures.append(embed(png, title, caption, drawn))
    if result.fit.free:
        figures.append(_correlation_figure(directory, result))
    write_text(directory / "identified.toml", result.scenario_text())
    if result.task.record:
        write_text(directory / "gearbox.toml", result.record_text())
    errors = [
        [
            e.log,
            e.channel,
            "held out" if e.held_out else "fitted",
            *(["no run", "", ""] if math.isnan(e.mae) else [f"{e.mae:.6g}", f"{e.rmse:.6g}", f"{100 * e.fit:.4g}"]),
            result.unit(e.channel),
        ]
        for e in result.errors
    ]
    header = ["log", "channel", "part", "MAE", "RMSE", "fit [%]", "unit of MAE and RMSE"]
    write_text(directory / "errors.csv", table_csv(header, errors))
    parameters = parameter_rows(result)
    write_text(
        directory / "parameters.csv", table_csv(["parameter", "value", "low", "high", "unit", "method"], parameters)
    )
    page = directory / "identified.html"
    context = {
        "title": result.task.title or name,
        "rungs": [[r.name, f"{r.train:.5g}", _held_out(r), k == result.chosen] for k, r in enumerate(result.rungs)],
        "error_unit": result.error_unit,
        "warnings": result.warnings(),
        "failures": [*result.failures(), *result.passed_over()],
        "parameters": parameters,
        "undetermined": [u.text for u in result.undetermined],
        "bounds": [*result.at_bounds, *result.differences()],
        "starts": [*result.inputs, *result.starts()],
        "header": header,
        "errors": errors,
        "left_out": result.left_out,
        "notes": result.notes,
        "figures": figures,
        "source": result.source(),
    }
    write_text(page, render_page("reports/identification.html.jinja", **context))
    return page


def _held_out(rung: RungResult) -> str:
    """The error of the logs held out, and how many have none."""
    error = "" if math.isnan(rung.held_out) else f"{rung.held_out:.5g}"
    return f"{error} ({len(rung.failed)} without a run)".strip() if rung.failed else error


def parameter_rows(result: IdentificationResult) -> list[list[str]]:
    """Values with intervals, as text in their units."""
    rows = []
    for name, p in result.task.parameters.items():
        value, interval = result.values[name], result.intervals.get(name)
        ends = (
            ["", "", p.unit, "given"]
            if interval is None
            else [p.shown(interval.low), p.shown(interval.high), p.unit, interval.method]
        )
        rows.append([name, p.shown(value), *ends])
    return rows


def _figures(result: IdentificationResult) -> list[tuple[str, str, str, list[Panel], int]]:
    """(name, title, caption, panels, columns) of all pictures."""
    variables = _variables(result)
    table = residual_table(result, tuple(variables))
    found = []
    overlays = [panel for log in result.logs for panel in _overlays(result, log.name, log.held_out, table[log.name])]
    for k in range(0, len(overlays), PER_FIGURE):
        number = "" if len(overlays) <= PER_FIGURE else f"-{k // PER_FIGURE + 1}"
        found.append(
            (
                f"overlays{number}",
                "Logs",
                "What was measured, and the run of the identified rig.",
                overlays[k : k + PER_FIGURE],
                COLUMNS,
            )
        )
    panels = _clouds(result, table, variables)
    if panels:
        found.append(
            (
                "residuals",
                "Residuals",
                "Measured less computed, all logs: what has a shape here, the model lacks.",
                panels,
                min(3, len(panels)),
            )
        )
    if result.profiles:
        panels = [_profile(result, name) for name in result.profiles]
        found.append(
            (
                "profiles",
                "Profiles",
                "Rise of the loss with one parameter given and all others fitted again; 1.92 is the 95 % interval.",
                panels,
                COLUMNS,
            )
        )
    if laws := _laws(result, table):
        caption = (
            "Of the identified rig. What it adds to a shaft's viscous friction, such as the back-e.m.f. of a motor, is in there, but for a phase "
            "that is without it: the curve of a phase with the motor off is the friction alone."
        )
        found.append(("laws", "Friction, losses and torsion", caption, laws, min(2, len(laws))))
    return found


def _variables(result: IdentificationResult) -> dict[str, str]:
    """Variables of the rig that residuals are shown over, with their labels."""
    assert result.rig is not None
    units, found = result.rig.units, {}
    measured = next(iter(result.task.measured.values())).variable
    shaft = measured.removesuffix("_angle").removesuffix("_speed")
    for name in (f"{shaft}_speed", f"{shaft}_angle"):
        if name in units:
            found[name] = f"{name} [{units[name]}]"
    for name in units:
        if name.endswith(("_output_torque", "_twist")):
            found[name] = f"{name} [{units[name]}]"
    return found


def _overlays(result: IdentificationResult, log: str, held_out: bool, run: dict[str, np.ndarray]) -> list[Panel]:
    panels = []
    for channel in result.task.measured:
        curves = (
            Curve("measured", run["time"], run[f"measured {channel}"], MEASURED),
            Curve("computed", run["time"], run[channel], COMPUTED),
        )
        panels.append(
            Panel(
                f"{_short(log)}{' (held out)' if held_out else ''}",
                "time [s]",
                _labelled(result, channel),
                curves,
            )
        )
    return panels


def _labelled(result: IdentificationResult, channel: str) -> str:
    """A channel with its unit."""
    unit = result.unit(channel)
    return f"{channel} [{unit}]" if unit else channel


def _clouds(
    result: IdentificationResult, table: dict[str, dict[str, np.ndarray]], variables: dict[str, str]
) -> list[Panel]:
    panels = []
    channel = next(iter(result.task.measured))
    residual = np.concatenate([run[f"measured {channel}"] - run[channel] for run in table.values()])
    step = max(1, len(residual) // MANY)
    for name, label in variables.items():
        x = np.concatenate([run[name] for run in table.values()])
        panels.append(
            Panel(
                f"over {name}",
                label,
                f"residual of {_labelled(result, channel)}",
                (Curve("residual", x[::step], residual[::step], DOTS),),
            )
        )
    return panels


def correlations(result: IdentificationResult) -> tuple[list[str], np.ndarray]:
    """Names of the free parameters, and the correlations of their errors, from the logs alone."""
    names = list(free_on(result.task, result.chosen))
    size = np.sqrt(np.diag(result.fit.normal))
    scale = np.divide(1.0, size, out=np.zeros_like(size), where=size > 0.0)  # so that no unit hides a parameter
    C = np.linalg.pinv(result.fit.normal * np.outer(scale, scale), rcond=1e-12, hermitian=True)
    d = np.sqrt(np.maximum(np.diag(C), 0.0))
    C = np.clip(np.divide(C, np.outer(d, d), out=np.zeros_like(C), where=np.outer(d, d) > 0.0), -1.0, 1.0)
    np.fill_diagonal(C, 1.0)
    return names, C


def _correlation_figure(directory: Path, result: IdentificationResult) -> Markup:
    """The whole matrix as a heat map and as a table, and its strongest pairs in words."""
    names, C = correlations(result)
    png = save_figure(plots.correlation_map(names, C), directory, "correlation")
    rows = [[name, *(f"{value:.6g}" for value in row)] for name, row in zip(names, C, strict=True)]
    write_text(directory / "correlation.csv", table_csv(["parameter", *names], rows))
    pairs = sorted(((i, j) for i in range(len(names)) for j in range(i)), key=lambda ij: -abs(C[ij]))[:PAIRS]
    words = "; ".join(f"{names[i]} and {names[j]} {C[i, j]:+.2f}" for i, j in pairs)
    caption = (
        "Of the errors of the parameters, from the logs alone: near +1 or -1 two of them can hardly be told apart."
    )
    return embed(png, "Correlations", f"{caption} Strongest: {words}." if words else caption, "correlation")


def _shade(k: int) -> str:
    """A colour that is readable in grey."""
    return ("#0b3c5d", "#d9730d", "#7fae3f", "#8a4f9e", "#b8b8b8", "#444444", "#c2a33a", "#5b9bd5")[k % 8]


def _profile(result: IdentificationResult, name: str) -> Panel:
    values, rise = np.array(result.profiles[name]).T
    unit = result.task.parameters[name].unit or "-"
    values = values / si_factor(unit)
    return Panel(
        name,
        f"{name} [{unit}]",
        "rise of the loss",
        (
            Curve("rise", values, rise, {**LINE, "marker": "o"}),
            Curve("95 %", values, np.full(len(values), 1.92), MEASURED),
        ),
    )


def _laws(result: IdentificationResult, table: dict[str, dict[str, np.ndarray]]) -> list[Panel]:
    """Friction of the shafts over speed, and the loops of gears with a twist."""
    panels = []
    for name in result.scenario.shafts:
        if curves := friction_curves(result, name):
            panels.append(Panel(f"friction of {name}", "speed [rad/s]", "torque [N·m]", curves))
    for name, gear in result.scenario.gears.items():
        if curves := loss_curves(gear):
            panels.append(Panel(f"losses of {name}", "output torque [N·m]", "lost at the output [N·m]", curves))
        if curves := loop_curves(name, table):
            panels.append(Panel(f"torsion of {name}", "twist [mrad]", "output torque [N·m]", curves))
    return panels


def friction_curves(result: IdentificationResult, shaft: str) -> tuple[Curve, ...]:
    """Friction of a shaft and of its motor's bearings over speed, and in the phases in which it is another.

    What a file adds to the viscous friction for the back-e.m.f. of a motor is not in that of a phase with the motor off: this one
    is the friction alone.
    """
    found: dict[str, Curve] = {}
    for label, scenario in [("dry and viscous", result.scenario), *_phases(result)]:
        curve = friction_curve(scenario, shaft, label)
        if curve is not None and not any(np.array_equal(curve.y, other.y) for other in found.values()):
            found[label] = curve
    return tuple(replace(c, style={**LINE, "color": _shade(k)}) for k, c in enumerate(found.values()))


def _phases(result: IdentificationResult) -> list[tuple[str, TrainScenario]]:
    """The rig in each phase of the task, with the values found, by what the phase is."""
    rig, first = result.rig, result.logs[0]
    assert rig is not None
    values = {**first.facts, **result.values_for(first.name)}
    changes = [rig.changes(values, result.chosen, k) for k in range(len(result.task.phases))]
    return [(str(p.when), rig.built(c).scenario) for p, c in zip(result.task.phases, changes, strict=True)]


def friction_curve(scenario: TrainScenario, name: str, label: str) -> Curve | None:
    """Friction of a shaft and of the bearings of its motors over speed; none without any."""
    shaft = scenario.shafts[name]
    slipping, at_rest, speeds, torques = shaft.friction()
    w = np.linspace(1e-3, max([5.0, *speeds]) if len(speeds) else 10.0, 200)
    dry = np.interp(w, speeds, torques) if len(speeds) else np.full(200, slipping)
    bearings = sum(m.friction_torque for m in scenario.motors.values() if m.shaft == name)
    if max(float(np.max(dry)), at_rest, bearings, shaft.viscous_friction) <= 0.0:
        return None
    return Curve(label, w, dry + bearings + shaft.viscous_friction * w, LINE)


def loop_curves(gear: str, table: dict[str, dict[str, np.ndarray]]) -> tuple[Curve, ...]:
    """Torque of a gear over its twist in the first logs, by the names of the logs."""
    twist, torque = f"{gear}_twist", f"{gear}_output_torque"
    runs = [(log, run) for log, run in table.items() if twist in run and torque in run][:LOOPS]
    return tuple(
        Curve(_short(log), 1e3 * run[twist], run[torque], {"color": _shade(k), "linewidth": 1.0})
        for k, (log, run) in enumerate(runs)
    )


def _short(log: str) -> str:
    """The name of a log without the ending of its file, of a long one the end."""
    return str(Path(log).with_suffix(""))[-28:]


def loss_curves(gear: Gear) -> tuple[Curve, ...]:
    """Torque that a gear loses over the torque at its output, positive where the input drives, at its least and its largest speed."""
    losses = gear.losses
    if isinstance(losses, MeshEfficiency | WormMesh):
        losses = efficiency_map(*losses.efficiencies())
    if not isinstance(losses, LossMap) or gear.rated_output_torque is None or gear.rated_input_speed is None:
        return ()
    speeds, loads, values = losses.whole()
    torque = np.array(loads) * gear.rated_output_torque
    table = np.array(values) * gear.rated_output_torque
    if not np.any(table):
        return ()
    return tuple(
        Curve(
            f"{speeds[k] * gear.rated_input_speed:.3g} rad/s",
            torque,
            table[:, k],
            {"color": _shade(n), "linewidth": 1.4},
        )
        for n, k in enumerate((0, len(speeds) - 1))
    )
