"""Charts of a run: axes, commands, speeds, torques, twists, contacts, energy, and the path through its loss maps."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..inputs.refusal_messages import shown
from ..live_page.scenario_drawing import axis_figures
from ..model.end_stops import END_STOP
from ..model.losses import LossMap
from ..model.shaft_ratio import tied
from ..model.train import DriveTrain
from ..simulation.runs.results import energy_of, scenario_of
from ..simulation.runs.separate_trains import parts_of
from ..units.practical import ARCMIN, charted
from .figure_style import FAINT, look
from .panels import Chart, Contacts, Curve, Flows, Ground, Panel

if TYPE_CHECKING:
    import xarray

Series = tuple[str, str, float]  # variable, label, factor
NEAR = 0.25  # of the range of a motion: the distance of end stops that are drawn
FIGURES = ("motion", "losses", "contacts", "energy")


def run_charts(result: xarray.Dataset) -> list[Chart]:
    """Charts over time: of controlled axes reference, measured value and following error; then what moves, and the contacts.

    Raises InputError: the dataset lacks what is shown.
    """
    if "scenario" not in result.attrs:
        raise InputError("this dataset is neither a run nor a frequency response; there is no figure of it")
    return [*_axes(result), *_elements(result)]


def figure_charts(result: xarray.Dataset, figure: str) -> list[Chart]:
    """Charts of a run on one subject.

    figure: ``"motion"``: references, errors, commands, speeds, torques, twists; ``"losses"``: torque over twist, and
        the way through the loss maps; ``"contacts"``: what is stuck when; ``"energy"``: where it comes from and where
        it goes.

    Raises InputError: the figure is unknown, or the drive has nothing that it shows.
    """
    if figure not in FIGURES:
        raise InputError(f"figure: {shown(figure)} is not known; take one of {', '.join(FIGURES)}")
    charts: list[Chart]
    if figure == "energy":
        charts = [Flows("Energy of the whole run", energy_of(result))]
    elif figure == "losses":
        charts = list(gear_charts(result))
    else:
        charts = [c for c in run_charts(result) if isinstance(c, Contacts) is (figure == "contacts")]
    if not charts:
        raise InputError(f"figure: the drive has nothing that {figure} shows; take another one of {', '.join(FIGURES)}")
    return charts


def _axes(result: xarray.Dataset) -> Iterator[Panel]:
    """Reference, measured value and following error of each controlled axis."""
    scenario = scenario_of(result)
    time = result["time"].values
    for motor in scenario.axes():
        for figure in axis_figures(scenario, motor):
            series = [s for s in figure["series"] if s["variable"] in result]
            error = any("minus" in s for s in series)
            unit, factor = charted(figure["unit"], small=error)
            label = f"{'error' if error else figure['title'].split()[0].lower()} [{unit}]"
            curves = []
            for k, s in enumerate(series):
                values = result[s["variable"]].values - (result[s["minus"]].values if "minus" in s else 0.0)
                curves.append(Curve(s["label"], time, factor * values, look(1 if len(series) > 1 and k == 0 else 0)))
            if curves:
                yield Panel(figure["title"], "time [s]", label, tuple(curves))


def _panel(result: xarray.Dataset, title: str, label: str, series: list[Series]) -> Panel:
    if lacking := [name for name, _, _ in series if name not in result]:
        raise InputError(f"this dataset lacks {', '.join(lacking)}, which the figure of a run shows")
    time = result["time"].values
    curves = tuple(
        Curve(text, time, factor * result[name].values, look(k)) for k, (name, text, factor) in enumerate(series)
    )
    if len(curves) == 1 and title.endswith("s"):  # of several elements; a single one needs no legend
        title = f"{title}: {curves[0].label}"
    return Panel(title, "time [s]", label, curves)


def _contacts(result: xarray.Dataset, names: Mapping[str, str]) -> Contacts:
    return Contacts("Contacts", result["time"].values, {label: result[name].values for name, label in names.items()})


def _elements(result: xarray.Dataset) -> Iterator[Chart]:
    """Commands, speeds, torques, twists and contacts of all elements."""
    scenario = scenario_of(result)
    train = scenario.train()
    loads = [(train.variable(name, "load_torque"), f"load on {name}", name) for name in scenario.loaded()]
    outputs = [(train.variable(name, "output_torque"), name, gear.output) for name, gear in train.gears.items()]
    motors = [(train.variable(name, "torque"), name, motor.shaft) for name, motor in train.motors.items()]
    twists = [(train.variable(n, "twist"), n, g.output) for n, g in train.gears.items() if g.stiffness.kind != "rigid"]
    stops = [
        (train.variable(name + END_STOP, "torque"), name, name)
        for name, shaft in train.shafts.items()
        if shaft.end_stops
    ]
    steppers = [name for name, motor in train.motors.items() if motor.kind == "stepper"]
    wanted: list[tuple[str, str, list[Series]]] = [
        (
            "Command",
            "command [-]",
            [(train.variable(n, "command"), n, 1.0) for n in scenario.commanded() if n not in steppers],
        ),
        ("Fields of steppers", "angle [rad]", [(train.variable(n, "command"), n, 1.0) for n in steppers]),
        (
            "Field before the rotor",
            "electrical angle [deg]",
            [(train.variable(n, "electrical_angle"), n, math.degrees(1.0)) for n in steppers],
        ),
        *_by_domain(train, "{Torque} of motors", "{torque} [{unit}]", "torque", motors),
        *(_speeds(part.train()) for part in parts_of(scenario)),
        *_by_domain(train, "{Torque} at outputs and loads", "{torque} [{unit}]", "torque", outputs + loads),
        *_by_domain(train, "{Torque} on end stops", "{torque} [{unit}]", "torque", stops),
        *_by_domain(train, "{Twist}", "{twist} [{unit}]", "twist", twists),
    ]
    for title, label, series in wanted:
        panel = _panel(result, title, label, series)
        if panel.curves:
            yield panel
    yield from (_between_stops(result, train, name) for _, name, _ in stops)
    flanks = train.flanks()
    contacts = [str(name) for name in result if str(name).endswith("_contact") and name not in flanks]
    if contacts:
        yield _contacts(result, {name: name.removesuffix("_contact").replace("_", " ") for name in contacts})


LINEAR_WORDS = {"torque": "force", "twist": "deflection"}


def _by_domain(
    train: DriveTrain, title: str, label: str, what: str, variables: list[tuple[str, str, str]]
) -> Iterator[tuple[str, str, list[Series]]]:
    """One panel for the variables of shafts and one for the variables of slides: (name, legend, shaft) of each."""
    for slides in (False, True):
        chosen = [(name, text, shaft) for name, text, shaft in variables if train.is_slide(shaft) == slides]
        if not chosen:
            continue
        shaft, word = chosen[0][2], LINEAR_WORDS[what] if slides else what
        si = train.torque_unit(shaft) if what == "torque" else train.angle_unit(shaft)
        unit, factor = charted(si, small=what == "twist")
        words = {what: word, what.capitalize(): word.capitalize(), "unit": unit}
        yield title.format(**words), label.format(**words), [(name, text, factor) for name, text, _ in chosen]


def _between_stops(result: xarray.Dataset, train: DriveTrain, name: str) -> Panel:
    """Position of a slide, or angle of a shaft, with the end stops that it comes near."""
    unit, factor = charted(train.angle_unit(name))
    time, values = result["time"].values, factor * result[train.variable(name, "angle")].values
    low, high = float(values.min()), float(values.max())
    stops: Any = train.shafts[name].end_stops
    near = {
        end: limit
        for end in ("lower", "upper")
        if low - NEAR * (high - low) <= (limit := factor * getattr(stops, end)) <= high + NEAR * (high - low)
    }
    lines = [Curve(f"{end} stop", time[[0, -1]], np.full(2, limit), FAINT) for end, limit in near.items()]
    word = "position" if train.is_slide(name) else "angle"
    return Panel(
        f"{word.capitalize()} of {name}", "time [s]", f"{word} [{unit}]", (Curve(name, time, values, look(0)), *lines)
    )


def _speeds(train: DriveTrain) -> tuple[str, str, list[Series]]:
    """Speeds of a train that hangs together, all in terms of its last shaft."""
    last = list(train.shafts)[-1]
    unit, factor = charted(train.speed_unit(last))
    series = [
        (train.variable(name, "speed"), _in_terms_of(train, name, last, ratio), factor / ratio)
        for name, ratio in ratios_to(train, last).items()
    ]
    return f"Speed of {last}", f"speed [{unit}]", series


def _in_terms_of(train: DriveTrain, name: str, last: str, ratio: float) -> str:
    if train.is_slide(last) and not train.is_slide(name):
        return f"{name}, {2e3 * math.pi / ratio:.4g} mm to a turn"
    return f"{name} / {ratio:.4g}".removesuffix(" / 1")


def ratios_to(train: DriveTrain, last: str) -> dict[str, float]:
    """Speed of each shaft over the speed of the last one, by the gears between them.

    Shafts that no gear joins to the last one are in terms of the last of their own, such as the slides of a mass matrix.
    """
    joints = [(gear.input, gear.output, gear.ratio) for gear in train.fixed_gears().values()]
    ratios: dict[str, float] = {}
    for start in (last, *reversed(train.shafts)):
        if start not in ratios:
            ratios = tied({**ratios, start: 1.0}, joints)
    return {name: ratios[name] for name in train.shafts}


# --- over each other ---


def gear_charts(result: xarray.Dataset) -> list[Panel]:
    """Torque over twist of each gear, and the operating point over its loss map."""
    scenario = scenario_of(result)
    train = scenario.train()
    found = []
    for name, gear in train.gears.items():
        twist, torque, speed = (
            train.variable(name, "twist"),
            train.variable(name, "output_torque"),
            train.variable(gear.input, "speed"),
        )
        if gear.stiffness.kind != "rigid" and twist in result and torque in result:
            linear = train.is_slide(gear.output)
            loop = Curve(name, (1e6 if linear else ARCMIN) * result[twist].values, result[torque].values, look(0))
            title = f"{'Deflection' if linear else 'Torsion'} and hysteresis of {name}"
            labels = ("deflection [µm]", "output force [N]") if linear else ("twist [arcmin]", "output torque [N·m]")
            found.append(Panel(title, *labels, (loop,)))
        if isinstance(gear.losses, LossMap) and gear.housing is None and speed in result and torque in result:
            found.append(_working(name, gear, result[speed].values, result[torque].values))
    return found


def _working(name: str, gear: Any, speed: np.ndarray, torque: np.ndarray) -> Panel:
    """The way of the working point through a loss map: relative load over relative speed, positive where the motor drives."""
    speeds, loads, values = (np.asarray(table) for table in gear.losses.whole())
    x = np.abs(speed) / gear.rated_input_speed
    y = torque * np.where(speed != 0.0, np.sign(speed), np.sign(torque)) / gear.rated_output_torque
    reach = (max(0.02, 1.15 * float(x.max())), max(0.02, 1.15 * float(np.abs(y).max())))
    return Panel(
        f"Loss map of {name}",
        "speed / rated speed [-]",
        "load / rated torque [-]",
        (Curve("working point", x, y, look(0)),),
        x_range=(0.0, reach[0]),
        y_range=(-reach[1], reach[1]),
        ground=Ground(speeds, loads, values, "loss coefficient"),
    )
