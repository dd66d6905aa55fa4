"""The command line: what it takes, when it starts, what it tries before the work, what it says meanwhile."""

import errno
import os
import pty
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import lostmotion as lm
from conftest import ALL_SCENARIOS, ROOT, SCENARIOS, forks, lostmotion
from lostmotion.cli import app, terminal
from lostmotion.data_sheets.motor_sheet import STEPPER_DATA
from lostmotion.data_sheets.records import table_of
from lostmotion.reports import plots, thinning
from lostmotion.reports.catalogue_text import list_records
from lostmotion.simulation.runs.run import run
from lostmotion.simulation.runs.run_time_forecast import forecast
from refusals import refused

SMALL = "paper-2dof-nl-small"


# --- scenarios by name, results as scenarios ---
def test_shipped_scenarios_are_known_by_name(tmp_path: Path) -> None:
    assert list(lm.shipped_scenarios()) == [p.stem for p in ALL_SCENARIOS]
    for path in ALL_SCENARIOS:
        assert lm.load(path.stem) == lm.load(path)
    by_name, by_file = (lostmotion("run", what, cwd=tmp_path) for what in (SMALL, SCENARIOS[0].parent / f"{SMALL}.toml"))
    assert by_name.returncode == 0
    # But for the next command that is named: with what was given.
    assert by_name.stdout == by_file.stdout.replace(str(SCENARIOS[0].parent / f"{SMALL}.toml"), SMALL)
    listed = lostmotion("scenarios", cwd=tmp_path).stdout
    *lines, then = listed.splitlines()
    assert then.startswith("Next: lostmotion run ")
    for path, line in zip(ALL_SCENARIOS, lines, strict=True):
        assert line.split(maxsplit=1) == [path.stem, lm.load(path).title]


def test_a_copy_of_a_shipped_scenario_loads_anywhere_and_keeps_its_comments(tmp_path: Path) -> None:
    for path in ALL_SCENARIOS:
        done = CliRunner().invoke(app, ["new", path.stem, "-o", str(tmp_path / path.name)])
        assert done.exit_code == 0, done.output
        assert lm.load(tmp_path / path.name) == lm.load(path.stem)
        assert path.read_text().count("#") == (tmp_path / path.name).read_text().count("#")
    again = CliRunner().invoke(app, ["new", "position-axis", "-o", str(tmp_path / "position-axis.toml")])
    assert "exists; name another file" in str(again.exception)


