"""The report of an identification: overlays, residuals, correlations, profiles, friction; tables as CSV."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..identification.candidate_models import RungResult
from ..identification.identify import residual_table
from ..identification.prepared_log import Prepared
from ..identification.result import IdentificationResult
from ..identification.task.identification_file import free_on
from ..identification.verdicts.residual_tests import shape_variables
from ..model.gear import Gear
from ..model.losses import LossMap, MeshEfficiency, WormMesh, efficiency_map
from ..model.train import DriveTrain
from ..simulation.scenario.scenario import Scenario
from ..units.conversion import si_factor
from ..units.practical import ARCMIN, printed
from .figure_style import FAINT, MEASURED, PALETTE, dots, look
from .page import Prose, Report, Table
from .panels import Curve, Group, Matrix, Panel
from .written_files import table_csv, write_report, write_text

CLOUD = dots(PALETTE["first"], 1.6, alpha=0.4)
FIRST = 4  # overlays before the tables
PER_FIGURE = 24  # overlays
ALL = 12  # logs, up to which all are drawn
OF_EACH = 4  # logs of the worst, median and best
CLOUDS = 24  # logs, about, whose residuals are shown in clouds where not all logs are drawn
LOOPS = 3  # logs whose loops are drawn
PAIRS = 8  # of the strongest correlations, in words
MANY = 5_000  # points of a cloud of residuals
POINTS = (100, 4_000, 60_000)  # of a curve of an overlay, least and most, and of all together
HEADER = ("log", "channel", "part", "MAE", "RMSE", "fit [%]", "unit of MAE and RMSE")


# --- the page ---


def write_identification(
    directory: Path, name: str, result: IdentificationResult, pictures: Sequence[str] = (), *, all_logs: bool = False
) -> Path:
    """``identified.html``, tables (CSV) and the rig as a scenario in a directory, made if missing; on request pictures.

    Values are written first, then the page, then pictures.

    all_logs: draw all logs; else of many logs the worst, median and best.

    Returns the path of the page.
    """
    tables = {
        "errors.csv": table_csv(HEADER, error_rows(result)),
        "parameters.csv": table_csv(["parameter", "value", "low", "high", "unit", "method"], parameter_rows(result)),
    }
    if result.fit.free:
        names, C = correlations(result)
        rows = [[name, *(f"{value:.6g}" for value in row)] for name, row in zip(names, C, strict=True)]
        tables["correlation.csv"] = table_csv(["parameter", *names], rows)
    directory.mkdir(parents=True, exist_ok=True)
    write_text(directory / "identified.toml", result.scenario_text())
    if result.task.record:
        write_text(directory / "gearbox.toml", result.record_text())
    for file, text in tables.items():
        write_text(directory / file, text)
    return write_report(directory, identification_report(name, result, all_logs=all_logs), pictures)


def identification_report(name: str, result: IdentificationResult, *, all_logs: bool = False) -> Report:
    """The page of an identification; of many logs it shows the worst, median and best, or on request all."""
    main, *groups = _groups(result, {} if all_logs else _chosen_logs(result))
    unit, factor = _bracketed(result)
    rungs = [[r.name, f"{factor * r.train:.5g}", _held_out(r, factor)] for r in result.rungs]
    left_out = [list(pair) for pair in result.left_out.items()]
    notes = [[log, line] for log, lines in result.notes.items() for line in lines]
    lists = {
        "Unidentifiable parameters": [*(u.text for u in result.undetermined), *result.at_bounds, *result.differences()],
        "Odd logs and residuals": result.warnings(),
        "Interpolated inputs and start values": [*result.inputs, *result.starts()],
        "Models without a result": [*result.failures(), *result.passed_over()],
    }
    return Report(
        title=result.task.title or name,
        lead=f"{result.source()}.",
        verdict=result.verdict,
        main=main,
        parts=(
            Table(
                "Model sequence",
                ("model", f"mean absolute error, fitted{unit}", f"held out{unit}"),
                rungs,
                chosen=frozenset({result.chosen}),
            ),
            Table(
                "Values", ("parameter", "value", "from", "to", "unit", "interval"), parameter_rows(result), INTERVALS
            ),
            _conditions(result),
            _kinds(result),
            *(Prose(title, texts, listed=True) for title, texts in lists.items()),
            *[group for group in groups if not group.name.startswith("overlays")],
            Table(
                "Errors of each log",
                HEADER,
                error_rows(result, shown=True),
                "MAE: mean absolute error. RMSE: root mean square error. Fit: 1 - RMSE/standard deviation of the measured values.",
            ),
            Table("Logs that are left out", ("log", "reason"), left_out),
            Table("Notes on the logs", ("log", "note"), notes),
            *[group for group in groups if group.name.startswith("overlays")],
        ),
        file="identified.html",
    )


INTERVALS = (
    "Values and 95 % intervals. The bootstrap draws blocks of half a second of the residuals, and with five or more logs whole logs. "
    "If residuals are structured, the interval also contains the value of the neighbouring model, and is marked. A blank unit means a plain number."
)


def error_rows(result: IdentificationResult, *, shown: bool = False) -> list[list[str]]:
    """Errors of each log and channel as text, in SI or as they are shown."""
    rows = []
    for e in result.errors:
        unit, factor = result.error_unit(e.channel) if shown else (result.unit(e.channel), 1.0)
        sizes = [f"{factor * e.mae:.6g}", f"{factor * e.rmse:.6g}", f"{100 * e.fit:.4g}"]
        part = "held out" if e.held_out else "fitted"
        rows.append([e.log, e.channel, part, *(["no run", "", ""] if math.isnan(e.mae) else sizes), unit])
    return rows


def _bracketed(result: IdentificationResult, channel: str | None = None) -> tuple[str, float]:
    """Unit of errors in brackets, and how many of them one SI unit is."""
    unit, factor = result.error_unit(channel)
    return f" [{printed(unit)}]" if unit else "", factor


def _conditions(result: IdentificationResult) -> Table:
    """Errors of the logs of each condition, with and without them in the fit."""
    unit, factor = _bracketed(result)
    rows = [
        [c.name, str(c.logs), f"{factor * c.fitted:.5g}", c.failed or f"{factor * c.left_out:.5g}"]
        for c in result.conditions
    ]
    heading = ("condition", "logs", f"mean absolute error, fitted{unit}", f"fitted without them{unit}")
    return Table(
        "Leave one condition out", heading, rows, "For each condition the model is fitted again without its logs."
    )


def _kinds(result: IdentificationResult) -> Table:
    """Errors of the logs by the values of their headers."""
    channel = next(iter(result.task.measured))
    unit, factor = _bracketed(result, channel)
    rows = [[f"{k.key} = {k.value}", str(k.logs), f"{factor * k.mae:.5g}", str(k.odd)] for k in result.kinds]
    heading = ("logs with", "number", f"mean absolute error of {channel}{unit}", "odd logs")
    return Table(
        "Errors by kind of log", heading, rows, "A kind with a far larger error shows an effect that the model lacks."
    )


def _held_out(rung: RungResult, factor: float) -> str:
    """The error of the logs held out, and how many have none."""
    error = "" if math.isnan(rung.held_out) else f"{factor * rung.held_out:.5g}"
    return f"{error} ({len(rung.failed)} without a run)".strip() if rung.failed else error


def parameter_rows(result: IdentificationResult) -> list[list[str]]:
    """Values with intervals, as text in their units."""
    rows = []
    for name, p in result.task.parameters.items():
        value, interval = result.values[name], result.intervals.get(name)
        ends = (
            ["", "", printed(p.unit), "given"]
            if interval is None
            else [
                p.shown(interval.low),
                p.shown(interval.high),
                printed(p.unit),
                "; ".join(filter(None, (interval.method, interval.flag))),
            ]
        )
        rows.append([name, p.shown(value), *ends])
    return rows


# --- charts ---


def _chosen_logs(result: IdentificationResult) -> dict[str, str]:
    """Names of the logs that are drawn of many, with their rank: the worst, median and best; empty if all are drawn."""
    if len(result.logs) <= ALL:
        return {}
    unit = dict(zip(result.task.measured, result.fit.deviations, strict=True))
    worst: dict[str, float] = {}
    for e in result.errors:
        worst[e.log] = max(worst.get(e.log, 0.0), e.rmse / unit[e.channel] if math.isfinite(e.rmse) else math.inf)
    ranked = sorted(worst, key=lambda log: -worst[log])
    middle = (len(ranked) - OF_EACH) // 2
    parts = {"worst": ranked[:OF_EACH], "median": ranked[middle : middle + OF_EACH], "best": ranked[-OF_EACH:]}
    return {log: rank for rank, logs in parts.items() for log in logs}


def _groups(result: IdentificationResult, chosen: Mapping[str, str]) -> list[Group]:
    """All charts; charts of some logs come first.

    chosen: names of the logs that are drawn, with their rank; empty: all.
    """
    variables = _variables(result)
    spread = [log.name for log in result.logs[:: max(1, len(result.logs) // CLOUDS)]]
    table = residual_table(result, tuple(variables), [*chosen, *spread] if chosen else None)
    logs = sorted(result.logs, key=lambda log: not log.held_out)  # held-out logs say most
    if chosen:
        order = list(chosen)
        logs = sorted((log for log in logs if log.name in chosen), key=lambda log: order.index(log.name))
    count = len(logs) * len(result.task.measured)
    overlays = [
        panel for log in logs for panel in _overlays(result, log, chosen.get(log.name, ""), table[log.name], count)
    ]
    caption = "Measured signals, and the run of the identified rig."
    if chosen:
        caption += f" Drawn are the worst, median and best of {len(result.logs)} logs."
    found = [Group("overlays", "Logs", caption, tuple(overlays[:FIRST]))]
    logs_shown = f"{len(table)} of {len(result.logs)} logs" if len(table) < len(result.logs) else "all logs"
    text = f"Measured less computed, {logs_shown}: a pattern here is an effect that the model lacks."
    found.append(Group("residuals", "Residuals", text, tuple(_clouds(result, table, variables))))
    if result.fit.free:
        found.append(_correlation_group(result))
    text = "Rise of the loss with one parameter given and all others fitted again; 1.92 is the 95 % interval."
    found.append(Group("profiles", "Profiles", text, tuple(_profile(result, name) for name in result.profiles)))
    found.append(Group("laws", "Friction, losses and torsion", LAWS, tuple(_laws(result, table))))
    for n, k in enumerate(range(FIRST, len(overlays), PER_FIGURE)):
        found.append(Group(f"overlays-{n + 2}", "" if n else "Further logs", "", tuple(overlays[k : k + PER_FIGURE])))
    return found


LAWS = (
    "Laws of the identified rig. The friction of a shaft includes what acts like viscous friction, such as the back-e.m.f. of a motor. In a phase with the "
    "motor off it does not."
)


def _variables(result: IdentificationResult) -> dict[str, str]:
    """Variables of the rig that residuals are shown over, with their labels."""
    assert result.rig is not None
    units = result.rig.units
    names = [
        *shape_variables(result.rig).values(),
        *(name for name in units if name.endswith(("_twist", "_deflection"))),
    ]
    return {name: f"{name.replace('_', ' ')} [{printed(units[name])}]" for name in names}


def _overlays(
    result: IdentificationResult, log: Prepared, rank: str, run: dict[str, np.ndarray], panels: int
) -> list[Panel]:
    """Measured and computed channels of a log.

    panels: number of all overlays, which share the points of the page.
    """
    least, most, together = POINTS
    count = max(least, min(most, together // (2 * panels)))
    marks = ", ".join([*([rank] if rank else []), *(["held out"] if log.held_out else [])])
    return [
        Panel(
            f"{_short(log.name)}{f' ({marks})' if marks else ''}",
            "time [s]",
            _labelled(result, channel),
            (
                Curve("measured", run["time"], result.error_unit(channel)[1] * run[f"measured {channel}"], MEASURED),
                Curve("computed", run["time"], result.error_unit(channel)[1] * run[channel], look(1)),
            ),
            max_points=count,
        )
        for channel in result.task.measured
    ]


def _labelled(result: IdentificationResult, channel: str) -> str:
    """A channel with its unit."""
    return f"{channel}{_bracketed(result, channel)[0]}"


def _clouds(
    result: IdentificationResult, table: dict[str, dict[str, np.ndarray]], variables: dict[str, str]
) -> list[Panel]:
    panels = []
    channel = next(iter(result.task.measured))
    residual = np.concatenate([run[f"measured {channel}"] - run[channel] for run in table.values()])
    residual *= result.error_unit(channel)[1]
    step = max(1, len(residual) // MANY)
    for name, label in variables.items():
        x = np.concatenate([run[name] for run in table.values()])
        panels.append(
            Panel(
                f"over {name.replace('_', ' ')}",
                label,
                f"residual of {_labelled(result, channel)}",
                (Curve("residual", x[::step], residual[::step], CLOUD),),
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


def _correlation_group(result: IdentificationResult) -> Group:
    """The whole matrix, and its strongest pairs in words."""
    names, C = correlations(result)
    pairs = sorted(((i, j) for i in range(len(names)) for j in range(i)), key=lambda ij: -abs(C[ij]))[:PAIRS]
    words = "; ".join(f"{names[i]} and {names[j]} {C[i, j]:+.2f}" for i, j in pairs)
    caption = "Correlations of the errors of the parameters, from the logs alone. Two parameters near +1 or -1 are hard to separate."
    text = f"{caption} Strongest: {words}." if words else caption
    return Group("correlation", "Correlations", text, (Matrix("correlation [-]", tuple(names), C),), 1)


def _profile(result: IdentificationResult, name: str) -> Panel:
    values, rise = np.array(result.profiles[name]).T
    unit = result.task.parameters[name].unit or "-"
    values = values / si_factor(unit)
    return Panel(
        name,
        f"{name} [{unit}]",
        "rise of the loss",
        (
            Curve("rise", values, rise, look(0) | {"marker": "o"}),
            Curve("95 %", values, np.full(len(values), 1.92), FAINT),
        ),
    )


def _laws(result: IdentificationResult, table: dict[str, dict[str, np.ndarray]]) -> list[Panel]:
    """Friction of the shafts and slides over speed, and the loops of what joins them with a twist or a deflection."""
    panels = []
    train = result.scenario.train()
    for name in train.shafts:
        if curves := friction_curves(result, name):
            torque = f"{train.torque_word(name)} [{printed(train.torque_unit(name))}]"
            panels.append(Panel(f"friction of {name}", f"speed [{train.speed_unit(name)}]", torque, curves))
    for name, gear in train.gears.items():
        unit = printed(train.torque_unit(gear.output))
        output = f"output {train.torque_word(gear.output)} [{unit}]"
        if curves := loss_curves(gear):
            panels.append(Panel(f"losses of {name}", output, f"lost at the output [{unit}]", curves))
        if curves := loop_curves(train, name, table):
            what, title = (
                ("deflection [µm]", "stiffness") if train.is_slide(gear.output) else ("twist [arcmin]", "torsion")
            )
            panels.append(Panel(f"{title} of {name}", what, output, curves))
    return panels


def friction_curves(result: IdentificationResult, shaft: str) -> tuple[Curve, ...]:
    """Friction of a shaft and of its motor's bearings over speed, and in the phases in which it is another.

    A file may add the back-e.m.f. of a motor to its viscous friction. In a phase with the motor off that part is left
    out, and the friction alone is shown.
    """
    found: dict[str, Curve] = {}
    for label, scenario in [("dry and viscous", result.scenario), *_phases(result)]:
        curve = friction_curve(scenario, shaft, label)
        if curve is not None and not any(np.array_equal(curve.y, other.y) for other in found.values()):
            found[label] = curve
    return tuple(replace(c, style=look(k)) for k, c in enumerate(found.values()))


def _phases(result: IdentificationResult) -> list[tuple[str, Scenario]]:
    """The rig in each phase of the task, with the values found, by what the phase is."""
    rig, first = result.rig, result.logs[0]
    assert rig is not None
    values = {**first.facts, **result.values_for(first.name)}
    changes = [rig.changes(values, result.chosen, k) for k in range(len(result.task.phases))]
    return [(str(p.when), rig.built(c).scenario) for p, c in zip(result.task.phases, changes, strict=True)]


def friction_curve(scenario: Scenario, name: str, label: str) -> Curve | None:
    """Friction of a shaft and of the bearings of its motors over speed; none without any."""
    train = scenario.train()
    shaft = train.shafts[name]
    law = shaft.friction()
    usual = 0.1 if train.is_slide(name) else 1.0
    last = max(5.0 * usual, *law["speeds"]) if law["speeds"] else 10.0 * usual
    w = usual * 1e-3 + last * np.linspace(0.0, 1.0, 200)
    dry = np.interp(w, law["speeds"] or [0.0], law["torques"] or [law["torque"]])
    bearings = sum(m.friction_torque for m in train.motors.values() if m.shaft == name)
    if max(float(np.max(dry)), law["breakaway_torque"], bearings, shaft.viscous_friction) <= 0.0:
        return None
    return Curve(label, w, dry + bearings + shaft.viscous_friction * w, look(0))


def loop_curves(train: DriveTrain, gear: str, table: dict[str, dict[str, np.ndarray]]) -> tuple[Curve, ...]:
    """Torque of a gear over its twist [arcmin] in the first logs, or force over deflection [µm], by the names of the logs."""
    twist, torque = train.variable(gear, "twist"), train.variable(gear, "output_torque")
    factor = 1e6 if train.is_slide(train.gears[gear].output) else ARCMIN
    runs = [(log, run) for log, run in table.items() if twist in run and torque in run][:LOOPS]
    return tuple(Curve(_short(log), factor * run[twist], run[torque], look(k)) for k, (log, run) in enumerate(runs))


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
        Curve(f"{speeds[k] * gear.rated_input_speed:.3g} rad/s", torque, table[:, k], look(n))
        for n, k in enumerate((0, len(speeds) - 1))
    )
