"""Draws the pictures of README and tutorial: python docs/images/make_images.py"""

import re
import tempfile
from pathlib import Path

import lostmotion as lm
from lostmotion import plots
from lostmotion.paper import AMPLITUDES, MODELS, paper_scenario
from lostmotion.plots import STYLES, Curve, Panel

HERE = Path(__file__).parent


def why() -> None:
    panels = []
    for amplitude, value in AMPLITUDES.items():
        curves = []
        for model in MODELS:
            run = lm.simulate(paper_scenario(model, amplitude))
            curves.append(Curve(model, run["time"].values, run["load_speed"].values, STYLES[model]))
        title = "at rated voltage" if value > 1 else "at a fortieth of it"
        panels.append(Panel(title, "time [s]", "load speed [rad/s]", tuple(curves)))
    figure = plots.draw(panels, 2, (9.5, 3.3), note="Loss table of 2-DOF-NL: a stand-in.")
    figure.savefig(HERE / "why.png", dpi=120, metadata={"Software": None})


def overview() -> None:
    toml = re.search(r"```toml\n(.*?)```", (HERE.parent / "tutorial.md").read_text(), re.S)
    assert toml is not None
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "my-drive.toml"
        path.write_text(toml.group(1))
        figure = plots.overview(lm.simulate(lm.load(path)))
    figure.savefig(HERE / "overview.png", dpi=90, metadata={"Software": None})


if __name__ == "__main__":
    why()
    overview()
