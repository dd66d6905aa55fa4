"""Sliders of the page: values of a scenario with unit and range."""

import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from ..inputs.quantities import Limit
from ..model.linear_train import LINEAR_DRIVES, LinearElements
from ..model.signals import TimeFunction
from ..units.practical import ARCMIN

Place = list[str | int]


@dataclass(frozen=True)
class Range:
    """Range of a slider [SI]."""

    min: float
    max: float
    logarithmic: bool = False


@dataclass(frozen=True)
class Slider:
    """One value of a scenario; all values in SI."""

    key: str  # in the scenario file
    group: str
    label: str
    si_unit: str
    value: float
    range: Range
    target: str | dict[str, Any]  # "parameter", "duration", or where it stands in an input
    view: Place | None = None  # where it stands in what is drawn
    needs: Mapping[str, float] | None = None  # other keys that the file needs with it

    def to_page(self) -> dict[str, Any]:
        """Slider as page/src/description.ts describes it."""
        unit, factor = unit_of(self.si_unit, max(abs(self.value), 0.3 * self.range.max))
        shown = {key: value for key, value in vars(self).items() if value is not None}
        del shown["si_unit"], shown["range"]
        return shown | vars(self.range) | {"unit": unit, "factor": factor}


# SI unit -> units that are shown, the largest first, each with its value in SI and the least value for which it is used.
UNITS: dict[str, list[tuple[str, float, float]]] = {
    "kg*m^2": [("kg·m²", 1.0, 0.05), ("kg·cm²", 1e-4, 0.0)],
    "N*m": [("N·m", 1.0, 0.5), ("mN·m", 1e-3, 0.0)],
    "N*m*s/rad": [("N·m·s/rad", 1.0, 0.05), ("mN·m·s/rad", 1e-3, 1e-3), ("µN·m·s/rad", 1e-6, 0.0)],
    "N*m/rad": [("kN·m/rad", 1e3, 500.0), ("N·m/rad", 1.0, 0.05), ("mN·m/rad", 1e-3, 0.0)],
    "rad": [("arcmin", 1.0 / ARCMIN, 0.0)],
    "angle": [("°", math.pi / 180.0, 0.0)],
    "rad/s": [("rad/s", 1.0, 0.0)],
    "rad/s^2": [("rad/s²", 1.0, 0.0)],
    "rad/s^3": [("rad/s³", 1.0, 0.0)],
    "kg": [("kg", 1.0, 0.0)],
    "N": [("kN", 1e3, 5e3), ("N", 1.0, 0.0)],
    "N/m": [("N/µm", 1e6, 0.0)],
    "N*s/m": [("N·s/m", 1.0, 0.0)],
    "m": [("m", 1.0, 2.0), ("mm", 1e-3, 5e-4), ("µm", 1e-6, 0.0)],
    "m/s": [("m/s", 1.0, 5.0), ("mm/s", 1e-3, 0.0)],
    "m/s^2": [("m/s²", 1.0, 0.0)],
    "m/s^3": [("m/s³", 1.0, 0.0)],
    "s": [("s", 1.0, 0.3), ("ms", 1e-3, 0.0)],
    "Hz": [("Hz", 1.0, 0.0)],
    "1/s": [("1/s", 1.0, 0.0)],
    "1/s^2": [("1/s²", 1.0, 0.0)],
    "1": [("", 1.0, 0.0)],
}


def unit_of(si_unit: str, value: float) -> tuple[str, float]:
    """(unit, its value in SI) in which such a value reads well."""
    return next((unit, factor) for unit, factor, low in UNITS[si_unit] if value >= low)


def around(value: float, ways: float = 10.0) -> Range:
    """The range from a share to a multiple of a value."""
    return Range(value / ways, value * ways, logarithmic=True)


def from_zero(value: float, usual: float = 0.0) -> Range:
    """The range from 0 to four times a value, or to the usual value where it is 0."""
    return Range(0.0, 4.0 * value if value > 0.0 else usual)


LEAST_SHARE = 0.3  # of what ends at a largest value that a file may have, such as an efficiency

