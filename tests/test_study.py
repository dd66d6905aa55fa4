"""Studies: designs, rows equal to single runs, interruption at any instant, executors, what they show."""

import hashlib
import json
import math
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from scipy import stats
from typer.testing import CliRunner

import lostmotion as lm
from conftest import ROOT, forks
from html_pages import Page, charts
from lostmotion.cli import app
from lostmotion.errors import InputError
from lostmotion.paper import paper_scenario
from lostmotion.reports.study import best_runs, influence, read_table, sobol_indices, write_study
from lostmotion.simulation.variables import VARIABLES
from lostmotion.studies.expressions.expressions import FUNCTIONS, REDUCTIONS
from lostmotion.studies.runs import chunk as study_chunk
from lostmotion.studies.runs.chunk import pieces, run_piece, scenario_of_run
from lostmotion.studies.runs.runs_in_core import core_can
from lostmotion.studies.study.random_designs import CHUNK
from lostmotion.studies.study.study_definition import Study
from lostmotion.studies.study.vary import Vary
from refusals import refused

SHORT = paper_scenario("2-DOF-NL", "large").replace(**{"simulation.duration": 0.2, "simulation.sample_interval": 2e-3})


def make(**changes) -> Study:
    values = {
        "scenario": SHORT,
        "design": "sobol",
        "runs": 32,
        "seed": 3,
        "vary": [
            {"key": "load.inertia", "uniform": [1.0, 3.0]},
            {"name": "stiffness", "key": "gearbox.stiffness.slopes", "relative": True, "normal": {"mean": 1.0, "deviation": 0.1}},
            {"key": "command.amplitude", "log_uniform": [0.02, 1.0]},
        ],
        "keep": {
            "peak_speed": "peak(load_speed)",
            "rms_twist": "rms(twist)",
            "end": "final(load_angle)",
            "lost": "energy.gear_losses / energy.source",
            "efficiency_driving": "efficiency.where(motor_power > 0).mean('time')",
            "starts": "dead_time(load_angle)",
        },
    }
    return Study(**(values | changes))


def rows_of(directory: Path) -> dict[str, list]:
    return read_table(directory).to_pydict()


# --- rows ---
@pytest.mark.parametrize("engine", ["core", "one by one"])
def test_a_row_equals_the_single_run_bit_for_bit(tmp_path: Path, engine: str):
    vary = list(make().vary)
    if engine == "one by one":  # a key that the core does not know
        vary.append({"key": "gearbox.stiffness.breaks", "relative": True, "values": [1.0, 1.1]})
    study = make(vary=vary, trajectories={"variables": ["load_speed"], "every": 10})
    assert core_can(study) is (engine == "core")
    rows = rows_of(lm.study(study, tmp_path / "s"))
    assert rows["run"] == list(range(32))
    for run in (0, 7, 31):
        result = lm.simulate(scenario_of_run(study, run))
        energy = lm.energy_of(result)
        own = {
            "peak_speed": FUNCTIONS["peak"].of_values(result["load_speed"]),
            "rms_twist": FUNCTIONS["rms"].of_values(result["twist"]),
            "end": result["load_angle"][-1],
            "lost": energy["gear_losses"] / energy["source"],
            "efficiency_driving": result["efficiency"].where(result["motor_power"] > 0).mean("time"),
            "starts": FUNCTIONS["dead_time"].of_values(result["load_angle"]),
        }
        for name, value in own.items():
            assert rows[name][run] == float(value), (run, name)
        assert rows["load_speed over time"][run] == result["load_speed"].values[::10].tolist()
        assert rows["switchings"][run] == result.attrs["switching_count"]


def test_what_the_core_reduces_equals_what_is_made_of_the_samples(tmp_path: Path):
    keep = {how: f"{how}({variable})" for how, variable in zip(REDUCTIONS, [v.name for v in VARIABLES if not v.derived][2:], strict=False)}
    reduced, sampled = (make(keep=keep | more) for more in ({}, {"more": "peak(abs(twist))"}))
    assert not run_piece(reduced, 0, 4, 1).samples
    assert run_piece(sampled, 0, 4, 1).samples
    rows, same = (rows_of(lm.study(s, tmp_path / name)) for s, name in ((reduced, "r"), (sampled, "s")))
    assert len(keep) == 6
    assert {name: rows[name] for name in keep} == {name: same[name] for name in keep}
    result = lm.simulate(scenario_of_run(reduced, 5))
    plain = {"peak": lambda v: np.max(np.abs(v)), "rms": lambda v: np.sqrt(np.mean(v**2)), "mean": np.mean}
    plain |= {"final": lambda v: v[-1], "least": np.min, "largest": np.max}
    for (how, function), variable in zip(plain.items(), [v.name for v in VARIABLES if not v.derived][2:], strict=False):
        assert rows[how][5] == pytest.approx(function(result[variable].values), rel=1e-13), how


