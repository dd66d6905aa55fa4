"""Pages of results: a verdict, the figures that support it, tables with units. One self-contained file each, with its data."""

import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path

import numpy as np

from ..atomic_writer import write_bytes
from ..errors import InputError
from ..portable.checkout import made_here
from ..verdict import State, Verdict
from .packed import packed
from .panels import Bars, Chart, Contacts, Drawing, Flows, Ground, Group, Histogram, Matrix, Panel
from .svg_charts import svg_of, swatch

HERE = Path(__file__).parent
SCRIPT = HERE / "report.js"  # `make page-report` puts it there, and the wheel carries it
NO_SCRIPT = (
    "The charts do not move on this page: its script was not built. `make page-report` builds it; it needs node."
)
STILL = 40  # charts of a page from which on they are not drawn for readers without JavaScript
COLOURS: dict[State, str] = {
    "fits": "fits",
    "fits with a reservation": "reserved",
    "does not fit": "misses",
    "not decided": "undecided",
}
ALIKE = re.compile(r"[+\-−±]?(\d|\.\d|nan|inf)")


class Html(str):
    """Text that is already HTML."""


@dataclass(frozen=True)
class Table:
    """Rows of text; units are in the header or the cells."""

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""
    marked: frozenset[int] = frozenset()  # rows that say what is wrong
    chosen: frozenset[int] = frozenset()  # rows that stand out


@dataclass(frozen=True)
class Prose:
    """Paragraphs, or a list of lines."""

    title: str
    paragraphs: Sequence[str]
    listed: bool = False
    noted: bool = False  # set apart as notes


Part = Table | Prose | Group


def _content(part: Part) -> Sequence[object]:
    """Rows, paragraphs or charts of a part."""
    return part.rows if isinstance(part, Table) else part.paragraphs if isinstance(part, Prose) else part.charts


@dataclass(frozen=True)
class Report:
    """The parts of a page, in their order."""

    title: str
    lead: str
    verdict: Verdict | tuple[str, ...]
    """in at most three lines; lines alone where nothing is asked, so that there is nothing to judge"""
    main: Group
    parts: Sequence[Part]  #: parts below; empty ones are left out
    file: str = "report.html"  # its name in a directory
    tables: Mapping[str, str] = field(default_factory=dict)  # text of the CSV files beside it, by their names

    def __post_init__(self) -> None:
        object.__setattr__(self, "parts", tuple(part for part in self.parts if _content(part)))

    def groups(self) -> list[Group]:
        """All groups of charts."""
        return [self.main, *(part for part in self.parts if isinstance(part, Group))]

    def _repr_html_(self) -> str:
        return framed(render(self))


def framed(page: str, height: int = 900) -> str:
    """A page inside another one, as notebooks show it."""
    return f'<iframe srcdoc="{escape(page)}" style="width: 100%; height: {height}px; border: none"></iframe>'


def render(report: Report) -> str:
    """The page as HTML; nothing in it refers to anything outside."""
    charts: list[Chart] = []
    parts = [verdict(report.verdict)]
    parts += [
        _group(part, charts) if isinstance(part, Group) else _words(part) for part in (report.main, *report.parts)
    ]
    return document(report.title, report.lead, "\n".join(parts), charts)


def verdict(found: Verdict | tuple[str, ...]) -> str:
    """Verdict of a report as HTML, its heading and colour by its state; a result where nothing is judged."""
    if isinstance(found, Verdict):
        kind, heading, lines = COLOURS[found.state], f"Verdict: {found.heading}", found.lines
    else:
        kind, heading, lines = "plain", "Result", found
    shown = "".join(f"<p>{_text(_sentence(line))}</p>\n" for line in lines)
    return f'<section class="verdict {kind}"><h2>{heading}</h2>\n{shown}</section>'


def _sentence(text: str) -> str:
    """Text with a capital at its start; a name with underscores stays as it is."""
    return text if isinstance(text, Html) or "_" in text.partition(" ")[0] else f"{text[:1].upper()}{text[1:]}"


