"""Measures of identification and monitor: spoiled logs, intervals, false alarms, many logs, and public logs of real drives.

    PYTHONPATH=tests .venv/bin/python benchmarks/measured_logs.py [spoiled] [coverage] [monitor] [many] [servo-a] [servo-b] [emps]

prints one table; without arguments it takes all. The public logs are not shipped: environment variables name their folders, and a
measure without them is left out with a line that says where they come from.
"""

from __future__ import annotations

import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
import zlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from report import Report

import lostmotion as lm
import test_identification_odd_logs as odd
import test_monitor as wear
from dry_friction import RIG
from identification_logs import NOISE, SERVO, TRUTH, servo_plans, servo_task
from lostmotion.errors import InputError
from lostmotion.identification.identify import identify_logs, identify_task
from lostmotion.identification.monitor.monitor import watched
from lostmotion.identification.preparation.prepare import prepared
from lostmotion.identification.readers.log import Channel, Log
from lostmotion.identification.rig.rig_scenario import Rig
from lostmotion.identification.task.identification_file import Identification, load_identification
from lostmotion.identification.virtual_logs import virtual_log, write_servo_json

ROOT = Path(__file__).parent.parent
FITTED, HELD_OUT = 90, 160
Row = tuple[str, str, str]


# --- spoiled logs ---


def without(log: Log, gone: slice) -> Log:
    kept = np.delete(np.arange(len(log.time)), gone)
    channels = {name: replace(c, values=c.values[kept]) for name, c in log.channels.items()}
    return replace(log, time=log.time[kept], channels=channels)


