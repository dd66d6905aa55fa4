"""The report of `lostmotion reproduce`: one HTML file that needs nothing beside it."""

from __future__ import annotations

import base64
import re
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from .paper import AMPLITUDES, Constant
from .plots import scientific

if TYPE_CHECKING:
    from .reproduce import FigureSpec


def render(specs: list[FigureSpec], images: dict[str, bytes], table: list[Constant], facts: dict[str, Any]) -> str:
    """The page, with the figures inside."""
    import jinja2
    from markupsafe import Markup, escape

    by_number = {spec.number: spec for spec in specs}

    def figure(number: str) -> Markup:
        spec = by_number[number]
        data = base64.b64encode(images[number]).decode()
        mark = '<span class="stand-in">stand-in loss table</span>' if spec.stand_in else ""
        return Markup(
            f'<figure id="figure-{number}"><img alt="{escape(spec.title)}" src="data:image/png;base64,{data}">'
            f"<figcaption><b>Figure {int(number)}. {escape(spec.title)}.</b> {_powers(str(escape(spec.caption)))} {mark}"
            "</figcaption></figure>\n"
        )

    template = files("lostmotion").joinpath("report.html.jinja").read_text(encoding="utf-8")
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    return environment.from_string(template).render(
        facts=facts,
        constants=table,
        amplitudes=AMPLITUDES,
        figure=figure,
        differs=lambda c: abs(c.recomputed / c.printed - 1.0) > 0.004,
        sci=lambda value: Markup(_powers(scientific(value))),
    )


def _powers(text: str) -> str:
    return re.sub(r"10\^(-?\d+)", r"10<sup>\1</sup>", text)
