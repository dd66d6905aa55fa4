"""How README, documentation, docstrings and messages are written: short sentences, words of the field."""

import ast
import importlib
import json
import re
from pathlib import Path
from statistics import mean

import pytest

from conftest import ROOT
from prose import sentences, words_of

PACKAGE = ROOT / "src" / "lostmotion"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
PAGES = [page for page in PAGES if not {"_generated", "_build"} & set(page.parts)]
MODULES = sorted(PACKAGE.rglob("*.py"))

LONGEST = 30  # words of a sentence
AVERAGE = 18


def check_sentences(text: str) -> None:
    """No sentence is long, and none begins with a relative clause."""
    found = list(sentences(text))
    assert [s for s in found if len(words_of(s)) > LONGEST] == []
    openings = [s for s in found if words_of(s)[0] in ("Of", "Where", "What") and not s.endswith("?")]
    assert openings == [], "subject first, then verb"


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_no_sentence_is_long_and_none_begins_with_a_relative_clause(page: Path) -> None:
    check_sentences(page.read_text())


@pytest.mark.parametrize("scenario", sorted((ROOT / "scenarios").glob("*.toml")), ids=lambda p: p.stem)
def test_sentences_of_a_scenario_are_short(scenario: Path) -> None:
    lines = (line.lstrip("# ") if line.startswith("#") else "" for line in scenario.read_text().splitlines())
    check_sentences("\n".join(lines))


@pytest.mark.parametrize("notebook", sorted((ROOT / "docs" / "notebooks").glob("*.ipynb")), ids=lambda p: p.stem)
def test_sentences_of_a_notebook_are_short(notebook: Path) -> None:
    cells = json.loads(notebook.read_text())["cells"]
    check_sentences("\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown"))


@pytest.mark.parametrize("name", ["scenario_reference", "train_reference", "variables", "commands"])
def test_sentences_of_a_generated_page_are_short(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(ROOT / "docs")
    check_sentences(getattr(importlib.import_module("generate"), name)())


@pytest.mark.parametrize("module", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_sentences_of_docstrings_are_short(module: Path) -> None:
    """Those above the sections, whose entries are no sentences, and above examples of commands."""
    for node in ast.walk(ast.parse(module.read_text())):
        if isinstance(node, ast.FunctionDef | ast.ClassDef | ast.Module):
            text = re.split(r"^\w+\n-{3,}\n|\x08", ast.get_docstring(node) or "", flags=re.MULTILINE)[0]
            assert [s for s in sentences(text) if len(words_of(s)) > LONGEST] == []


def test_sentences_are_short_on_average() -> None:
    lengths = {page.name: [len(words_of(s)) for s in sentences(page.read_text())] for page in PAGES}
    assert mean(n for found in lengths.values() for n in found) < AVERAGE
    assert all(mean(lengths[name]) < AVERAGE for name in ("README.md", "get-started.md", "index.md", "tutorial.md"))


def test_long_sentences_are_recognised() -> None:
    page = "Of the input, `a. b` [c](d. e).\n\n- One two three. " + "Word " * 31 + ".\n\n```sh\none two three\n```\n"
    found = list(sentences(page))
    assert [len(words_of(s)) for s in found] == [5, 3, 31]


def test_the_change_log_lists_what_a_release_has() -> None:
    lines = (ROOT / "CHANGELOG.md").read_text().splitlines()
    assert len(lines) <= 60  # of 0.1.0 alone; a longer one has become a diary
    assert [line for line in lines if len(line) > 120] == []


def length_of(node: ast.expr) -> int:
    """Characters of a text in the code; a value that is filled in counts as eight."""
    match node:
        case ast.Constant(value=str(text)):
            return len(text)
        case ast.JoinedStr(values=parts):
            return sum(map(length_of, parts))
        case ast.FormattedValue():
            return 8
        case ast.BinOp(left=left, op=ast.Add(), right=right):
            return length_of(left) + length_of(right)
    return 0


@pytest.mark.parametrize("module", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_messages_have_at_most_200_characters_and_docstrings_begin_with_a_noun_or_a_verb(module: Path) -> None:
    for node in ast.walk(ast.parse(module.read_text())):
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
            assert all(length_of(text) <= 200 for text in node.exc.args), f"line {node.lineno}"
        if isinstance(node, ast.FunctionDef | ast.ClassDef | ast.Module):
            words = (ast.get_docstring(node) or "None").split()
            assert words[0] not in ("Of", "What", "Where", "That", "Those", "Whose", "How", "Who", "Which", "As"), (
                " ".join(words[:12])
            )
        if isinstance(node, ast.ClassDef):
            for field, text in zip(node.body, node.body[1:], strict=False):
                if (
                    isinstance(field, ast.AnnAssign)
                    and isinstance(text, ast.Expr)
                    and isinstance(text.value, ast.Constant)
                ):
                    words = str(text.value.value).split()
                    assert words[0] not in ("of", "what", "where", "that", "those", "whose", "how", "who"), " ".join(
                        words
                    )


# Phrases of our own, and what is written in their place.
PLAIN_WORDS = {
    r"go(es)? on where": "resume",
    r"hand-?over": "export",
    r"what matters": "selected results",
    r"rises? without end": "thermal runaway",
    r"the other way backward": "in reverse",
    r"truth value": "Boolean",
    r"\ba look tests|between two looks": "each check covers",
    r"\bsoft (mesh|zone)": "mesh compliance, low stiffness",
    r"\bone's own": "your own",
    r"nothing beside": "self-contained",
    r"in plain words": "",
    r"\b[Mm]akers?\b": "manufacturer",
    r"\b[Rr]eckon": "compute",
    r"\bcannot be told\b": "cannot be determined",
    r"\bvirgin": "initial loading",
    r"\bknots?\b": "breakpoint",
    r"\bheld[ _]torque": "locked torque",
    r"\b(stands?|standing) still": "at rest",
    r"\b(own|printed|missing) figures?\b|\bfigures? of (a|the|your) (data )?sheet": "datum, data, value",
    r"\bby and by\b": "by a low-pass filter",
    r"\bhonest": "state what was found",
    r"(?<!/)\breferee\b": "reference solver",
    r"\bin the place of\b": "in place of",
    r"\bis no number\b": "is not a number",
    r"\bgo(es)? along with\b": "follow",
    r"\bhang together\b": "form one rigid group",
    r"\b(servo|pointing) sheet\b": "report",
    r"[Ww]hat the logs cannot tell": "unidentifiable parameters",
    r"\bthat of the other side of\b": "the ratio of",
    r"does not stand beside": "is not allowed beside",
    r"as it likes": "depends on the contact state",
    r"\bgrows? without end\b": "without limit",
}
FORMER = r"""[`"](maker|virgin_\.\.\.|held_torque)[`"]"""  # names that were, and are still read


def texts() -> dict[Path, str]:
    """All that is written for readers, by file."""
    files = [*PAGES, *(ROOT / "scenarios").glob("*.toml")]
    files += [path for ending in ("py", "jinja", "toml") for path in PACKAGE.rglob(f"*.{ending}")]
    return {path: re.sub(FORMER, "", path.read_text()) for path in files}


TEXTS = texts()


@pytest.mark.parametrize("wrong", PLAIN_WORDS)
def test_the_prose_uses_the_words_of_the_field(wrong: str) -> None:
    lines = [(path.name, line.strip()) for path, text in TEXTS.items() for line in text.splitlines()]
    assert [(name, line) for name, line in lines if re.search(wrong, line)] == [], PLAIN_WORDS[wrong]
