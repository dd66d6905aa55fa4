"""Run of a candidate of a task: its cycle again and again, until two of them agree."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ... import _core
from ...control.axis import driven
from ...simulation.runs.results import RunArrays
from ...simulation.runs.run import BYTES_PER_VALUE, check_memory, run
from ...simulation.scenario.field_oriented_motors import oriented
from ...simulation.scenario.scenario import Scenario
from ...sizing.axis_task.axis_task import FEWEST, REPEATS
from ...sizing.axis_task.candidate_scenario import Cycles, begins_alike, cycles_of, over
from ...sizing.axis_task.cycle_demands import Repeated, change

if TYPE_CHECKING:
    from ..study.study_definition import Study

VARIABLES = ("command", "motor_torque", "motor_speed", "output_torque", "load_angle", "load_speed", "twist")
"""from which the columns of a task are made"""


def until_it_repeats(study: Study, row: np.ndarray) -> Repeated:
    """Runs twice as many cycles again and again, until the last two agree, or there are as many as the task permits.

    If references and loads begin alike, the longer run continues the shorter one, to the same bits.
    """
    task, count, base = study.axis, FEWEST, study.base_of(row)
    assert task is not None
    while True:
        most = min(2 * count, task.max_cycles)
        shorter, longer = (cycles_of(base, task, n) for n in (count, most))
        scenario = study.axis_at(row, most)
        continues = begins_alike(shorter, longer) and scenario.controller is not None and not any(oriented(scenario))
        if most > count and continues:
            result = _run(scenario, shorter, longer)
            if len(result.time) > shorter.simulation.samples:
                count = most
        else:
            scenario = study.axis_at(row, count)
            result = run(scenario, energy=False)
        apart = change(result, count)
        if count >= task.max_cycles or apart <= REPEATS:
            cycles = cycles_of(base, task, count)
            return Repeated(over(scenario, cycles), cycles, result, apart)
        count = min(2 * count, task.max_cycles)


def _run(scenario: Scenario, shorter: Cycles, longer: Cycles) -> RunArrays:
    """Run of the shorter cycles if their last two agree, else of the longer ones, which the scenario has."""
    samples = shorter.simulation.samples
    check_memory(len(longer.time), BYTES_PER_VALUE * len(VARIABLES))
    values = np.empty((len(VARIABLES), len(longer.time)))

    def until(end: int, **attributes: int) -> RunArrays:
        named = {name: row[:end] for name, row in zip(VARIABLES, values, strict=True)}
        return RunArrays(longer.time[:end], named, attributes, scenario)

    stopped = False

    def enough() -> bool:
        nonlocal stopped
        stopped = change(until(samples), shorter.count) <= REPEATS
        return stopped

    train = scenario.train().core(("load",), {"motor": driven(scenario.axes()["motor"])})
    signals, numbers = scenario.signals(), {name: k for k, (name, *_) in enumerate(train.channels())}
    inputs = [signals[name].core() for name in train.input_names()]
    state = {"start": scenario.start(), "hysteresis_capacities": scenario.capacities()}
    switchings = _core.run_into(
        _core.Case(train, inputs=inputs, **state),
        values,
        duration=longer.simulation.duration,
        sample_interval=longer.simulation.sample_interval,
        control=scenario.control(),
        channels=[numbers[name] for name in VARIABLES],
        pause=samples - 1,
        enough=enough,
    )
    return until(samples if stopped else len(longer.time), switching_count=switchings)
