"""The live page in a notebook."""

from __future__ import annotations

import html
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..inputs.argument_checks import checked
from ..inputs.quantities import Count
from ..simulation.scenario.scenario import Scenario
from .page import page, write_page

HEIGHTS = (200, 10_000)  # of the page in a notebook, in pixels

# Shows the page and takes up what its sliders say; without it the page is shown alone.
_WIDGET = """
export default {
  render({ model, el }) {
    const frame = document.createElement("iframe");
    frame.srcdoc = model.get("page");
    frame.style = `width: 100%; height: ${model.get("height")}px; border: none`;
    const listen = (event) => {
      if (event.source !== frame.contentWindow || !event.data.lostmotion) return;
      model.set("values", event.data.lostmotion.values);
      model.set("tables", event.data.lostmotion.scenario);
      model.save_changes();
    };
    addEventListener("message", listen);
    el.append(frame);
    return () => removeEventListener("message", listen);
  },
};
"""


class LivePage:
    """A scenario on the live page, shown as the last line of a notebook cell.

    With anywidget installed, `values` and `scenario` follow the sliders; without, the page is shown alone.
    """

    @checked
    def __init__(self, scenario: Scenario, height: Count) -> None:
        if not HEIGHTS[0] <= height <= HEIGHTS[1]:
            raise InputError(f"height: {height} pixels must lie between {HEIGHTS[0]} and {HEIGHTS[1]}")
        self._scenario = scenario
        self._height = height
        self._page = page(scenario)
        self._widget = _widget(self._page, height)

    @property
    def values(self) -> dict[str, float]:
        """Values that the sliders have changed, by keys of the scenario file [SI].

        Raises
        ------
        MissingLibraryError
            anywidget is not installed.
        """
        if self._widget is None:
            from ..errors import need

            need("anywidget", "Reading the sliders of the live page", "notebook")
            return {}
        return dict(self._widget.values)

    @property
    def scenario(self) -> Scenario:
        """The scenario with the values of the sliders.

        Raises
        ------
        MissingLibraryError
            anywidget is not installed.
        """
        return type(self._scenario)(**self._widget.tables) if self.values else self._scenario

    @checked
    def save(self, path: str | Path) -> None:
        """Writes the page as an HTML file, with the values of the scenario.

        Raises
        ------
        InputError
            It cannot be written there.
        """
        write_page(Path(path), self._scenario)

    def __repr__(self) -> str:
        return f"LivePage({self._scenario.title!r})"

    def _repr_html_(self) -> str:
        return f'<iframe srcdoc="{html.escape(self._page)}" style="width: 100%; height: {self._height}px; border: none"></iframe>'

    def _repr_mimebundle_(self, **options: Any) -> Any:
        if self._widget is None:
            return {"text/plain": repr(self), "text/html": self._repr_html_()}
        return self._widget._repr_mimebundle_(**options)


def _widget(page: str, height: int) -> Any:
    """None without anywidget."""
    try:
        import anywidget
        import traitlets
    except ImportError:
        return None

    class PageWidget(anywidget.AnyWidget):
        _esm = _WIDGET
        page = traitlets.Unicode().tag(sync=True)
        height = traitlets.Int().tag(sync=True)
        values = traitlets.Dict().tag(sync=True)  # that are changed, by key
        tables = traitlets.Dict().tag(sync=True)  # of the scenario with them

    return PageWidget(page=page, height=height)


@checked
def live(scenario: Scenario, *, height: Count = 900) -> LivePage:
    """Show a drive in the notebook as a page that simulates it in the browser.

    Parameters
    ----------
    scenario : Scenario
        The drive and its inputs, with or without controllers.
    height : int
        Height of the page in the notebook, in pixels.

    Returns
    -------
    LivePage
        The page. A notebook shows it if it is the last line of a cell. `LivePage.save` writes it as one HTML file.

    Raises
    ------
    InputError
        A controller has your own law, which only Python can call. In a checkout: the page has not been built.

    Examples
    --------
    >>> import lostmotion as lm
    >>> page = lm.live(lm.load("paper-2dof-nl-small"), height=600)
    >>> type(page).__name__
    'LivePage'
    """
    return LivePage(scenario, height)
