"""What README and documentation show is true."""

import importlib
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest

import lostmotion as lm
from conftest import ALL_SCENARIOS, ROOT, lostmotion
from lostmotion.cli import app as lm_app
from lostmotion.simulation.forms.train_tables import TrainTables


def test_the_first_identification_prints_what_the_page_shows() -> None:
    page = (ROOT / "docs" / "identification.md").read_text()
    file, shown = re.findall(r"```toml\n(.*?)```", page, re.S)[0], re.findall(r"```text\n(.*?)```", page, re.S)[0]
    assert file == (ROOT / "examples" / "wear" / "identify.toml").read_text()
    command, *lines = shown.splitlines()
    done = lostmotion(*shlex.split(command.removeprefix("$ lostmotion ")), cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert [line for line in lines if line.strip() != "..." and line not in done.stdout.splitlines()] == []
    found = lm.identify(ROOT / "examples" / "wear" / "identify.toml")
    assert found.values == pytest.approx({"friction": 0.1, "viscous": 0.02}, rel=0.03)  # of which the logs were made
    lm.simulate(found.scenario.replace(**{"command.drive": {"mean": 0.2}}))


def test_the_tutorial_can_be_followed(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "tutorial.md").read_text()
    sheet, drive, changed = re.findall(r"```toml\n(.*?)```", page, re.S)
    commands = re.findall(r"^lostmotion (.*)$", "\n".join(re.findall(r"```sh\n(.*?)```", page, re.S)), re.M)
    assert len(commands) == 8

    def run(command: str) -> str:
        done = lostmotion(*shlex.split(command), cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        return done.stdout

    run(commands[0])
    template = (tmp_path / "my-gearbox.toml").read_text()
    assert 'kind = "planetary"' in template
    (tmp_path / "my-gearbox.toml").write_text(sheet)
    (tmp_path / "my-drive.toml").write_text(drive)
    printed = [run(command) for command in commands[1:]]
    assert "hysteresis loss" in printed[0]
    assert "holds 3.89 N·m" in printed[1]
    assert (tmp_path / "rig" / "rig.html").exists()
    assert (tmp_path / "my-drive.png").exists()
    assert "input_contact: stuck" in printed[4]
    assert "motor first_motor: its shaft turns forward with a constant command above" in printed[6]
    (tmp_path / "changed.toml").write_text(changed)
    assert lm.load(tmp_path / "changed.toml").load.inertia == 3.0
    result = lm.simulate(lm.load(tmp_path / "my-drive.toml"))
    assert float(abs(result["load_speed"]).max()) > 0.1
    (tmp_path / "my-drive.toml").write_text(drive.replace("friction_torque =", "friction_torqe ="))
    done = lostmotion("run", "my-drive.toml", cwd=tmp_path)
    shown = re.search(r"^lostmotion: my-drive.toml.*$", page, re.M)
    assert shown is not None
    assert done.stderr.strip() == shown.group(0)


def test_the_readme_s_python_prints_what_it_shows(tmp_path: Path) -> None:
    page = (ROOT / "README.md").read_text()
    code, shown = re.search(r"```python\n(.*?)```", page, re.S), re.search(r"```text\n(.*?)```", page, re.S)
    assert code is not None and shown is not None
    done = subprocess.run([sys.executable, "-c", code.group(1)], cwd=tmp_path, check=True, capture_output=True, text=True)
    assert done.stdout == shown.group(1)


def test_the_readme_s_second_picture_is_described_by_its_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "docs")
    figures = importlib.import_module("tracking_figures")
    models = ("constant efficiency of 0.9", "loss map")
    constant, mapped = (figures.peak_error(figures.axis(0.01, figures.MODELS[name][0]), 12.0) for name in models)
    assert f"at 0.01 rad/s, {round(constant / mapped, -1):.0f} times less error" in (ROOT / "README.md").read_text()


def commands_in(page: str) -> list[str]:
    """The commands of the shell in a page, without their comments."""
    blocks = "\n".join(re.findall(r"```sh\n(.*?)```", (ROOT / page).read_text(), re.S))
    return [line.split("  #")[0].strip() for line in re.findall(r"^lostmotion (.*)$", blocks, re.M)]


def test_the_first_commands_run(tmp_path: Path) -> None:
    for command in commands_in("docs/drive-check.md"):
        assert lostmotion(*shlex.split(command), cwd=tmp_path).returncode == 0, command
    pages = ["README.md", "docs/get-started.md"]
    commands = commands_in(pages[0])
    assert len(commands) == 4
    assert commands_in(pages[1]) == commands[:3]
    printed = []
    for command in commands:
        done = lostmotion(*shlex.split(command), cwd=tmp_path)
        misses = "does not fit: stable, but misses the window" in done.stdout  # the verdict on the axis, which is no error
        assert misses == command.startswith("servo ")
        assert done.returncode == (1 if misses else 0), done.stderr
        printed.append(done.stdout)
    assert (tmp_path / "run.png").exists()
    assert [path.name for path in tmp_path.iterdir()] == ["run.png"]  # nothing is written that was not asked for
    assert "All charts on a page: lostmotion rig schaeffler-rt1-h-20-100 -o rig" in printed[1]
    for page in pages[1:]:
        for shown in re.findall(r"```text\n(.*?)```", (ROOT / page).read_text(), re.S):
            for line in shown.strip().splitlines():
                assert line.strip() == "..." or line in printed[0]


def test_every_extra_is_explained_on_the_home_page() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    page = (ROOT / "docs" / "get-started.md").read_text()
    assert set(re.findall(r"^\| `(\w+)` \|", page, re.M)) == set(extras) - {"all"}


@pytest.fixture
def generate(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(ROOT / "docs")
    return importlib.import_module("generate")


def test_committed_pages_are_those_that_the_code_makes(generate: Any) -> None:
    made = dict(generate.pages())
    for name, text in made.items():
        shown = (generate.OUT / name).read_text(encoding="utf-8")
        assert shown == text, f"docs/reference/{name} is old: run python docs/generate.py"
    assert {p.relative_to(generate.OUT).as_posix() for p in generate.OUT.rglob("*.md")} == set(made)
    shown = {(page.parent / link).resolve() for page in PAGES for link in links_of(page)}
    assert {path for path in (ROOT / "docs" / "images").rglob("*.*") if path.suffix != ".py"} <= shown
    assert {p.stem for p in (generate.IMAGES / "gallery").glob("*.png")} == set(lm.shipped_scenarios())
    assert {generate.topic_of(name) for name in lm.shipped_scenarios()} == set(generate.TOPICS)


PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
PAGES = [page for page in PAGES if not {"_build", "_generated"} & set(page.parts)]


def without_code(text: str) -> str:
    return re.sub(r"```.*?```|`[^`\n]*`", lambda code: "`x`" if "\n" not in code[0] else "", text, flags=re.S)


def anchors_of(page: Path, anchors: Any) -> set[str]:
    """Fragments of the headings of a page, as GitHub and the site make them."""
    lines = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.S).splitlines()
    headings = [line.lstrip("# ") for line in lines if re.match("#+ ", line)]
    return set(anchors([re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading) for heading in headings]))


