"""Accessor `result.lm` of xarray datasets: plots, energy, explanation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import xarray as xr

from ..errors import InputError
from ..inputs.argument_checks import checked
from ..inputs.refusal_messages import shown
from ..response.harmonic import of_output
from ..simulation.runs.results import energy_of, scenario_of, whole
from ..simulation.scenario.scenario import Scenario
from .run import summary

if TYPE_CHECKING:
    from matplotlib.figure import Figure


BODE = (9.0, 7.5)  # size of the figure of gain over phase [inch]


@xr.register_dataset_accessor("lm")  # type: ignore[no-untyped-call]
class ResultAccessor:
    """Figures, text and scenario of a result: ``result.lm.plot()``.

    It is there once a function of lostmotion that returns a dataset has been used.
    """

    def __init__(self, dataset: xr.Dataset) -> None:
        if not isinstance(dataset, xr.Dataset):
            raise InputError(f"{shown(dataset)} must be a dataset, such as simulate returns")
        self._dataset = dataset

    def __repr__(self) -> str:
        return "result.lm: plot(), plot_maps(), summary(), scenario, energy"

    @checked
    def plot(self, output: str | None = None) -> Figure:
        """The figure that the command line draws: of a run the overview, of a frequency response the Bode figure, of a hunting map
        amplitude and frequency.

        Parameters
        ----------
        output
            The variable of a frequency response; left out, the load's speed, of a train the speed of its last shaft.

        Raises
        ------
        InputError
            The dataset is of another kind.
        """
        from . import plots
        from .hunting_figures import map_figure
        from .response import bode

        if "response" in self._dataset:
            name = str(of_output(self._dataset, output)["output"].item())
            return plots.draw(bode({"": self._dataset}, name), 1, BODE)
        if "reason" in self._dataset and "amplitude" in self._dataset:
            return map_figure(self._dataset)
        return plots.overview(self._dataset)

    @checked
    def plot_maps(self, output: str | None = None) -> Figure:
        """Gain, phase, efficiency and distortion of a frequency response over amplitude and frequency.

        Raises
        ------
        InputError
            The dataset is no frequency response, or has fewer than two amplitudes or frequencies.
        """
        from . import plots
        from .response import maps

        found = maps(self._dataset, str(of_output(self._dataset, output)["output"].item()))
        if not found:
            raise InputError(
                "maps need at least two amplitudes and two frequencies; plot() draws the response over frequency"
            )
        return plots.draw(found, 2, (10.0, 6.8))

    def _repr_html_(self) -> str:
        """A run in a notebook: the page that `lostmotion run --report` writes."""
        from .run import run_report

        try:
            return run_report("run", whole(self._dataset))._repr_html_()
        except InputError:  # not a run
            return f"<code>{self!r}</code>"

    def summary(self) -> str:
        """A run in a few lines, as `lostmotion run` prints it."""
        return summary(whole(self._dataset))

    @property
    def scenario(self) -> Scenario:
        """The scenario that the run came from."""
        return scenario_of(self._dataset)

    @property
    def energy(self) -> dict[str, float]:
        """The energy ledger [J], as of `lostmotion.energy_of`."""
        return energy_of(self._dataset)
