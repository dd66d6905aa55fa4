"""The tasks of examples/tasks: their demands against the arithmetic of a spreadsheet, and which pairs fit."""

import math
from functools import cache
from typing import Any

import numpy as np
import pytest

import lostmotion as lm
from conftest import ROOT
from lostmotion.sizing.winding_temperature import rms
from lostmotion.studies.runs.candidate_rows import Axes
from lostmotion.studies.study.study_definition import Study

TASKS = ROOT / "examples" / "tasks"
G, DEG = 9.80665, math.pi / 180.0
BY_HAND = 1e-6  # relative: what jumps is resolved to 1e-9 of an interval
ARC = 2e-4  # relative: what bends is sampled a thousand times a cycle, so that a peak is missed by (pi/1000)^2 and less


@cache
def task(name: str) -> Study:
    return lm.studies.load_task(TASKS / f"{name}.toml")


def motion(name: str) -> Any:
    return Axes(task(name)).motion(task(name).parameters(0, 1)[0])


def peak(values: np.ndarray) -> float:
    return float(np.abs(values).max())


def spreadsheet(rows: list[tuple[float, float]]) -> float:
    """Root mean square of rows of time and torque."""
    return math.sqrt(sum(t * x**2 for t, x in rows) / sum(t for t, _ in rows))


def at(found: Any, time: float, values: np.ndarray) -> float:
    return float(np.interp(time, found.time, values))


def findings(name: str, row: int = 0) -> dict[str, Any]:
    """Those of one pair, by rule."""
    return {f.rule: f for f in Axes(task(name)).judged(task(name).parameters(row, row + 1)[0])}


def test_robot_shoulder():
    found = motion("robot-shoulder")
    arm, tool = 20.0 * G * 0.6, 2.0 * G * 0.8
    assert arm == pytest.approx(117.7, abs=0.05)
    # Up: level at 30 degrees, in the middle of the move, which lasts 60/80 + 80/200 s = 1.15 s. Constant speed: friction of 3 N m.
    assert at(found, 0.575, found.torque) == pytest.approx(arm + 3.0, rel=ARC)
    assert at(found, 1.3, found.torque) == pytest.approx(arm * math.sin(120.0 * DEG), rel=BY_HAND)
    # Down from 1.5 s on, with the tool: it starts 60 degrees beyond hanging by 60, and accelerates downwards.
    J = 9.0 + 2.0 * 0.8**2
    down = (arm + tool) * math.sin(120.0 * DEG) - J * 200.0 * DEG - 3.0
    assert at(found, 1.5 + 1e-6, found.torque) == pytest.approx(down, rel=1e-4)
    # The largest: braking on the way down, at its end 60 degrees above hanging, or just before: from 16 degrees on.
    brakes = max((arm + tool) * math.sin((60.0 + 0.01 * k) * DEG) for k in range(1600)) + J * 200.0 * DEG - 3.0
    assert peak(found.torque) == pytest.approx(brakes, rel=ARC)
    rules = findings("robot-shoulder", 1)  # harmonic-drive-shg-40-160-2uh
    assert 3.0 * rules["holding_brake"].use == pytest.approx((arm + tool) / 160.0, rel=ARC)


def test_indexing_table():
    found = motion("indexing-table")
    inertial = 0.6 * 2250.0 * DEG
    rows = [(0.1, inertial + 4.0), (0.1, 4.0), (0.1, 4.0 - inertial), (0.5, 0.0)]
    assert inertial == pytest.approx(23.56, abs=5e-3)
    assert peak(found.torque) == pytest.approx(27.56, abs=5e-3)
    assert rms(found.time, found.torque) == pytest.approx(spreadsheet(rows), rel=BY_HAND)
    assert spreadsheet(rows) == pytest.approx(12.03, abs=5e-3)
    assert float(found.position.max()) == pytest.approx(45.0 * DEG)


