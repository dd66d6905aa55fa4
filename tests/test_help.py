"""The examples of `--help`: each command has one that runs from a checkout, leaves only what it names, and prints at most a screen."""

import doctest
import importlib
import inspect
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command
from typer.testing import CliRunner

import lostmotion as lm
from conftest import ROOT
from lostmotion.cli import app
from lostmotion.namespace import homes_of

SCREEN = 40  # lines
# Commands that take minutes with any input that is worth showing; their other tests run them on less.
LONG = {"select": "1705 pairs", "identify": "three models of three logs", "reproduce": "all figures of the paper"}

DO_NOT_FIT = {("monitor",), ("servo",)}  # the axis of the one example has worn, that of the other misses its window


def commands(group: Any, prefix: tuple[str, ...] = ()) -> dict[tuple[str, ...], Any]:
    """Commands by their words, those within groups too."""
    found: dict[tuple[str, ...], Any] = {}
    for name, command in group.commands.items():
        if command.hidden:  # a former name
            continue
        if hasattr(command, "commands"):
            found |= commands(command, (*prefix, name))
        else:
            found[(*prefix, name)] = command
    return found


COMMANDS = commands(get_command(app))


def examples_of(command: Any) -> list[list[str]]:
    """Words of the examples in the help of a command, without the name of the program."""
    _, _, block = inspect.cleandoc(command.help or "").partition("\b\n")
    lines = [line.partition(" > ")[0].strip() for line in block.splitlines()]
    return [shlex.split(line)[1:] for line in lines if line.startswith("lostmotion ")]


def can_run(words: list[str]) -> bool:
    """Whether all input files that an example names are in the checkout."""
    targets = {words[k + 1] for k, word in enumerate(words[:-1]) if word in ("-o", "--plot", "--report", "--logs")}
    files = [word for word in words if word.endswith((".toml", ".csv")) and word not in targets]
    return "new" not in words[1:] and all((ROOT / file).exists() for file in files)