def document(title: str, lead: str, body: str, charts: Sequence[Chart]) -> str:
    """A page around its body, with the data of the charts in it."""
    script = _script()
    told = "" if script else f'<p class="note">{escape(NO_SCRIPT)}</p>'
    data = f'<script type="text/plain" id="data">{packed(charts)}</script>\n<script>{script}</script>' if script else ""
    return f"""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark"><link rel="icon" href="data:,"><title>{escape(title)}</title>
<style>{style()}</style></head>
<body><header><div><h1>{escape(title)}</h1><p class="lead">{_text(lead)}</p></div><div id="actions"></div></header>
<main>{told}
{body}</main>
{data}
</body></html>
"""


def write_page(path: Path, report: Report) -> None:
    """Write a page whole or not at all."""
    write_bytes(path, render(report).encode())


def style() -> str:
    """The style sheet, whose dark colours also hold where only the system asks for them."""
    shared = (HERE / "style.css").read_text(encoding="utf-8")
    dark = re.search(r':root\[data-theme="dark"\] (\{.*?\})', shared, re.S)
    assert dark is not None
    system = f"@media screen and (prefers-color-scheme: dark) {{\n:root:not([data-theme]) {dark.group(1)}\n}}\n"
    return shared + system + (HERE / "report.css").read_text(encoding="utf-8")


def _script() -> str:
    """Script of the charts; empty if it is not built and cannot be."""
    if not SCRIPT.is_file() and shutil.which("npm") is not None:
        try:
            made_here("page-report", [], "the script of reports")
        except InputError:
            return ""
    return SCRIPT.read_text(encoding="utf-8") if SCRIPT.is_file() else ""


def _text(text: str) -> str:
    """Text as HTML, with `code` as code."""
    return text if isinstance(text, Html) else re.sub(r"`([^`]+)`", r"<code>\1</code>", escape(text))


# --- charts ---


def _group(group: Group, charts: list[Chart]) -> str:
    title = f"<h2>{escape(group.title)}</h2>" if group.title else ""
    about = f'<p class="about">{_text(group.caption)}</p>' if group.caption else ""
    if not group.charts:  # as the first group of a report may have none
        return ""
    return f'<section id="{escape(group.name)}">{title}{about}\n{cards(group.charts, charts, group.columns)}</section>'


def cards(shown: Sequence[Chart], charts: list[Chart], columns: int = 2) -> str:
    """Figures beside each other; their charts are added to the charts of the page."""
    kind = {1: "charts one", 3: "charts three"}.get(columns, "charts")
    return (
        f'<div class="{kind}">{chr(10).join(_card(chart, charts, still=len(charts) < STILL) for chart in shown)}</div>'
    )


def _card(chart: Chart, charts: list[Chart], *, still: bool) -> str:
    """A figure with its legend, and the place of the chart among the data."""
    caption = f"<b>{escape(chart.title)}</b>{_legend(chart)}"
    if isinstance(chart, Matrix):
        return f'<figure class="chart"><figcaption>{caption}</figcaption>{_matrix(chart)}</figure>'
    shown = still or isinstance(chart, Bars | Histogram | Drawing)
    number, svg = len(charts), svg_of(chart) if shown else ""
    charts.append(chart)
    if isinstance(chart, Flows):
        svg = _table(Table("", ("energy", "[J]"), [[name, f"{e:.4g}"] for name, e in chart.shown.items()]))
    kind = {Panel: "plot", Contacts: "strip", Flows: "energy"}.get(type(chart), "plot still")
    place = "" if isinstance(chart, Bars | Histogram | Drawing) else f' data-chart="{number}"'
    if isinstance(chart, Panel):
        kind += " still"  # until the script takes over
    figure = "chart wide" if isinstance(chart, Drawing) and chart.wide else "chart"
    shown_chart = f'<div class="{kind}"{place}>{svg}</div>{_key(chart)}'
    return f'<figure class="{figure}"><figcaption>{caption}</figcaption>{shown_chart}</figure>'


def _key(chart: Chart) -> str:
    """The names of numbered points."""
    if not isinstance(chart, Panel):
        return ""
    lists = ["".join(f"<li>{escape(name)}</li>" for name in curve.names) for curve in chart.curves if curve.numbered]
    return "".join(f'<ol class="key">{items}</ol>' for items in lists)


