"""Figures and the table of docs/self-locking.md, from the exact solver and from `lostmotion.sizing.self_locking`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from figure_files import save

import lostmotion as lm
from lostmotion.data_sheets.components import gearbox_table
from lostmotion.reports import plots
from lostmotion.reports.figure_style import FAINT, FIRST, INK, MUTED, PALETTE, SECOND
from lostmotion.reports.panels import Curve, Panel

WORM, RATIO, STIFFNESS, LOAD = 1e-4, 50.0, 1e4, 20.0  # kg m2, -, N m/rad, N m: those of `worm-lowering`
ETAS = np.linspace(-0.95, -0.05, 13)
RATIOS = np.geomspace(0.7, 45.0, 13)
DAMPING, OIL = 0.05, 0.1  # of the map: damping ratio of the mesh; viscous friction of the worm/(J_1 omega)


def histories(out: Path) -> None:
    """Holding, smooth lowering and chatter over time."""
    base = lm.load("worm-lowering")
    hung = {"simulation.duration": 0.6, "simulation.sample_interval": 1e-4}
    holding = base.replace(
        **hung, **{"command.motor.steps": (), "shafts.drum.torque.steps": [{"height": 20.0, "time": 0.1}]}
    )
    runs = {
        "holding: the load doubles at 0.1 s, motor off": holding,
        "smooth lowering: drum of 0.5 kg·m²": base.replace(**hung, **{"shafts.drum.inertia": 0.5}),
        "chatter: drum of 2 kg·m²": base.replace(**hung),
    }
    speeds, torques = [], []
    for title, scenario in runs.items():
        run = lm.simulate(scenario)
        t, ratio = run["time"].values, scenario.gears["worm_gear"].ratio
        speeds.append(
            Panel(
                title,
                "time [s]",
                "speed [rad/s]",
                (
                    Curve("worm", t, run["worm_speed"].values, FIRST),
                    Curve("drum times ratio", t, ratio * run["drum_speed"].values, SECOND),
                ),
                y_range=(-125.0, 95.0),
            )
        )
        torques.append(
            Panel(
                "torque of the worm gear",
                "time [s]",
                "at the output [N·m]",
                (
                    Curve("mesh", t, run["worm_gear_output_torque"].values, FIRST),
                    Curve("load", t, run["drum_load_torque"].values, FAINT),
                ),
                y_range=(-170.0, 250.0) if "chatter" in title else (-10.0, 70.0),
            )
        )
    save([*speeds, *torques], 3, (11.0, 5.6), out, "self-locking-histories")


def three_degrees(out: Path) -> None:
    """One cycle of the chatter with a soft coupling: the worm locks, the rotor swings on."""
    scenario = lm.load("worm-lowering").replace(
        **{
            "gears.coupling.stiffness.stiffness": 3.0,
            "gears.coupling.mesh_damping": 2e-4,
            "simulation.duration": 0.45,
            "simulation.sample_interval": 5e-5,
        }
    )
    run = lm.simulate(scenario).sel(time=slice(0.2, 0.45))
    t = run["time"].values
    locked = np.where(run["worm_contact"].values == 0.0, 0.0, np.nan)
    speeds = (
        Curve("rotor", t, run["rotor_speed"].values, SECOND),
        Curve("worm", t, run["worm_speed"].values, FIRST),
        Curve("worm locked", t, locked, {"color": INK, "linewidth": 4.0, "solid_capstyle": "butt"}),
    )
    drawn = [
        Panel("speeds", "time [s]", "speed [rad/s]", speeds),
        Panel(
            "torques at the worm",
            "time [s]",
            "torque [N·m]",
            (
                Curve("coupling", t, run["coupling_output_torque"].values, SECOND),
                Curve("worm gear, input", t, run["worm_gear_input_torque"].values, FIRST),
            ),
        ),
    ]
    save(drawn, 2, (10.0, 3.4), out, "self-locking-three-degrees")


def lowering(
    eta_b: float, mass: float, *, stiffness: float = STIFFNESS, damping: float = 0.0, viscous: float = 0.0
) -> lm.Scenario:
    """A worm that lowers its load at the speed of its own swing; 2 % beside the steady motion."""
    swing = math.sqrt(stiffness / mass)
    speed = LOAD / stiffness * swing * RATIO
    duration = 1500.0 / swing
    losses = lm.model.MeshEfficiency(drive_efficiency=0.4, backdrive_efficiency=eta_b)
    gear = lm.Gear(
        input="worm",
        output="drum",
        ratio=RATIO,
        stiffness=lm.model.LinearStiffness(stiffness=stiffness),
        mesh_damping=damping,
        losses=losses,
    )
    return lm.Scenario(
        shafts={"worm": {"inertia": WORM, "viscous_friction": viscous}, "drum": {"inertia": mass, "torque": LOAD}},
        motors={"motor": {"shaft": "worm", "kind": "torque_source", "rotor_inertia": 0.0}},
        gears={"gear": gear},
        command={"motor": eta_b * LOAD / RATIO - viscous * speed},
        initial={"speeds": {"worm": -speed, "drum": -0.98 * speed / RATIO}, "twists": {"gear": LOAD / stiffness}},
        simulation={"duration": duration, "sample_interval": duration / 3000},
    )


def chatters(scenario: lm.Scenario) -> bool:
    """Whether the worm locks, or its mesh swings through zero, in the last tenth of a run."""
    run = lm.simulate(scenario, energy=False)
    stops = lm.switchings_of(run)["cause"].values == "came to rest"
    return bool(stops.any() or (run["gear_output_torque"].values[-300:] < 0.0).any())


def map_points() -> list[tuple[float, float, bool, bool]]:
    """(eta_b, inertia ratio, said to chatter, does chatter) with oil on the worm and damping in the mesh."""
    points = []
    for eta_b in ETAS:
        for ratio in RATIOS:
            mass = ratio * WORM * RATIO**2
            swing = math.sqrt(STIFFNESS / mass)
            values = {"damping": 2.0 * DAMPING * math.sqrt(STIFFNESS * mass), "viscous": OIL * WORM * swing}
            scenario = lowering(eta_b, mass, **values)
            said = lm.sizing.self_locking(scenario.train(), "gear", LOAD).lowering == "chatters"
            points.append((float(eta_b), float(ratio), said, chatters(scenario)))
    return points


def growth(eta_b: float, ratio: float, stiffness: float) -> tuple[float, float]:
    """(rate by the closed form, rate that a run shows) [1/s], without damping."""
    mass = ratio * WORM * RATIO**2
    theory = math.sqrt(stiffness * (-eta_b / (WORM * RATIO**2) - 1.0 / mass))
    scenario = lowering(eta_b, mass, stiffness=stiffness)
    small = {"speeds": {"worm": -1e3, "drum": -1e3 / RATIO}, "twists": {"gear": LOAD / stiffness * (1.0 + 1e-6)}}
    times = {"duration": 10.0 / theory, "sample_interval": 0.05 / theory}
    run = lm.simulate(
        lm.Scenario(**scenario.model_dump(exclude={"initial", "simulation"}), initial=small, simulation=times),
        energy=False,
    )
    off = np.abs(run["gear_output_torque"].values - LOAD)
    return theory, float(np.polyfit(run["time"].values[100:], np.log(off[100:]), 1)[0])


@plots.in_our_looks
def chatter_map(out: Path) -> None:
    """Chatter over backward efficiency and inertia ratio, and its rate over the stiffness."""
    points = map_points()
    figure = plots.Picture(figsize=(10.5, 4.8))
    left, right = figure.subplots(1, 2)
    for does, marker, label in (
        (True, {"marker": "o", "color": PALETTE["first"]}, "chatters in the run"),
        (False, {"marker": "o", "facecolors": "none", "edgecolors": MUTED}, "smooth in the run"),
    ):
        x, y = zip(*((e, r) for e, r, _, d in points if d is does), strict=True)
        left.scatter(x, y, s=26, label=label, **marker)
    eta = np.linspace(-1.0, -0.03, 300)
    left.plot(eta, -1.0 / eta, color=INK, linewidth=1.3, label=r"paradox of rigid friction, $1/|\eta_b|$")
    left.plot(
        ETAS,
        [boundary(float(e)) for e in ETAS],
        color=PALETTE["second"],
        linestyle="--",
        linewidth=1.6,
        label="verdict, with oil and mesh damping",
    )
    left.set(
        xlabel=r"backward efficiency $\eta_b$ [-]",
        ylabel="inertia ratio $J_2/(J_1 i^2)$ [-]",
        yscale="log",
        ylim=(0.6, 55.0),
        title=r"$\zeta$ = 0.05 in the mesh, $b = 0.1\, J_1\sqrt{k/J_2}$ at the worm",
    )
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower left", ncols=2)
    stiffnesses = np.geomspace(1e3, 1e5, 7)
    for (eta_b, ratio), line in zip(((-0.2, 8.0), (-0.6, 3.0), (-0.6, 10.0)), ("-", "--", ":"), strict=True):
        rates = [growth(eta_b, ratio, float(k)) for k in stiffnesses]
        right.plot(
            stiffnesses,
            [r for r, _ in rates],
            color=INK,
            linestyle=line,
            linewidth=1.2,
            label=rf"$\eta_b$ = {eta_b:g}, $J_2/(J_1 i^2)$ = {ratio:g}",
        )
        right.plot(stiffnesses, [r for _, r in rates], "o", color=PALETTE["first"], markersize=4.5)
    right.set(
        xlabel="stiffness of the mesh $k$ [N·m/rad]",
        ylabel=r"growth of a disturbance $\lambda$ [1/s]",
        xscale="log",
        yscale="log",
        title="without damping: closed form (lines), runs (points)",
    )
    right.legend()
    right.set_yticks([20, 50, 100, 200, 400])
    right.yaxis.set_minor_formatter("")
    right.yaxis.set_major_formatter("{x:g}")
    left.yaxis.set_major_formatter("{x:g}")
    left.set_yticks([1, 2, 5, 10, 20, 50])
    left.yaxis.set_minor_formatter("")
    figure.savefig(out / "self-locking-map.png", dpi=100, metadata={"Software": None})


def boundary(eta_b: float) -> float:
    """Inertia ratio at which the verdict changes, with the damping of the map."""
    low, high = 0.05, 500.0
    for _ in range(40):
        ratio = math.sqrt(low * high)
        mass = ratio * WORM * RATIO**2
        values = {
            "damping": 2.0 * DAMPING * math.sqrt(STIFFNESS * mass),
            "viscous": OIL * WORM * math.sqrt(STIFFNESS / mass),
        }
        train = lowering(eta_b, mass, **values).train()
        if lm.sizing.self_locking(train, "gear", LOAD).lowering == "chatters":
            high = ratio
        else:
            low = ratio
    return math.sqrt(low * high)


def worm_page() -> str:
    """The page of the shipped worm gears."""
    about = "This page is for those who select a worm gear. [Self-locking](../self-locking.md#the-worm-gears-of-the-catalogue) describes the columns."
    return f"# Worm gears of the catalogue\n\n{about}\n\n{worm_table()}"


def worm_table() -> str:
    """The shipped worm gears: what is said of each."""
    lines = [
        "| record | i | η_f | η_b in motion | η_b at rest | verdict | least torque to lower, of M/i | motion under load unstable above J_2/(J_1 i²) |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for record in lm.catalogue():
        if record.kind != "worm" or not record.losses.efficiency:  # nothing is known of it
            continue
        gearbox = lm.Gearbox(**worm_values(record))
        at = lm.sizing.overrunning(gearbox)
        verdict = (
            "locks, and stops its load" if at.stops else "holds, but does not stop its load" if at.holds else "overruns"
        )
        least = f"{at.input_torque * gearbox.ratio / at.load_torque:.2f}" if at.holds else "none"
        critical = f"{at.critical_inertia_ratio:.2g}" if at.slope < 0.0 else ""
        lines.append(
            f"| `{record.name}` | {record.ratio:g} | {at.forward_efficiency:.2f} | {at.backward_efficiency:.2f} | {at.static_efficiency:.2f} | "
            f"{verdict} | {least} | {critical} |"
        )
    return "\n".join([*lines, ""])


def worm_values(record: Any) -> dict[str, Any]:
    """Values of a worm record, with stand-ins for what it lacks and no efficiency depends on."""
    changes: dict[str, Any] = {"inertia": 0.0, "stiffness": {"kind": "rigid"}}
    if record.rated_output_torque is None:
        changes["rated_output_torque"] = 1.0
    return gearbox_table(record.name, changes)[0]


def write(out: Path) -> None:
    """All of the page's figures into a directory."""
    histories(out)
    three_degrees(out)
    chatter_map(out)
