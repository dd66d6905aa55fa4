"""Sphinx configuration."""

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator

project = "lostmotion"
author = "the lostmotion developers"
copyright = "2026, the lostmotion developers"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_enable_extensions = ["dollarmath", "colon_fence"]
myst_heading_anchors = 3
html_theme = "furo"
html_title = "lostmotion"
exclude_patterns = ["_build"]
html_extra_path = ["_generated/extra"]
autodoc_typehints = "description"
autodoc_member_order = "bysource"
autodoc_mock_imports: list[str] = []
napoleon_numpy_docstring = True
suppress_warnings = ["myst.header"]
smartquotes = False  # commands are shown as they are typed
html_math_renderer = "mathml"


def inline_math(self: HTML5Translator, node: nodes.math) -> None:
    self.body.append(convert(node.astext()))
    raise nodes.SkipNode


def display_math(self: HTML5Translator, node: nodes.math_block) -> None:
    text = node.astext().replace("{aligned}", "{align*}")  # the name that the converter knows
    self.body.append(f'<div class="math">{convert(text, display="block")}</div>')
    raise nodes.SkipNode


def setup(app: Sphinx) -> None:
    # Formulas as MathML: the pages need no script from elsewhere.
    app.add_html_math_renderer("mathml", (inline_math, None), (display_math, None))
