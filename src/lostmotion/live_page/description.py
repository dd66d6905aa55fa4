"""A scenario as the page takes it: what its core runs, what it draws, and what can be changed."""

import base64
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..control.command import FieldAngle
from ..model.signals import Signal
from ..model.torsion import TorsionCurve
from ..portable.scenario_as_numbers import described
from ..simulation.scenario.requirements import need_free_motion
from ..simulation.scenario.scenario import Scenario
from ..simulation.scenario.units_of_keys import limit_in, unit_for
from ..units.practical import ARCMIN
from ..version import __version__
from . import sliders
from .loop_margins import loop_views
from .references import reference_sliders, reference_view, signal_view
from .scenario_drawing import axis_figures, drawn, stepper_figures

USUAL_BACKLASH = 12.0 / ARCMIN  # to where the slider goes where there is none


def describe(scenario: Scenario, name: str) -> dict[str, Any]:
    """The scenario as page/src/description.ts describes it.

    name: by which downloads are called.
    """
    need_free_motion(scenario, "live page")
    numbers, values = described(scenario)
    closed = _closed_gap(scenario)
    core = {
        "numbers": _packed(numbers),
        "with_gap": None
        if closed is None or closed in dict(values)
        else {"key": closed, "numbers": _packed(described(scenario.replace(**{closed: USUAL_BACKLASH}))[0])},
        "inputs": [signal_view(signal, scenario.simulation.duration) for _, signal in _inputs(scenario)],
        "references": [reference_view(c.reference, scenario.simulation.duration) for c in scenario.axes().values()],
        "duration": scenario.simulation.duration,
        "interval": scenario.simulation.sample_interval,
        "values": {},
        "changed_inputs": [],
        "changed_references": [],
    }
    return {
        "name": name,
        "title": scenario.title,
        "version": __version__,
        "core": core,
        **drawn(scenario),
        "open_loop": not scenario.tables.controllers
        and all(m.kind != "stepper" for m in scenario.train().motors.values()),
        "loops": [view for motor in scenario.axes() for view in loop_views(scenario, motor)],
        "figures": [
            *stepper_figures(scenario),
            *(figure for motor in scenario.axes() for figure in axis_figures(scenario, motor)),
        ],
        "sliders": [s.to_page() for s in _sliders(scenario, values, closed)],
        "scenario": scenario.model_dump(exclude_none=True, mode="json"),
    }


def _packed(numbers: np.ndarray) -> str:
    return base64.b64encode(numbers.astype("<f8").tobytes()).decode()


def _closed_gap(scenario: Scenario) -> str | None:
    """The key of the backlash of the one gear whose torsion curve has none."""
    curves = {key: g.stiffness for key, g in scenario.gears_by_key().items() if isinstance(g.stiffness, TorsionCurve)}
    closed = [
        f"{key}.stiffness.backlash"
        for key, c in curves.items()
        if c.backlash == 0.0 == c.preload and key.startswith("gear")
    ]
    return closed[0] if len(closed) == 1 else None


def _inputs(scenario: Scenario) -> list[tuple[str, Signal[Any]]]:
    """Inputs, in the order of the core, by its table in the scenario file; references of controllers, which the page does not
    change, without."""
    signals, keys = scenario.signals(), scenario.input_keys()
    names = scenario.core().input_names()
    return [(keys[name], signals[name]) if name in keys and name in signals else ("", Signal()) for name in names]


def _sliders(scenario: Scenario, values: list[tuple[str, float]], closed: str | None) -> list[sliders.Slider]:
    usual: dict[str, float] = {}
    views: dict[str, sliders.Place] = {}
    for k, key in enumerate(scenario.gears_by_key()):
        views |= {f"{key}.ratio": ["gears", k, "ratio"], f"{key}.stiffness.backlash": ["gears", k, "backlash"]}
        views |= {f"{key}.backlash": ["gears", k, "backlash"]}
    if closed is not None:
        values = [*(pair for pair in values if pair[0] != closed), (closed, 0.0)]
        usual[closed] = USUAL_BACKLASH
    for key, _ in values:
        if key.endswith("friction_torque") or (key.startswith("slides.") and key.endswith("friction_force")):
            usual[key] = _usual_friction(scenario, key)
    units = {key: unit_for(scenario, key) or "1" for key, _ in values}
    limits = {key: limit_in(type(scenario.written), key) for key, _ in values}
    parameters = sliders.of_parameters(values, usual, views, units, limits)
    found = [*_signal_sliders(scenario), *reference_sliders(scenario), *parameters]
    return [
        *sliders.told_apart(sliders.ordered(found)),
        sliders.duration(scenario.simulation.duration, scenario.simulation.sample_interval),
    ]


def _signal_sliders(scenario: Scenario) -> Iterator[sliders.Slider]:
    keys, train = scenario.input_keys(), scenario.train()
    turned = {keys[train.variable(motor, "command")] for motor in (*scenario.axes(), *scenario.continuous())}
    loads = {train.variable(shaft, "load_torque"): shaft for shaft in train.shafts}
    shafts = {keys[name]: shaft for name, shaft in loads.items() if name in keys}
    duration = scenario.simulation.duration
    inputs = _inputs(scenario)
    for number, (key, signal) in enumerate(inputs):
        if not key or key in turned or isinstance(signal, FieldAngle):  # whose steps a slider would take away
            continue
        if key.startswith("command"):
            _, _, name = key.partition(".")
            group = f"Command of {name.replace('_', ' ')}" if name and len(inputs) > 2 else "Command"
            yield from sliders.of_signal(signal, key, group, "1", {"input": number}, 1.1, duration)
        else:
            shaft = shafts[key]
            slides = train.is_slide(shaft)
            word, unit = ("Load force", "N") if slides else ("Load torque", "N*m")
            group = word if shaft == "load" else f"{word} on {shaft.replace('_', ' ')}"
            most = _torque_at(scenario, shaft)
            yield from sliders.of_signal(signal, key, group, unit, {"input": number}, most, duration)


def _torque_at(scenario: Scenario, shaft: str) -> float:
    """Typical torque of a shaft [N·m]: the rated torque of the gear or the motor that drives it, else 1."""
    train = scenario.train()
    for gear in train.gears.values():
        if gear.output == shaft:
            return gear.rated_output_torque or abs(gear.ratio) * _torque_at(scenario, gear.input)
    return next((m.rated_torque for m in train.motors.values() if m.shaft == shaft and m.rated_torque), 1.0)


def _usual_friction(scenario: Scenario, key: str) -> float:
    """Upper end of the slider of a friction torque that is 0 [N·m]."""
    table, *names = key.split(".")
    if table == "motors":
        return 0.2 * _torque_at(scenario, scenario.train().motors[names[0]].shaft)
    return 0.05 * _torque_at(scenario, names[0] if table in ("shafts", "slides") else table)