def links_of(page: Path) -> list[str]:
    found = re.findall(r"\]\(([^()\s]+)\)", without_code(page.read_text(encoding="utf-8")))
    return [link for link in found if not re.match(r"https?:|mailto:", link)]


@pytest.mark.parametrize("page", PAGES, ids=[page.relative_to(ROOT).as_posix() for page in PAGES])
def test_each_link_and_picture_of_a_page_is_in_the_checkout(page: Path, generate: Any) -> None:
    tracked = {ROOT / name for name in git("ls-files", "--cached", "--others", "--exclude-standard").splitlines()}
    directories = {parent for path in tracked for parent in path.parents}
    for link in links_of(page):
        name, _, anchor = link.partition("#")
        target = (page.parent / name).resolve() if name else page
        assert target in tracked | directories, f"{link}: no such file"
        assert not anchor or anchor in anchors_of(target, generate.api_pages.anchors), f"{link}: no such heading"
    if page.name != "contributing.md":  # the site's copy of CONTRIBUTING.md
        assert "{include}" not in page.read_text(), "text that a checkout does not show"


def git(*words: str) -> str:
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout


def test_every_page_is_in_one_part_of_the_site() -> None:
    home = (ROOT / "docs" / "index.md").read_text()
    parts = re.findall(r":caption: ([^\n]*)\n\n(.*?)```", home, re.S)
    assert [caption for caption, _ in parts] == ["Get started", "Tutorials", "How-to", "Explanation", "Reference"]
    listed = [page for _, pages in parts for page in pages.split()]
    listed += re.findall(r"^(contributing|verification)$", (ROOT / "docs" / "developers.md").read_text(), re.M)
    assert len(listed) == len(set(listed))
    assert {p.stem for p in (ROOT / "docs").glob("*.md")} - {"index"} <= set(listed)
    assert {f"notebooks/{p.stem}" for p in (ROOT / "docs" / "notebooks").glob("*.ipynb")} <= set(listed)


def test_generated_pages_name_every_key_and_variable(generate: Any) -> None:
    commands = generate.commands()
    for name, command in generate._commands_of(generate.get_command(lm_app), "lostmotion"):
        assert f"## `{name}`" in commands
        section = commands.split(f"## `{name}`\n")[1].split("\n## ")[0]
        for parameter in command.params:
            for option in parameter.opts if parameter.param_type_name == "option" else [parameter.metavar.split(" ")[0]]:
                assert option == "--help" or option in section
    for path in ALL_SCENARIOS:
        assert generate.introduction(path), f"{path} needs a comment below its title, for the gallery"
    reference = generate.scenario_reference()
    for table in ("command", "motor", "gearbox", "gearbox.stiffness", "gearbox.hysteresis", "gearbox.losses", "load", "simulation"):
        assert f"[{table}" in reference
    for key in (*lm.Motor.model_fields, *lm.Gearbox.model_fields, *lm.Load.model_fields, *lm.model.LossMap.model_fields):
        assert f"| `{key}` |" in reference
    of_trains = generate.train_reference()
    parts = (lm.Shaft, lm.ShaftMotor, lm.Gear, lm.model.WormMesh, lm.model.MeshEfficiency, lm.Brake, lm.Clutch, lm.Freewheel)
    for key in (*TrainTables.model_fields, *(key for part in (*parts, lm.model.Gravity) for key in part.model_fields)):
        assert f"| `{key}` |" in of_trains
    for variable in lm.simulation.VARIABLES:
        assert f"| `{variable.name}` |" in generate.variables()