def _legend(chart: Chart) -> str:
    if isinstance(chart, Panel):
        several = len(chart.curves) > 1
        shown = [(k, c) for k, c in enumerate(chart.curves) if several and c.shown != "_"]
        found = [
            f'<span class="entry">{swatch(c)}{escape(c.shown)} <output data-line="{k}"></output></span>'
            for k, c in shown
        ]
        if chart.ground is not None:
            found.append(f'<span class="entry">{scale_of(chart.ground)}</span>')
        return "".join(found)
    if isinstance(chart, Bars) and chart.series:
        boxes = [
            f'<svg viewBox="0 0 26 8"><rect width="20" height="8" fill="var(--{colour})"/></svg>'
            for colour in ("first", "second")
        ]
        return "".join(
            f'<span class="entry"><span class="swatch" aria-hidden="true">{box}</span>{escape(name)}</span>'
            for box, name in zip(boxes, chart.series, strict=True)
        )
    if isinstance(chart, Histogram):
        return '<span class="entry">lines: 5, 50 and 95 %</span>'
    if isinstance(chart, Contacts):
        return '<span class="entry">full: stuck; upper half: slips forward; lower half: backward</span>'
    return ""


def scale_of(ground: Ground) -> str:
    """Legend of the shades of a map: its colour bar between the least and the largest value."""
    values = ground.values[np.isfinite(ground.values)]
    if len(values) == 0:
        return "no values"
    low, high = f"{values.min():.3g}", f"{values.max():.3g}"
    return f'{escape(ground.label)} {low} <span class="scale" role="img" aria-label="to"></span> {high}'


def _matrix(chart: Matrix) -> str:
    """A table whose cells are coloured by their values."""
    head = "".join(f'<th scope="col" class="cell">{escape(name)}</th>' for name in chart.names)
    rows = []
    for name, values in zip(chart.names, chart.values.tolist(), strict=True):
        cells = []
        for value in values:
            colour, share = ("second" if value > 0 else "first"), round(45 * abs(value))
            shade = (
                f' style="background: color-mix(in srgb, var(--{colour}) {share}%, var(--surface))"' if share else ""
            )
            cells.append(f'<td class="cell"{shade}>{value:+.2f}</td>')
        rows.append(f'<tr><th scope="row">{escape(name)}</th>{"".join(cells)}</tr>')
    table = f"<table><thead><tr><td></td>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"
    return f'<div class="scroll" role="region" tabindex="0" aria-label="{escape(chart.title)}">{table}</div>'


# --- words ---


def _words(part: Table | Prose) -> str:
    title = f"<h2>{escape(part.title)}</h2>" if part.title else ""
    if isinstance(part, Table):
        note = f'<p class="about">{_text(part.note)}</p>' if part.note else ""
        return f'<section>{title}{note}<div class="card table">{_table(part)}</div></section>'
    if part.listed:
        items = "".join(f"<li>{_text(text)}</li>\n" for text in part.paragraphs)
        return f'<section class="prose">{title}<ul>{items}</ul></section>'
    kind = ' class="note"' if part.noted else ""
    return (
        f'<section class="prose">{title}{"".join(f"<p{kind}>{_text(text)}</p>" for text in part.paragraphs)}</section>'
    )


def _table(table: Table) -> str:
    numbers = [_of_numbers([row[k] for row in table.rows]) for k in range(len(table.header))]
    longest = [max((len(row[k]) for row in table.rows), default=0) for k in range(len(table.header))]

    def kind(k: int) -> str:
        return ' class="number"' if numbers[k] else ' class="words"' if longest[k] > 40 else ""

    head = "".join(
        f'<th scope="col"{kind(k) if numbers[k] else ""}>{_text(what)}</th>' for k, what in enumerate(table.header)
    )
    rows = []
    for n, row in enumerate(table.rows):
        mark = ' class="differs"' if n in table.marked else ' class="chosen"' if n in table.chosen else ""
        cells = "".join(f"<td{kind(k)}>{_text(value)}</td>" for k, value in enumerate(row))
        rows.append(f"<tr{mark}>{cells}</tr>\n")
    name = escape(table.title or ", ".join(table.header))
    inner = f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"
    return f'<div class="scroll" role="region" tabindex="0" aria-label="{name}">{inner}</div>'


def _of_numbers(cells: list[str]) -> bool:
    """Whether a column holds numbers, with or without a unit or a remark behind them."""
    shown = [cell for cell in cells if cell not in ("", "-", "none")]
    return bool(shown) and all(ALIKE.match(cell) and len(cell) < 24 for cell in shown)
