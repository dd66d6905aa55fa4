"""What comes nearest where nothing fits: excesses over limits, and slower cycles against the law of similarity."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from conftest import ROOT
from lostmotion.control.references import PositionReference
from lostmotion.simulation.runs.core_runs import core_case
from lostmotion.simulation.runs.run import run
from lostmotion.sizing.axis_task.axis_task import reference_of
from lostmotion.sizing.axis_task.candidate_scenario import begins_alike, cycles_of
from lostmotion.sizing.axis_task.cycle_demands import change
from lostmotion.studies.runs.candidate_cycles import VARIABLES, until_it_repeats
from lostmotion.studies.runs.candidate_rows import Axes
from lostmotion.studies.runs.read_table import read_table
from lostmotion.studies.runs.run_study import study
from lostmotion.studies.selection.nearest_misses import least_factor, misses, not_judged, slowed
from lostmotion.studies.selection.ranking import candidates, prices
from lostmotion.studies.selection.task_file import load_task, task_of
from lostmotion.studies.study.drive_check_columns import UNSTABLE
from lostmotion.studies.study.records_that_vary import names_that_fit
from lostmotion.studies.study.study_definition import Study
from test_axis_tasks import ARM, GEARBOX, MOTOR, SLIDE
from test_select import TABLES
from test_task_keys import FORMS

EXCESS = 0.44
"""by which the current is beyond its limit: a cycle so much longer that 1/s^2 makes up for it takes 1.2 times as long"""

ROTOR = 1e-8
"""[kg m2] little beside the load, as all of the cycle is decided by inertia; a lighter one swings faster and takes longer to run"""

# Inertia alone: 0.8 kg m2 at the load, rotor and all, and 5 rad/s2 at 100:1 are 0.04 N m, 0.4 A.
INERTIAL: dict[str, Any] = {
    **ARM,
    "task": {"cycle": "4 s", "max_inertia_ratio": 1e9, "hold_without_power": False},
    "load": {"inertia": 0.8 - 100.0**2 * ROTOR},
    "gearbox": {**GEARBOX, "inertia": 0.0, "losses": {"kind": "constant_efficiency", "efficiency": 1.0}},
    "motor": {**MOTOR, "rotor_inertia": ROTOR, "limits": {**MOTOR["limits"], "max_current": 0.4 / (1.0 + EXCESS)}},
}


@pytest.fixture(scope="module")
def task() -> Study:
    return task_of(INERTIAL)


@pytest.fixture(scope="module")
def ranked(task: Study, tmp_path_factory: pytest.TempPathFactory) -> Any:
    return candidates(read_table(study(task, tmp_path_factory.mktemp("near") / "rows")), task)


def test_a_torque_of_inertia_falls_with_the_square_of_the_time(task: Study):
    factor = least_factor(task, task.parameters(0, 1)[0])
    # Found to 0.3 %, and rounded up to hundredths.
    assert math.sqrt(1.0 + EXCESS) <= factor <= 1.0031 * math.sqrt(1.0 + EXCESS) + 0.01
    heavy = task_of({**INERTIAL, "task": {**INERTIAL["task"], "gravity": {"mass": 20.0, "radius": 0.5}}})
    assert least_factor(heavy, heavy.parameters(0, 1)[0]) is None  # a weight is not carried by going slower


def test_a_slower_cycle_has_the_same_path(task: Study):
    before, after = reference_of(task.scenario), reference_of(slowed(task, 1.5).scenario)
    for t in (0.1, 0.7, 1.9, 2.6, 3.5):
        x, v, a, _ = (float(d) for d in before.at(t))
        assert [float(d) for d in after.at(1.5 * t)[:3]] == pytest.approx([x, v / 1.5, a / 1.5**2], abs=1e-12)
    assert slowed(task, 1.5).axis.cycle == pytest.approx(6.0)


def test_sines_samples_payloads_and_processes_are_stretched():
    duty = {"payload": [{"begin": "1 s", "end": "2 s", "inertia": 0.1}], "process": [{"times": [0.0, 1.0], "torques": [0.0, 1.0]}]}
    reference = {"kind": "position", "amplitude": 0.3, "frequency": 0.5}
    tables = {**INERTIAL, "task": {**INERTIAL["task"], **duty}, "controller": {**ARM["controller"], "reference": reference}}
    slow = slowed(task_of(tables), 2.0)
    assert slow.axis.payload[0].end == 4.0
    assert slow.axis.process[0].times == (0.0, 2.0)
    assert reference_of(slow.scenario).frequency == 0.25
    sampled = PositionReference(samples={"times": [0.0, 4.0], "values": [0.0, 1.0]})
    tables["controller"] = {**ARM["controller"], "reference": sampled.model_dump(exclude_none=True)}
    assert reference_of(slowed(task_of(tables), 2.0).scenario).samples.times == (0.0, 8.0)


def test_the_nearest_miss_says_what_it_lacks_and_when_it_fits(task: Study, ranked: Any):
    (miss,), (price,) = misses(task, ranked, 3), prices(ranked, task.select)
    assert (price.limit, price.excludes, price.alone) == ("current", 1, 1)
    assert price.opens == pytest.approx(EXCESS, rel=1e-6)
    assert miss.lacks == pytest.approx({"current": EXCESS}, rel=1e-6)
    assert miss.slower == pytest.approx(1.2, abs=0.015)
    longest = max(b - a for a, b in reference_of(task.scenario).intervals())
    assert f"its longest move {miss.slower * longest:.4g} s instead of {longest:.4g} s" in miss.then
    assert "current 44 % over its limit" in str(miss)
    row = task.parameters(miss.candidate.run, miss.candidate.run + 1)[0]
    assert Axes(slowed(task, miss.slower)).refused(row) is None
    assert Axes(slowed(task, 0.98 * miss.slower)).refused(row)["violated"] == "current"


def test_records_without_data_are_listed_apart(tmp_path: Path):
    lacking = next(r.name for r in lm.catalogue() if isinstance(r, lm.data_sheets.GearboxSheet) and r.missing())
    tables = {key: value for key, value in INERTIAL.items() if key != "gearbox"}
    tables["vary"] = [{"key": "gearbox", "values": ["schaeffler-rt1-h-20-100", lacking]}]
    what = task_of(tables)
    ranked = candidates(read_table(study(what, tmp_path / "rows")), what)
    (group,) = not_judged(ranked)
    assert lacking in group.candidates[0]
    assert "lacks" in group.datum
    assert all(lacking not in miss.candidate.name for miss in misses(what, ranked, 5))
    # Illustrative records are no candidates unless they are asked for.
    assert "paper-gearbox" not in names_that_fit("gearbox", {"ratio": [85.0, 95.0]})
    assert names_that_fit("gearbox", {"name": "paper-*"}) == ["paper-gearbox"]


def test_a_loop_by_rule_that_is_unstable_is_the_reason_before_the_limits_that_its_swing_exceeds(tmp_path: Path):
    """Both gears of the press feed have the same load; the swing of the stiffer one is that of its loop, not of its task."""
    feed = load_task(ROOT / "examples" / "tasks" / "press-feed.toml")
    motors = {**feed.vary[1].model_dump(), "values": ["yaskawa-sgmsh-10aa"]}
    feed = feed.model_copy(update={"vary": (feed.vary[0], type(feed.vary[1])(**motors))})
    rows = read_table(study(feed, tmp_path / "rows"))
    for candidate in candidates(rows, feed):
        axis = feed.axis_at(feed.parameters(candidate.run, candidate.run + 1)[0], 2)
        assert lm.commission(axis).stable != candidate.why.startswith(UNSTABLE)
        assert candidate.fits != candidate.open
    (miss,) = misses(feed, candidates(rows, feed), 1)
    assert str(miss).startswith(f"{UNSTABLE}, with average_output_torque")


def test_an_unstable_loop_by_rule_that_keeps_all_limits_is_a_reservation():
    """A light slide on a screw with little damping: the speed loop has a pole outside the unit circle, and friction hides it."""
    tables = FORMS["screw"]
    soft = {
        **tables,
        "slide": {"mass": "10 kg"},
        "screw": tables["screw"] | {"damping": "50 N s/m"},
        "controller": tables["controller"] | {"sample_time": "250 us"},
    }
    task = task_of(soft)
    axis = task.axis_at(task.parameters(0, 1)[0], 2)
    assert not lm.commission(axis).stable
    columns, _ = Axes(task).measured(task.parameters(0, 1)[0])
    assert columns["violated"] == ""
    assert "stability" in str(columns["not judged"]).split()
    damped = task_of({**soft, "screw": tables["screw"]})
    assert "stability" not in str(Axes(damped).measured(damped.parameters(0, 1)[0])[0]["not judged"]).split()


def test_a_candidate_whose_run_violates_a_limit_is_run_in_slower_cycles(tmp_path: Path):
    """Friction, backlash and gains are those of the pair; its tracking error falls with the speed."""
    loose = task_of({**ARM, "task": {**ARM["task"], "max_inertia_ratio": 1e9}})
    error = float(lm.select(loose)["tracking_error_peak"].values[0])
    tight = task_of({**ARM, "task": {**ARM["task"], "max_inertia_ratio": 1e9, "max_tracking_error": 0.95 * error}})
    ranked = candidates(read_table(study(tight, tmp_path / "rows")), tight)
    (miss,) = misses(tight, ranked, 1)
    assert miss.candidate.ran
    assert miss.lacks == pytest.approx({"tracking_error_peak": 1.0 / 0.95 - 1.0}, rel=1e-9)
    assert miss.slower is not None
    row = tight.parameters(miss.candidate.run, miss.candidate.run + 1)[0]
    columns, _ = Axes(slowed(tight, miss.slower)).measured(row)
    assert columns["tracking_error_peak"] <= 0.95 * error


# --- A longer run of a repeated goes on where the shorter one ends ---
STEPS = TABLES["controller"]["reference"] | {"moves": [{"to": 1.2}]}  # it goes on from where it ends
WITHOUT_REST = TABLES["controller"]["reference"] | {"acceleration": 8.0, "moves": [{"to": 0.5}, {"to": 0.0}]}
JUMPS = {"samples": {"times": [0.0, 0.3, 0.300001, 0.999], "values": [2.0, 2.0, -1.0, -1.0]}}  # also where the cycle ends
SAMPLES = {"times": [0.0, 0.25, 0.5, 0.75, 1.0], "values": [0.0, 0.3, 0.6, 0.3, 0.0]}

WINDOWLESS = {"settling_window": None}  # there are no moves


def repeated(base: dict[str, Any] = TABLES, **changes: Any) -> dict[str, Any]:
    return {**base, **{key: base[key] | value for key, value in changes.items()}}


TASKS = {
    "moves there and back": repeated(),
    "moves one way": repeated(controller={"reference": STEPS}),
    "no rest": repeated(controller={"reference": WITHOUT_REST}),
    "a load that jumps": repeated(load={"torque": JUMPS}),
    "an ideal current loop": repeated(controller={"current": {"kind": "ideal"}}),
    "gravity and a payload": repeated(ARM, task={"payload": [{"begin": 0.0, "end": 1.5, "mass": 1.0, "radius": 0.4}]}),
    "a slide": SLIDE,
    "samples": repeated(task=WINDOWLESS, controller={"reference": {"kind": "position", "samples": SAMPLES}}),
    "a spline": repeated(task=WINDOWLESS, controller={"reference": {"kind": "position", "samples": SAMPLES | {"interpolation": "cubic"}}}),
}


@pytest.mark.parametrize("name", TASKS)
@pytest.mark.parametrize("least", [0.0, 1.0])
def test_a_run_that_goes_on_is_a_run_of_its_own(name: str, least: float, monkeypatch: pytest.MonkeyPatch):
    """`least`: the relative difference of two cycles that ends a run, so that all stop after two cycles, or none."""
    study = task_of(TASKS[name])
    row = study.parameters(study.total - 1, study.total)[0]
    monkeypatch.setattr("lostmotion.studies.runs.candidate_cycles.REPEATS", least)
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
