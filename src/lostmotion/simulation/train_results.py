"""Runs of drive trains, and their results."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from .. import _core
from ..control.axis import OPEN_LOOP, Bound
from ..model.torsion import Rigid
from ..model.train import DriveTrain
from .results import RawResult, add_ledger, installed_version, variables_of
from .switchings import ATTRIBUTE as SWITCHINGS
from .switchings import CONTACTS_OF_TRAIN, packed
from .train_parts import SIDE_BY_SIDE, control_of_part, joined_results, parts_of
from .train_scenario import TrainScenario
from .train_state import start_capacities
from .train_variables import angle_through, angles_through_gears, named_signals
from .windings import set_torques


def run_train(
    scenario: TrainScenario, options: tuple[Any, ...], how: str, control: Bound, *, ledger: bool
) -> RawResult:
    """A run of a drive train. Parts of it that nothing joins are solved apart; under controllers side by side, unless one of these is a
    function in Python.

    Parameters
    ----------
    options
        Duration [s], sample interval [s], samples, whether to keep the energy ledger, relative tolerance (0: exact), and how
        many switchings are kept.
    """
    core, result = _core_result(scenario, options, control)
    time = np.arange(scenario.simulation.samples) * scenario.simulation.sample_interval
    data = dict(zip((name for name, _, _ in core.channels()), result["values"], strict=True))
    data |= named_signals(scenario.axes(), result["control"])
    set_torques(scenario, data)
    add_derived_of_train(scenario.train(), data, time)
    attributes = _attributes(scenario, result, how, ledger=ledger)
    attributes |= {CONTACTS_OF_TRAIN: " ".join(core.contact_names())}
    return RawResult(time, data, attributes, variables_of(scenario))


def _core_result(
    scenario: TrainScenario, options: tuple[Any, ...], control: Bound
) -> tuple[_core.Train, dict[str, Any]]:
    """The solver's train, and what the solver gave for it."""
    parts = parts_of(scenario)
    if len(parts) > 1:

        def solved(part: TrainScenario) -> dict[str, Any]:
            core, result = _core_result(part, options, control_of_part(control, scenario, part))
            names = {"channels": [name for name, _, _ in core.channels()], "contacts": core.contact_names()}
            return result | names

        if not control[1] or any(c.law for c in scenario.axes().values()) or options[0] > SIDE_BY_SIDE * control[0]:
            results = list(map(solved, parts))
        else:
            with ThreadPoolExecutor(len(parts) - 1) as beside:
                others = [beside.submit(solved, part) for part in parts[1:]]
                results = [solved(parts[0]), *(other.result() for other in others)]
        return scenario.core(), joined_results(scenario, parts, results, options[-1])
    case = core_case(scenario)
    return case[0], core_run(case, options, control)


Case = tuple[_core.Train, Sequence[_core.Signal], Mapping[str, float], Mapping[str, float]]
"""train, inputs, state and hysteresis capacities by name"""


def core_run(case: Case, options: tuple[Any, ...], control: Bound = OPEN_LOOP) -> dict[str, Any]:
    """One run of the core, with options as of `run_train`."""
    core, inputs, start, capacities = case
    return _core.run_train(core, inputs, start, capacities, *(*options, control))


def core_case(
    scenario: TrainScenario,
) -> tuple[_core.Train, list[_core.Signal], dict[str, float], dict[str, float]]:
    """What every run of the core begins with: train, inputs, state and hysteresis capacities by name."""
    core = scenario.core()
    signals = scenario.signals()
    inputs = [signals[name].core() for name in core.input_names()]
    return core, inputs, scenario.start(), start_capacities(scenario.initial)


def _attributes(scenario: TrainScenario, result: dict[str, Any], how: str, *, ledger: bool) -> dict[str, Any]:
    attributes = {
        "title": scenario.title,
        "scenario": scenario.to_json(),
        "solver": how,
        "lostmotion_version": installed_version(),
        "switching_count": int(result["switching_count"]),
        "end_state": json.dumps(result["end_state"]),
        "steps": int(result["steps"]),
        "mode_trials": int(result["mode_trials"]),
        "mode_fallbacks": int(result["mode_fallbacks"]),
        SWITCHINGS: packed(result["switchings"]),
    }
    warnings = []
    if np.isfinite(result["left_data_at"]):
        warnings.append(
            f"from t = {result['left_data_at']:.6g} s on a loss map is used outside its data; there it continues with the slope "
            "of its edge. Extend the losses of the gear."
        )
    if ledger:
        add_ledger(attributes, result["energy"], warnings)
    if warnings:
        attributes["warning"] = " ".join(warnings)
    if notes := [f"{name}: {gear.note}" for name, gear in scenario.gears.items() if gear.note]:
        attributes["note"] = " ".join(notes)
    return attributes


def add_derived_of_train(train: DriveTrain, data: dict[str, np.ndarray], time: np.ndarray) -> None:
    """Adds what the solver does not integrate: twists of rigid gears, and the angles that follow through the gears."""
    for name, gear in train.gears.items():
        if isinstance(gear.stiffness, Rigid):
            data.setdefault(f"{name}_twist", np.zeros_like(time))
    known = [name for name in train.shafts if f"{name}_angle" in data]
    for shaft, source, name, forward in angles_through_gears(train, known):
        angle, twist = data[f"{source}_angle"], data[f"{name}_twist"]
        data[f"{shaft}_angle"] = angle_through(train.gears[name], angle, twist, forward=forward)