# End of a key -> label, and how many ways around the value its slider goes; None: from 0 on. Unit and largest value follow from the key.
LABELS: dict[str, tuple[str, float | None]] = {
    "rotor_inertia": ("rotor inertia", 10.0),
    "electrical_time_constant": ("electrical time constant", 10.0),
    "ratio": ("ratio", 3.0),
    "stiffness.backlash": ("backlash (total)", None),
    "stiffness.stiffness": ("torsional stiffness", 10.0),
    "hysteresis.efficiency": ("hysteresis efficiency", None),
    "losses.efficiency": ("efficiency", None),
    "mesh_damping": ("mesh damping", None),
    "inertia": ("inertia", 10.0),
    "viscous_friction": ("viscous friction", None),
    "feedforward.friction_torque": ("friction feedforward", None),
    "friction_torque": ("friction torque", None),
    "breakaway_torque": ("break-away torque", 4.0),
    "position.gain": ("position gain", 10.0),
    "position.integral_gain": ("position integral gain", None),
    "position.feedforward": ("speed feedforward", None),
    "speed.gain": ("speed gain", 10.0),
    "speed.integral_gain": ("speed integral gain", None),
    "speed.torque_limit": ("torque limit", 10.0),
    "slides.mass": ("mass", 10.0),
    "slides.friction_force": ("friction force", None),
    "slides.breakaway_force": ("break-away force", 4.0),
    "slides.viscous_friction": ("viscous friction", None),
    "screws.lead": ("lead", 3.0),
    "current.time_constant": ("current loop time constant", 10.0),
}
# Of screws, racks and belts.
LINEAR_LABELS: dict[str, tuple[str, float | None]] = {
    "stiffness": ("axial stiffness", 10.0),
    "backlash": ("axial play (total)", None),
    "damping": ("damping", None),
    "efficiency": ("efficiency", None),
    "inertia": ("inertia", 10.0),
    "drag_torque": ("drag torque", None),
}
ON_SLIDES = {"N": ("torque", "force"), "kg": ("inertia", "mass")}
"""words of a label that change where a motor moves a slide, by the unit"""
LINEAR_TABLES = ("slides", *LINEAR_DRIVES)
TABLES = ("motor", "gearbox", "load", "controller", "controllers", "shafts", "slides", *LinearElements.model_fields)


def of_parameters(
    values: Iterable[tuple[str, float]],
    usual: Mapping[str, float],
    views: Mapping[str, Place],
    units: Mapping[str, str],
    limits: Mapping[str, Limit],
) -> Iterator[Slider]:
    """Sliders of the values that the core can change.

    values: keys of the scenario file, and the values.
    usual: of keys that are 0: to where the slider goes.
    views: of keys that are drawn: where they stand.
    units, limits: SI units of the keys (units of forces where a motor moves a slide), and their values in the file.
    """
    for key, value in values:
        table, *names = key.split(".")
        label = _label(key)
        none = key.endswith((".ratio", "losses.efficiency")) and value == 1.0  # a coupling, a gear without losses
        if table not in TABLES or label is None or none:
            continue
        text, way = label
        unit, most = units[key], limits[key].le
        if unit in ON_SLIDES:
            text = text.replace(*ON_SLIDES[unit])
        if most is not None:
            reach = Range(min(LEAST_SHARE * most, value), most)
        elif way is not None and value > 0.0:
            reach = around(value, way)
        else:
            reach = from_zero(value, usual.get(key, 0.0))
        if reach.max > reach.min:
            yield Slider(key, _group(table, names), text, unit, value, reach, "parameter", views.get(key))


def _label(key: str) -> tuple[str, float | None] | None:
    table, *_, last = parts = key.split(".")
    if table in LINEAR_TABLES:
        found = LINEAR_LABELS.get(last) if table != "slides" and len(parts) == 3 else None
        return LABELS.get(f"{table}.{last}", found)
    ends = (".".join(parts[-n:]) for n in (2, 1))
    return next((LABELS[end] for end in ends if end in LABELS), None)


