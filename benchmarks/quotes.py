"""Times that README and documentation quote, taken from RESULTS.md: `python benchmarks/quotes.py` renews them, as `make bench` does."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parent.parent


class Results:
    """The text of RESULTS.md."""

    def __init__(self, text: str) -> None:
        self.sections = {title: body for title, _, body in (part.partition("\n") for part in text.split("\n## "))}

    def column(self, section: str, column: str) -> dict[str, float]:
        """First cell of each row -> number in a column, in all tables of a section that have this column."""
        found: dict[str, float] = {}
        header: list[str] = []
        for line in self.sections[section].splitlines():
            cells = [cell.strip() for cell in line.strip("|").split("|")]
            if not line.startswith("|"):
                header = []
            elif not header:
                header = cells
            elif column in header and (number := re.match(r"[\d.]+", cells[header.index(column)])):
                found[cells[0]] = float(number[0])
        return found

    def cell(self, section: str, row: str, column: str) -> float:
        """The number of the first row whose first cell begins with `row`."""
        return next(value for name, value in self.column(section, column).items() if name.startswith(row))

    def number(self, section: str, pattern: str) -> float:
        """The group of a pattern in the text of a section."""
        found = re.search(pattern, self.sections[section])
        assert found, f"RESULTS.md, {section}: has no {pattern!r}"
        return float(found[1].replace(",", ""))


def shown(value: float) -> str:
    """A count, or a measured number with two digits, whole from 10 on."""
    if isinstance(value, int):
        return f"{value:,}"
    rounded = float(f"{value:.2g}")
    return f"{rounded:,.0f}" if rounded >= 10.0 else f"{rounded:g}"


RUN = "One run"


@dataclass(frozen=True)
class Quote:
    """A sentence of a page; its places `{}` are numbers of the results."""

    page: str
    sentence: str
    numbers: Callable[[Results], tuple[float, ...]]

    def renewed(self, text: str, results: Results) -> str:
        """The text of the page, with the numbers of the results in the sentence."""
        words = [r"\s+".join(map(re.escape, part.split(" "))) for part in self.sentence.split("{}")]
        places = [f"({part})" for part in words]
        found, count = re.subn(r"([\d.,]*\d)".join(places), lambda m: self._filled(m, results), text)
        if count != 1:
            raise ValueError(f"{self.page}: has {count} sentences {self.sentence!r}; there must be one")
        return found

    def _filled(self, match: re.Match[str], results: Results) -> str:
        kept, numbers = match.groups()[::2], [shown(number) for number in self.numbers(results)]
        return "".join(text + number for text, number in zip(kept, [*numbers, ""], strict=True))


QUOTES = (
    Quote(
        "README.md",
        "| the paper's run of 2 s with {} switchings and 2001 samples | {} ms in the core, {} ms to a labelled dataset |",
        lambda r: (
            int(r.cell("Drive trains", "the paper's drive", "switchings")),
            r.cell(RUN, "C++: exact, same drive again", "time [ms]"),
            r.cell(RUN, "Python to dataset, with ledger", "time [ms]"),
        ),
    ),
    Quote(
        "README.md",
        "| the same by CVODE in C, scipy and PathSim at 1e-6 | {}, {} and {} times as long |",
        lambda r: (
            r.cell(RUN, "C++: SUNDIALS CVODE Adams in C, rtol 1e-06", "ratio"),
            r.cell(RUN, "scipy LSODA, rtol 1e-06, right-hand side in Python", "ratio"),
            r.cell(RUN, "PathSim RKDP54, rtol 1e-06, in Python", "ratio"),
        ),
    ),
    Quote(
        "README.md",
        "| frequency response, 480 periodic motions | {} s |",
        lambda r: (1e-3 * r.cell("Frequency response", "480 points by shooting, 2 threads", "time [ms]"),),
    ),
    Quote(
        "README.md",
        "| a study of 100,000 runs of 1 s, on disk | {} s |",
        lambda r: (r.number("Studies", r"100,000 runs of 1 s on 2 cores, [^:]*: ([\d.]+) s"),),
    ),
    Quote(
        "docs/live.md",
        "The page is one file of {} to {} kB.",
        lambda r: (min(r.column("Live page", "page [kB]").values()), max(r.column("Live page", "page [kB]").values())),
    ),
)


def renewed(page: str, text: str, results: Results) -> str:
    """A page with all its quotes."""
    for quote in QUOTES:
        if quote.page == page:
            text = quote.renewed(text, results)
    return text


def write() -> None:
    """Renews all pages."""
    results = Results((ROOT / "benchmarks" / "RESULTS.md").read_text(encoding="utf-8"))
    for page in dict.fromkeys(quote.page for quote in QUOTES):
        path = ROOT / page
        path.write_text(renewed(page, path.read_text(encoding="utf-8"), results), encoding="utf-8")


if __name__ == "__main__":
    write()
