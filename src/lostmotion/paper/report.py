"""The report of `lostmotion reproduce`: one self-contained HTML file."""

from __future__ import annotations

import re

from ..reports.pages import embed, render_page
from ..reports.panels import scientific
from .drive import AMPLITUDES, MODELS, Constant
from .facts import Facts
from .figures import FigureSpec
from .runs import FREQUENCIES


def render(
    specs: list[FigureSpec], images: dict[str, bytes], table: list[Constant], facts: Facts, *, live: bool = False
) -> str:
    """The page, with the figures inside."""
    from markupsafe import Markup, escape

    by_number = {spec.number: spec for spec in specs}

    def figure(number: str) -> Markup:
        spec = by_number[number]
        mark = Markup('<span class="stand-in">stand-in loss table</span>') if spec.stand_in else ""
        caption = Markup("<b>{}. {}.</b> {} {}").format(
            spec.heading or f"Figure {int(number)}", spec.title, Markup(_powers(str(escape(spec.caption)))), mark
        )
        return embed(images[number], spec.title, caption, f"figure-{number}")

    return render_page(
        "paper/report.html.jinja",
        facts=facts,
        constants=table,
        amplitudes=AMPLITUDES,
        models=MODELS,
        lowest=FREQUENCIES[0],
        figure=figure,
        different=[c.name for c in table if abs(c.recomputed / c.printed - 1.0) > 0.004],
        sci=lambda value: Markup(_powers(scientific(value))),
        live=live,
    )


def _powers(text: str) -> str:
    return re.sub(r"10\^(-?\d+)", r"10<sup>\1</sup>", text)