def test_long_runs_are_made_in_pieces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    study = make(trajectories={"variables": ["load_speed"], "every": 10})
    rows = rows_of(lm.study(study, tmp_path / "one"))
    assert pieces(study, 0, 32) == [(0, 32)]
    monkeypatch.setattr(study_chunk, "MAX_NUMBERS", 13 * SHORT.simulation.samples * 7)
    assert pieces(study, 0, 32) == [(0, 7), (7, 14), (14, 21), (21, 28), (28, 32)]
    assert rows_of(lm.study(study, tmp_path / "many")) == rows
    with ThreadPoolExecutor(1) as pool:
        assert rows_of(lm.study(study, tmp_path / "pool", executor=pool)) == rows


def test_bandwidth_and_tracking_error_of_each_run(tmp_path: Path):
    study = make(
        design="list",
        runs=None,
        vary=[{"key": "gearbox.ratio", "values": [90.0, 60.0, 90.0]}, {"key": "command.amplitude", "values": [1.0, 0.5, 1e-3]}],
        keep={"own": "bandwidth()", "small": "bandwidth(0.1)", "lag": "tracking_error(load_speed, ideal_speed)"},
    )
    rows = rows_of(lm.study(study, tmp_path / "s"))
    for run in (0, 1):
        scenario = scenario_of_run(study, run)
        assert rows["own"][run] == lm.response.bandwidth(scenario.drive(), scenario.command.amplitude)
        assert rows["small"][run] == lm.response.bandwidth(scenario.drive(), 0.1)
        result = lm.simulate(scenario)
        # Without load the speed of a DC motor is u / k_E, here by its rated point: w_R M_stall / (M_stall - M_R).
        ideal = result["command"] * scenario.motor.rated_speed * 3.1169 / 2.1169 / scenario.gearbox.ratio
        assert rows["lag"][run] == pytest.approx(float(((result["load_speed"] - ideal) ** 2).mean() ** 0.5), rel=1e-12)
    assert "does not move" in rows["error"][2]  # the run itself can be, but has no bandwidth
    assert math.isnan(rows["own"][2])
    refused(
        lambda: make(scenario=SHORT.replace(**{"motor.kind": "torque_source"}), keep={"x": "peak(ideal_speed)"}), match="a motor of kind dc"
    )


def test_bad_runs_are_recorded_and_stop_no_other(tmp_path: Path):
    vary = [{"key": "load.inertia", "values": [1.0, -1.0, 2.0, 0.0]}]
    rows = rows_of(lm.study(make(design="list", runs=None, vary=vary), tmp_path / "s"))
    assert [e == "" for e in rows["error"]] == [True, False, True, False]
    assert "load.inertia: -1.0" in rows["error"][1]
    assert math.isnan(rows["peak_speed"][1]) and rows["peak_speed"][2] > 0.0
    assert rows["load.inertia"] == [1.0, -1.0, 2.0, 0.0]
    what = make(design="list", runs=None, vary=[{"key": "command.amplitude", "values": [0.5, 1e9]}])
    assert ["left the range" in error for error in rows_of(lm.study(what, tmp_path / "t"))["error"]] == [False, True]
    speeds = run_piece(what, 0, 2, 1).samples["load_speed"]
    assert np.isfinite(speeds[0]).all()
    assert np.isnan(speeds[1]).all()  # none is left as the memory happened to be


def test_parquet_opens_directly_with_study_and_parameters(tmp_path: Path):
    import pandas as pd

    directory = lm.study(make(), tmp_path / "s")
    frame = pd.read_parquet(directory)
    assert list(frame.columns[:4]) == ["run", "load.inertia", "stiffness", "command.amplitude"]
    meta = pq.read_schema(directory / "part-000000.parquet").metadata
    stored = json.loads(meta[b"lostmotion_study"])
    assert stored["scenario"]["gearbox"]["ratio"] == 90.0
    assert stored["keep"]["peak_speed"] == "peak(load_speed)"
    for schema in (pq.read_schema(directory / "part-000000.parquet"), read_table(directory).schema):
        units = {f.name: (f.metadata or {}).get(b"units", b"").decode() for f in schema}
        assert units["load.inertia"] == "kg*m^2"
        assert units["stiffness"] == units["lost"] == units["efficiency_driving"] == "1"  # relative; a share of energies
        assert (units["peak_speed"], units["rms_twist"], units["starts"]) == ("rad/s", "rad", "s")


