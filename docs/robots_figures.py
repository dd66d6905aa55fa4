"""Figures of docs/robots.md: the six-axis arm of examples/mujoco_arm.py, the quadruped of mujoco_quadruped.py."""

from __future__ import annotations

import importlib.util
import io
import sys
from pathlib import Path
from typing import Any

import numpy as np
from figure_files import save
from PIL import Image

from lostmotion.reports import plots
from lostmotion.reports.figure_style import INK, LOOKS, MUTED
from lostmotion.reports.panels import Curve, Panel

EXAMPLES = Path(__file__).parent.parent / "examples"
KINDS = {"strain wave": LOOKS[0], "ideal": LOOKS[1], "quasi-direct": LOOKS[2]}
FRAME, FRAMES_FROM, SECONDS_A_FRAME = 20, 1000, 0.08  # steps of the trot


def example(name: str) -> Any:
    """An example as a module."""
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def tracking(out: Path) -> None:
    """How far the tip of the arm is from its reference, with ideal gears and with those of the catalogue."""
    arm = example("mujoco_arm")
    curves = []
    for label, ideal, style in (("strain wave gears", False, LOOKS[0]), ("ideal gears", True, LOOKS[1])):
        times, errors = arm.track(ideal=ideal)
        curves.append(Curve(label, times, 1e3 * errors, style))
    panel = Panel("tip of the six-axis arm", "time [s]", "distance from the reference [mm]", tuple(curves))
    save([panel], 1, (8.0, 3.4), out, "robots-tracking")


def hunting(out: Path) -> None:
    """Limit cycle of the pan joint, whose position loop has an integrator and reads an encoder on the joint."""
    arm = example("mujoco_arm")
    curves = []
    for label, gap, style in (("as new", 0.0, LOOKS[0]), ("backlash of 1 mrad by wear", 1e-3, LOOKS[1])):
        times, angles = arm.hunt(added_backlash=gap)
        curves.append(Curve(label, times[2000:], 1e3 * (angles[2000:] - arm.TARGET), style))
    panel = Panel("pan joint of the arm, encoder on the joint", "time [s]", "position error [mrad]", tuple(curves))
    save([panel], 1, (8.0, 3.2), out, "robots-hunting")


def quadruped(out: Path, trots: dict[str, Any], squats: dict[str, Any]) -> None:
    """Trunk and knee in a squat; ground force and work of the motors in a trot."""
    work = {kind: np.cumsum(run.power) * (run.times[1] - run.times[0]) for kind, run in trots.items()}
    charts = (
        ("trunk below its reference, squat", "[mm]", {k: 1e3 * r.sag for k, r in squats.items()}),
        ("front left knee, error in the squat", "[mrad]", {k: 1e3 * r.errors[:, 2] for k, r in squats.items()}),
        ("ground force on the front left foot, trot", "[N]", {k: r.forces[:, 0] for k, r in trots.items()}),
        ("work of all motors, trot", "[J]", work),
    )
    panels = []
    for title, unit, values in charts:
        times = next(iter(trots.values())).times
        curves = tuple(Curve(kind, times, y, KINDS[kind]) for kind, y in values.items())
        panels.append(Panel(title, "time [s]", unit, curves))
    save(panels, 2, (9.0, 5.6), out, "robots-quadruped")


def outline(example: Any, model: Any, q: np.ndarray) -> dict[str, np.ndarray]:
    """Hip, knee and foot of each leg [m], forwards and upwards."""
    import mujoco

    data = mujoco.MjData(model)
    data.qpos[:] = q
    mujoco.mj_kinematics(model, data)
    return {
        leg: np.array([*(data.body(f"{leg}_{part}").xpos for part in ("hip", "knee")), data.geom(leg).xpos])[:, ::2]
        for leg in example.LEGS
    }


def stick_figure(axes: Any, legs: dict[str, np.ndarray], colour: str, faint: float) -> None:
    """A robot from its left side; `faint` is the share of opacity."""
    for leg in ("FR", "RR", "FL", "RL"):
        opacity = faint * (1.0 if leg.endswith("L") else 0.45)
        axes.plot(
            *legs[leg].T, color=colour, alpha=opacity, linewidth=4.5, solid_capstyle="round", solid_joinstyle="round"
        )
        axes.plot(*legs[leg][-1], "o", color=colour, alpha=opacity, markersize=7)
    front, rear = (np.mean([legs[f"{end}{side}"][0] for side in "LR"], axis=0) for end in "FR")
    axes.plot(*np.array([rear, front]).T, color=colour, alpha=faint, linewidth=17, solid_capstyle="round")


@plots.in_our_looks
def trot(out: Path, runs: dict[str, Any]) -> None:
    """A period of the trot in slow motion, over a faint robot with ideal joints."""
    import mujoco

    legged = example("mujoco_quadruped")
    model = mujoco.MjModel.from_xml_string(legged.mjcf())
    steps = round(legged.PERIOD / legged.STEP)
    frames = []
    for k in range(FRAMES_FROM, FRAMES_FROM + steps, FRAME):
        figure = plots.Picture(figsize=(9.2, 2.75), layout="none")
        for n, kind in enumerate(("quasi-direct", "strain wave")):
            axes = figure.add_axes((0.51 * n, 0.0, 0.49, 1.0))
            axes.set(xlim=(-0.385, 0.335), ylim=(-0.06, 0.379))
            axes.axis("off")
            for name, colour, faint in (("ideal", MUTED, 0.3), (kind, str(KINDS[kind]["color"]), 1.0)):
                run = runs[name]
                begin, end = run.poses[FRAMES_FROM, 0], run.poses[FRAMES_FROM + steps, 0]
                camera = begin + (end - begin) * (k - FRAMES_FROM) / steps
                q = run.poses[k].copy()
                q[0] -= camera
                legs = outline(legged, model, q)
                stick_figure(axes, legs, colour, faint)
            axes.plot([-0.385, 0.335], [0.0, 0.0], color=INK, linewidth=1.5)
            mark = 0.5 * (end - begin)
            for x in np.arange(-10, 11) * mark - (camera - begin) % mark:
                axes.plot([x, x - 0.02], [0.0, -0.02], color=MUTED, linewidth=1.5, clip_on=True)
            for leg, force in zip(legged.LEGS, run.forces[k], strict=True):
                if force > 5.0:
                    foot = legs[leg][-1][0]
                    axes.annotate(
                        "",
                        (foot, 0.002 * force),
                        (foot, 0.0),
                        arrowprops={"arrowstyle": "->", "color": INK, "linewidth": 2.0},
                    )
            axes.text(-0.37, 0.335, f"{kind} drives", color=str(KINDS[kind]["color"]), fontsize=14)
        figure.text(
            0.99, 0.02, "a quarter of real time; grey: ideal joints; arrows: ground forces", ha="right", color=MUTED
        )
        png = io.BytesIO()
        figure.savefig(png, format="png", dpi=65)
        frames.append(Image.open(png).convert("RGB").quantize(16, dither=Image.Dither.NONE))
    path, milliseconds = out / "robots-trot.gif", round(1e3 * SECONDS_A_FRAME)
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=milliseconds, loop=0, optimize=True)


def write(out: Path) -> None:
    """All figures of the page into a directory."""
    tracking(out)
    hunting(out)
    legged = example("mujoco_quadruped")
    trots, squats = ({kind: legged.move(kind, gait, 2.0) for kind in KINDS} for gait in ("trot", "squat"))
    quadruped(out, trots, squats)
    trot(out, trots)
