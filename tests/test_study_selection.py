"""Which gearbox is best for a task: what fits, why the others do not, what each limit costs, the Pareto front."""

import csv
import itertools
import math
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from typer.testing import CliRunner

import lostmotion as lm
from conftest import ROOT
from html_pages import charts
from lostmotion.cli import app
from lostmotion.reports.study import best_lines
from lostmotion.reports.study_selection import pareto_figure
from lostmotion.simulation.forms.key_aliases import DRIVE
from lostmotion.sizing.drive_check import check_drive
from lostmotion.studies.runs.chunk import scenario_of_run
from lostmotion.studies.runs.read_table import read_table
from lostmotion.studies.selection.ranking import NOT_RUN, RankedCandidate, candidates, pareto_front, prices
from lostmotion.studies.study.select_table import Selection
from refusals import refused

EXAMPLE = ROOT / "examples" / "select-gearbox.toml"


@pytest.fixture(scope="module")
def selection(tmp_path_factory: pytest.TempPathFactory) -> tuple[lm.studies.Study, Path]:
    directory = tmp_path_factory.mktemp("selection") / "rows"
    study = lm.studies.load_study(EXAMPLE)
    return study, lm.study(study, directory)


def test_what_fits_is_what_a_check_of_each_drive_by_itself_finds(selection: tuple[lm.studies.Study, Path]):
    study, directory = selection
    ranked = candidates(read_table(directory), study)
    assert sorted(c.run for c in ranked) == list(range(study.total))
    for c in ranked[::3]:  # of each kind some
        try:
            scenario = scenario_of_run(study, c.run)
        except lm.InputError as error:
            assert c.violated == (NOT_RUN,)
            assert c.why == str(error)
            continue
        result = lm.simulate(scenario)
        findings = check_drive(scenario)
        wrong = {f.rule for f in findings if f.verdict == "warning"}
        if float(result["load_angle"].max() - result["load_angle"].min()) < math.radians(45.0):
            wrong.add("travel")
        assert set(c.violated) == wrong, c.name
        assert c.values["energy"] == lm.energy_of(result)["source"]
        binding = [f for f in findings if f.use is not None and (f.use <= 1.0 or f.rule in wrong)]  # else a recommendation
        most = max(binding, key=lambda f: f.use)
        assert c.tightest == f"{most.rule} {100.0 * most.use:.0f} %"
    fitting = [c for c in ranked if c.fits]
    assert 1 < len(fitting) < len(ranked) - sum(NOT_RUN in c.violated for c in ranked)
    assert ranked[: len(fitting)] == fitting
    assert [c.values["energy"] for c in fitting] == sorted(c.values["energy"] for c in fitting)
    nearness = [99 if NOT_RUN in c.violated else len(c.violated) for c in ranked]
    assert nearness == sorted(nearness)


def test_a_slow_study_shows_progress_within_a_chunk(tmp_path: Path):
    text = EXAMPLE.read_text().replace('base = "..', f'base = "{ROOT}').replace("ratio = [40, 130]", "ratio = [80, 99]")
    (tmp_path / "s.toml").write_text(text)
    study = lm.studies.load_study(tmp_path / "s.toml")
    seen: list[int] = []
    lm.study(study, tmp_path / "rows", progress=seen.append)
    assert 20 < study.total < 40
    assert seen == [0, 20, study.total]


