"""What commands write: figures as PNG and SVG, their data as CSV, and self-contained HTML pages."""

from __future__ import annotations

import base64
import csv
import io
from collections.abc import Callable, Iterable
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..atomic_writer import write_bytes
from ..errors import need

if TYPE_CHECKING:
    from markupsafe import Markup
    from matplotlib.figure import Figure

    from .panels import Panel


def save_figure(figure: Figure, directory: Path, name: str) -> bytes:
    """Write a figure as PNG and SVG; returns the PNG."""
    png = io.BytesIO()
    figure.savefig(png, format="png", metadata={"Software": None})
    svg = io.BytesIO()
    figure.savefig(svg, format="svg", metadata={"Date": None})
    write_bytes(directory / f"{name}.png", png.getvalue())
    write_bytes(directory / f"{name}.svg", svg.getvalue())
    return png.getvalue()


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


def panels_csv(panels: Iterable[Panel]) -> str:
    """The data of a figure: long form, one row a point."""
    rows = []
    for panel in panels:
        labels = (_plain(panel.x_label), _plain(panel.y_label))
        for curve in panel.curves:
            for x, y in zip(curve.x.tolist(), curve.y.tolist(), strict=True):
                rows.append([_plain(panel.title), _plain(curve.label), x, y, *labels])
    return table_csv(["panel", "curve", "x", "y", "x_label", "y_label"], rows)


def _plain(label: str) -> str:
    """A label without its markup."""
    return label.replace("$", "").replace("{", "").replace("}", "")


def embed(png: bytes, title: str, caption: Markup | str, anchor: str) -> Markup:
    """A figure inside the page, with its caption."""
    from markupsafe import Markup, escape

    data = base64.b64encode(png).decode()
    image = Markup('<img alt="{}" src="data:image/png;base64,{}">').format(title, data)
    return Markup('<figure id="{}">{}<figcaption>{}</figcaption></figure>\n').format(anchor, image, escape(caption))


def render_page(template: str, **context: Any) -> str:
    """An HTML page from a template of the package; values are escaped, names that are missing raise."""
    need("jinja2", "A page", "report")
    import jinja2

    def source(name: str) -> str:
        return files("lostmotion").joinpath(name).read_text(encoding="utf-8")

    loader: Callable[[str], str] = source
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, loader=jinja2.FunctionLoader(loader)
    )
    return environment.get_template(template).render(**context)