def test_values_with_the_unit_of_something_else_are_refused():
    slopes = {"key": "gearbox.stiffness.slopes", "relative": True, "uniform": ["1 N*m/rad", "2 N*m/rad"]}
    unit = r'of load.inertia: "1 N" has the unit of something else \(N\).*kg\*m\^2'
    refused(lambda: make(vary=[{"key": "load.inertia", "uniform": ["1 N", "2 N"]}]), "vary[0]", match=unit)
    refused(lambda: make(vary=[slopes]), "vary[0]", match=r"of gearbox.stiffness.slopes: .* has the unit of something else")
    read = make(vary=[{"key": "motor.rated_speed", "triangular": ["3000 rpm", "3300 rpm", 400.0]}]).vary[0].triangular
    assert read == pytest.approx((3000 * math.pi / 30, 3300 * math.pi / 30, 400.0))


# --- designs ---
def test_designs_cover_what_they_say():
    grid = make(design="grid", runs=None, vary=[{"key": "load.inertia", "grid": [1, 2, 3]}, {"key": "command.phase", "values": [0, 1]}])
    assert grid.total == 6
    assert grid.parameters(0, 6).tolist() == [[1, 0], [1, 1], [1.5, 0], [1.5, 1], [2, 0], [2, 1]]
    latin = make(design="latin_hypercube", runs=50, vary=[{"key": "load.inertia", "uniform": [0.5, 1.5]}])
    strata = np.floor((latin.parameters(0, 50)[:, 0] - 0.5) * 50).astype(int)
    assert sorted(strata.tolist()) == list(range(50))
    # Any part of a design is what the whole has there.
    for design in ("sobol", "latin_hypercube", "random"):
        study = make(design=design, runs=1024 + 8)
        assert np.array_equal(study.parameters(512, 700), study.parameters(0, 1032)[512:700])
        assert not np.array_equal(study.parameters(0, 10), make(design=design, runs=1032, seed=4).parameters(0, 10))


def test_distributions_have_their_tails():
    vary = [
        {"key": "load.inertia", "uniform": [1.0, 3.0]},
        {"key": "motor.friction_torque", "normal": {"mean": 0.016, "deviation": 0.002}},
        {"key": "command.amplitude", "log_uniform": [0.01, 1.0]},
        {"key": "load.viscous_friction", "triangular": [1.0, 2.0, 5.0]},
    ]
    x = make(design="random", runs=5000, vary=vary, seed=1).parameters(0, 5000)
    laws = [stats.uniform(1.0, 2.0), stats.norm(0.016, 0.002), stats.loguniform(0.01, 1.0), stats.triang(0.25, 1.0, 4.0)]
    for k, law in enumerate(laws):
        assert stats.kstest(x[:, k], law.cdf).pvalue > 0.01
        for tail in (0.01, 0.99):
            share = np.mean(x[:, k] < law.ppf(tail))
            assert abs(share - tail) < 4.0 * math.sqrt(tail * (1 - tail) / 5000)  # four deviations of the count


def test_coupled_keys_go_together(tmp_path: Path):
    vary = [{"name": "friction", "keys": ["motor.friction_torque", "load.viscous_friction"], "relative": True, "values": [0.5, 2.0]}]
    study = make(design="list", runs=None, vary=vary)
    scenario = scenario_of_run(study, 1)
    assert scenario.motor.friction_torque == 2.0 * SHORT.motor.friction_torque
    assert scenario.load.viscous_friction == 2.0 * SHORT.load.viscous_friction
    assert rows_of(lm.study(study, tmp_path / "s"))["friction"] == [0.5, 2.0]


# --- safety ---
LONG = """
base = "{base}"
set = {{ "simulation.duration" = 0.5 }}
design = "random"
runs = 6000
[[vary]]
key = "load.inertia"
uniform = [1.0, 3.0]
[keep]
peak = "peak(load_speed)"
"""


@pytest.fixture(scope="module")
def long_study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("long") / "long.toml"
    path.write_text(LONG.format(base=ROOT / "scenarios" / "paper-2dof-nl-large.toml"))
    return path


@pytest.fixture(scope="module")
def whole(long_study: Path) -> pa.Table:
    return read_table(lm.study(lm.studies.load_study(long_study), long_study.parent / "whole"))


