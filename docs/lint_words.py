"""`make lint-words`: warns of long sentences, words of our own and long texts in what readers see. Nothing fails by it."""

import ast
import json
import re
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "src" / "lostmotion"
LONGEST = 30  # words of a sentence
MESSAGE = 200  # characters of an error
SCREEN = 50  # lines of a function, without its heading and docstring
NO_SUBJECT = ("of", "what", "where", "that", "those", "whose", "how", "who", "which", "as")
"""words with which no sentence of a docstring begins"""

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
    r"in plain words": "nothing",
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
WORD = re.compile(r"[\w'’°%µ/.,-]*\w[\w'’°%µ/.,-]*")


def paragraphs(page: str) -> Iterator[str]:
    """Paragraphs and list items of Markdown, each on one line, without code, tables, headings and formulas."""
    lines: list[str] = []
    fence, formula = "", False
    for line in [*page.split("\n"), ""]:
        text = line.strip()
        opening = re.match(r"\s*(```+|:::+)", line)
        item = re.match(r"\s*([-*]|\d+\.) ", line)
        if fence:
            fence = "" if text.startswith(fence) and set(text) <= set("`:") else fence
            continue
        if opening and not text.startswith("```{glossary}"):
            fence = opening.group(1)
        if text.startswith("$$") and text.count("$$") == 1:
            formula = not formula
        skipped = bool(opening) or formula or text.startswith(("$$", "|", "#", "<", "![", ">"))
        code = line.startswith("    ") and not lines
        if lines and (not text or item or skipped):
            yield " ".join(lines)
            lines = []
        if text and not skipped and not code:
            lines.append(line[item.end() :].strip() if item else text)


def words_of(sentence: str) -> list[str]:
    """Words of a sentence; a piece of code or a formula is one word, a link is its text."""
    shown = re.sub(r"`[^`]*`|\$[^$]+\$", "code", sentence.replace("``", "`"))
    return WORD.findall(re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", shown))


def sentences(page: str) -> Iterator[str]:
    """Sentences of a page."""
    for paragraph in paragraphs(page):
        masked = re.sub(r"`[^`]*`|\$[^$]+\$|\]\([^)]*\)", lambda m: "\0" * len(m.group(0)), paragraph)
        ends = [m.end() for m in re.finditer(r"(?<=[.!?])[\"*)]*\s+(?=[A-Z\"(*\[\0])", masked)]
        for begin, end in zip([0, *ends], [*ends, len(paragraph)], strict=True):
            if len(words_of(paragraph[begin:end])) >= 3:
                yield paragraph[begin:end].strip()


def of_prose(text: str) -> Iterator[str]:
    for sentence in sentences(text):
        words = words_of(sentence)
        if len(words) > LONGEST:
            yield f"{len(words)} words: {sentence}"
        if words[0] in ("Of", "Where", "What") and not sentence.endswith("?"):
            yield f"begins with a relative clause: {sentence}"


def length_of(node: ast.AST) -> int:
    """Characters of a text in the code; a value that is filled in counts as eight."""
    own = len(node.value) if isinstance(node, ast.Constant) and isinstance(node.value, str) else 0
    if isinstance(node, ast.FormattedValue):
        return 8
    return own + sum(map(length_of, ast.iter_child_nodes(node)))


def of_code(code: str) -> Iterator[str]:
    """Docstrings, messages and functions of a module."""
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Raise) and (length := length_of(node)) > MESSAGE:
            yield f"line {node.lineno}: a message of {length} characters"
        if not isinstance(node, ast.FunctionDef | ast.ClassDef | ast.Module):
            continue
        # Entries of sections, lines of parameters and examples of commands are no sentences.
        text = re.split(r"^\w+\n-{3,}\n|^[a-z_][\w, ]*: |\x08", ast.get_docstring(node) or "", flags=re.MULTILINE)[0]
        yield from of_prose(text)
        if text.partition(" ")[0].lower() in NO_SUBJECT:
            yield f"begins without its subject: {text.splitlines()[0]}"
        if (
            isinstance(node, ast.FunctionDef)
            and (node.end_lineno or 0) - node.body[len(node.body) > 1 and bool(ast.get_docstring(node))].lineno
            >= SCREEN
        ):
            yield f"line {node.lineno}: {node.name} does not fit on a screen"


def of_page(path: Path, text: str) -> Iterator[str]:
    if path.suffix == ".ipynb":
        cells = json.loads(text)["cells"]
        text = "\n\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    elif path.suffix == ".toml":
        text = "\n".join(line.lstrip("# ") if line.startswith("#") else "" for line in text.splitlines())
    yield from of_prose(text)
    lines = text.splitlines()
    most = {"README.md": 80, "CHANGELOG.md": 60}.get(path.name)
    if most is not None and (len(lines) > most or max(map(len, lines)) > 120):
        yield f"has {len(lines)} lines, the longest of {max(map(len, lines))} characters; {most} and 120 are enough"
    opening = (
        " ".join(text.partition("\n\n")[2].partition("\n\n")[0].split())
        if path.parent.name == "docs" and path.suffix == ".md"
        else ""
    )
    if opening and not re.match(r"This (page|site|tutorial) .*( for |lists)", opening):
        yield f"does not say for whom it is: {opening}"


def warnings() -> Iterator[tuple[Path, str]]:
    docs = [path for path in (ROOT / "docs").rglob("*.*") if not {"_generated", "_build"} & set(path.parts)]
    pages = [*ROOT.glob("*.md"), *(path for path in docs if path.suffix in (".md", ".ipynb"))]
    pages += (ROOT / "scenarios").glob("*.toml")
    code = list(PACKAGE.rglob("*.py"))
    for path in sorted({*pages, *code, *PACKAGE.rglob("*.jinja"), *PACKAGE.rglob("*.toml")}):
        text = path.read_text(encoding="utf-8")
        own = of_code(text) if path in code else of_page(path, text) if path in pages else ()
        yield from ((path, warning) for warning in own)
        for wrong, right in PLAIN_WORDS.items():
            for found in re.finditer(wrong, re.sub(FORMER, "", text)):
                yield path, f"{found.group(0)!r}; write: {right}"


if __name__ == "__main__":
    for path, warning in warnings():
        print(f"{path.relative_to(ROOT)}: {warning:.200}")
