"""The paper's figures: what each shows, drawn from the runs, and its data."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..model.losses import LossMap
from ..reports.figure_style import FAINT, LEVEL, STYLES, dots, step
from ..reports.panels import Chart, Curve, Drawing, Ground, Panel, scientific
from ..reports.written_files import panels_csv, table_csv
from ..response.crossovers import THREE_DECIBELS
from ..response.rigid import rigid_constants
from .published_drive import AMPLITUDES, MODELS, paper_scenario
from .quoted_numbers import Facts
from .runs import FREQUENCIES, Results, stuck_intervals
from .schematics import drawings

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure

FIGURES = 14
STAND_IN = "Loss table: a stand-in. The paper prints its own only as a picture."
SHADED = "Shaded: the motor shaft of 2-DOF-NL is stuck."


@dataclass(frozen=True)
class FigureSpec:
    """One figure of the paper."""

    number: str
    title: str
    caption: str
    panels: tuple[Chart, ...]
    columns: int = 2
    size: tuple[float, float] = (10.0, 6.4)
    stand_in: bool = True  # whether the loss table shows in it
    heading: str = ""  # its numbers in the paper, if it is more than one
    table: str = ""  # its data as CSV, where those are not the data of its panels


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
        shaded = stuck_intervals(results.runs["2-DOF-NL", amplitude]) if x_label == "time [s]" else ()
        yield Panel(_titled(what, value), x_label, y_label, tuple(curves), shaded=shaded, **options)


def _titled(what: str, amplitude: float) -> str:
    """Title of a panel with the amplitude of its command."""
    return f"{what}, amplitude {amplitude:g}" if what else f"amplitude {amplitude:g}"


def _differences(panels: Iterable[Panel], label: str) -> Iterator[Panel]:
    """Differences of the other models from 2-DOF-L."""
    for panel in panels:
        curves = {c.label: c for c in panel.curves if c.label in MODELS}
        linear = curves.pop("2-DOF-L")
        others = tuple(Curve(c.label, c.x, c.y - linear.y, c.style) for c in curves.values())
        amplitude = panel.title.rpartition(" ")[2]
        yield replace(panel, title=_titled("difference from 2-DOF-L", float(amplitude)), y_label=label, curves=others)


LOOP_STYLES: tuple[dict[str, Any], ...] = (*(STYLES[name] for name in ("2-DOF-NL", "2-DOF-L", "1-DOF-L")),)

CLOSED_FORM: dict[str, Any] = {**STYLES["1-DOF-L"], "linestyle": (0, (1, 1)), "linewidth": 2.2}

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
    torques = list(_pairs(results, lambda r: r["motor_torque"].values / M_DR, "command, motor torque [-]", **options))
    for amplitude, panel in zip(AMPLITUDES, torques, strict=True):
        run = results.runs["2-DOF-NL", amplitude]
        command = Curve("command", run["time"].values, run["command"].values, FAINT)
        panels.append(replace(panel, curves=(command, *panel.curves)))
    return (*panels, *_differences(torques, "motor torque [-]"))


def _speed_and_load(results: Results, **options: Any) -> tuple[Panel, ...]:
    speed = list(_pairs(results, lambda r: r["load_speed"].values, "load speed [rad/s]", what="speed", **options))
    torque = list(_pairs(results, _relative_load, "output torque [-]", what="torque", **options))
    return (*speed, *_differences(speed, "load speed [rad/s]"), *torque, *_differences(torque, "output torque [-]"))


def figure_specs(results: Results, facts: Facts) -> list[FigureSpec]:
    """All figures in the order of the paper, with their data."""
    return [
        _schematics_spec(),
        _loss_spec(),
        _stiffness_spec(results),
        _hysteresis_spec(results),
        *_torque_specs(results),
        *_motion_specs(results, facts),
        *_gearbox_specs(results),
        *_power_specs(results, facts),
        *_response_specs(results),
    ]


def _schematics_spec() -> FigureSpec:
    return FigureSpec(
        "01",
        "Schematics",
        "The comparison (1), the drive in general (2), the two traditional models (3, 4), and the measurement of a gearbox (6).",
        drawings(),
        stand_in=False,
        heading="Figures 1 to 4 and 6",
    )


def _loss_spec() -> FigureSpec:
    losses = paper_scenario("2-DOF-NL", "large").gearbox.losses
    assert isinstance(losses, LossMap)
    speeds, loads, values = np.array(losses.speeds), np.array(losses.loads), np.array(losses.values)
    curves = tuple(
        Curve(f"load {load:g}", speeds, row, step(k, len(loads)) | {"marker": "o", "markersize": 4})
        for k, (load, row) in enumerate(zip(loads, values, strict=True))
    )
    speed, load, loss = "relative speed [-]", "relative load [-]", "loss coefficient [-]"
    rows = (
        [v, mu, m]
        for mu, row in zip(losses.loads, losses.values, strict=True)
        for v, m in zip(losses.speeds, row, strict=True)
    )
    return FigureSpec(
        "05",
        "Loss coefficient over speed and load",
        "Left, contours over speed and load; right, curves over speed. The loss does not vanish at zero load, so no constant "
        "efficiency describes it.",
        (
            Panel("Contours", speed, load, (), ground=Ground(speeds, loads, values, loss)),
            Panel("Curves", speed, loss, curves, y_range=(0.0, 1.06 * float(values.max()))),
        ),
        size=(10.0, 4.2),
        table=table_csv(["relative_speed", "relative_load", "loss_coefficient (stand-in)"], rows),
    )


def _stiffness_spec(results: Results) -> FigureSpec:
    spring = paper_scenario("2-DOF-NL", "large").gearbox.stiffness
    linear = paper_scenario("2-DOF-L", "large").gearbox.stiffness.stiffness  # type: ignore[union-attr]
    breaks, slopes = map(np.array, spring.pieces())  # type: ignore[union-attr]
    twist, torque = results.first_loading
    chords = np.diff(torque) / np.diff(twist)
    within, ends = twist[[0, -1]], np.array([spring.torque(d) for d in breaks])  # type: ignore[union-attr]
    points = dots(STYLES["2-DOF-NL"]["color"], 5)
    return FigureSpec(
        "07",
        "Torsional stiffness",
        "Measured on the virtual test rig: the input is locked and the output is loaded slowly, from rest to 1.2 times rated "
        "torque. Left, the torque and the two breakpoints of (14); right, its slope.",
        (
            Panel(
                "torque",
                "twist [mrad]",
                "output torque [N·m]",
                (
                    Curve("2-DOF-L", 1e3 * within, linear * within, STYLES["2-DOF-L"]),
                    Curve("2-DOF-NL", 1e3 * twist, torque, STYLES["2-DOF-NL"]),
                    Curve("breakpoints of (14)", 1e3 * breaks, ends, points),
                ),
            ),
            Panel(
                "stiffness",
                "twist [mrad]",
                "stiffness / largest stiffness [-]",
                (
                    Curve("2-DOF-L", 1e3 * within, np.full(2, linear / slopes[-1]), STYLES["2-DOF-L"]),
                    Curve("2-DOF-NL", 5e2 * (twist[1:] + twist[:-1]), chords / slopes[-1], STYLES["2-DOF-NL"]),
                ),
                y_range=(0.0, 1.1),
            ),
        ),
        size=(10.0, 3.8),
        stand_in=False,
    )


def _hysteresis_spec(results: Results) -> FigureSpec:
    rated = _rated_values()[1]
    curves = tuple(
        Curve(f"±{100.0 * loop.amplitude / rated:.0f} % of rated torque", 1e3 * loop.twist, loop.torque / rated, style)
        for loop, style in zip(results.loops, LOOP_STYLES, strict=True)
    )
    axes = ("twist [mrad]", "output torque [-]")
    return FigureSpec(
        "08",
        "Hysteresis loop",
        "Measured on the virtual test rig with the input locked, at three amplitudes; right, the middle enlarged. Each turning "
        "point sets the hysteresis anew, in proportion to the torque there (16).",
        (Panel("loops", *axes, curves), Panel("detail", *axes, curves, x_range=(-1.0, 1.0))),
        size=(10.0, 3.8),
        stand_in=False,
    )


def _torque_specs(results: Results) -> Iterator[FigureSpec]:
    yield FigureSpec(
        "09",
        "Command and motor torque",
        "Command E_C and relative motor torque m_D from rest, 1 Hz, for both amplitudes and all three models. Below, the "
        "difference of the torques from that of 2-DOF-L.",
        _command_and_torque(results),
        size=(10.0, 6.4),
    )
    yield FigureSpec(
        "10",
        "Command and motor torque, detail",
        "A reversal of figure 9 enlarged. While the motor shaft of 2-DOF-NL is stuck, there is no back e.m.f., so its torque is "
        "in proportion to the command; the kink at the end of a shaded interval is the break-away.",
        _command_and_torque(results, x_range=(1.4, 1.7)),
        size=(10.0, 6.4),
    )


def _motion_specs(results: Results, facts: Facts) -> Iterator[FigureSpec]:
    case = "2-DOF-NL", "small"
    rests = facts.load_rests[case]
    load = (
        f"for {100.0 * rests:.0f} % of the time after it first moves" if rests > 0.0 else "only before it first moves"
    )
    yield FigureSpec(
        "11",
        "Load speed and output torque",
        f"Speed of the load and relative torque on it, and the differences from 2-DOF-L. At the small amplitude the motor shaft of 2-DOF-NL is stuck for "
        f"{100.0 * facts.stuck[case]:.0f} % of the time (shaded). Its load is at rest {load}.",
        _speed_and_load(results),
        size=(10.0, 11.0),
    )
    zone = paper_scenario("2-DOF-NL", "large").gearbox.stiffness.pieces()[0][0]  # type: ignore[union-attr]
    run = results.runs[case]
    largest = float(np.abs(run["twist"].values).max())
    where = "within" if largest < zone else "beyond"
    yield FigureSpec(
        "12",
        "Load speed and output torque, detail",
        f"A reversal of figure 11 enlarged. At the small amplitude the load of 2-DOF-NL swings on while the motor shaft is stuck. "
        f"The twist is at most {1e3 * largest:.2f} mrad, {where} the segment of low stiffness, which ends at {1e3 * zone:g} mrad.",
        _speed_and_load(results, x_range=(1.4, 1.7)),
        size=(10.0, 11.0),
    )


def _gearbox_specs(results: Results) -> Iterator[FigureSpec]:
    spring = paper_scenario("2-DOF-NL", "large").gearbox.stiffness
    rated_twist = 3.0e-3
    assert abs(spring.torque(rated_twist) / _rated_values()[1] - 1.0) < 0.02  # type: ignore[union-attr]
    along = list(_pairs(results, lambda r: r["loss_coefficient"].values, "loss coefficient [-]", models=("2-DOF-NL",)))
    least = min(float(panel.curves[0].y.min()) for panel in along)
    yield FigureSpec(
        "13",
        "Loss coefficient along the motion",
        f"m_2B at each instant. It is never less than {least:.3f}. Where the motor shaft is stuck, it is the start-up value at the load.",
        tuple(replace(p, y_range=(0.0, 1.06 * float(p.curves[0].y.max()))) for p in along),
        size=(10.0, 3.4),
    )
    yield FigureSpec(
        "14",
        "Normalised hysteresis loop",
        "Above, relative torque over twist / 3 mrad, the twist at about rated torque. Below, the same less the torque of the "
        "torsion curve: what remains is the hysteresis that the last turning points set. It is a loop also at the small amplitude.",
        (*_loops(results, rated_twist), *_loops(results, rated_twist, spring)),
        size=(10.0, 7.4),
    )


def _loops(results: Results, rated_twist: float, spring: Any = None) -> Iterator[Panel]:
    """Torque over twist, or the part that is not the spring's."""
    rated = _rated_values()[1]

    def torque(r: xarray.Dataset) -> Any:
        if spring is None:
            return _relative_load(r)
        return _relative_load(r) - np.array([spring.torque(d) for d in r["twist"].values]) / rated

    label = "output torque [-]" if spring is None else "hysteresis [-]"
    yield from _pairs(
        results,
        torque,
        label,
        x=lambda r: r["twist"].values / rated_twist,
        x_label="twist / 3 mrad [-]",
        models=("2-DOF-L", "2-DOF-NL") if spring is None else ("2-DOF-NL",),
        what="" if spring is None else "hysteresis",
    )


