"""The figure of a run of a drive train."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from ..model.train import DriveTrain
from ..simulation.results import scenario_of
from ..simulation.train_parts import parts_of
from ..simulation.train_scenario import TrainScenario
from .panels import COMMAND_STYLE, STYLES, Curve, Panel
from .plots import draw

if TYPE_CHECKING:
    import xarray

# From the foreground to the background, different in grey too.
LOOKS: tuple[dict[str, Any], ...] = (
    *STYLES.values(),
    COMMAND_STYLE,
    {"color": "#7b2d8b", "linestyle": (0, (5, 1)), "linewidth": 1.3},
    {"color": "#111111", "linestyle": (0, (1, 1)), "linewidth": 1.3},
)


def train_overview(result: xarray.Dataset) -> Figure:
    """A run of a drive train at a glance: commands, speeds, torques, twists and contacts of all elements."""
    scenario = scenario_of(result)
    assert isinstance(scenario, TrainScenario)
    train = scenario.train()
    torques = [(f"{name}_torque", name, 1.0) for name in train.motors]
    panels = [
        ("command [-]", [(f"{name}_command", name, 1.0) for name in scenario.commanded()]),
        ("torque of motor [N·m]", torques),
        *(_speeds(part.train()) for part in parts_of(scenario)),
        (
            "torque at output of gear, of load [N·m]",
            [(f"{name}_output_torque", name, 1.0) for name in train.gears]
            + [(f"{name}_load_torque", f"load on {name}", 1.0) for name in scenario.loaded()],
        ),
        (
            "twist [mrad]",
            [(f"{name}_twist", name, 1e3) for name, g in train.gears.items() if g.stiffness.kind != "rigid"],
        ),
        (
            "contact: -1, 0 stuck, +1",
            [
                (str(name), str(name).removesuffix("_contact").replace("_", " "), 1.0)
                for name in result
                if str(name).endswith("_contact")
            ],
        ),
    ]
    shown = [Panel("", "time [s]", label, _curves(result, curves)) for label, curves in panels]
    note = result.attrs.get("warning", "") or result.attrs.get("note", "")
    panels_shown = [panel for panel in shown if panel.curves]
    rows = max(3, -(-len(panels_shown) // 2))
    figure = draw(panels_shown, 2, (10.0, 8.0 * rows / 3), note=note)
    if result.attrs.get("title"):
        figure.suptitle(result.attrs["title"])
    return figure


def _speeds(train: DriveTrain) -> tuple[str, list[tuple[str, str, float]]]:
    """Label and curves of the panel of speeds of a train that hangs together, all in terms of its last shaft."""
    last = list(train.shafts)[-1]
    curves = [
        (f"{name}_speed", f"{name} / {ratio:.4g}".removesuffix(" / 1"), 1.0 / ratio)
        for name, ratio in ratios_to(train, last).items()
    ]
    return f"speed at {last} [rad/s]", curves


def _curves(result: xarray.Dataset, curves: list[tuple[str, str, float]]) -> tuple[Curve, ...]:
    t = result["time"].values
    there = [(name, label, factor) for name, label, factor in curves if name in result]
    return tuple(
        Curve(label, t, factor * result[name].values, LOOKS[k % len(LOOKS)])
        for k, (name, label, factor) in enumerate(there)
    )


def ratios_to(train: DriveTrain, last: str) -> dict[str, float]:
    """For each shaft its speed over that of the last one, by the gears between them; 1 where there are none."""
    ratios = {last: 1.0}
    waiting = [last]
    while waiting:
        shaft = waiting.pop()
        for gear in train.fixed_gears().values():
            for near, far, ratio in (
                (gear.output, gear.input, gear.ratio),
                (gear.input, gear.output, 1.0 / gear.ratio),
            ):
                if near == shaft and far not in ratios:
                    ratios[far] = ratio * ratios[near]
                    waiting.append(far)
    return {name: ratios.get(name, 1.0) for name in train.shafts}
