"""Writes what the browser tests open: pages of shipped scenarios, and the samples that Python has of the same runs.

python pages.py DIRECTORY
"""

import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

import lostmotion as lm
from lostmotion.live_page.page import write_page
from lostmotion.reports.drive_check import check_report
from lostmotion.reports.figure_style import DOTS, look
from lostmotion.reports.page import Prose, Report, Table, render
from lostmotion.reports.panels import Bars, Contacts, Curve, Flows, Ground, Group, Histogram, Mark, Matrix, Panel
from lostmotion.reports.response import response_report
from lostmotion.reports.run import run_report
from lostmotion.reports.servo import servo_report
from lostmotion.sizing.drive_check import check_drive
from lostmotion.verdict import Verdict

# Page -> scenario, and what the test changes on it by its address.
PAGES = {
    "drive": (
        "paper-2dof-nl-small",
        {"load.inertia": 3.25, "command.amplitude": 0.05, "gearbox.stiffness.backlash": 1e-3},
    ),
    "worm": ("worm-lowering", {"shafts.drum.inertia": 2.5, "gears.worm_gear.stiffness.stiffness": 8e3}),
    "axis": (
        "hunting-with-backlash",
        {"controller.position.gain": 8.0, "controller.reference.moves.0.to": 0.6, "controller.reference.speed": 0.9},
    ),
}
EXAMPLES = Path(__file__).parents[2] / "examples"
# Page -> the commands that write it into a directory of its own.
COMMANDS: dict[str, list[list[str]]] = {
    "rig": [["rig", "paper-gearbox", "-o", "rig"]],
    "track": [["track", "tracking-loss-map", "-o", "track"]],
    "study": [["study", str(EXAMPLES / "tolerance.toml"), "-o", "runs"], ["study", "show", "runs", "-o", "study"]],
    "monitor": [["monitor", str(EXAMPLES / "cycloidal" / "baseline.toml"), "-o", "monitor"]],
    "identified": [["identify", str(EXAMPLES / "cycloidal" / "baseline.toml"), "-o", "identified"]],
}
# Instants at which Python says what stands still [s].
INSTANTS = {"drive": (0.0, 0.05, 0.6667, 0.9), "worm": (0.05, 0.31, 1.4), "axis": (0.0101, 0.8003, 2.5003)}


def samples(scenario: lm.Scenario) -> dict[str, list[float | None]]:
    """All variables; what is undefined as null."""
    result = lm.simulate(scenario)
    columns = {str(name): result[name].values.tolist() for name in result.data_vars}
    return {name: [None if math.isnan(v) else v for v in column] for name, column in columns.items()}


def explanations(scenario: lm.Scenario, name: str) -> list[dict[str, Any]]:
    """What `lm.explain` says at INSTANTS; of a closed loop by a simulation that has come there."""
    found = []
    for time in INSTANTS[name]:
        if scenario.axes():
            simulation = lm.Simulation(scenario)
            simulation.advance(time)
            told = lm.explain(simulation)
        else:
            told = lm.explain(scenario, time)
        contacts = [(c.name, c.mode, c.speed, c.torque, c.capacity_forward, c.capacity_backward) for c in told.contacts]
        if isinstance(told, lm.simulation.Explanation):
            motors = [("motor", told.command_forward, told.command_backward)]
        else:
            motors = [(m.name, m.command_forward, m.command_backward) for m in told.motors]
        found.append({"time": time, "contacts": contacts, "motors": motors})
    return found


def responses(scenario: lm.Scenario) -> list[dict[str, float]]:
    """Of the load's speed, by periodic motions."""
    found = lm.frequency_response(scenario, [0.5, 5.0, 30.0], [1.0, 0.1])["response"].sel(output="load_speed")
    cells = [cell for row in found for cell in row]
    return [
        {"amplitude": float(c.amplitude), "frequency": float(c.frequency), "re": complex(c).real, "im": complex(c).imag}
        for c in cells
    ]