@pytest.mark.parametrize("name", COMMANDS, ids=" ".join)
def test_the_help_of_a_command_begins_with_what_it_is_for_and_an_example_that_runs(
    name: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, _, _, example, *_ = inspect.cleandoc(COMMANDS[name].help).splitlines()
    assert first.startswith("To ") and can_run(shlex.split(example.partition(" > ")[0])[1:])
    examples = [words for words in examples_of(COMMANDS[name]) if can_run(words)]
    if name == ("study",):
        examples = [words for words in examples if "show" not in words and "resume" not in words]
    assert examples and tuple(examples[0][: len(name)]) == name
    if name[0] in LONG:
        pytest.skip(LONG[name[0]])
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    words = [*examples[0], "--no-open"] if name == ("live",) else examples[0]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == (1 if name in DO_NOT_FIT else 0), done.output
    assert name not in DO_NOT_FIT or isinstance(done.exception, SystemExit), "an error is no verdict"
    left = {path.name for path in tmp_path.iterdir()} - {"examples"}
    assert left <= {Path(word).name for word in words} | {"drive.html", "paper-2dof-nl-small.html"}
    if name != ("schema",):  # which is for programs
        lines = done.stdout.splitlines()
        assert len(lines) <= SCREEN or name == ("scenarios",)  # of which there are more
        assert re.search(r"(lostmotion|fmpy) \w+ ", lines[-1]), "the next command is the last line"
        assert not re.search(r"-0(\.0+)? ", done.stdout)
        numbers = re.findall(r"\d+\.\d+", done.stdout)
        assert [n for n in numbers if len(n.replace(".", "").lstrip("0")) > 5] == [], "digits that no one reads"


def test_the_summaries_of_commands_fit_on_a_line() -> None:
    listed = CliRunner().invoke(app, ["--help"]).stdout
    assert not re.search(r"\w\.\.\.$", listed, re.MULTILINE)
    assert all(len(line) <= 80 for line in listed.splitlines())


@pytest.mark.parametrize("kind", ["strain_wave", "planetary", "motor", "screw", "belt", "rack"])
def test_a_list_of_the_catalogue_fits_on_a_screen_unless_all_is_asked_for(kind: str) -> None:
    lines = CliRunner().invoke(app, ["catalogue", "--kind", kind]).stdout.splitlines()
    assert len(lines) <= SCREEN
    whole = CliRunner().invoke(app, ["catalogue", "--kind", kind, "--all"]).stdout.splitlines()
    more = [int(line.split()[0]) for line in lines if line.endswith(" more: add --all, or narrow the list")]
    assert len(whole) == len(lines) + sum(more) - len(more)


UNASKED = [
    ("response", "paper-2dof-nl-small", "--amplitudes", "0.025,1", "--frequencies", "1,2,3"),
    ("rig", "schaeffler-rt1-h-20-100"),
    ("run", "paper-2dof-nl-small"),
    ("check", "catalogue-robot-joint"),
    ("reproduce",),
    ("monitor", str(ROOT / "examples" / "wear" / "monitor.toml")),
]


@pytest.mark.parametrize("call", UNASKED, ids=lambda call: call[0])
def test_a_command_writes_only_what_it_is_asked_for_and_names_the_next_one(
    call: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(app, list(call))
    assert done.exit_code == (1 if call[0] == "monitor" else 0), done.output  # the example of wear has worn
    assert list(tmp_path.iterdir()) == []
    lines = done.stdout.splitlines()
    assert len(lines) <= SCREEN
    assert "lostmotion " in lines[-1]
    assert not re.search(r"[-+]?\d(\.\d+)?e-1[2-9]", done.stdout), "rounding is printed as 0"
    if call[0] == "run":
        for command, name in (("study", "tolerance"), ("select", "select-axis")):  # which resume, from the directory of their runs
            done = CliRunner().invoke(app, [command, str(ROOT / "examples" / f"{name}.toml")])
            assert f"name the directory of the runs, as in `-o {name}`" in str(done.exception)
        assert list(tmp_path.iterdir()) == []


# --- docstrings of the public names ---
SPACES = [name for name, home in homes_of("lostmotion").items() if home == "lostmotion"]


def public_names() -> Iterator[tuple[str, Any]]:
    """Dotted names below `lostmotion` with their values."""
    for name in homes_of("lostmotion"):
        if name not in (*SPACES, "__version__"):
            yield name, getattr(lm, name)
    for space in SPACES:
        module = importlib.import_module(f"lostmotion.{space}")
        for name in homes_of(module.__name__):
            yield f"{space}.{name}", getattr(module, name)


FUNCTIONS = {name: value for name, value in public_names() if callable(value) and not inspect.isclass(value)}
CLASSES = {name: value for name, value in public_names() if inspect.isclass(value)}


def sections_of(thing: Any) -> dict[str, str]:
    """Sections of a numpydoc docstring by their headings, and the text above them as the empty one."""
    parts = re.split(r"^(\w+)\n-{3,}\n", inspect.getdoc(thing) or "", flags=re.MULTILINE)
    return {"": parts[0], **dict(zip(parts[1::2], parts[2::2], strict=True))}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_function_states_parameters_returns_errors_and_an_example(name: str) -> None:
    function = inspect.unwrap(FUNCTIONS[name])
    sections = sections_of(function)
    parameters = list(inspect.signature(function).parameters)
    assert sections["Returns"].strip() and ">>> " in sections["Examples"]
    if parameters:
        described = re.findall(r"^(\w[\w, ]*?)(?: : .*)?$", sections["Parameters"], re.MULTILINE)
        assert [word for line in described for word in line.split(", ")] == parameters
        assert sections["Raises"].strip()


EXAMPLES = [name for name, value in {**FUNCTIONS, **CLASSES}.items() if ">>> " in (inspect.getdoc(value) or "")]


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_prints_what_it_shows(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if name.startswith("mujoco."):
        pytest.importorskip("mujoco", reason='pip install "lostmotion[mujoco]"')
    if name.startswith("warp."):
        pytest.importorskip("warp", reason='pip install "lostmotion[warp]"')
    monkeypatch.chdir(ROOT)
    thing = inspect.unwrap({**FUNCTIONS, **CLASSES}[name])
    example = doctest.DocTestParser().get_doctest(inspect.getdoc(thing) or "", {"lm": lm}, name, None, None)
    told: list[str] = []
    failed, tried = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE).run(example, out=told.append)
    assert tried and not failed, "".join(told)


def test_few_examples_are_skipped() -> None:
    skipped = [name for name in EXAMPLES if "+SKIP" in (inspect.getdoc({**FUNCTIONS, **CLASSES}[name]) or "")]
    assert skipped == ["select"]  # it takes a minute
    assert (ROOT / "examples" / "select-axis.toml").exists()
