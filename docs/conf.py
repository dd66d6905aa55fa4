"""Sphinx configuration."""

import re
from pathlib import Path

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator

project = "lostmotion"
author = "the lostmotion developers"
copyright = "2026, the lostmotion developers"
# As text: importing the package would not be needed for it.
release = re.findall(
    r'__version__ = "(.*)"', (Path(__file__).parents[1] / "src" / "lostmotion" / "version.py").read_text()
)[0]
version = release
extensions = [
    "myst_nb",  # pages in Markdown, and notebooks, which are executed
    "sphinx_copybutton",
]
myst_enable_extensions = ["dollarmath"]
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 300
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True
copybutton_selector = "div:not(.output) > div.highlight:not(.highlight-text *) pre"
myst_heading_anchors = 3
html_theme = "furo"
html_title = f"lostmotion {release}"
html_static_path = ["_static"]
html_css_files = ["pages.css"]
exclude_patterns = ["_build", "jupyter_execute"]
html_extra_path = ["_generated/extra"]
html_show_sourcelink = True
suppress_warnings = ["myst.header", "mystnb.unknown_mime_type"]
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
