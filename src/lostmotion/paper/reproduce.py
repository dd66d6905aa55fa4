"""The paper reproduced: its figures 5 and 9 to 18, their data, its constants, and a report."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.parts import LossMap
from ..reports.pages import panels_csv, save_figure, table_csv, write_text
from ..reports.panels import COMMAND_STYLE, STYLES, Curve, Panel, scientific
from ..response.harmonic import frequency_response
from ..response.linear import rigid_constants
from ..simulation.results import energy_of
from ..simulation.run import simulate
from .drive import AMPLITUDES, MODELS, Constant, constants, paper_scenario

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

FREQUENCIES = np.geomspace(0.1, 100.0, 61)  # [Hz], twenty a decade

# Work units for the progress bar: six runs, the response of each point, the figures.
N_FIGURES = 11
N_RESPONSES = 2 * len(FREQUENCIES)
WORK = len(MODELS) * len(AMPLITUDES) + N_RESPONSES + N_FIGURES

STAND_IN = "Loss table: a stand-in. The paper prints its own only as a picture."


@dataclass
class Results:
    """All runs that the figures are drawn from."""

    runs: dict[tuple[str, str], xarray.Dataset] = field(default_factory=dict)
    response: xarray.Dataset | None = None

    def load_response(self, amplitude: str) -> Any:
        """F(w)/F(E) [rad/s] of the nonlinear drive over `FREQUENCIES`."""
        assert self.response is not None
        return self.response["response"].sel(output="load_speed", amplitude=AMPLITUDES[amplitude]).values


@dataclass(frozen=True)
class FigureSpec:
    """One figure of the paper."""

    number: str
    title: str
    caption: str
    panels: tuple[Panel, ...] = ()
    columns: int = 2
    size: tuple[float, float] = (10.0, 6.4)
    stand_in: bool = True  # whether the loss table shows in it


def reproduce(directory: Path, progress: Callable[[], None] = lambda: None) -> Path:
    """Write figures (PNG, SVG), their data (CSV), the constants (CSV) and ``report.html`` into a directory.

    Parameters
    ----------
    progress
        Called `WORK` times.

    Returns
    -------
    Path
        Of the report.
    """
    from .report import render

    directory.mkdir(parents=True, exist_ok=True)
    results = compute(progress)
    table = constants()
    write_text(directory / "constants.csv", constants_csv(table))
    images = {}
    specs = figure_specs(results)
    for spec in specs:
        figure = draw(spec)
        name = f"figure-{spec.number}"
        images[spec.number] = save_figure(figure, directory, name)
        write_text(directory / f"{name}.csv", figure_csv(spec))
        progress()
    report = directory / "report.html"
    write_text(report, render(specs, images, table, facts(results)))
    return report


def compute(progress: Callable[[], None] = lambda: None) -> Results:
    """All simulations behind the figures."""
    results = Results()
    for model in MODELS:
        for amplitude in AMPLITUDES:
            results.runs[model, amplitude] = simulate(paper_scenario(model, amplitude))
            progress()
    drive = paper_scenario("2-DOF-NL", "large").drive()
    results.response = frequency_response(drive, list(FREQUENCIES), list(AMPLITUDES.values()), progress=progress)
    if any(reasons := [r for r in results.response["reason"].values.ravel() if r]):
        raise RuntimeError(f"figures 17 and 18: {reasons[0]}")
    return results


# --- figures -----------------------------------------------------------------------------------------------


def _pairs(
    results: Results,
    y: Callable[[xarray.Dataset], Any],
    y_label: str,
    *,
    x: Callable[[xarray.Dataset], Any] = lambda r: r["time"].values,
    x_label: str = "time [s]",
    models: tuple[str, ...] = MODELS,
    what: str = "",
    **options: Any,
) -> Iterator[Panel]:
    """One panel for each amplitude, with the models overlaid, the nonlinear one on top."""
    for amplitude, value in AMPLITUDES.items():
        curves = []
        for model in models:
            run = results.runs[model, amplitude]
            curves.append(Curve(model, x(run), y(run), STYLES[model]))
        title = f"{what}, " if what else ""
        yield Panel(f"{title}$E_{{CA}}$ = {value:g}", x_label, y_label, tuple(curves), **options)


def _rated_values() -> tuple[float, float, float]:
    drive = paper_scenario("2-DOF-NL", "large").drive()
    assert drive.motor.rated_speed is not None
    return drive.motor.rated_torque, drive.gearbox.rated_output_torque, drive.motor.rated_speed


def figure_specs(results: Results) -> list[FigureSpec]:
    """Figures 5 and 9 to 18, with all their data."""
    M_DR, T_2R, omega_DR = _rated_values()

    def motor(r: xarray.Dataset) -> Any:
        return r["motor_torque"].values / M_DR

    def load(r: xarray.Dataset) -> Any:
        return r["output_torque"].values / T_2R

    def command_and_torque(**options: Any) -> tuple[Panel, ...]:
        panels = []
        for amplitude, panel in zip(AMPLITUDES, _pairs(results, motor, "[-]", **options), strict=True):
            run = results.runs["2-DOF-NL", amplitude]
            command = Curve("$E_C$", run["time"].values, run["command"].values, COMMAND_STYLE)
            torque = tuple(Curve(f"$m_D$, {c.label}", c.x, c.y, c.style) for c in panel.curves)
            panels.append(Panel(panel.title, panel.x_label, "$E_C$, $m_D$ [-]", (command, *torque), panel.x_range))
        return tuple(panels)

    def speed_and_load(**options: Any) -> tuple[Panel, ...]:
        speed = _pairs(results, lambda r: r["load_speed"].values, "load speed ω [rad/s]", what="speed", **options)
        torque = _pairs(results, load, "relative output torque $t_2$ [-]", what="torque", **options)
        return (*speed, *torque)

    nonlinear = ("2-DOF-NL",)
    spring = paper_scenario("2-DOF-NL", "large").gearbox.stiffness
    rated_twist = 3.0e-3
    assert abs(spring.torque(rated_twist) / T_2R - 1.0) < 0.02  # type: ignore[union-attr]
    return [
        FigureSpec(
            "05",
            "Loss coefficient over speed and load",
            "Above, as a surface and as curves. Near zero load the loss does not vanish: that is what no constant "
            "efficiency can say.",
            size=(10.0, 4.2),
        ),
        FigureSpec(
            "09",
            "Command and motor torque",
            "Command E_C and relative motor torque m_D from rest, 1 Hz, for both amplitudes and all three models.",
            command_and_torque(),
            size=(10.0, 3.6),
        ),
        FigureSpec(
            "10",
            "Command and motor torque, detail",
            "A reversal of figure 9 enlarged. At the small amplitude the torque of the nonlinear drive is in proportion to "
            "the command most of the way: the shaft is stuck, so there is no back e.m.f.; the kink is the break-away.",
            command_and_torque(x_range=(1.4, 1.7)),
            size=(10.0, 3.6),
        ),
        FigureSpec(
            "11",
            "Load speed and output torque",
            "Speed of the load and relative torque on it. At the small amplitude the load stops in every half period.",
            speed_and_load(),
        ),
        FigureSpec(
            "12",
            "Load speed and output torque, detail",
            "The reversal of figure 11 enlarged: the load swings on within the zone of low stiffness while the motor stands still.",
            speed_and_load(x_range=(1.4, 1.7)),
        ),
        FigureSpec(
            "13",
            "Loss coefficient along the motion",
            "m_2B at each instant. It never falls to zero; where the shaft stands it is the start-up value.",
            tuple(
                _pairs(
                    results,
                    lambda r: r["loss_coefficient"].values,
                    "loss coefficient $m_{2B}$ [-]",
                    models=nonlinear,
                    y_range=(0.0, None),
                )
            ),
            size=(10.0, 3.4),
        ),
        FigureSpec(
            "14",
            "Normalised hysteresis loop",
            "Relative torque over twist / 3 mrad, the twist at about rated torque. The zone of low stiffness in the middle, the "
            "two branches apart by the hysteresis set at the last turning point.",
            tuple(
                _pairs(
                    results,
                    load,
                    "$t_2$ [-]",
                    x=lambda r: r["twist"].values / rated_twist,
                    x_label="twist / 3 mrad [-]",
                    models=("2-DOF-L", "2-DOF-NL"),
                )
            ),
            size=(10.0, 4.0),
        ),
        FigureSpec(
            "15",
            "Normalised motor power",
            "p = m_D w_M / w_DR.",
            tuple(_pairs(results, lambda r: r["motor_power"].values / (M_DR * omega_DR), "motor power p [-]")),
            size=(10.0, 3.4),
        ),
        FigureSpec(
            "16",
            "Instantaneous efficiency of the gearbox",
            "The traditional models hold 0.9, and 1/0.9 where the load drives: there they create energy. The nonlinear one "
            "sweeps from zero at every reversal to its best and back.",
            tuple(
                _pairs(
                    results,
                    lambda r: r["efficiency"].values,
                    "efficiency η [-]",
                    models=("2-DOF-L", "2-DOF-NL"),
                    y_range=(-0.03, 1.2),
                )
            ),
            size=(10.0, 3.4),
        ),
        *_response_specs(results),
    ]


def _response_specs(results: Results) -> Iterator[FigureSpec]:
    constants_of_rigid = rigid_constants(paper_scenario("1-DOF-L", "large").drive())
    ratio = paper_scenario("1-DOF-L", "large").gearbox.ratio
    normal = ratio / constants_of_rigid.rated_speed
    closed = constants_of_rigid.response(FREQUENCIES, ratio) * normal
    small = {**STYLES["2-DOF-NL"], "linestyle": (0, (4, 1.5)), "marker": "o", "markersize": 2.5}
    lines = [("1-DOF-L, closed form (10), (11)", closed, STYLES["1-DOF-L"])]
    for amplitude, style in (("large", STYLES["2-DOF-NL"]), ("small", small)):
        values = results.load_response(amplitude) * normal
        lines.append((f"2-DOF-NL, $E_{{CA}}$ = {AMPLITUDES[amplitude]:g}", values, style))
    assert results.response is not None
    worst = float(results.response["residual"].max())
    periodic = (
        f"{len(FREQUENCIES)} frequencies; each first harmonic comes from a motion whose states repeat within "
        f"{scientific(worst)} of their magnitude from one period to the next."
    )
    yield FigureSpec(
        "17",
        "Frequency response, magnitude",
        f"g(f) = (i_C/ω_MRC) |F(ω)|/|F(E)|. {periodic}",
        (
            Panel(
                "",
                "frequency [Hz]",
                "magnitude g [-]",
                tuple(Curve(label, FREQUENCIES, np.abs(v), style) for label, v, style in lines),
                log_x=True,
                log_y=True,
            ),
        ),
        columns=1,
        size=(8.0, 4.4),
    )
    yield FigureSpec(
        "18",
        "Frequency response, phase",
        "Phase of the first harmonic of the load speed.",
        (
            Panel(
                "",
                "frequency [Hz]",
                "phase φ [°]",
                tuple(
                    Curve(label, FREQUENCIES, np.degrees(np.unwrap(np.angle(v))), style) for label, v, style in lines
                ),
                log_x=True,
            ),
        ),
        columns=1,
        size=(8.0, 4.4),
    )


def _stand_in_table() -> tuple[Any, Any, Any]:
    losses = paper_scenario("2-DOF-NL", "large").gearbox.losses
    assert isinstance(losses, LossMap)
    return np.array(losses.speeds), np.array(losses.loads), np.array(losses.values)


def draw(spec: FigureSpec) -> Figure:
    """The figure of a spec."""
    from ..reports import plots

    note = STAND_IN if spec.stand_in else ""
    if spec.number == "05":
        return plots.loss_map(*_stand_in_table(), note=note)
    return plots.draw(spec.panels, spec.columns, spec.size, note=note)


def figure_csv(spec: FigureSpec) -> str:
    """The data of a figure: long form, one row a point."""
    if spec.number != "05":
        return panels_csv(spec.panels)
    speeds, loads, values = _stand_in_table()
    rows = [
        [speed, load, v] for load, row in zip(loads, values, strict=True) for speed, v in zip(speeds, row, strict=True)
    ]
    return table_csv(["relative_speed", "relative_load", "loss_coefficient (stand-in)"], rows)


def constants_csv(table: list[Constant]) -> str:
    """The constants table, one row each."""
    return table_csv(
        ["constant", "unit", "printed", "recomputed", "from printed t_m0 and T_RC", "remark"],
        ([c.name, c.unit, c.printed, f"{c.recomputed:.5g}", f"{c.from_printed:.5g}", c.remark] for c in table),
    )


# --- what the report states --------------------------------------------------------------------------------


def _bandwidth(frequencies: Any, magnitude: Any) -> float:
    """Frequency [Hz] at which the magnitude first falls below its first value / sqrt(2), in log-log interpolation."""
    level = magnitude[0] / math.sqrt(2.0)
    below = int(np.argmax(magnitude < level))
    x, y = np.log(frequencies[below - 1 : below + 1]), np.log(magnitude[below - 1 : below + 1])
    return float(np.exp(np.interp(-math.log(level), -y, x)))


def facts(results: Results) -> dict[str, Any]:
    """Numbers that the report's text quotes, all taken from the runs."""
    out: dict[str, Any] = {"worst_balance": 0.0, "stuck": {}, "efficiency": {}, "created": {}, "bandwidth": {}}
    for (model, amplitude), run in results.runs.items():
        ledger = energy_of(run)
        out["worst_balance"] = max(out["worst_balance"], abs(ledger["residual"]) / ledger["turned_over"])
        ratio = paper_scenario(model, amplitude).gearbox.ratio
        loss = (run["input_torque"] - run["output_torque"] / ratio) * run["motor_speed"]
        created = -float(np.minimum(loss, 0.0).sum()) * float(run["time"][1])
        out["created"][model, amplitude] = created
        out["stuck"][model, amplitude] = float((run["input_contact"] == 0).mean())
        moving = run["efficiency"].values[np.isfinite(run["efficiency"].values)]
        out["efficiency"][model, amplitude] = float(np.max(moving)), float(np.mean(moving))
    rigid = rigid_constants(paper_scenario("1-DOF-L", "large").drive())
    out["bandwidth"]["closed"] = rigid.bandwidth
    for amplitude in AMPLITUDES:
        out["bandwidth"][amplitude] = _bandwidth(FREQUENCIES, np.abs(results.load_response(amplitude)))
    out["static_gain_small"] = float(
        np.abs(results.load_response("small")[0]) / np.abs(results.load_response("large")[0])
    )
    return out
