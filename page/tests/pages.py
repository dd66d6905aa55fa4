"""Writes what the browser tests open: pages of shipped scenarios, and the samples that Python has of the same runs.

python pages.py DIRECTORY
"""

import json
import math
import sys
from pathlib import Path
from typing import Any

import lostmotion as lm
from lostmotion.live_page.page import write_page

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
# Instants at which Python says what stands still [s].
INSTANTS = {"drive": (0.0, 0.05, 0.6667, 0.9), "worm": (0.05, 0.31, 1.4), "axis": (0.0101, 0.8003, 2.5003)}


def samples(scenario: lm.Scenario | lm.TrainScenario) -> dict[str, list[float | None]]:
    """All variables; what is undefined as null."""
    result = lm.simulate(scenario)
    columns = {str(name): result[name].values.tolist() for name in result.data_vars}
    return {name: [None if math.isnan(v) else v for v in column] for name, column in columns.items()}


def explanations(scenario: lm.Scenario | lm.TrainScenario, name: str) -> list[dict[str, Any]]:
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
        if isinstance(told, lm.Explanation):
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


def main(directory: Path) -> None:
    """For each page NAME.html and NAME.json."""
    directory.mkdir(parents=True, exist_ok=True)
    # So long that its beginning is shown before the whole is there.
    write_page(directory / "long.html", lm.load("joint-under-gravity", {"simulation.duration": 30.0}))
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