def test_a_file_comes_before_a_shipped_name_and_may_build_on_one(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").write_text(f'base = "{SMALL}"\ntitle = "mine"\n')
    assert lm.load("mine.toml") == lm.load(SMALL).replace(title="mine")
    Path(SMALL).write_text(f'base = "{SCENARIOS[0]}"\ntitle = "a file of that name"\n')
    assert lm.load(SMALL).title == "a file of that name"
    Path("study.toml").write_text(
        'base = "step-to-standstill"\ndesign = "list"\n[[vary]]\nkey = "load.inertia"\nvalues = [1]\n[keep]\na = "peak(twist)"\n'
    )
    assert lm.studies.load_study("study.toml").scenario == lm.load("step-to-standstill")


def test_an_unknown_name_is_told_with_the_nearest_and_a_directory_hides_none(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    told = "paper-2dof-nl-smal: there is no such file (.toml) and no such scenario; did you mean paper-2dof-nl-small?"
    assert refused(lambda: lm.load("paper-2dof-nl-smal")) == told
    Path(SMALL).mkdir()
    assert lm.load(SMALL) == lm.load(SCENARIOS[0].parent / f"{SMALL}.toml")
    Path("folder").mkdir()
    refused(lambda: lm.load("folder"), match="folder: is a directory")
    refused(lambda: lm.load("xyz"), match="the scenarios that come with the package are backlash-reversing-load, ")
    refused(lambda: lm.load(f"{SMALL}.toml"), match=f"{SMALL}.toml: there is no such file; the shipped scenario is called {SMALL}")


def test_a_file_that_is_no_result_of_a_run_is_refused(tmp_path: Path) -> None:
    response = lm.frequency_response(lm.load(SMALL), [1.0], 0.1)[["efficiency", "angle_advance"]]
    response.to_netcdf(tmp_path / "response.nc", engine="h5netcdf")
    (tmp_path / "table.csv").write_text("a,b\n1,2\n")
    for name, words in (("response.nc", "carries no scenario"), ("table.csv", "no result"), ("none.csv", "no such file")):
        done = lostmotion("run", name, cwd=tmp_path)
        assert done.returncode == 1
        assert done.stderr.startswith(f"lostmotion: {name}: ")
        assert words in done.stderr
        assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize("ending", ["csv", "nc", "parquet"])
def test_a_saved_result_is_run_again_as_it_was(tmp_path: Path, ending: str) -> None:
    first, second = tmp_path / f"first.{ending}", tmp_path / f"second.{ending}"
    assert lostmotion("run", SMALL, "--set", "load.inertia=1.5", "-o", first, cwd=tmp_path).returncode == 0
    again = lostmotion("run", first, "-o", second, cwd=tmp_path)
    assert again.returncode == 0, again.stderr
    assert lm.open_result(second).identical(lm.open_result(first))
    changed = lm.load(first, ["command.amplitude=0.1"])
    assert changed == lm.load(SMALL, {"load.inertia": 1.5, "command.amplitude": 0.1})
    refused(lambda: lm.load(first, ["load.inertai=1"]), match=rf"first.{ending}: key load.inertai: is not known; did you mean inertia")


# --- the catalogue ---
def test_the_catalogue_says_what_is_a_gearbox_a_motor_complete_or_not() -> None:
    lines = list_records().splitlines()
    assert lines[0].split()[:3] == ["name", "type", "kind"]
    of = {line.split()[0]: line.split()[1:] for line in lines[1:-2]}
    for record in lm.catalogue():
        assert of[record.name][:2] == [table_of(record), record.kind]
        runs_as = " ".join(of[record.name])
        assert runs_as.endswith(record.level() or ", ".join(record.missing()))
    gearboxes = [r for r in lm.catalogue() if isinstance(r, lm.data_sheets.GearboxSheet)]
    complete = [r for r in gearboxes if not r.missing()]
    assert 0 < len(complete) < len(gearboxes)
    assert f"{len(gearboxes)} gearboxes, {len(complete)} of them run" in lines[-2]
    only = list_records("gearbox", complete=True).splitlines()
    assert [line.split()[0] for line in only[1:-2]] == [r.name for r in complete]
    assert len(list_records("dc_brushed").splitlines()) > 4
    assert "--kind engine: is not known; take one of gearbox, motor, " in refused(lambda: list_records("engine"))
    assert "--kind planetry: is not known; did you mean planetary?" in refused(lambda: list_records("planetry"))
    assert list_records(ratio="50-100") == list_records(ratio="50..100")


@pytest.mark.parametrize("kind", ["motor", "dc_brushed", "synchronous"])
def test_the_template_of_a_motor_sheet_can_be_used_as_it_is(tmp_path: Path, kind: str) -> None:
    made = lostmotion("catalogue", "new", "--kind", kind, "-o", "my-motor.toml", cwd=tmp_path)
    assert made.returncode == 0, made.stderr
    assert "It can be simulated" in lostmotion("catalogue", "my-motor.toml", cwd=tmp_path).stdout
    (tmp_path / "drive.toml").write_text('base = "catalogue-robot-joint"\nmotor = "my-motor.toml"\n')
    assert lostmotion("run", "drive.toml", cwd=tmp_path).returncode == 0
    text = (tmp_path / "my-motor.toml").read_text()
    assert f'kind = "{ {"motor": "brushless"}.get(kind, kind) }"' in text
    for figure in set(lm.data_sheets.MotorSheet.model_fields) - set(STEPPER_DATA) if kind != "synchronous" else ():
        assert figure in ("note", "sources", "gaps", "illustrative") or f"{figure} = " in text
    done = lostmotion("rig", "my-motor.toml", cwd=tmp_path)
    assert done.stderr == "lostmotion: my-motor.toml: a gearbox is wanted here, and this file has none; name a file with one\n"


# --- before the work ---
def test_output_is_tried_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text((ROOT / "examples" / "tolerance.toml").read_text().replace("../scenarios/", ""))
    (tmp_path / f"{SMALL}.toml").write_text(f'base = "{SMALL}"\n')
    calls = [
        ("run", SMALL, "-o", "/proc/result.csv"),
        ("run", SMALL, "--plot", "/proc/run.png"),
        ("rig", "schaeffler-rt1-h-20-100", "-o", "/proc/rig"),
        ("response", SMALL, "-o", "/proc/response"),
        ("reproduce", "-o", "/proc/paper"),
        ("study", "study.toml", "-o", "/proc/study"),
    ]
    for done in forks(calls, tmp_path, STOPS_AT_THE_FIRST_COMPUTATION):
        assert done.returncode == 1, done
        assert "computes" not in done.stdout
        assert done.stderr.startswith(f"lostmotion: {done.args[-1]}: ")
        assert len(done.stderr.strip().splitlines()) == 1
    before = list(tmp_path.iterdir())
    assert lostmotion("rig", "nord-sk1si50-60", "-o", "a/b/c", cwd=tmp_path).returncode == 1  # a record that lacks figures
    assert list(tmp_path.iterdir()) == before


# --- quick to start ---
# An exit takes the worker threads along.
STOPS_AT_THE_FIRST_COMPUTATION = """
import lostmotion._core, lostmotion.simulation.scenario.scenario
def stop(*arguments, **options):
    print("computes", *sorted(sys.modules), flush=True)
    os._exit(0)
core = sys.modules["lostmotion._core"]
core.run = core.respond = core.run_batch = stop
"""
# Libraries that take a tenth of a second or more to import.
DATASETS = {"xarray", "pandas", "pyarrow"}
NETCDF = {"h5netcdf", "h5py"}
FIGURES = {"matplotlib", "jinja2"}
SLOW = DATASETS | NETCDF | FIGURES | {"pint", "scipy", "control", "SALib", "distributed", "rich"}


STUDY = """
base = "paper-2dof-nl-small"
design = "{design}"
runs = 8
[[vary]]
key = "load.inertia"
normal = {{ mean = 2.0, deviation = 0.1 }}
[[vary]]
key = "load.friction_torque"
triangular = [0.0, 0.1, 0.3]
[keep]
top = "peak(load_speed)"
"""
SAYS_WHEN_IT_IMPORTS = """
import os, sys
class Watch:
    def find_spec(self, name, path=None, target=None):
        if name == "scipy.stats":
            os.write(1, f"imports, progress shown: {'rich.progress' in sys.modules}".encode())  # the bar takes print over
            os._exit(0)
sys.meta_path.insert(0, Watch())
sys.stderr.isatty = lambda: True
"""


def test_no_command_imports_a_slow_library_before_it_computes(tmp_path: Path) -> None:
    for design in ("random", "latin_hypercube"):
        (tmp_path / f"{design}.toml").write_text(STUDY.format(design=design))
    calls = [
        ("rig", "schaeffler-rt1-h-20-100"),
        ("response", SMALL),
        ("reproduce", "-o", "out"),
        ("reproduce",),
        ("study", "random.toml", "-o", "random"),
        ("study", "latin_hypercube.toml", "-o", "latin"),
    ]
    for done in forks(calls, tmp_path, STOPS_AT_THE_FIRST_COMPUTATION):
        word, *modules = done.stdout.split()
        assert word == "computes", done
        assert {"numpy", "pydantic", "lostmotion"} <= set(modules)
        assert not (SLOW | {"scipy.stats", "scipy.special"}) & set(modules), done.args


def test_the_engine_of_sobol_points_is_imported_behind_all_checks_and_the_progress_bar(tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(STUDY.format(design="sobol"))
    (tmp_path / "bad.toml").write_text(STUDY.format(design="sobol").replace("runs = 8", "runs = -8"))
    calls = [("study", f"{name}.toml", "-o", name) for name in ("s", "bad")]
    good, bad = forks(calls, tmp_path, SAYS_WHEN_IT_IMPORTS + STOPS_AT_THE_FIRST_COMPUTATION)
    assert good.stdout.strip() == "imports, progress shown: True"
    assert bad.returncode == 1
    assert "key runs: -8 must be at least 1" in bad.stderr
    assert bad.stdout == ""


def test_help_imports_next_to_nothing(tmp_path: Path) -> None:
    for done in forks([("--help",), ("--version",), ("run", "--help"), ("study", "--help"), ("scenarios",)], tmp_path):
        assert done.returncode == 0, done
        assert "typer" in done.modules
        assert not done.modules & (SLOW | {"numpy"}), done.args
    assert "pydantic" in done.modules


# Which slow libraries a whole command may import.
MAY_IMPORT = {
    "run paper-2dof-nl-small": set(),
    "run paper-2dof-nl-small --explain 0.5": set(),
    "run position-axis": {"scipy"},  # for the poles of its loops
    "run catalogue-robot-joint --set load.inertia=2": set(),
    "run direction-finder --solver dormand-prince --set simulation.duration=0.1": {"scipy"},
    "run paper-2dof-nl-small -o run.csv": DATASETS,
    "run paper-2dof-nl-small -o run.nc": DATASETS | NETCDF,
    "run paper-2dof-nl-small --plot run.svg": DATASETS | FIGURES,
    "schema": set(),
    "catalogue": set(),
    "catalogue schaeffler-rt1-h-20-100": set(),
    "catalogue new --kind motor": set(),
    "check catalogue-robot-joint": set(),
    "check position-axis": set(),
    "rig schaeffler-rt1-h-20-100": DATASETS | FIGURES,
    "response paper-2dof-nl-small --amplitudes 0.1 --frequencies 1.0,2.0": DATASETS | NETCDF | FIGURES,
    "servo position-axis": {"scipy", "rich"},
    "track tracking-loss-map --set simulation.duration=0.5": FIGURES | {"rich"},
    "study study.toml -o rows": DATASETS,
}


def test_a_command_imports_what_it_needs_alone(tmp_path: Path) -> None:
    """Without dask and pint, which xarray imports by itself where they are installed."""
    (tmp_path / "study.toml").write_text(STUDY.format(design="random"))
    before = "sys.modules.update(dask=None, pint=None); import lostmotion.simulation.scenario.scenario"
    for done in forks(map(str.split, MAY_IMPORT), tmp_path, before):
        assert done.returncode in (0, 1, 3), done  # a verdict, which an error has not
        assert "lostmotion: " not in done.stderr
        assert {"numpy", "pydantic"} <= done.modules
        assert done.modules & SLOW <= MAY_IMPORT[" ".join(done.args)], done.args


# --- help, version, completion, progress ---
def test_short_help_version_and_completion() -> None:
    run = CliRunner().invoke
    for command in ([], ["run"], ["rig"], ["check"], ["drive", "check"], ["study"]):
        short, long = (run(app, [*command, option]) for option in ("-h", "--help"))
        assert short.exit_code == 0
        assert short.output == long.output
    assert run(app, ["--version"]).output == f"{lm.__version__}\n"
    assert "--install-completion" in run(app, ["--help"]).output
    for options, kind in (([], "planetary"), (["--kind", "worm"], "worm")):
        assert f'kind = "{kind}"' in run(app, ["catalogue", "new", *options]).output


@pytest.mark.parametrize(("typed", "expected"), [
    ("lostmotion run paper-2dof-nl-", ["paper-2dof-nl-large", "paper-2dof-nl-small"]),
    ("lostmotion rig schaeffler-rt1-h-2", ["schaeffler-rt1-h-20-100", "schaeffler-rt1-h-25-100"]),
    ("lostmotion run my", ["my-drive.toml"]),
    ("lostmotion run /usr/li", ["/usr/lib/"]),
])  # fmt: skip
def test_the_shell_completes_scenarios_gearboxes_and_files(tmp_path: Path, typed: str, expected: list[str]) -> None:
    (tmp_path / "my-drive.toml").touch()
    words = {"_LOSTMOTION_COMPLETE": "complete_bash", "COMP_WORDS": typed, "COMP_CWORD": str(len(typed.split()) - 1)}
    script = "from lostmotion.cli import app; app(prog_name='lostmotion')"
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, env=os.environ | words, capture_output=True, text=True, check=False)
    assert [name for name in done.stdout.split() if name in expected] == expected
    assert all(name.startswith(typed.rsplit(maxsplit=1)[-1]) for name in done.stdout.split())


def on_a_terminal(script: str, cwd: Path) -> str:
    """What a script writes to its standard error while that is a terminal."""
    leader, follower = pty.openpty()
    process = subprocess.Popen([sys.executable, "-c", script], cwd=cwd, stderr=follower, env=os.environ | {"TERM": "xterm"})
    os.close(follower)
    seen = b""
    while True:
        try:
            piece = os.read(leader, 4096)
        except OSError as error:  # the other end is closed
            assert error.errno == errno.EIO
            break
        if not piece:
            break
        seen += piece
    os.close(leader)
    assert process.wait() == 0
    return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", seen.decode())


def test_long_work_shows_what_it_does_and_short_work_nothing(tmp_path: Path) -> None:
    script = "import time; from lostmotion.cli.terminal import busy\nwith busy('Simulating'): time.sleep({})"
    assert "Simulating 0:00:0" in on_a_terminal(script.format(1.5), tmp_path)
    assert on_a_terminal(script.format(0.01), tmp_path) == ""


LONG_RUN = ("simulation.duration=1e7 s", "simulation.sample_interval=1000 s")  # ten million periods of the command


def test_a_run_of_minutes_says_so_at_once_and_is_interrupted() -> None:
    command = [sys.executable, "-m", "lostmotion", "run", SMALL, *(word for key in LONG_RUN for word in ("--set", key))]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    line = process.stderr.readline()
    assert re.fullmatch(r"Simulating: takes [0-9.]+ (s|min|h) by estimate; its first [0-9.e+]+ s have [0-9]+ switchings\n", line)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out, err) == (130, "", "lostmotion: interrupted; nothing was written\n")


@pytest.mark.parametrize("scenario", [SMALL, "worm-lowering", "position-axis"])
def test_the_length_of_a_run_is_estimated_within_a_factor(scenario: str) -> None:
    loaded = lm.load(scenario)
    duration = 20.0 * loaded.simulation.duration
    whole = loaded.replace(**{"simulation.duration": duration})
    run(whole)
    begin = time.process_time()
    run(whole)
    taken = time.process_time() - begin
    expected = forecast(whole)
    written = 1e-6 * duration / whole.simulation.sample_interval  # what samples take is not part of the estimate
    assert (taken - written) / 10.0 < expected.seconds < 10.0 * taken + 0.1
    assert 0.0 < expected.part <= whole.simulation.duration / 16.0


def test_the_estimate_sees_a_motion_that_begins_late() -> None:
    """Friction holds 0.1 N·m, the motor gives at most 0.06 until a step of 0.05 lets it move to and fro for most of the run."""
    scenario = lm.Scenario(
        shafts={"a": {"inertia": 1e-3, "friction_torque": 0.1}},
        motors={"m": {"shaft": "a", "kind": "torque_source", "rotor_inertia": 1e-4, "rated_torque": 1.0}},
        command={"m": {"amplitude": 0.06, "frequency": 5.0, "steps": [{"time": 1e3, "height": 0.05}]}},
        simulation={"duration": 1e5, "sample_interval": 100.0},
    )
    begin = time.process_time()
    run(scenario)
    taken = time.process_time() - begin
    expected = forecast(scenario)
    assert expected.part > 1e3
    assert expected.switchings > 0
    assert taken / 10.0 < expected.seconds < 10.0 * taken


def test_work_that_takes_long_prints_a_line_now_and_then(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    with terminal.progress(3, "Runs") as step:
        step()
    assert capsys.readouterr().err == ""
    assert terminal._progress(30.0, 120.0) == "about 25 %, 90 s left by estimate"
    assert terminal._progress(600.0, 7800.0) == "about 8 %, 2 h left by estimate"
    assert terminal._progress(130.0, 120.0) == "2 min so far, longer than estimated; Ctrl-C ends it"
    monkeypatch.setattr(terminal, "LONG", 0.0)
    monkeypatch.setattr(terminal, "EVERY", 0.05)
    with terminal.progress(3, "Runs") as step:
        time.sleep(0.06)
        step()
        step()
    assert re.fullmatch(r"Runs: 1 of 3, 0 s left by estimate\n", capsys.readouterr().err)
    with terminal.simulating("Simulating", lm.load(SMALL)):
        time.sleep(0.12)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0].startswith("Simulating: takes 0 s by estimate")
    assert "longer than estimated" in lines[-1]
    monkeypatch.setattr(terminal, "EVERY", 0.0)
    with terminal.busy("Identifying") as tell:
        tell("model, iteration 3")
    assert re.fullmatch(r"Identifying: model, iteration 3, [0-9.]+ s so far\n", capsys.readouterr().err)


def test_a_terminal_shows_how_far_a_long_run_has_got(tmp_path: Path) -> None:
    script = (
        "import time, lostmotion as lm\nfrom lostmotion.cli import terminal\nterminal.LONG = 0.0\n"
        f"with terminal.simulating('Simulating', lm.load({SMALL!r})): time.sleep(1.5)"
    )
    assert "longer than estimated; Ctrl-C ends it" in on_a_terminal(script, tmp_path)


def test_the_rig_reports_its_progress_to_the_end() -> None:
    from lostmotion.test_rig.measurement import WORK

    steps: list[None] = []
    gearbox = lm.load(SMALL).gearbox
    lm.test_rig.measure(gearbox, progress=lambda: steps.append(None))
    assert len(steps) == WORK


def test_a_run_of_a_million_samples_is_drawn_in_seconds() -> None:
    scenario = lm.load(SMALL).replace(**{"simulation.sample_interval": 2e-6})
    result = lm.simulate(scenario)
    assert result.sizes["time"] == 1_000_001
    begin = time.process_time()
    figure = plots.overview(result)
    figure.savefig(os.devnull, format="png")
    # All points would take 10 s on an idle machine; the thinned ones take about 1.
    assert time.process_time() - begin < 5.0
    for axes in figure.axes:
        for line in axes.lines:
            assert len(line.get_xdata()) <= thinning.MAX_POINTS + 10
    drawn = figure.axes[4].lines[0].get_ydata()
    assert np.max(drawn) == pytest.approx(10800.0 / np.pi * float(result["twist"].max()), rel=1e-15)
