"""Files that commands write: self-contained HTML pages, data of charts and tables as CSV, pictures on request."""

import csv
import io
from collections.abc import Callable, Iterable, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from ..atomic_writer import write_bytes
from ..errors import need
from .page import Report, write_page
from .panels import Chart, Group, Panel


def write_text(path: Path, text: str) -> None:
    """Write a text file whole or not at all."""
    write_bytes(path, text.encode())


def table_csv(header: Iterable[str], rows: Iterable[Iterable[Any]]) -> str:
    """A table as the text of a CSV file."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return out.getvalue()


def panels_csv(panels: Iterable[Chart]) -> str:
    """The data of lines and points: long form, one row a point."""
    rows = ["panel,curve,x,y,x_label,y_label"]
    for panel in panels:
        if not isinstance(panel, Panel):
            continue
        behind = table_csv((panel.x_label, panel.y_label), ()).rstrip("\n")
        for curve in panel.curves:
            before = table_csv((panel.title, curve.label), ()).rstrip("\n")
            points = zip(np.asarray(curve.x).tolist(), np.asarray(curve.y).tolist(), strict=True)
            rows += [f"{before},{x!r},{y!r},{behind}" for x, y in points]
    return "\n".join([*rows, ""])


def write_report(directory: Path, report: Report, pictures: Sequence[str] = ()) -> Path:
    """Write a page, the data of its charts and its tables into a directory, made if missing.

    pictures: endings of the files in which matplotlib draws each group of charts: png, svg, pdf.

    Returns the path of the page.
    """
    directory.mkdir(parents=True, exist_ok=True)
    write_page(directory / report.file, report)
    data = {f"{group.name}.csv": panels_csv(group.charts) for group in report.groups() if _has_panels(group)}
    for name, text in (data | dict(report.tables)).items():
        write_text(directory / name, text)
    if pictures:
        from .pictures import draw_all

        draw_all(directory, report.groups(), pictures)
    return directory / report.file


def _has_panels(group: Group) -> bool:
    return any(isinstance(chart, Panel) and chart.curves for chart in group.charts)


def render_page(template: str, **context: Any) -> str:
    """HTML from a template of the package; values are escaped, names that are missing raise."""
    need("jinja2", "A page", "report")
    import jinja2

    def source(name: str) -> str:
        return files("lostmotion").joinpath(name).read_text(encoding="utf-8")

    loader: Callable[[str], str] = source
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, loader=jinja2.FunctionLoader(loader)
    )
    return environment.get_template(template).render(**context)