def test_the_command_line_shows_the_selection(selection: tuple[lm.studies.Study, Path]):
    _, directory = selection
    done = CliRunner().invoke(app, ["study", "show", str(directory), "--best", "energy:largest", "-o", str(directory.with_name("page"))])
    assert done.exit_code == 0, done.output
    for text in ("Selection: ", " fit, ", "Pareto front", "What each limit costs:", "best without it", "Largest energy [J]"):
        assert text in done.output
    figures = directory.with_name("page")
    assert {"study.html", "selection.csv", "limits.csv"} <= {p.name for p in figures.iterdir()}
    assert {p.suffix for p in directory.iterdir()} == {".parquet", ".json", ".txt"}
    with (figures / "selection.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [int(r["rank"]) for r in rows] == list(range(1, len(rows) + 1))
    (chart,) = (c for c in charts((figures / "study.html").read_text()) if c["title"] == "Objectives of all candidates")
    shown = {line["label"]: set(line["names"]) for line in chart["lines"]}
    assert shown["fits"] == {r["gearbox"] for r in rows if r["fits"] == "yes"}
    assert shown["Pareto front"] == {r["gearbox"] for r in rows if r["Pareto front"] == "yes"}
    assert all(r["why"] for r in rows if r["fits"] == "no")
    assert not any(r["why"] for r in rows if r["fits"] == "yes")
    assert {r["gearbox"] for r in rows} == set(lm.studies.load_study(EXAMPLE).vary[0].names)


def made(*rows: tuple[str, str, float, float]) -> list[RankedCandidate]:
    return [
        RankedCandidate(
            k, name, (NOT_RUN,) if violated == NOT_RUN else tuple(violated.split()), violated, "", {"cost": cost, "speed": speed}
        )
        for k, (name, violated, cost, speed) in enumerate(rows)
    ]


SELECT = Selection(objectives={"cost": "least", "speed": "largest"})


def test_a_limit_costs_what_the_best_without_it_would_save():
    ranked = made(
        ("a", "", 10.0, 1.0),
        ("b", "", 12.0, 5.0),
        ("c", "torque", 6.0, 1.0),
        ("d", "torque", 11.0, 9.0),
        ("e", "torque heat", 1.0, 9.0),
        ("f", "noise", 20.0, 9.0),
        ("g", NOT_RUN, math.nan, math.nan),
    )
    found = {p.limit: p for p in prices(ranked, SELECT)}
    assert list(found) == ["torque", "heat", "noise"]
    torque = found["torque"]
    assert (torque.excludes, torque.alone, torque.best.name) == (3, 2, "c")
    assert torque.gain == pytest.approx(0.4)
    assert (found["heat"].excludes, found["heat"].alone, found["heat"].best.name) == (1, 0, "a")
    assert found["heat"].gain == found["noise"].gain == 0.0
    nothing = {p.limit: p for p in prices(made(("c", "torque", 6.0, 1.0), ("e", "torque heat", 1.0, 9.0)), SELECT)}
    assert nothing["torque"].best.name == "c"
    assert math.isnan(nothing["torque"].gain)
    assert nothing["heat"].best is None


def test_the_front_is_what_a_comparison_of_all_pairs_leaves():
    rng = np.random.default_rng(5)
    rows = [(str(k), "" if rng.random() < 0.7 else "x", *np.round(rng.random(2), 1)) for k in range(60)]
    ranked = made(*rows)
    left = {c.run for c in ranked if c.fits}
    for a, b in itertools.permutations([c for c in ranked if c.fits], 2):
        better = a.values["cost"] <= b.values["cost"] and a.values["speed"] >= b.values["speed"]
        if better and (a.values != b.values):
            left.discard(b.run)
    assert {c.run for c in pareto_front(ranked, SELECT)} == left
    assert 0 < len(left) < 42


def test_directions_and_limits_of_a_selection(tmp_path: Path):
    text = (ROOT / "examples" / "tolerance.toml").read_text().replace("runs = 256", "runs = 16")
    text = text.replace('base = "..', f'base = "{ROOT}')
    text += (
        '\n[select]\nobjectives = { peak_load_speed = "largest" }\ndrive_check = false\n'
        'limits = { stuck_share = { max = "40 percent" }, "load.inertia" = { min = "1.7 kg*m^2", max = 2.4 } }\n'
    )
    (tmp_path / "s.toml").write_text(text)
    study = lm.studies.load_study(tmp_path / "s.toml")
    table = read_table(lm.study(study, tmp_path / "rows"))
    rows = table.to_pylist()
    assert "violated" not in table.column_names
    fits = [r for r in rows if r["stuck_share"] <= 0.4 and 1.7 <= r["load.inertia"] <= 2.4]
    assert 0 < len(fits) < 16
    ranked = candidates(table, study)
    expected = sorted(fits, key=lambda r: -r["peak_load_speed"])
    assert [c.run for c in ranked if c.fits] == [r["run"] for r in expected]
    outside = next(c for c in ranked if c.violated == ("load.inertia",))
    assert "load.inertia" in outside.why


@pytest.mark.parametrize(("select", "match"), [
    ('objectives = { enery = "least" }', "'enery' is no column of numbers; did you mean energy"),
    ('objectives = { gearbox = "least" }', "'gearbox' is no column of numbers"),
    ('objectives = { energy = "smallest" }', "objectives"),
    ("objectives = {}", "objectives"),
    ("limits = {}", "objectives"),
    ('objectives = { energy = "least" }\nlimits = { energy = {} }', "needs min or max"),
    ('objectives = { energy = "least" }\nlimits = { energy = { max = "1 m" } }', "select.limits.energy"),
    ('objectives = { energy = "least" }\nlimits = { energy = { min = 2, max = 1 } }', "min 2 is above max 1"),
    ('objectives = { energy = "least" }\nlimits = { mass = { max = 1 } }', "'mass' is no column"),
    ('objectives = { energy = "least" }\ncheck = true', "not known"),
    ('objectives = { "use of voltage" = "least" }\ndrive_check = false', "'use of voltage' is no column"),
])  # fmt: skip
def test_a_bad_selection_ends_in_one_clear_line(tmp_path: Path, select: str, match: str):
    text = EXAMPLE.read_text().replace('base = "..', f'base = "{ROOT}')
    path = tmp_path / "s.toml"
    path.write_text(text[: text.index("[select]")] + "[select]\n" + select)
    refused(lambda: lm.studies.load_study(path), match=match)


def test_a_name_of_the_drive_check_s_columns_is_taken(tmp_path: Path):
    text = EXAMPLE.read_text().replace('base = "..', f'base = "{ROOT}').replace("travel", "why")
    (tmp_path / "s.toml").write_text(text)
    assert "keeps 'why', a name that is taken" in refused(lambda: lm.studies.load_study(tmp_path / "s.toml"))


def test_best_takes_a_direction(selection: tuple[lm.studies.Study, Path]):
    study, directory = selection
    energies = [e for e in read_table(directory)["energy"].to_pylist() if math.isfinite(e)]
    for text, title, first in (
        ("energy", "Least", min(energies)),
        ("energy:least", "Least", min(energies)),
        ("energy:largest", "Largest", max(energies)),
    ):
        lines = best_lines(directory, text)
        assert lines[0] == f"{title} energy [J]:"
        assert f"energy {first:.5g}" in lines[1]
        assert study.vary[0].names[int(lines[1].split()[1].rstrip(","))] in lines[1]  # names are shown too
    assert "direction must be least or largest, as in energy:largest" in refused(lambda: best_lines(directory, "energy:most"))
    assert "no such column of numbers" in refused(lambda: best_lines(directory, "gearbox"))


def test_the_points_of_the_pareto_front_are_numbered_within_the_axes_and_named_below(selection: tuple[lm.studies.Study, Path]):
    study, directory = selection
    table = read_table(directory)
    ranked = candidates(table, study)
    assert study.select is not None
    front = pareto_front(ranked, study.select)
    figure = pareto_figure(table, study)
    FigureCanvasAgg(figure).draw()
    (axes,) = figure.axes
    assert [text.get_text() for text in axes.texts] == [str(k) for k in range(1, len(front) + 1)]
    (key,) = (text for text in figure.texts if "\n" in text.get_text())
    assert figure.bbox.contains(*key.get_window_extent().max)
    in_order = sorted(front, key=lambda c: c.values[axes.get_xlabel().split()[0]])
    assert key.get_text().split("\n") == [f"{k}  {c.name}" for k, c in enumerate(in_order, 1)]
    for text in axes.texts:
        assert axes.bbox.padded(1).contains(*text.get_window_extent().min), text.get_text()
        assert axes.bbox.padded(1).contains(*text.get_window_extent().max), text.get_text()


# --- studies of axes that follow a target ---
CAMERA = {"sample_time": 5e-3, "latency": 10e-3, "noise": 1e-4, "seed": 4}


def two_axes() -> lm.Scenario:
    s = lm.load("direction-finder", {"simulation.duration": 0.3})
    data = s.model_dump(exclude_none=True) | {"initial": {"on_reference": True}}
    for c in data["controllers"].values():
        c |= {"camera": CAMERA, "tracker": {"alpha": 0.5, "beta": 0.2}}
    return lm.Scenario(**data)


def one_axis() -> lm.Scenario:
    return lm.load("tracking-camera", {"simulation.duration": 0.5, "initial": {"on_reference": True}})


CASES: list[tuple[Any, str, str]] = [
    (two_axes, "controllers.traverse_drive.", "traverse_drive_pointing_error"),
    (one_axis, "controller.", "pointing_error"),
]


@pytest.mark.parametrize(("make", "prefix", "error"), CASES, ids=["two", "one"])
def test_rows_are_those_of_single_runs_for_any_number_of_workers(make: Any, prefix: str, error: str, tmp_path: Path) -> None:
    signal = error.replace("pointing_error", "target_direction")
    study = lm.studies.Study(
        scenario=make(),
        vary=[{"key": f"{prefix}reference.target.speed", "values": [60.0, 120.0]}, {"key": f"{prefix}camera.seed", "grid": [1, 2, 2]}],
        keep={"rms": f"rms({error})", "peak": f"peak({error}.where(time > 0.1))", "last": f"final({signal})"},
    )
    with ProcessPoolExecutor(2) as workers:
        ways: list[dict[str, Any]] = [{"threads": 1}, {"threads": 3}, {"executor": workers}]
        found = [pq.ParquetDataset(lm.study(study, tmp_path / str(k), **way)).read() for k, way in enumerate(ways)]
    assert set(found[0]["error"].to_pylist()) == {""}
    for name in ("rms", "peak", "last"):
        rows = [table[name].to_numpy() for table in found]
        np.testing.assert_array_equal(rows[0], rows[1])
        np.testing.assert_array_equal(rows[0], rows[2])
        assert len(set(rows[0])) == 4
    for run in range(4):
        s = scenario_of_run(study, run)
        r = lm.simulate(s, energy=False)
        axis = s.controller if s.form == DRIVE else s.controllers["traverse_drive"]
        shaft = "load" if s.form == DRIVE else "traverse"
        missed = axis.reference.at(r.time.values)[0] - r[f"{shaft}_angle"].values
        assert found[0]["rms"][run].as_py() == pytest.approx(np.sqrt(np.mean(missed**2)), rel=1e-14)
        assert found[0]["peak"][run].as_py() == np.abs(missed[r.time.values > 0.1]).max()
        assert found[0]["last"][run].as_py() == r[signal].values[-1]


def test_an_axis_begins_on_its_reference() -> None:
    drive, train = one_axis(), two_axes()
    r = lm.simulate(drive, duration=5e-3, energy=False)
    angle, speed, *_ = drive.controller.reference.at(0.0)
    assert r.load_angle[0] == angle
    assert r.load_speed[0] == pytest.approx(speed, rel=1e-15)  # the rigid gear ties it to the motor
    assert r.motor_speed[0] == pytest.approx(speed * drive.gearbox.ratio, rel=1e-15)
    r = lm.simulate(train, duration=5e-3, energy=False)
    for axis in ("traverse", "elevation"):
        angle, speed, *_ = train.controllers[f"{axis}_drive"].reference.at(0.0)
        assert (r[f"{axis}_angle"][0], r[f"{axis}_speed"][0]) == (angle, speed)
        assert r[f"{axis}_motor_speed"][0] == pytest.approx(speed * train.gears[f"{axis}_gear"].ratio, rel=1e-15)
    steps = lm.Simulation(train, step=1e-3)
    assert steps["traverse_angle"] == float(r["traverse_angle"][0])
    for s, key in ((drive, "initial.load_angle"), (train, "initial.angles")):
        with pytest.raises(lm.InputError, match="follows from it"):
            s.replace(**{key: 0.1 if s.form == DRIVE else {"traverse": 0.1}})
    assert "no controller" in refused(lambda: lm.load("paper-2dof-nl-small", {"initial.on_reference": True}))