def write_reports(directory: Path) -> None:
    """reports of an axis, and of each kind of chart with the numbers of one of them."""
    axis = servo_report("speed-axis", lm.commission(lm.load("speed-axis")))
    (directory / "servo.html").write_text(render(axis))
    joint = lm.load("catalogue-robot-joint")
    (directory / "run.html").write_text(render(run_report("joint", lm.simulate(joint))))
    (directory / "check.html").write_text(render(check_report("joint", check_drive(joint), joint.title)))
    response = lm.frequency_response(joint, [1.0, 3.0, 9.0], [0.1, 0.5])
    (directory / "response.html").write_text(render(response_report({"joint": response}, joint, "load_speed")))
    x = np.geomspace(0.1, 1000.0, 200)
    y = np.where(x > 100.0, np.nan, 10.0 / x)
    named = Curve("designs", np.arange(3.0), np.array([2.0, 1.0, 3.0]), DOTS, names=("first", "second", "third"))
    bode = Panel("Gain", "frequency [Hz]", "gain [-]", (Curve("falling", x, y, look(0)), Curve("level", x, 0 * x + 1.0, look(1))),
                 log_x=True, log_y=True, level=1.0, marks=(Mark(10.0, 1.0, "10 Hz", look(0)),))  # fmt: skip
    phase = Panel(
        "Phase", "frequency [Hz]", "phase [deg]", (Curve("falling", x, -90.0 * x / (x + 10.0), look(0)),), log_x=True
    )
    ground = Ground(x, np.array([1.0, 2.0]), np.vstack([np.log(x), 2.0 * np.log(x)]), "logarithm")
    time = np.linspace(0.0, 1.0, 101)
    charts = (
        bode,
        phase,
        Panel("Map", "frequency [Hz]", "amplitude", (), log_x=True, ground=ground),
        Panel("Designs", "cost", "mass", (named,)),
        Contacts("Contacts", time, {"motor": np.sign(np.round(time - 0.5, 1)), "load": 0.0 * time}),
        Flows("Energy", {"source": 2.0, "gear_losses": -1.5, "stored_change": 0.5}),
        Bars("Influence", "rank correlation [-]", {"a": (0.5, 0.1), "b": (-0.7, 0.2)}, ("first", "total")),
        Histogram("Peaks", "torque [N·m]", np.sin(np.arange(200.0))),
        Matrix("Correlations", ("a", "b"), np.array([[1.0, -0.97], [-0.97, 1.0]])),
    )
    table = Table("Values", ("what", "value [N·m]"), [["one", "1.5"], ["two", "2"]], marked=frozenset({1}))
    words = Prose("What is computed", ("All of it, from `x`.",))
    verdict = Verdict("does not fit", ("Something is wrong.",))
    page = Report("All charts", "Each kind of chart.", verdict, Group("main", "Charts", "", charts), (table, words))
    (directory / "charts.html").write_text(render(page))
    numbers = {"x": x.tolist(), "y": [None if math.isnan(v) else v for v in y]}
    (directory / "charts.json").write_text(json.dumps(numbers))


def write_by_commands(directory: Path) -> None:
    """Reports of the commands, as a user gets them."""
    for page, commands in COMMANDS.items():
        for command in commands:
            argv = [sys.executable, "-m", "lostmotion", *command]
            ran = subprocess.run(argv, check=False, cwd=directory, capture_output=True, text=True)
            # 3: written, and its verdict is not decided.
            if ran.returncode not in (0, 1, 3):
                raise SystemExit(f"{' '.join(argv)} ends with {ran.returncode}: {ran.stderr}")
        (directory / page / f"{page}.html").rename(directory / f"{page}.html")


def main(directory: Path) -> None:
    """For each page NAME.html and NAME.json."""
    directory.mkdir(parents=True, exist_ok=True)
    write_reports(directory)
    write_by_commands(directory)
    # So long that its beginning is shown before the whole is there.
    write_page(directory / "long.html", lm.load("joint-under-gravity", {"simulation.duration": 30.0}))
    write_page(directory / "slide.html", lm.load("ball-screw-axis", {"simulation.duration": 0.5}))
    for page, (name, changes) in PAGES.items():
        scenario = lm.load(name)
        write_page(directory / f"{page}.html", scenario)
        expected = {
            "changes": changes,
            "as_it_is": samples(scenario),
            "changed": samples(scenario.replace(**changes)),
            "explained": explanations(scenario, page),
            "responses": responses(scenario) if page == "drive" else [],
        }
        (directory / f"{page}.json").write_text(json.dumps(expected))


main(Path(sys.argv[1]))