def blank(x: np.ndarray) -> np.ndarray:
    return np.where(np.arange(len(x)) // 40 == 3, np.nan, x)


def glitches(x: np.ndarray) -> np.ndarray:
    return x + np.where(np.arange(len(x)) % 97 == 50, 3.0 + np.ptp(x), 0.0)


def stepped_back(log: Log) -> Log:
    return replace(log, time=np.where(np.arange(len(log.time)) == 200, log.time - 1.0, log.time))


def stamped_twice(log: Log) -> Log:
    return replace(log, time=np.where(np.arange(len(log.time)) % 50 == 25, np.roll(log.time, 1), log.time))


def paused(log: Log) -> Log:
    return replace(log, time=log.time + np.where(np.arange(len(log.time)) > 200, 3.0, 0.0))


# Beside those of the test: what must be in the answer or in the notes on the log.
WAYS: dict[str, tuple[Callable[[Log], Log], str]] = odd.FAULTS | {
    "NaN block of the sensor": (lambda log: odd.changed(log, "angle", blank), "angle is not a number"),
    "NaN block of the command": (lambda log: odd.changed(log, "torque", blank), "torque is not a number"),
    "pause": (paused, "pause"),
    "samples lost": (lambda log: without(log, slice(150, 250)), "pause"),
    "glitches": (lambda log: odd.changed(log, "angle", glitches), "glitches of angle"),
    "clock steps back": (stepped_back, "time goes back"),
    "repeated time stamps": (stamped_twice, "time stamp of the sample before"),
    "command at the arm": (lambda log: odd.changed(log, "torque", lambda x: 20.0 * x), "a factor of 20 too large"),
}


def spoiled(rigs: int = 20) -> list[Row]:
    """Ways to spoil one of five logs, each on rigs with random values."""
    missed: list[str] = []
    for seed in range(rigs):
        draw = np.random.default_rng(seed)
        truth = {name: float(value * draw.uniform(0.5, 2.0)) for name, value in odd.TRUTH.items()}
        for way, (spoil, words) in WAYS.items():
            with tempfile.TemporaryDirectory() as folder:
                rig = Rig(odd.arm_task(Path(folder), seed, truth), Path(folder))
                logs = odd.arm_logs(rig, 1000 + 100 * seed, truth)
                logs[odd.SPOILED] = spoil(logs[odd.SPOILED])
                try:
                    result = identify_logs(rig, [prepared(rig.task, log, rig.units) for log in logs], threads=1)
                    notes = [n for name, own in result.notes.items() if name.startswith(f"{odd.SPOILED}.") for n in own]
                    said = " ".join([*notes, *(o.text for o in result.odd), *result.left_out.values()])
                except InputError as error:
                    said = str(error)
            if not re.search(words, said):
                missed.append(f"{way} ({seed})")
    count = rigs * len(WAYS)
    text = f"{count - len(missed)} of {count} named" + (f"; not {', '.join(missed[:12])}" if missed else "")
    return [(f"spoiled logs, {len(WAYS)} ways x {rigs} rigs", text, "all named")]


# --- intervals ---

AXIS_TASK = {
    "scenario": "axis.toml",
    "logs": {"files": ["*.csv"]},
    "inputs": {"m_command": {"channel": "u", "interpolation": "hold"}},
    "set": {
        "motors.m.rotor_inertia": "inertia",
        "shafts.c.viscous_friction": "viscous",
        "shafts.c.friction_torque": "coulomb",
    },
    "parameters": {
        "inertia": {"start": 6e-3, "min": 1e-4, "max": 1},
        "viscous": {"start": 0.03, "max": 1.0},
        "coulomb": {"start": 0.12, "max": 2.0},
    },
}


def axis_logs(scenario: lm.Scenario, draw: np.random.Generator) -> list[Log]:
    """Five logs of 2 s of an axis with Stribeck and quadratic friction, which the model lacks."""
    t = 2e-3 * np.arange(1000)
    found = []
    for k in range(5):
        u = sum(draw.uniform(0.15, 0.5) * np.sin(draw.uniform(2, 14) * t + draw.uniform(0, 6)) for _ in range(3))
        axis = lm.Simulation(scenario.train(), step=2e-3)
        angle = np.zeros(len(t))
        for i, x in enumerate(np.round(u, 4)):
            angle[i] = axis["c_angle"]
            axis.advance(2e-3, m_command=float(x))
        angle += 1e-3 * draw.normal(size=len(t))
        found.append(Log(f"{k}", t, {"u": Channel(np.round(u, 4)), "a": Channel(angle)}))
    return found


def coverage(axes: int = 200) -> list[Row]:
    """How often a 95 % interval holds the value, or is flagged, with a wrong friction law."""
    draw = np.random.default_rng(0)
    count = covered = either = 0
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "axis.toml").write_text(RIG)
        scenario = lm.load(Path(folder) / "axis.toml")
        for axis in range(axes):
            measured = {"channel": "a", "variable": "c_angle", **({"deviation": 1e-3} if axis % 2 else {})}
            rig = Rig(Identification(**AXIS_TASK, measured={"a": measured}), Path(folder))
            truth = {"inertia": 5e-3, "viscous": 0.02, "coulomb": 0.1}
            truth = {name: value * draw.uniform(0.5, 2.0) for name, value in truth.items()}
            more, speed, square = draw.uniform(0.0, 0.6), draw.uniform(0.2, 2.0), 2e-4 * draw.uniform(0.0, 5.0)
            speeds = speed * np.array([0.0, 0.3, 0.7, 1.2, 2.0, 4.0])
            torques = truth["coulomb"] * (1.0 + more * np.exp(-((speeds / speed) ** 2)))
            changes = {
                "motors.m.rotor_inertia": truth["inertia"],
                "shafts.c.viscous_friction": truth["viscous"],
                "shafts.c.friction_torque": 0.0,
                "shafts.c.friction_curve": {"speeds": speeds.tolist(), "torques": torques.tolist()},
                "shafts.c.drag": {"kind": "quadratic", "coefficient": square + 1e-9, "max_speed": 60.0},
            }
            logs = axis_logs(scenario.replace(**changes), draw)
            result = identify_logs(rig, [prepared(rig.task, log, rig.units) for log in logs], threads=1)
            for name, value in truth.items():
                i = result.intervals[name]
                inside = i.low <= value <= i.high
                count, covered, either = count + 1, covered + inside, either + (inside or bool(i.flag))
    text = f"{100 * either / count:.1f} % hold the value or are flagged; {100 * covered / count:.0f} % hold it"
    return [(f"95 % intervals over {axes} axes with a wrong friction law", text, "90 %")]


# --- monitor ---


def monitored(healthy: int = 120, orders: int = 200) -> list[Row]:
    """Backlash that grows by 0.1 mrad, and false alarms over random orders of healthy logs."""
    with tempfile.TemporaryDirectory() as folder:
        task = wear.write_logs(Path(folder), lambda k: 0.6e-3 if k < healthy else 0.7e-3, healthy + 20)
        begin = time.process_time()
        result = lm.monitor(task)
        cost = (time.process_time() - begin) / len(result.logs)
        draw, free = np.random.default_rng(1), list(result.watched)
        false = found = 0
        for _ in range(orders):
            order = draw.permutation(healthy)
            false += any(w.alarm for w in watched(result.task, [result.logs[k] for k in order], free).values())
            worn = [*order[:60], *(healthy + draw.permutation(20))]
            change = watched(result.task, [result.logs[k] for k in worn], free)["backlash"].change
            found += change is not None and change.alarm is not None and change.alarm >= 60
    return [
        ("backlash growth of 0.1 mrad, motor encoder of 17 bit", f"found in {found} of {orders} sequences", "all"),
        (f"false alarms, sequences of {healthy} healthy logs", f"{100 * false / orders:.1f} %", "below 1 %"),
        ("monitor, processor time for one log", f"{cost:.2f} s", "below 1 s"),
    ]


# --- many logs ---