def started(study: Path, directory: Path, parts: int) -> subprocess.Popen:
    """A study in a process of its own, once it has written some parts."""
    command = [sys.executable, "-m", "lostmotion", "study", str(study), "-o", str(directory)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while len(list(directory.glob("part-*.parquet"))) < parts:  # however long a busy machine takes
        assert process.poll() is None, process.stderr.read() if process.stderr else ""
        time.sleep(0.01)
    return process


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGINT])
def test_killed_and_started_again_it_goes_on_where_it_was(long_study: Path, whole: pa.Table, tmp_path: Path, how: signal.Signals):
    directory = tmp_path / "killed"
    process = started(long_study, directory, 2)
    os.kill(process.pid, how)
    _, error = process.communicate()
    if how == signal.SIGINT:
        assert process.returncode == 130
        assert "resumes it" in error
    kept = {p.name: p.stat().st_mtime_ns for p in directory.glob("part-*.parquet")}
    assert 2 <= len(kept) < 12
    (directory / ".part-000011.parquet.x.parquet").write_bytes(b"half")  # what a kill in mid-write leaves
    done = CliRunner().invoke(app, ["study", str(long_study), "-o", str(directory)])
    assert done.exit_code == 0, done.output
    for name, stamp in kept.items():
        assert (directory / name).stat().st_mtime_ns == stamp  # nothing twice
    assert not list(directory.glob(".part*"))
    assert read_table(directory).equals(whole)
    assert whole["run"].to_pylist() == list(range(6000))


def test_a_full_disk_stops_it_with_one_line_and_loses_nothing(tmp_path: Path):
    (tmp_path / "s.toml").write_text(GOOD.format(base="step-to-standstill"))
    before = (
        "import resource, signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN);"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (4000, 4000))"  # room for the note, not for a part
    )
    (done,) = forks([("study", "s.toml", "-o", "full")], tmp_path, before)
    assert done.returncode == 1
    assert "cannot be written" in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not list((tmp_path / "full").glob("*part*"))


def test_a_directory_of_another_study_is_left_alone(tmp_path: Path):
    lm.study(make(runs=4), tmp_path / "s")
    assert "holds another study" in refused(lambda: lm.study(make(runs=4, seed=9), tmp_path / "s"))
    (tmp_path / "p").mkdir()
    (tmp_path / "p" / "mine.parquet").write_bytes(b"")
    assert "of no study" in refused(lambda: lm.study(make(runs=4), tmp_path / "p"))


SWAPPED = ("part-000000.parquet", "part-000001.parquet")


def changed(change):
    def harm(directory: Path) -> None:
        part = directory / SWAPPED[1]
        part.write_bytes(change(part.read_bytes()))

    return harm


