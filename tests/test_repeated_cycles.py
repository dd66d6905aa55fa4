"""A longer run of a task goes on where the shorter one ends: it is, to the bit, a run of its own."""

from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from lostmotion.simulation.runs.core_runs import core_case
from lostmotion.simulation.runs.run import run
from lostmotion.sizing.axis_task.candidate_scenario import begins_alike, cycles_of
from lostmotion.sizing.axis_task.cycle_demands import change
from lostmotion.studies.runs.axis_cycles import VARIABLES, until_it_repeats
from lostmotion.studies.selection.task_file import task_of
from test_axis_tasks import ARM, SLIDE
from test_select import TABLES

STEPS = TABLES["controller"]["reference"] | {"moves": [{"to": 1.2}]}  # it goes on from where it ends
WITHOUT_REST = TABLES["controller"]["reference"] | {"acceleration": 8.0, "moves": [{"to": 0.5}, {"to": 0.0}]}
JUMPS = {"samples": {"times": [0.0, 0.3, 0.300001, 0.999], "values": [2.0, 2.0, -1.0, -1.0]}}  # also where the cycle ends
SAMPLES = {"times": [0.0, 0.25, 0.5, 0.75, 1.0], "values": [0.0, 0.3, 0.6, 0.3, 0.0]}

WINDOWLESS = {"settling_window": None}  # there are no moves


def task(base: dict[str, Any] = TABLES, **changes: Any) -> dict[str, Any]:
    return {**base, **{key: base[key] | value for key, value in changes.items()}}


TASKS = {
    "moves there and back": task(),
    "moves one way": task(controller={"reference": STEPS}),
    "no rest": task(controller={"reference": WITHOUT_REST}),
    "a load that jumps": task(load={"torque": JUMPS}),
    "an ideal current loop": task(controller={"current": {"kind": "ideal"}}),
    "gravity and a payload": task(ARM, task={"payload": [{"begin": 0.0, "end": 1.5, "mass": 1.0, "radius": 0.4}]}),
    "a slide": SLIDE,
    "samples": task(task=WINDOWLESS, controller={"reference": {"kind": "position", "samples": SAMPLES}}),
    "a spline": task(task=WINDOWLESS, controller={"reference": {"kind": "position", "samples": SAMPLES | {"interpolation": "cubic"}}}),
}


@pytest.mark.parametrize("name", TASKS)
@pytest.mark.parametrize("least", [0.0, 1.0])
def test_a_run_that_goes_on_is_a_run_of_its_own(name: str, least: float, monkeypatch: pytest.MonkeyPatch):
    """`least`: the relative difference of two cycles that ends a run, so that all stop after two cycles, or none."""
    study = task_of(TASKS[name])
    row = study.parameters(study.total - 1, study.total)[0]
    monkeypatch.setattr("lostmotion.studies.runs.axis_cycles.REPEATS", least)
    found = until_it_repeats(study, row)
    count = found.cycles.count
    assert count == (2 if least else 4)
    alone = run(study.axis_at(row, count), energy=False)
    assert np.array_equal(found.result.time, alone.time)
    for variable in VARIABLES:
        assert np.array_equal(found.result[variable], alone[variable]), variable
    assert found.result.attrs["switching_count"] == alone.attrs["switching_count"]
    assert found.change == change(alone, count)


def test_a_spline_through_more_cycles_is_another_one():
    for name, alike in (("samples", True), ("a spline", False)):
        study = task_of(TASKS[name])
        two, four = (cycles_of(study.scenario, study.axis, count) for count in (2, 4))
        assert begins_alike(two, four) == alike


def test_an_error_at_the_pause_ends_the_run():
    study = task_of(TABLES)
    row = study.parameters(0, 1)[0]
    scenario = study.axis_at(row, 4)

    def fails() -> bool:
        raise KeyError("at the pause")

    out = np.empty((1, scenario.simulation.samples))
    table = scenario.simulation
    times = {"duration": table.duration, "sample_interval": table.sample_interval}
    rest = {**times, "control": scenario.control(), "pause": 100, "enough": fails}
    with pytest.raises(KeyError, match="at the pause"):
        lm._core.run_into(core_case(scenario), out, channels=[0], **rest)
    with pytest.raises(ValueError, match="room"):
        lm._core.run_into(core_case(scenario), out, channels=[0, 1], **rest)