def many(count: int = 250) -> list[Row]:
    """The command on many logs of 6 s of a virtual servo."""
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        (home / "logs").mkdir()
        for name in ("identify.toml", "servo.toml"):
            shutil.copy(SERVO / name, home / name)
        rig = Rig(servo_task(home / "logs"), SERVO)
        draw = np.random.default_rng(0)
        for k, plan in enumerate(servo_plans(count, 6.0, 190.0)):
            goal = plan.channels["goal_position"].values * draw.uniform(0.6, 1.0)
            own = replace(plan, channels=plan.channels | {"goal_position": Channel(goal)})
            log = virtual_log(rig, own, TRUTH, rung=len(rig.rungs()) - 1, noise={"position": NOISE}, seed=k)
            write_servo_json(home / "logs" / plan.name, log)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        begin = time.perf_counter()
        command = [sys.executable, "-m", "lostmotion", "identify", "identify.toml", "-o", "out"]
        subprocess.run(command, cwd=home, check=True, capture_output=True)
        wall = time.perf_counter() - begin
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        page = (home / "out" / "identified.html").stat().st_size
    processor = used.ru_utime + used.ru_stime - before.ru_utime - before.ru_stime
    return [
        (f"{count} logs of 6 s, whole sequence and page", f"{wall:.0f} s, {processor:.0f} s of processor", "120 s"),
        ("memory of it", f"{used.ru_maxrss / 1024:.0f} MB", "below 400 MB"),
        ("page of it", f"{page / 1e6:.2f} MB", "below 2 MB"),
    ]


# --- public logs ---


def servo(name: str, variable: str, where: str, changes: dict[str, object], aim: str) -> list[Row]:
    """Held-out error of a hobby servo, 90 logs fitted and 160 held out, chosen by the checksums of their names."""
    label = f"hobby servo {name}, {FITTED} logs fitted, {HELD_OUT} held out, mean absolute error"
    source = Path(os.environ.get(variable, ""))
    files = sorted(source.glob("*.json"), key=lambda p: zlib.crc32(p.name.encode())) if os.environ.get(variable) else []
    if len(files) < FITTED + HELD_OUT:
        return [(label, f"left out: {variable} names no folder with {where}", aim)]
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        for part, some in (("fit", files[:FITTED]), ("held_out", files[FITTED : FITTED + HELD_OUT])):
            (home / part).mkdir()
            for path in some:
                shutil.copy(path, home / part / path.name)
        for file in ("sts3215.toml", "servo-firmware.toml"):
            shutil.copy(SERVO / file, home / file)
        task, directory = load_identification(home / "sts3215.toml")
        data = task.model_dump()
        data["parameters"] |= changes
        begin = time.process_time()
        result = identify_task(Identification(**data), directory)
    text = f"{result.error(held_out=True)[0]:.4f} rad ({time.process_time() - begin:.0f} s of processor)"
    return [(label, text, aim)]


def emps() -> list[Row]:
    """Held-out error of the ball-screw axis in open loop."""
    label, variable = "EMPS in open loop, held out, rms", "LOSTMOTION_EMPS"
    source = Path(os.environ.get(variable, ""))
    names = ("DATA_EMPS.mat", "DATA_EMPS_PULSES.mat")
    if not os.environ.get(variable) or not all((source / name).is_file() for name in names):
        where = f"{' and '.join(names)} (github.com/forgi86/sysid-neural-continuous at 956aa7e, examples/EMPS/data)"
        return [(label, f"left out: {variable} names no folder with {where}", "2.6 mm")]
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(ROOT / "examples" / "emps", folder, dirs_exist_ok=True)
        for name in names:
            shutil.copy(source / name, folder)
        result = lm.identify(Path(folder) / "identify.toml")
    return [(label, f"{1e3 * result.error(held_out=True)[1]:.2f} mm", "2.6 mm")]


STS3215 = "the logs of github.com/kscalelabs/sysid at 6b78737, data/feetech/STS_3215_12V_20250317/processed"
STS3250 = "the logs of github.com/kscalelabs/sysid at b372b64~1, data/feetech/STS_3250_20250319/processed"
MEASURES: dict[str, Callable[[], list[Row]]] = {
    "spoiled": spoiled,
    "coverage": coverage,
    "monitor": monitored,
    "many": many,
    "servo-a": lambda: servo("A", "LOSTMOTION_SERVO_A", STS3215, {}, "0.0085 rad"),
    "servo-b": lambda: servo("B", "LOSTMOTION_SERVO_B", STS3250, {}, "0.015 rad"),
    "emps": emps,
}


def main(wanted: list[str]) -> None:
    if unknown := [name for name in wanted if name not in MEASURES]:
        sys.exit(f"{unknown[0]!r} is no measure; the measures are {', '.join(MEASURES)}")
    rows = [row for name in wanted or MEASURES for row in MEASURES[name]()]
    report = Report()
    report.table(("measure", "found", "aim"), rows)
    print(report.text(), end="")


if __name__ == "__main__":
    main(sys.argv[1:])