flip = changed(lambda part: part[: len(part) // 3] + bytes([part[len(part) // 3] ^ 1]) + part[len(part) // 3 + 1 :])


def swap(directory: Path) -> None:
    first, second = (directory / name for name in SWAPPED)
    content = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(content)


def swap_with_checksums(directory: Path) -> None:
    swap(directory)
    sums = directory / "_checksums.txt"
    sums.write_text(sums.read_text().replace("000000.p", "x").replace("000001.p", "000000.p").replace("x", "000001.p"))


def from_another_study(directory: Path) -> None:
    other = lm.study(make(design="random", runs=2 * CHUNK + 1, seed=9), directory.parent / "other")
    for name in (SWAPPED[1], "_checksums.txt"):
        (directory / name).write_bytes((other / name).read_bytes())


def forget(directory: Path) -> None:
    (directory / "_checksums.txt").write_bytes(b"\xff\x00 rubbish\n")


def repair(directory: Path, whole: pa.Table) -> None:
    done = CliRunner().invoke(app, ["study", "resume", str(directory), "--repair"])
    assert done.exit_code == 0, done.output
    assert read_table(directory).equals(whole)


@pytest.mark.parametrize(("harm", "said"), [
    (changed(lambda part: part[:-100]), "part-000001.parquet: is damaged: its checksum differs"),
    (flip, "part-000001.parquet: is damaged: its checksum differs"),
    (changed(lambda part: np.random.default_rng(1).bytes(5000)), "part-000001.parquet: is damaged: its checksum differs"),
    (changed(lambda part: b""), "part-000001.parquet: is damaged: its checksum differs"),
    (swap, r"part-000000.parquet: is damaged: its checksum differs \(1 more parts are damaged\)"),
    (swap_with_checksums, "part-000000.parquet: does not hold the runs 0 to 499"),
    (from_another_study, "part-000001.parquet: (is damaged|belongs to another study)|part-000000.parquet: is damaged"),
    (forget, "part-000000.parquet: has no line in _checksums.txt"),
])  # fmt: skip
def test_damaged_parts_are_named_and_made_again(tmp_path: Path, harm, said: str):
    study = make(design="random", runs=2 * CHUNK + 1)
    directory = lm.study(study, tmp_path / "s")
    whole = read_table(directory)
    harm(directory)
    before = {p.name: p.stat().st_mtime_ns for p in directory.glob("part-*.parquet")}
    for call in (lambda: read_table(directory), lambda: lm.study(study, directory)):
        with pytest.raises(InputError, match=said) as caught:
            call()
        assert "study resume" in str(caught.value) and "--repair" in str(caught.value)
    for command in (["show"], ["resume"]):
        done = CliRunner().invoke(app, ["study", *command, str(directory)])
        assert isinstance(done.exception, InputError)
    repair(directory, whole)
    if harm is flip:  # only the damaged part is made again
        assert [p.name for p in directory.glob("part-*.parquet") if before[p.name] != p.stat().st_mtime_ns] == [SWAPPED[1]]
        for checksum, name in map(str.split, (directory / "_checksums.txt").read_text().splitlines()):
            assert hashlib.sha256((directory / name).read_bytes()).hexdigest() == checksum


@pytest.mark.parametrize("name", [*SWAPPED[:2], "_checksums.txt", "_study.json"])
@pytest.mark.parametrize("what", ["device", "directory", "link to nothing", "link to itself"])
def test_what_is_no_file_is_named_and_not_read(tmp_path: Path, name: str, what: str):
    study = make(design="random", runs=CHUNK + 1)
    directory = lm.study(study, tmp_path / "s")
    whole = read_table(directory)
    path = directory / name
    path.unlink()
    if what == "directory":
        path.mkdir()
    else:
        path.symlink_to({"device": "/dev/zero", "link to nothing": "none", "link to itself": name}[what])
    begin = time.process_time()
    refused(lambda: read_table(directory), match="holds no study" if name == "_study.json" else name)
    done = CliRunner().invoke(app, ["study", "resume", str(directory), "--repair"])
    assert time.process_time() - begin < 10.0
    if done.exit_code == 0:
        assert read_table(directory).equals(whole)
    else:
        assert isinstance(done.exception, InputError), done.output
        assert name in str(done.exception)
    assert done.exit_code == 0 or name.startswith("_") or what == "directory"


def test_a_part_that_no_run_of_the_study_is_in_is_refused(tmp_path: Path):
    directory = lm.study(make(runs=4), tmp_path / "s")
    (directory / "part-000007.parquet").write_bytes((directory / SWAPPED[0]).read_bytes())
    assert "part-000007.parquet: is no part of this study; remove it" in refused(lambda: read_table(directory))
    assert "remove it" in refused(lambda: lm.study(make(runs=4), directory, repair=True))
    assert (directory / "part-000007.parquet").exists()


@pytest.mark.parametrize("content", [b"", b"{", b"\xff\xfe", b"[]", b'{"scenario": 3}', b"[" * 100_000])
def test_a_damaged_note_is_restored_from_a_part(tmp_path: Path, content: bytes):
    directory = lm.study(make(runs=4), tmp_path / "s")
    whole = read_table(directory)
    (directory / "_study.json").write_bytes(content)
    for call in (lambda: read_table(directory), lambda: lm.study(make(runs=4), directory)):
        refused(call, match=r"_study\.json: is damaged; `lostmotion study resume .* --repair` restores it")
    repair(directory, whole)


def test_a_note_of_another_study_is_restored_from_a_part_that_matches_its_checksum(tmp_path: Path):
    study, another = (make(design="random", runs=2 * CHUNK + 1, seed=seed) for seed in (3, 5))
    directory, other = lm.study(study, tmp_path / "s"), lm.study(another, tmp_path / "other")
    whole, parts = read_table(directory), {p: p.stat().st_mtime_ns for p in directory.glob("part-*.parquet")}
    (directory / "_study.json").write_bytes((other / "_study.json").read_bytes())
    for call in (lambda: read_table(directory), lambda: lm.study(another, directory, repair=True)):
        refused(call, match=r"_study\.json: is of another study than part-000000\.parquet; `lost.*--repair")
    repair(directory, whole)
    assert parts == {p: p.stat().st_mtime_ns for p in directory.glob("part-*.parquet")}  # none is made again
    (directory / "_study.json").unlink()
    (directory / SWAPPED[0]).write_bytes((other / SWAPPED[0]).read_bytes())
    repair(directory, whole)


class Lost(Executor):
    """An executor whose second chunk is lost."""

    def __init__(self, error: Exception) -> None:
        self.error, self.chunks = error, 0

    def submit(self, function, /, *args, **kwargs):
        self.chunks += 1
        future: Future = Future()
        if self.chunks == 2:
            future.set_exception(self.error)
        else:
            future.set_result(function(*args, **kwargs))
        return future


@pytest.mark.parametrize("name", ["CancelledError", "BrokenProcessPool", "KilledWorker"])
def test_lost_workers_end_in_one_line_and_lose_no_part(tmp_path: Path, name: str):
    from concurrent.futures import CancelledError
    from concurrent.futures.process import BrokenProcessPool

    killed = type("KilledWorker", (Exception,), {"__module__": "distributed.scheduler"})
    error = {"CancelledError": CancelledError, "BrokenProcessPool": BrokenProcessPool, "KilledWorker": killed}[name]()
    study = make(design="random", runs=2 * CHUNK + 1)
    refused(
        lambda: lm.study(study, tmp_path / "s", executor=Lost(error)),
        match=f"were lost .{name}.; what is written stays, and the same command resumes",
    )
    assert read_table(lm.study(study, tmp_path / "s")).equals(read_table(lm.study(study, tmp_path / "t")))


class Cluster:
    """A Dask scheduler and two workers as processes of their own, as docs/studies.md starts them on several machines."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory

    def start(self, name: str, *words: str) -> subprocess.Popen:
        with (self.directory / f"{name}.log").open("a") as log:
            command = [sys.executable, "-m", f"distributed.cli.dask_{name}", "--no-dashboard", *words]
            return subprocess.Popen(command, stdout=log, stderr=log)

    def __enter__(self) -> "Cluster":
        about = self.directory / "scheduler.json"
        where = ("--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(about))
        self.scheduler = self.start("scheduler", *where)
        while not (about.is_file() and about.stat().st_size):  # however long a busy machine takes
            assert self.scheduler.poll() is None
            time.sleep(0.05)
        self.address = json.loads(about.read_text())["address"]
        self.workers = [self.start("worker", self.address, "--nthreads", "1", "--no-nanny") for _ in range(2)]
        return self

    def __exit__(self, *_: object) -> None:
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()


@pytest.mark.filterwarnings("default")
def test_dask_workers_compute_and_neither_a_worker_nor_the_scheduler_takes_anything_with_it(tmp_path: Path):
    from distributed import Client

    example = ROOT / "examples" / "tolerance.toml"
    study, directory = make(design="random", runs=12 * CHUNK), tmp_path / "s"
    whole = read_table(lm.study(study, tmp_path / "t"))
    with Cluster(tmp_path) as cluster:
        words = ["study", str(example), "-o", str(tmp_path / "e"), "--scheduler", cluster.address]
        done = CliRunner().invoke(app, words)
        assert done.exit_code == 0, done.output
        assert read_table(tmp_path / "e").equals(read_table(lm.study(lm.studies.load_study(example), tmp_path / "f")))
        with Client(cluster.address, timeout="10s") as client:
            seen: list[int] = []

            def kill_a_worker(done: int) -> None:
                seen.append(done)
                if len(seen) == 3:
                    cluster.workers[0].kill()

            lm.study(study, tmp_path / "d", executor=client.get_executor(pure=False), progress=kill_a_worker)
            assert len(client.scheduler_info()["workers"]) == 1
            assert seen[-1] == study.total
            assert read_table(tmp_path / "d").equals(whole)

            def kill_scheduler(done: int) -> None:
                if done >= 2 * CHUNK:
                    cluster.scheduler.kill()

            refused(
                lambda: lm.study(study, directory, executor=client.get_executor(pure=False), progress=kill_scheduler),
                match="workers or their scheduler were lost",
            )
    kept = {p.name: p.stat().st_mtime_ns for p in directory.glob("part-*.parquet")}
    assert 2 <= len(kept) < 12
    lm.study(study, directory)
    assert {name: (directory / name).stat().st_mtime_ns for name in kept} == kept
    assert read_table(directory).equals(whole)


def test_progress_rises_to_the_total_and_starts_from_what_is_there(tmp_path: Path):
    study = make(runs=2 * CHUNK + 1, design="random")
    seen: list[int] = []
    lm.study(study, tmp_path / "s", progress=seen.append)
    assert seen == [0, CHUNK, 2 * CHUNK, 2 * CHUNK + 1]
    (tmp_path / "s" / "part-000001.parquet").unlink()
    seen.clear()
    lm.study(study, tmp_path / "s", progress=seen.append)
    assert seen == [CHUNK + 1, 2 * CHUNK + 1]


# --- what it shows ---
def test_sobol_indices_of_a_closed_form(tmp_path: Path):
    """A free inertia: w(t) = (M - M_Z) t/J with fixed J is linear in both torques, so S = variance share, and no interaction."""
    drive = lm.Scenario(
        motor=lm.Motor(kind="torque_source", rotor_inertia=0.01),
        gearbox=lm.Gearbox(
            ratio=1.0,
            rated_input_speed=100.0,
            rated_output_torque=1.0,
            stiffness=lm.model.LinearStiffness(stiffness=1e4),
            losses=lm.model.ConstantEfficiency(efficiency=1.0),
        ),
        load={"inertia": 0.01},
        simulation={"duration": 0.1, "sample_interval": 0.05},
    )
    study = Study(
        scenario=drive,
        design="saltelli",
        runs=1024,
        vary=[{"key": "command.mean", "uniform": [0.0, 3.0]}, {"key": "load.torque.mean", "uniform": [0.0, 1.0]}],
        keep={"momentum": "final(motor_speed) + final(load_speed)"},
    )
    table = read_table(lm.study(study, tmp_path / "s"))
    indices = sobol_indices(table, study)["momentum"]
    for key, share in (("command.mean", 0.9), ("load.torque.mean", 0.1)):
        first, total, *half = indices[key]
        assert (first, total) == pytest.approx((share, share), abs=0.02)
        assert abs(first - share) < 1.5 * half[0] and abs(total - share) < 1.5 * half[1]  # 95 % intervals
        assert max(half) < 0.15
    write_study(tmp_path / "s", tmp_path / "page")
    rows = [line.split(",") for line in (tmp_path / "page" / "sobol.csv").read_text().splitlines()]
    assert [float(x) for x in rows[1][2:]] == pytest.approx(list(indices["command.mean"]), rel=1e-4)
    ranks = influence(table, study)["momentum"]
    assert ranks["command.mean"] > 0.8
    assert ranks["load.torque.mean"] < -0.2
    assert "depends most on command.mean (total Sobol index 0.9" in (tmp_path / "page" / "study.html").read_text()

    equal = [{"key": key, "uniform": [0.0, 1.0]} for key in ("command.mean", "load.torque.mean")]
    lm.study(Study(scenario=drive, design="saltelli", runs=64, vary=equal, keep=study.keep), tmp_path / "equal")
    write_study(tmp_path / "equal", tmp_path / "even")  # both have a half of the variance
    assert "these runs do not decide which" in (tmp_path / "even" / "study.html").read_text()


def test_show_and_best_from_the_command_line(tmp_path: Path):
    out = tmp_path / "t"
    done = CliRunner().invoke(app, ["study", str(ROOT / "examples" / "tolerance.toml"), "-o", str(out)])
    assert done.exit_code == 0, done.output
    assert "stuck_share" in done.output and "std. dev." in done.output  # the summary
    assert f"lostmotion study show {out} -o t-report" in done.output.replace("\n", "")
    assert {p.name for p in tmp_path.iterdir()} == {"t"}
    within = CliRunner().invoke(app, ["study", "show", str(out), "-o", str(out / "page")])
    assert "is within the directory of the runs" in str(within.exception)
    shown = CliRunner().invoke(app, ["study", "show", str(out), "--best", "stuck_share", "-o", str(tmp_path / "page"), "--figures", "png"])
    assert shown.exit_code == 0, shown.output
    assert "256 of 256 runs, 0 failed" in shown.output
    written = {p.name for p in (tmp_path / "page").iterdir()}
    assert {"study.html", "statistics.csv", "distributions.png", "tornado.png", "scatter.png"} <= written
    import pandas as pd

    table = read_table(out)
    page = (tmp_path / "page" / "study.html").read_text()
    assert not Page(page).faults
    first = next(chart for chart in charts(page) if chart["title"] == "stuck share over motor friction torque")
    assert np.array_equal(first["lines"][0]["x"], table["motor.friction_torque"].to_numpy())
    assert np.array_equal(first["lines"][0]["y"], table["stuck_share"].to_numpy())
    assert len(pd.read_parquet(out)) == table.num_rows == 256  # nothing but data among the data
    best = best_runs(table, "stuck_share", 3)["stuck_share"].to_pylist()
    assert best == sorted(table["stuck_share"].to_pylist())[:3]


GOOD = """
base = "{base}"
design = "list"
[[vary]]
key = "load.inertia"
values = [1, 2]
[keep]
peak = "peak(load_speed)"
"""


@pytest.mark.parametrize(("old", "new", "match"), [
    ('base = "{base}"', "", "key base"),
    ('base = "{base}"', 'base = "none.toml"', "key base: .*none.toml: there is no such file"),
    ('"list"', '"lists"', "design"),
    ("load.inertia", "load.inertai", "does not know"),
    ("load.inertia", "simulation.duration", "same samples"),
    ("values = [1, 2]", "", "needs one of values"),
    ("values = [1, 2]", "values = []", "is empty"),
    ("values = [1, 2]", 'values = ["1 kg*m"', "TOML"),
    ("values = [1, 2]", "uniform = [1, 2]", "for which load.inertia needs values"),
    ("values = [1, 2]", "values = [1]\nuniform = [1, 2]", "needs one of values"),
    ('design = "list"', 'design = "sobol"', "lacks runs"),
    ('design = "list"', 'design = "list"\nruns = 3', "leave it out"),
    ('design = "list"', 'design = "saltelli"\nruns = 3', "power of two"),
    ("peak(load_speed)", "peak(load_sped)", "neither a result variable"),
    ("peak(load_speed)", "peak(load_speed", "cannot be read"),
    ("peak(load_speed)", "energy.gear_loss", "energy.gear_loss is none"),
    ("peak(load_speed)", "load_speed.__class__", "must not use"),
    ("peak(load_speed)", "load_speed", r"reduce it, as in peak\(load_speed\)"),
    ("peak(load_speed)", "load_speed.isel(time=2001)", "sample that a run of 2001 does not have"),
    ("peak(load_speed)", "load_speed.sel(time=2.5)", "instant outside the 2.0 s"),
    ('peak = "peak', 'run = "peak', "a name that is taken"),
    ("[keep]", "[kept]", "kept"),
    ("values = [1, 2]", "values = [1, 2]\nvalue = 3", "not known"),
    ("values = [1, 2]", "values = [true]", "load.inertia: true is not a number$"),
    ("values = [1, 2]", "grid = [1, 2, 2.5]", r"key vary\[0\]\.grid\[2\]: 2.5 must be a whole number$"),
    ("values = [1, 2]", "values = [1, inf]", r"key vary\[0\]\.values\[1\]: inf must be a finite number"),
    ("values = [1, 2]", "grid = [1, 2, 1000000000]", "grid needs 1 to 1000000 values, not 1000000000"),
    ("values = [1, 2]", "grid = [1, 2, 0]", "grid needs 1 to 1000000 values, not 0"),
    ("[[vary]]", "[vary]", "key vary: .* must be a list, in square brackets$"),
    ("[keep]", "[[keep]]", "key keep: .* must be a table$"),
    ('"peak(load_speed)"', "3", "key keep.peak: 3 must be text, in quotes$"),
    ('design = "list"', 'design = "lists"', '"lists" must be one of "grid", "list"'),
])  # fmt: skip
def test_a_bad_study_ends_in_one_clear_line(tmp_path: Path, old: str, new: str, match: str):
    path = tmp_path / "s.toml"
    assert old in GOOD
    path.write_text(GOOD.replace(old, new).replace("{base}", str(ROOT / "scenarios" / "paper-2dof-nl-large.toml")))
    refused(lambda: lm.studies.load_study(path), match=match)


def test_a_saved_result_can_be_the_base_of_a_study_and_is_no_file_of_text(tmp_path: Path):
    """All its values are written out, so the study is that of the scenario."""
    lm.save(lm.simulate(lm.load("step-to-standstill")), tmp_path / "result.csv")
    for name, base in (("own", "result.csv"), ("other", "step-to-standstill")):
        (tmp_path / f"{name}.toml").write_text(GOOD.replace("{base}", base))
    first, second = (lm.studies.load_study(tmp_path / f"{name}.toml") for name in ("own", "other"))
    assert first.scenario == second.scenario
    tables = [read_table(lm.study(study, tmp_path / name)) for name, study in (("a", first), ("b", second))]
    assert tables[0].to_pydict() == tables[1].to_pydict()
    (tmp_path / "s.toml").write_text('base = "result.csv"\n')
    refused(lambda: lm.load(tmp_path / "s.toml"), "base")
    refused(lambda: lm.studies.load_study(tmp_path / "result.csv"), match="result.csv: has the ending of a saved result; a study is a")


def test_quantiles_are_those_of_the_statistics_library():
    import scipy.stats

    u = np.concatenate([[1e-12, 0.5, 1.0 - 1e-12], np.random.default_rng(1).random(1000)])
    normal = Vary(key="load.inertia", normal={"mean": 2.0, "deviation": 0.1})
    assert np.allclose(normal.quantile(u), scipy.stats.norm.ppf(u, 2.0, 0.1), rtol=1e-14, atol=0.0)
    for low, mode, high in ((1.0, 1.2, 3.0), (1.0, 1.0, 3.0), (1.0, 3.0, 3.0), (-2.0, 0.0, 1.0)):
        triangular = Vary(key="load.inertia", triangular=[low, mode, high])
        theirs = scipy.stats.triang.ppf(u, (mode - low) / (high - low), low, high - low)
        assert np.allclose(triangular.quantile(u), theirs, rtol=0.0, atol=1e-14)
    assert (Vary(key="load.inertia", triangular=[2.0, 2.0, 2.0]).quantile(u) == 2.0).all()


def test_memory_does_not_grow_with_the_length_of_a_study(tmp_path: Path):
    import resource

    def peak() -> int:
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss  # [kB]

    lm.study(make(design="random", runs=2 * CHUNK), tmp_path / "short")
    before = peak()
    worker = threading.Thread(target=lambda: lm.study(make(design="random", runs=10 * CHUNK), tmp_path / "long"))
    worker.start()
    worker.join()
    assert peak() - before < 60_000  # ten chunks of samples alone would be 100 MB
