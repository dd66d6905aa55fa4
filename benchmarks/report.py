"""Text that reads well in the terminal and as Markdown, and the clock."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

VECTORS = {"avx2": ", AVX2"}  # of a build


def best(repeats: int, work: Callable[[], object], clock: Callable[[], float] = time.perf_counter) -> float:
    """Least time of several [ms]."""
    times = []
    for _ in range(repeats):
        begin = clock()
        work()
        times.append(clock() - begin)
    return 1e3 * min(times)


class Report:
    """Lines, as they are added."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def add(self, *lines: str) -> None:
        self.lines += lines

    def section(self, title: str, text: str) -> None:
        self.add("", f"## {title}", "", text, "")

    def table(self, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        widths = [max(len(str(r[k])) for r in [header, *rows]) for k in range(len(header))]

        def line(cells: Sequence[str]) -> str:
            first, *rest = (str(c) for c in cells)
            aligned = [first.ljust(widths[0]), *(c.rjust(w) for c, w in zip(rest, widths[1:], strict=True))]
            return "| " + " | ".join(aligned) + " |"

        rule = "|".join(("-" * (w + 1) + ":") if k else "-" * (w + 2) for k, w in enumerate(widths))
        if self.lines and self.lines[-1]:
            self.add("")
        self.add(line(header), f"|{rule}|", *(line(r) for r in rows))

    def text(self) -> str:
        return "\n".join(self.lines) + "\n"