def _power_specs(results: Results, facts: Facts) -> Iterator[FigureSpec]:
    M_DR, _, omega_DR = _rated_values()
    yield FigureSpec(
        "15",
        "Normalised motor power",
        "p = m_D ω_M/ω_DR.",
        tuple(_pairs(results, lambda r: r["motor_power"].values / (M_DR * omega_DR), "motor power [-]")),
        size=(10.0, 3.4),
    )
    yield FigureSpec(
        "16",
        "Instantaneous efficiency of the gearbox",
        "2-DOF-L has 0.9 where the motor drives and 1/0.9 where the load drives: there it creates energy. 2-DOF-NL has at most "
        f"{facts.best_efficiency['large']:.2f} at the large and {facts.best_efficiency['small']:.2f} at the small amplitude, "
        "and 0 around each reversal of the torque.",
        tuple(
            _pairs(
                results,
                lambda r: r["efficiency"].values,
                "efficiency [-]",
                models=("2-DOF-L", "2-DOF-NL"),
                y_range=(-0.03, 1.2),
            )
        ),
        size=(10.0, 3.4),
    )


def _response_specs(results: Results) -> Iterator[FigureSpec]:
    worst = max(float(response["residual"].max()) for response in results.responses.values())
    yield FigureSpec(
        "17",
        "Frequency response, magnitude",
        "g(f) = (i_C/ω_MRC) |F(ω)|/|F(E)|. The closed form (10) drops the friction of the motor bearings; 1-DOF-L beside it has "
        "this friction, and so have the other two. The step from the closed form to 1-DOF-L is thus the bearing, from there "
        "to 2-DOF-NL the gearbox. The line at -3 dB is the bandwidth criterion of the closed form. "
        f"{len(FREQUENCIES)} frequencies; each first harmonic comes from a motion whose states repeat within "
        f"{scientific(worst)} of their magnitude from one period to the next.",
        tuple(
            _response_panels(results, "magnitude [dB]", _decibels, (-75.0, 5.0), ("-3 dB", -_decibels(THREE_DECIBELS)))
        ),
        size=(10.0, 4.6),
    )
    yield FigureSpec(
        "18",
        "Frequency response, phase",
        "Phase of the first harmonic of the load speed, of the same models. The line at -45° marks the phase "
        "of a first-order lag at its -3 dB frequency. The models with a spring fall further behind above their resonance.",
        tuple(
            _response_panels(
                results, "phase [deg]", lambda v: np.degrees(np.unwrap(np.angle(v))), (-260.0, 10.0), ("-45°", -45.0)
            )
        ),
        size=(10.0, 4.6),
    )


