"""The report of `lostmotion reproduce`: one self-contained HTML file."""

import re

from ..reports.page import cards, document, verdict
from ..reports.panels import Chart, scientific
from ..reports.written_files import render_page
from .figures import FigureSpec
from .published_drive import AMPLITUDES, MODELS, Constant
from .quoted_numbers import Facts
from .runs import FREQUENCIES

TITLE = "Reproduction of “Simplified dynamic model of the transmission”"
AT_A_GLANCE = "09"  # the figure that supports the verdict


def render(specs: list[FigureSpec], table: list[Constant], facts: Facts, *, live: bool = False) -> str:
    """The page, with the charts inside."""
    from markupsafe import Markup, escape

    by_number = {spec.number: spec for spec in specs}
    charts: list[Chart] = []

    def figure(number: str) -> Markup:
        spec = by_number[number]
        mark = Markup('<span class="stand-in">stand-in loss table</span>') if spec.stand_in else ""
        caption = Markup("<b>{}. {}.</b> {} {}").format(
            spec.heading or f"Figure {int(number)}", spec.title, Markup(_powers(str(escape(spec.caption)))), mark
        )
        shown = Markup(cards(spec.panels, charts, spec.columns))
        return Markup('<section id="figure-{}">{}<p class="about">{}</p></section>\n').format(number, shown, caption)

    glance = Markup(cards(by_number[AT_A_GLANCE].panels, charts))
    body = render_page(
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
    lead = "A DC motor turns a load through a gearbox; three models of the gearbox are compared at two amplitudes."
    return document(TITLE, lead, f"{verdict(agreement(facts))}\n{glance}\n{body}", charts)


def agreement(facts: Facts) -> tuple[str, ...]:
    """Agreement and disagreement of the three models."""
    stuck = {model: f"{100.0 * facts.stuck[model, 'small']:.0f} %" for model in MODELS}
    traditional = " and ".join(f"{stuck[model]} ({model})" for model in MODELS if model != "2-DOF-NL")
    return (
        f"At rated voltage the motor torque of the three models differs by at most {100.0 * facts.torque_gap:.0f} % of its peak.",
        f"At a fortieth of it the motor shaft of 2-DOF-NL is stuck for {stuck['2-DOF-NL']} of the time, in the traditional models for {traditional}.",
        "The loss table is a stand-in, since the paper prints its own only as a picture: curves of 2-DOF-NL compare in shape, not in digits.",
    )


def _powers(text: str) -> str:
    """Powers of ten and the lower parts of symbols as HTML."""
    text = re.sub(r"10\^(-?\d+)", r"10<sup>\1</sup>", text)
    return re.sub(r"\b([A-Za-zω])_(\w+)", r"\1<sub>\2</sub>", text)
