"""The paper's figures 5 and 9 to 18: what each shows, drawn from the runs, and its data."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.losses import LossMap
from ..reports.pages import panels_csv, table_csv
from ..reports.panels import COMMAND_STYLE, STYLES, Curve, Panel, scientific
from ..response.linear import rigid_constants
from .drive import AMPLITUDES, MODELS, paper_scenario
from .runs import FREQUENCIES, Results

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

FIGURES = 11
STAND_IN = "Loss table: a stand-in. The paper prints its own only as a picture."


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


LOSS_MAP = FigureSpec(
    "05",
    "Loss coefficient over speed and load",
    "Above, as a surface and as curves. Near zero load the loss does not vanish: that is what no constant "
    "efficiency can say.",
    size=(10.0, 4.2),
)


# What the panels show over time or over the twist; each normalised by the rated value of the paper's drive.


def _rated_values() -> tuple[float, float, float]:
    """M_DR [N·m], T_2R [N·m], omega_DR [rad/s]."""
    drive = paper_scenario("2-DOF-NL", "large").drive()
    assert drive.motor.rated_speed is not None
    return drive.motor.rated_torque, drive.gearbox.rated_output_torque, drive.motor.rated_speed


def _relative_load(r: xarray.Dataset) -> Any:
    return r["output_torque"].values / _rated_values()[1]


def _command_and_torque(results: Results, **options: Any) -> tuple[Panel, ...]:
    M_DR = _rated_values()[0]
    panels = []
    torques = _pairs(results, lambda r: r["motor_torque"].values / M_DR, "[-]", **options)
    for amplitude, panel in zip(AMPLITUDES, torques, strict=True):
        run = results.runs["2-DOF-NL", amplitude]
        command = Curve("$E_C$", run["time"].values, run["command"].values, COMMAND_STYLE)
        torque = tuple(Curve(f"$m_D$, {c.label}", c.x, c.y, c.style) for c in panel.curves)
        panels.append(Panel(panel.title, panel.x_label, "$E_C$, $m_D$ [-]", (command, *torque), panel.x_range))
    return tuple(panels)


def _speed_and_load(results: Results, **options: Any) -> tuple[Panel, ...]:
    speed = _pairs(results, lambda r: r["load_speed"].values, "load speed ω [rad/s]", what="speed", **options)
    torque = _pairs(results, _relative_load, "relative output torque $t_2$ [-]", what="torque", **options)
    return (*speed, *torque)


def figure_specs(results: Results) -> list[FigureSpec]:
    """Figures 5 and 9 to 18, with all their data."""
    return [
        LOSS_MAP,
        *_torque_specs(results),
        *_motion_specs(results),
        *_gearbox_specs(results),
        *_power_specs(results),
        *_response_specs(results),
    ]


def _torque_specs(results: Results) -> Iterator[FigureSpec]:
    yield FigureSpec(
        "09",
        "Command and motor torque",
        "Command E_C and relative motor torque m_D from rest, 1 Hz, for both amplitudes and all three models.",
        _command_and_torque(results),
        size=(10.0, 3.6),
    )
    yield FigureSpec(
        "10",
        "Command and motor torque, detail",
        "A reversal of figure 9 enlarged. At the small amplitude the torque of the nonlinear drive is in proportion to "
        "the command most of the way: the shaft is stuck, so there is no back e.m.f.; the kink is the break-away.",
        _command_and_torque(results, x_range=(1.4, 1.7)),
        size=(10.0, 3.6),
    )


def _motion_specs(results: Results) -> Iterator[FigureSpec]:
    yield FigureSpec(
        "11",
        "Load speed and output torque",
        "Speed of the load and relative torque on it. At the small amplitude the load stops in every half period.",
        _speed_and_load(results),
    )
    yield FigureSpec(
        "12",
        "Load speed and output torque, detail",
        "The reversal of figure 11 enlarged: the load swings on within the zone of low stiffness while the motor is at rest.",
        _speed_and_load(results, x_range=(1.4, 1.7)),
    )


def _gearbox_specs(results: Results) -> Iterator[FigureSpec]:
    spring = paper_scenario("2-DOF-NL", "large").gearbox.stiffness
    rated_twist = 3.0e-3
    assert abs(spring.torque(rated_twist) / _rated_values()[1] - 1.0) < 0.02  # type: ignore[union-attr]
    yield FigureSpec(
        "13",
        "Loss coefficient along the motion",
        "m_2B at each instant. It never falls to zero; where the shaft is at rest it is the start-up value.",
        tuple(
            _pairs(
                results,
                lambda r: r["loss_coefficient"].values,
                "loss coefficient $m_{2B}$ [-]",
                models=("2-DOF-NL",),
                y_range=(0.0, None),
            )
        ),
        size=(10.0, 3.4),
    )
    yield FigureSpec(
        "14",
        "Normalised hysteresis loop",
        "Relative torque over twist / 3 mrad, the twist at about rated torque. The zone of low stiffness in the middle, the "
        "two branches apart by the hysteresis set at the last turning point.",
        tuple(
            _pairs(
                results,
                _relative_load,
                "$t_2$ [-]",
                x=lambda r: r["twist"].values / rated_twist,
                x_label="twist / 3 mrad [-]",
                models=("2-DOF-L", "2-DOF-NL"),
            )
        ),
        size=(10.0, 4.0),
    )


def _power_specs(results: Results) -> Iterator[FigureSpec]:
    M_DR, _, omega_DR = _rated_values()
    yield FigureSpec(
        "15",
        "Normalised motor power",
        "p = m_D w_M / w_DR.",
        tuple(_pairs(results, lambda r: r["motor_power"].values / (M_DR * omega_DR), "motor power p [-]")),
        size=(10.0, 3.4),
    )
    yield FigureSpec(
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
    )


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