def _decibels(values: Any) -> Any:
    """Gain in dB."""
    return 20.0 * np.log10(np.abs(values))


def _response_panels(
    results: Results, label: str, quantity: Callable[[Any], Any], y_range: tuple[float, float], level: tuple[str, float]
) -> Iterator[Panel]:
    """The models at each amplitude, with the cutoff that the paper prints."""
    rigid = paper_scenario("1-DOF-L", "large")
    closed_form, ratio = rigid_constants(rigid), rigid.gearbox.ratio
    closed = closed_form.response(FREQUENCIES, ratio)
    normal = ratio / closed_form.rated_speed
    ends = FREQUENCIES[[0, -1]]
    across = Curve(level[0], ends, np.full(2, level[1]), LEVEL)
    printed = Curve("2.6 Hz, printed", np.full(2, 2.6), np.array(y_range), FAINT)
    for amplitude, value in AMPLITUDES.items():
        curves = [Curve("1-DOF-L, closed form", FREQUENCIES, quantity(closed * normal), CLOSED_FORM)]
        for model in MODELS:
            response = results.load_response(model, amplitude) * normal
            curves.append(Curve(model, FREQUENCIES, quantity(response), STYLES[model]))
        yield Panel(
            _titled("", value), "frequency [Hz]", label, (*curves, across, printed), y_range=y_range, log_x=True
        )


def draw(spec: FigureSpec) -> Figure:
    """The figure of a spec."""
    from ..reports import plots
    from . import schematics

    if isinstance(spec.panels[0], Drawing):
        return schematics.draw()
    shaded = any(isinstance(panel, Panel) and panel.shaded for panel in spec.panels)
    note = " ".join([SHADED] * shaded + [STAND_IN] * spec.stand_in)
    return plots.draw(spec.panels, spec.columns, spec.size, note=note)


def figure_csv(spec: FigureSpec) -> str | None:
    """The data of a figure: long form, one row a point; none of the schematics."""
    return None if isinstance(spec.panels[0], Drawing) else spec.table or panels_csv(spec.panels)
