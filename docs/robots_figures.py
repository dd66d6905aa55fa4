"""Figures of docs/robots.md: units and signs in one drawing, and the six-axis arm of examples/mujoco_arm.py."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

from matplotlib.patches import Arc, Circle, FancyArrow, Rectangle

from lostmotion.reports import plots
from lostmotion.reports.looks import INK, LOOKS, PALETTE
from lostmotion.reports.panels import Curve, Panel

EXAMPLE = Path(__file__).parent.parent / "examples" / "mujoco_arm.py"


def example() -> Any:
    """The example as a module."""
    spec = importlib.util.spec_from_file_location("mujoco_arm", EXAMPLE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@plots.in_our_looks
def signs(out: Path) -> None:
    """A motor, a gearbox and a link, with every quantity and the direction in which it counts."""
    figure = plots.Picture(figsize=(9.0, 3.3), layout="none")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(0, 9), ylim=(0, 3.3), aspect="equal")
    axes.axis("off")
    ink, accent = INK, PALETTE["first"]
    for x, y, width, height, text in ((0.5, 1.25, 1.3, 0.9, "motor"), (3.3, 1.05, 1.5, 1.3, "gearbox\nratio $i$")):
        axes.add_patch(Rectangle((x, y), width, height, fill=False, edgecolor=ink, linewidth=1.4))
        axes.text(x + 0.5 * width, y + 0.5 * height, text, ha="center", va="center")
    axes.plot([1.8, 3.3], [1.7, 1.7], color=ink, linewidth=3)
    axes.plot([4.8, 6.6], [1.7, 1.7], color=ink, linewidth=5)
    axes.add_patch(Circle((6.75, 1.7), 0.16, fill=False, edgecolor=ink, linewidth=1.6))
    axes.plot([6.9, 8.6], [1.75, 2.25], color=ink, linewidth=7, solid_capstyle="round")
    axes.text(7.9, 1.62, "link (MuJoCo)", ha="center")

    def turning(x: float, label: str) -> None:
        axes.add_patch(Arc((x, 1.7), 0.34, 0.9, theta1=100, theta2=350, color=accent, linewidth=1.5))
        axes.add_patch(
            FancyArrow(x + 0.165, 1.62, 0.0, 0.1, width=0.004, head_width=0.11, head_length=0.12, color=accent)
        )
        axes.text(x, 2.48, label, ha="center", va="bottom", color=accent)

    turning(2.55, "ctrl: torque of a torque source [N·m]\nmotor_speed [rad/s]")
    turning(5.9, "arm.torque, on the joint [N·m]\nqvel = load_speed, qpos = load_angle")
    axes.text(4.05, 0.78, "twist = motor angle / i - qpos  [rad]", ha="center", va="top", color=accent)
    axes.text(
        4.05,
        0.42,
        "output_torque, input_torque [N·m]; input_contact -1, 0 (stuck), +1",
        ha="center",
        va="top",
        color=accent,
    )
    axes.text(
        0.1,
        3.1,
        "All arrows are positive together: the motor turns as the joint does, i times as fast.",
        va="top",
        color=ink,
    )
    figure.savefig(out / "robots-signs.png", dpi=110, metadata={"Software": None})


def tracking(out: Path) -> None:
    """How far the tip of the arm is from its reference, with ideal gears and with those of the catalogue."""
    arm = example()
    curves = []
    for label, ideal, style in (("strain wave gears", False, LOOKS[0]), ("ideal gears", True, LOOKS[1])):
        times, errors = arm.track(ideal=ideal)
        curves.append(Curve(label, times, 1e3 * errors, style))
    panel = Panel("tip of the six-axis arm", "time [s]", "distance from the reference [mm]", tuple(curves))
    plots.draw([panel], 1, (8.0, 3.4)).savefig(out / "robots-tracking.png", metadata={"Software": None})


def write(out: Path) -> None:
    """All figures of the page into a directory."""
    signs(out)
    tracking(out)


if __name__ == "__main__":
    from generate import OUT

    OUT.mkdir(exist_ok=True)
    write(OUT)