def test_vertical_ball_screw():
    found = motion("vertical-ball-screw")
    weight = 40.0 * G
    assert at(found, 0.05, found.torque) == pytest.approx(weight + 60.0 + 200.0, rel=BY_HAND)
    assert at(found, 0.3, found.torque) == pytest.approx(weight + 60.0, rel=BY_HAND)
    assert peak(found.torque) == pytest.approx(652.27, abs=5e-3)
    # Up in 0.7 s, rest, and down from 1.0 s on: screw of 10 mm lead, efficiency 0.9 and 2 - 1/0.9.
    axes = Axes(task("vertical-ball-screw"))
    row = next(r for r in task("vertical-ball-screw").parameters(0, 4) if axes.stage(r)[0].lead == 10e-3)
    stage, turning, rules = axes.stage(row)
    steel = math.pi / 32.0 * 7850.0 * 0.7 * 20e-3**4
    up = (652.27 * 10e-3 / (2.0 * math.pi * 0.9)) + steel * 5.0 * 2.0 * math.pi / 10e-3 + stage.drag_torque
    assert at(turning, 0.05, turning.torque) == pytest.approx(up, rel=1e-5)
    down = (weight - 60.0) * 10e-3 / (2.0 * math.pi) * (2.0 - 1.0 / 0.9) - stage.drag_torque
    assert at(turning, 1.3, turning.torque) == pytest.approx(down, rel=1e-5)
    by_rule = {f.rule: f for f in rules}
    assert by_rule["screw_static"].use == pytest.approx(652.27 / stage.static_capacity, rel=1e-5)
    # Cubic mean over both ways: forces of 652, 452, 252 N up and of 132, 332, 532 N down, over 25, 250 and 25 mm each.
    forces = [weight + 60.0 + a for a in (200.0, 0.0, -200.0)] + [weight - 60.0 + a for a in (-200.0, 0.0, 200.0)]
    mean = (sum(s * F**3 for s, F in zip([25.0, 250.0, 25.0] * 2, forces, strict=True)) / 600.0) ** (1.0 / 3.0)
    hours = (stage.dynamic_capacity / (1.3 * mean)) ** 3 * 1e6 / (0.6 / 10e-3) * 2.0 / 3600.0
    assert 20000.0 / by_rule["screw_life"].use == pytest.approx(hours, rel=1e-4)
    brake = findings("vertical-ball-screw", int(np.flatnonzero([axes.stage(r)[0].lead == 10e-3 for r in task("vertical-ball-screw").parameters(0, 4)])[0]))["holding_brake"]  # fmt: skip
    assert brake.use == pytest.approx(1.5 * weight * 10e-3 / (2.0 * math.pi) / 1.5, rel=1e-5)


def test_rack_gantry():
    found = motion("rack-gantry")
    rows = [(1.4 / 3.0, 700.0), (2.0 / 1.4 - 1.4 / 3.0, 100.0), (1.4 / 3.0, -500.0)]
    rest = 3.0 - sum(t for t, _ in rows)
    assert peak(found.torque) == pytest.approx(200.0 * 3.0 + 100.0, rel=BY_HAND)
    assert rms(found.time, found.torque) == pytest.approx(spreadsheet([*rows, (rest, 0.0)]), rel=BY_HAND)
    stage, turning, rules = Axes(task("rack-gantry")).stage(task("rack-gantry").parameters(0, 1)[0])
    travel = math.pi * 2e-3 * 20 / math.cos(19.5283 * DEG)
    assert stage.travel() == pytest.approx(travel)
    torque = 700.0 * travel / (2.0 * math.pi * 0.97) + 4e-4 * 3.0 * 2.0 * math.pi / travel
    assert peak(turning.torque) == pytest.approx(torque, rel=1e-5)
    assert rules[0].use == pytest.approx(700.0 / 2200.0, rel=BY_HAND)


def test_conveyor():
    found = motion("conveyor")
    rows = [(0.5, 60.0 * 1.2 + 150.0), (1.0 / 0.6 - 0.5, 150.0), (0.5, 150.0 - 72.0)]
    rest = 3.0 - sum(t for t, _ in rows)
    assert rms(found.time, found.torque) == pytest.approx(spreadsheet([*rows, (rest, 0.0)]), rel=BY_HAND)
    rules = findings("conveyor")
    assert 1200.0 * rules["belt_force"].use == pytest.approx(2.0 * 222.0, rel=1e-5)  # as much pretension
    assert rules["belt_teeth"].verdict == "unknown"
    assert "95 %" in rules["motor_torque"].remark  # at 1500 m


def test_winder():
    found = motion("winder")
    inertia = 0.25 + 0.20
    acceleration = 0.625 * 2.0 * math.pi
    assert peak(found.torque) == pytest.approx(inertia * acceleration + 1.0 + 12.0, rel=1e-6)
    # At 10 s: constant speed, tension 10 N m; at 20 s it stands against 8 N m.
    assert at(found, 10.0, found.torque) == pytest.approx(11.0, rel=1e-6)
    assert at(found, 25.0, found.torque) == pytest.approx(8.0, rel=1e-6)
    assert float(found.inertia.min()) == pytest.approx(0.25)


