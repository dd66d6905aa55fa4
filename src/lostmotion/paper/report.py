"""The report of `lostmotion reproduce`: one self-contained HTML file."""

from __future__ import annotations

import re
from typing import Any

from ..reports.pages import embed, render_page
from ..reports.panels import scientific
from .drive import AMPLITUDES, Constant
from .figures import FigureSpec


def render(specs: list[FigureSpec], images: dict[str, bytes], table: list[Constant], facts: dict[str, Any]) -> str:
    """The page, with the figures inside."""
    from markupsafe import Markup, escape

    by_number = {spec.number: spec for spec in specs}

    def figure(number: str) -> Markup:
        spec = by_number[number]
        mark = Markup('<span class="stand-in">stand-in loss table</span>') if spec.stand_in else ""
        caption = Markup("<b>Figure {}. {}.</b> {} {}").format(
            int(number), spec.title, Markup(_powers(str(escape(spec.caption)))), mark
        )
        return embed(images[number], spec.title, caption, f"figure-{number}")

    return render_page(
        "paper/report.html.jinja",
        facts=facts,
        constants=table,
        amplitudes=AMPLITUDES,
        figure=figure,
        differs=lambda c: abs(c.recomputed / c.printed - 1.0) > 0.004,
        sci=lambda value: Markup(_powers(scientific(value))),
    )


def _powers(text: str) -> str:
    return re.sub(r"10\^(-?\d+)", r"10<sup>\1</sup>", text)