def _group(table: str, names: list[str]) -> str:
    """Heading: the table, or the name of the element."""
    if table in ("motor", "gearbox", "load", "controller"):
        return table.capitalize()
    element = names[0].replace("_", " ").capitalize()
    return f"Controller of {element}" if table == "controllers" else element


def of_signal(
    signal: TimeFunction[Any], key: str, group: str, unit: str, where: Mapping[str, int], most: float, duration: float
) -> Iterator[Slider]:
    """Sliders of a command, a load torque or a reference: its mean, its first sine, its steps; where there is none, one can be added.

    key: its table in the scenario file.
    where: its number among the inputs, or the references, of the core.
    most: to where its values go, at least.
    duration: of the run [s].
    """

    def slider(
        end: str, label: str, si_unit: str, value: float, reach: Range, path: Place, needs: Any = None
    ) -> Slider:
        there = None if needs is None else {f"{key}.{other}": given for other, given in needs.items()}
        return Slider(f"{key}.{end}", group, label, si_unit, value, reach, {**where, "path": path}, needs=there)

    mean = float(signal.mean)
    most = max(most, 1.5 * abs(mean))
    yield slider("mean", "mean", unit, mean, Range(-most, most), ["mean"])
    amplitude, frequency = float(signal.amplitude or 0.0), signal.frequency
    if amplitude > 0.0 and frequency is not None:
        reach = Range(min(most, amplitude) / 50.0, max(most, 1.5 * amplitude), logarithmic=True)
        yield slider("amplitude", "amplitude", unit, amplitude, reach, ["sines", 0, 0])
        yield slider("frequency", "frequency", "Hz", frequency, around(frequency), ["sines", 0, 1])
    elif frequency is None and not signal.sines:
        yield slider("amplitude", "amplitude", unit, 0.0, Range(0.0, most), ["sines", 0, 0], {"frequency": 1.0})
        yield slider("frequency", "frequency", "Hz", 1.0, around(1.0), ["sines", 0, 1], {"amplitude": 0.0})
    steps = [(float(step.height), step.time) for step in signal.steps[:4]] or [no_step(duration)]
    for k, (height, time) in enumerate(steps):
        words = f"step {k + 1}" if len(steps) > 1 else "step"
        high = max(most, 1.5 * abs(height))
        other = None if signal.steps else {f"steps.{k}.time": time}
        yield slider(f"steps.{k}.height", words, unit, height, Range(-high, high), ["steps", k, 0], other)
        other = None if signal.steps else {f"steps.{k}.height": height}
        yield slider(
            f"steps.{k}.time", f"{words} at", "s", time, Range(0.0, max(duration, time)), ["steps", k, 1], other
        )


def no_step(duration: float) -> tuple[float, float]:
    """(height, time) of a step that can be added to a signal without one."""
    return 0.0, 0.1 * duration


def duration(value: float, sample_interval: float) -> Slider:
    """Duration of the run."""
    reach = Range(max(value / 5.0, sample_interval), 5.0 * value, logarithmic=True)
    return Slider("simulation.duration", "Run", "duration", "s", value, reach, "duration")


def told_apart(found: list[Slider]) -> list[Slider]:
    """The sliders. Sliders with equal labels form one group, named by the kind of their elements."""
    labels = Counter((s.group, s.label) for s in found)

    def kind(slider: Slider) -> str:
        table = slider.key.partition(".")[0]  # a motor and its shaft may have one name
        return table.removesuffix("es" if table.endswith("ches") else "s")

    return [replace(s, label=f"{s.label}, {kind(s)}") if labels[s.group, s.label] > 1 else s for s in found]


def ordered(found: Iterable[Slider]) -> list[Slider]:
    """Sliders in the order inputs, controllers, drive, run; within each group as they were found."""
    ranks = ("Command", "Reference", "Controller")

    def rank(slider: Slider) -> int:
        first = next((k for k, word in enumerate(ranks) if re.match(word, slider.group)), len(ranks))
        return len(ranks) + 1 if slider.group == "Run" else first

    return sorted(found, key=rank)
