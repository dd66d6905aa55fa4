"""Sentences of Markdown pages, as a reader sees them: without code blocks, tables, headings, formulas and link targets."""

import re
from collections.abc import Iterator

WORD = re.compile(r"[\w'’°%µ/.,-]*\w[\w'’°%µ/.,-]*")


def paragraphs(page: str) -> Iterator[str]:
    """Paragraphs and list items, each on one line."""
    lines: list[str] = []
    fence, formula = "", False
    for line in [*page.split("\n"), ""]:
        text = line.strip()
        opening = re.match(r"\s*(```+|:::+)", line)
        item = re.match(r"\s*([-*]|\d+\.) ", line)
        if fence:
            if text.startswith(fence) and set(text) <= set("`:"):
                fence = ""
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
    shown = re.sub(r"\$[^$]+\$", "x", sentence.replace("``", "`"))
    shown = re.sub(r"`[^`]*`", "code", shown)
    shown = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", shown)
    return WORD.findall(shown)


def sentences(page: str) -> Iterator[str]:
    """Sentences of a page."""
    for paragraph in paragraphs(page):
        masked = re.sub(r"`[^`]*`|\$[^$]+\$|\]\([^)]*\)", lambda m: "\0" * len(m.group(0)), paragraph)
        ends = [m.end() for m in re.finditer(r"(?<=[.!?])[\"*)]*\s+(?=[A-Z\"(*\[\0])", masked)]
        for begin, end in zip([0, *ends], [*ends, len(paragraph)], strict=True):
            if len(words_of(paragraph[begin:end])) >= 3:
                yield paragraph[begin:end].strip()