def test_telescope_axis():
    found = motion("telescope-axis")
    inertial = 2000.0 * 0.625 * DEG
    one_way = [(4.0, inertial + 40.0), (4.0, 40.0), (4.0, 40.0 - inertial), (8.0, 0.0)]
    assert inertial == pytest.approx(21.82, abs=5e-3)
    assert rms(found.time, found.torque) == pytest.approx(spreadsheet(one_way), rel=BY_HAND)
    assert "86 %" in findings("telescope-axis")["motor_torque"].remark  # at 2400 m


def test_antenna_in_wind():
    found = motion("antenna-in-wind")
    inertial = 120.0 * 3.0 * DEG
    assert inertial == pytest.approx(6.28, abs=5e-3)
    # The gust is largest at 1.25 s and every 5 s after, in the first of the moves at constant speed.
    assert at(found, 1.25, found.torque) == pytest.approx(150.0 + 100.0 + 10.0, rel=ARC)
    # A sine of the wind: mean square of 150^2 + 100^2/2.
    assert rms(found.time, found.holding) == pytest.approx(math.sqrt(150.0**2 + 0.5 * 100.0**2), rel=ARC)
    rules = findings("antenna-in-wind")
    assert "safety factor 1.5" in rules["peak_output_torque"].remark


def test_delta_joint():
    found = motion("delta-joint")
    J, alpha = 0.06 + 0.5 * 0.3**2, 7000.0 * DEG
    arm, part = 1.2 * G * 0.15, 0.5 * G * 0.3
    # Level at 0, with the part: all of it at the first instant.
    assert at(found, 1e-7, found.torque) == pytest.approx(J * alpha + arm + part + 0.3, rel=1e-4)
    assert peak(found.torque) == pytest.approx(J * alpha + arm + part + 0.3, rel=1e-4)
    # Back without the part, from 50 degrees: cos 50 of the arm.
    back = -0.06 * alpha + arm * math.cos(50.0 * DEG) - 0.3
    assert at(found, 0.25 + 1e-7, found.torque) == pytest.approx(back, rel=1e-3)


def test_press_feed():
    found = motion("press-feed")
    rows = [(0.05, 0.03 * 480.0 + 7.0), (0.05, 7.0), (0.05, 7.0 - 14.4), (0.01, 6.0), (0.23, 2.0)]
    ramp = 0.01 * (6.0**2 + 6.0 * 2.0 + 2.0**2) / 3.0
    square = sum(t * x**2 for t, x in rows) + ramp
    assert peak(found.torque) == pytest.approx(21.4, rel=BY_HAND)
    assert rms(found.time, found.torque) == pytest.approx(math.sqrt(square / 0.4), rel=BY_HAND)
    assert float(found.position.max()) == pytest.approx(0.12 / 0.05)


FITS = {
    "antenna-in-wind": "bonfiglioli-mp160-3-125, yaskawa-sgmsh-10aa",
    "conveyor": "bonfiglioli-lc070p-2-20, yaskawa-sgmuh-10da",
    "delta-joint": "bonfiglioli-lc070p-2-20, yaskawa-sgmph-04a",
    "indexing-table": "bonfiglioli-mp080-2-35, yaskawa-sgmph-04a",
    "pick-and-place": "yaskawa-sgmsh-10aa",
    "press-feed": "bonfiglioli-sl070p-1-7, yaskawa-sgmsh-10aa",
    "rack-gantry": "bonfiglioli-tqf070-1-4, yaskawa-sgm7a-15a",
    "robot-shoulder": "harmonic-drive-shg-40-160-2uh, yaskawa-sgmsh-10aa",
    "telescope-axis": "bonfiglioli-tr105-3-400, yaskawa-sgmph-04a",
    "vertical-ball-screw": "hiwin-r20-10k3-fsc, yaskawa-sgmph-04a",
    "winder": "bonfiglioli-lck070p-2-10, yaskawa-sgmsh-10aa",
}


@pytest.mark.parametrize("name", FITS)
def test_the_pair_of_an_example_fits(name: str):
    """In the run, too; its rms torque is near that of the rules, which know no tuning."""
    study = task(name)
    found = lm.select(study)
    names = [", ".join(filter(None, (str(found[v.title].values[k]) for v in study.vary))) for k in range(found.sizes["pair"])]
    pair = found.isel(pair=names.index(FITS[name]))
    assert bool(pair["fits"]), str(pair["why"].values)
    row = study.parameters(int(pair["run"]), int(pair["run"]) + 1)[0]
    demand, _ = Axes(study).gearbox(row)
    of_rules = demand.cycle(demand.motor_torque(study.part("motor", row))).rms_motor_torque
    assert float(pair["motor_torque_rms"]) == pytest.approx(of_rules, rel=0.25)


def test_every_example_is_tried():
    assert {path.stem for path in TASKS.glob("*.toml")} == set(FITS)
