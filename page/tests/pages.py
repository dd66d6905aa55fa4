"""Writes what the browser tests open: pages of shipped scenarios, and the samples that Python has of the same runs.

python pages.py DIRECTORY
"""

import json
import math
import sys
from pathlib import Path

import lostmotion as lm
from lostmotion.live_page.page import write_page

# Page -> scenario, and what the test changes on it by its address.
PAGES = {
    "drive": (
        "paper-2dof-nl-small",
        {"load.inertia": 3.25, "command.amplitude": 0.05, "gearbox.stiffness.backlash": 1e-3},
    ),
    "worm": ("worm-lowering", {"shafts.drum.inertia": 2.5, "gears.worm_gear.stiffness.stiffness": 8e3}),
    "axis": ("hunting-with-backlash", {"controller.position.gain": 8.0}),
}


def samples(scenario: lm.Scenario | lm.TrainScenario) -> dict[str, list[float | None]]:
    """All variables; what is undefined as null."""
    result = lm.simulate(scenario)
    columns = {str(name): result[name].values.tolist() for name in result.data_vars}
    return {name: [None if math.isnan(v) else v for v in column] for name, column in columns.items()}


def main(directory: Path) -> None:
    """For each page NAME.html and NAME.json."""
    directory.mkdir(parents=True, exist_ok=True)
    for page, (name, changes) in PAGES.items():
        scenario = lm.load(name)
        write_page(directory / f"{page}.html", scenario)
        expected = {"changes": changes, "as_it_is": samples(scenario), "changed": samples(scenario.replace(**changes))}
        (directory / f"{page}.json").write_text(json.dumps(expected))


main(Path(sys.argv[1]))
