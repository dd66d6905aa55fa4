"""Draws the pictures of README and tutorial: python docs/images/make_images.py"""

import re
import tempfile
from pathlib import Path

import lostmotion as lm
from lostmotion.data_sheets.records import find
from lostmotion.paper import AMPLITUDES, MODELS, paper_scenario
from lostmotion.paper.runs import stuck_intervals
from lostmotion.reports import plots
from lostmotion.reports.figure_style import STYLES
from lostmotion.reports.panels import Curve, Panel
from lostmotion.reports.rig import panels
from lostmotion.reports.study_selection import pareto_figure
from lostmotion.studies.runs.read_table import read_table
from lostmotion.test_rig.measurement import measure

HERE = Path(__file__).parent


def why() -> None:
    drawn = []
    for amplitude, value in AMPLITUDES.items():
        runs = {model: lm.simulate(paper_scenario(model, amplitude)) for model in MODELS}
        curves = [Curve(m, run["time"].values, run["motor_speed"].values, STYLES[m]) for m, run in runs.items()]
        title = "at rated voltage" if value > 1 else "at a fortieth of it"
        shaded = stuck_intervals(runs["2-DOF-NL"])
        drawn.append(Panel(title, "time [s]", "motor speed [rad/s]", tuple(curves), shaded=shaded))
    note = "Shaded: the motor shaft of 2-DOF-NL is stuck. Loss table of 2-DOF-NL: a stand-in."
    plots.draw(drawn, 2, (9.5, 3.3), note=note).savefig(HERE / "why.png", dpi=120, metadata={"Software": None})


def tutorial() -> None:
    sheet, drive = re.findall(r"```toml\n(.*?)```", (HERE.parent / "tutorial.md").read_text(), re.S)
    with tempfile.TemporaryDirectory() as directory:
        (Path(directory) / "my-gearbox.toml").write_text(sheet)
        path = Path(directory) / "my-drive.toml"
        path.write_text(drive)
        scenario = lm.load(path)
        record = find(str(path.parent / "my-gearbox.toml"), "gearbox")
    plots.overview(lm.simulate(scenario)).savefig(HERE / "overview.png", dpi=90, metadata={"Software": None})
    rig = plots.draw(panels(measure(scenario.gearbox), record), 2, (10.0, 11.5))
    rig.savefig(HERE / "rig.png", dpi=80, metadata={"Software": None})


def selection(study: lm.studies.Study, name: str) -> None:
    with tempfile.TemporaryDirectory() as directory:
        table = read_table(lm.study(study, Path(directory) / "selection"))
    figure = pareto_figure(table, study)
    figure.savefig(HERE / name, dpi=110, metadata={"Software": None})


if __name__ == "__main__":
    why()
    tutorial()
    examples = HERE.parents[1] / "examples"
    selection(lm.studies.load_study(examples / "select-gearbox.toml"), "selection.png")
    selection(lm.studies.load_task(examples / "select-axis.toml"), "select-axis.png")