@pytest.fixture
def quotes(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    return importlib.import_module("quotes")


RESULTS = (ROOT / "benchmarks" / "RESULTS.md").read_text()


def test_times_that_pages_quote_are_those_of_the_benchmark(quotes: Any) -> None:
    pages = {quote.page for quote in quotes.QUOTES}
    assert {"README.md", "docs/live.md"} <= pages
    for page in pages:
        text = (ROOT / page).read_text()
        assert quotes.renewed(page, text, quotes.Results(RESULTS)) == text, "run python benchmarks/quotes.py"


def test_a_new_benchmark_changes_the_quotes(quotes: Any) -> None:
    def changed(what: str, into: str) -> str:
        line = next(line for line in RESULTS.splitlines() if line.startswith(what))
        renewed = RESULTS.replace(line, re.sub(r"[\d.]+(?= \|| *s\.$)", into, line, count=1))
        assert renewed != RESULTS
        return quotes.renewed("README.md", (ROOT / "README.md").read_text(), quotes.Results(renewed))

    assert "| 0.26 ms in the core" in changed("| C++: exact, same drive again, AVX2 ", "0.2551")
    assert "480 periodic motions | 0.99 s |" in changed("| 480 points by shooting, 2 threads", "987")
    assert "on disk | 77 s |" in changed("100,000 runs of 1 s on 2 cores", "77.3")
    with pytest.raises(ValueError, match="there must be one"):
        quotes.renewed("README.md", "", quotes.Results(RESULTS))


THEORY = (ROOT / "docs" / "theory.md").read_text()
ROWS = [line.strip("| ").split(" | ") for line in THEORY.splitlines() if re.match(r"\| .*`\w+\.(hpp|py)`|\| .*`\w+/", line)]


def test_every_numbered_equation_of_the_theory_is_in_its_table() -> None:
    text, table = THEORY.split("## Where each equation is")
    numbered = set(re.findall(r"(?<!\^\{)\((\d+[ab]?)\)", text))  # and not the order of a derivative
    assert len(numbered) >= 10
    assert numbered == set(re.findall(r"\((\d+[ab]?)\)", "".join(row[0] for row in ROWS)))
    assert len(ROWS) == len(re.findall(r"^\|", table, re.M)) - 2


@pytest.mark.parametrize("equation, where, test", ROWS, ids=[row[0] for row in ROWS])
def test_the_table_of_equations_names_functions_and_tests_that_exist(equation: str, where: str, test: str) -> None:
    file, *functions = re.findall(r"`([^`]+)`", where)
    home = ROOT / ("core" if file.endswith((".hpp", ".cpp")) else "src") / "lostmotion"
    home = ROOT / "core" if file.startswith("kernels/") else home
    code = re.sub(r"//.*|#.*", "", (home / file).read_text())
    assert functions
    for function in functions:
        # Defined there, not only called: nothing but a type, or `def`, in front of it.
        assert re.search(rf"^(?!.*\breturn )[\w:<>&*,\[\] ]*[\w>&*\]] (?:[\w<>]+::)?{function}\(", code, re.M), function
    file, *names = re.findall(r"`([^`]+)`", test)
    if file.endswith(".cpp"):
        titles = re.findall(r'TEST_CASE\("(.*?)"\)', (ROOT / "core" / "tests" / file).read_text())
        assert re.findall(r'"(.*)"', test)[0] in titles
    else:
        assert names and all(f"def {name}(" in (ROOT / "tests" / file).read_text() for name in names)


def test_the_loss_map_of_the_page_has_the_efficiencies_that_it_names(tmp_path: Path) -> None:
    page = (ROOT / "docs" / "catalogue-data.md").read_text().partition("## A loss map of your own")[2]
    text = re.findall(r"```toml\n(.*?)```", page, re.S)[0]
    (tmp_path / "own.toml").write_text('base = "paper-2dof-nl-large"\n' + text)
    losses = lm.load(tmp_path / "own.toml").gearbox.losses
    assert isinstance(losses, lm.model.LossMap)
    for load, row, told in zip(losses.loads[1:], losses.values[1:], re.findall(r"of (0\.\d+), (0\.\d+) and (0\.\d+)", text), strict=True):
        assert [load / (load + loss) for loss in row] == pytest.approx([float(v) for v in told], abs=1e-4)
