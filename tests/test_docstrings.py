"""Docstrings of the public names: their sections, and examples that print what they show."""

import doctest
import importlib
import inspect
import re
from collections.abc import Iterator
from typing import Any

import pytest

import lostmotion as lm
from conftest import ROOT
from lostmotion.namespace import homes_of

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
