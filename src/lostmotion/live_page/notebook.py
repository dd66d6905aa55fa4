"""The live page in a notebook."""

from __future__ import annotations

import html
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..inputs.arguments import checked
from ..inputs.quantities import Count
from ..simulation.scenario import Scenario
from ..simulation.train_scenario import TrainScenario
from .page import page, write_page

HEIGHTS = (200, 10_000)
"""of the page in a notebook, in pixels"""

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
    """A scenario in the browser, as the last line of a notebook's cell shows it.

    With anywidget installed, `values` and `scenario` follow the sliders; without, the page is shown alone.
    """

    @checked
    def __init__(self, scenario: Scenario | TrainScenario, height: Count) -> None:
        if not HEIGHTS[0] <= height <= HEIGHTS[1]:
            raise InputError(f"height: {height} pixels must lie between {HEIGHTS[0]} and {HEIGHTS[1]}")
        self._scenario = scenario
        self._height = height
        self._page = page(scenario)
        self._widget = _widget(self._page, height)

    @property
    def values(self) -> dict[str, float]:
        """What the sliders have changed, by keys of the scenario file [SI].

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
    def scenario(self) -> Scenario | TrainScenario:
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
def live(scenario: Scenario | TrainScenario, *, height: Count = 900) -> LivePage:
    """The drive in the browser, solved there by the same core: sliders, and a drawing that moves.

    Parameters
    ----------
    scenario
        In the short or the long form, with or without controllers.
    height
        Of the page in the notebook, in pixels.

    Returns
    -------
    LivePage
        A notebook shows it where it is the last line of a cell; `save` writes it as one HTML file.

    Raises
    ------
    InputError
        A controller has a law of your own, which only Python can call; in a checkout, the page has not been built.
    """
    return LivePage(scenario, height)
