"""Fits of servo logs: one step over a hundred of them; exact derivatives against differences and against CMA-ES."""

from __future__ import annotations

import os
import time
from dataclasses import replace
from pathlib import Path

import cma
import numpy as np
from report import Report

from lostmotion.identification.fit.least_squares import FitProblem, moved, problem_of, search
from lostmotion.identification.identify import identify_logs
from lostmotion.identification.preparation.prepare import prepared
from lostmotion.identification.prepared_log import Prepared
from lostmotion.identification.readers.log import Channel, Log
from lostmotion.identification.rig.residuals import Engine, ParameterPoint
from lostmotion.identification.rig.rig_scenario import Rig
from lostmotion.identification.task.identification_file import free_on, load_identification
from lostmotion.identification.virtual_logs import virtual_log

SERVO = Path(__file__).parent.parent / "examples" / "servo_logs"
TRUTH = {
    "torque_constant": 2.0,
    "resistance": 2.5,
    "armature": 0.02,
    "coulomb_friction": 0.06,
    "viscous_friction": 0.03,
    "dead_time": 0.028,
    "angle_offset": 0.015,
    "load_friction": 0.2,
    "direction": 0.2,
}
RUNG = 2  # nine parameters, friction that depends on load and direction
NEAR = 1.05  # times the least cost: where a search has arrived
MOST = 4000  # points that CMA-ES may try


def plan(k: int) -> Log:
    """The k-th of moves of several kinds, weights, lengths and gains: twelve rigs."""
    t = np.arange(0.0, 3.5, 0.01)
    goal = (np.sin(4.0 * t), np.sin(1.5 * t**2), 1.2 * np.minimum(1.5 * t, 1.0), 0.8 * np.sign(np.sin(5.0 * t + 0.1)))[
        k % 4
    ]
    header = {"mass": (0.5, 1.0)[k % 2], "arm_mass": 0.1, "length": (0.1, 0.15)[k // 2 % 2], "vin": 15.0}
    channels = {
        "goal_position": goal,
        "torque_enable": np.ones(len(t)),
        "position": np.zeros(len(t)),
        "input_volts": np.full(len(t), 15.0),
    }
    return Log(str(k), t, {n: Channel(v) for n, v in channels.items()}, {**header, "kp": (16.0, 8.0, 32.0)[k % 3]})


def logs(rig: Rig, count: int) -> list[Prepared]:
    """Of a servo with the values of TRUTH, with noise of half a milliradian and the steps of its encoder."""
    found = []
    for k in range(count):
        log = virtual_log(rig, replace(plan(k), name=str(k)), TRUTH, rung=RUNG, noise={"position": 5e-4}, seed=k)
        found.append(prepared(rig.task, log, rig.units))
    return found


class ByDifferences(Engine):
    """All derivatives by central differences."""

    def jacobians(self, logs, point, rung, parameters):  # type: ignore[no-untyped-def]
        self.by_differences = dict.fromkeys(parameters, "measured")
        return super().jacobians(logs, point, rung, parameters)


def fitted(engine: Engine, train: list[Prepared], start: ParameterPoint, goal: float) -> tuple[float, float]:
    """(processor time [s], cost) when a search has arrived."""
    reached: list[float] = []
    begin = time.process_time()

    def notice(_: int, cost: float) -> None:
        if cost <= goal and not reached:
            reached.append(time.process_time() - begin)

    fit = search(problem(engine, train), start, iterations=40, notify=notice)
    return (reached or [time.process_time() - begin])[0], fit.cost


def problem(engine: Engine, train: list[Prepared]) -> FitProblem:
    """With the deviation of noise and steps, so that costs of different points can be compared."""
    return replace(problem_of(engine, train, RUNG), given=np.array([np.hypot(5e-4, 1.534e-3 / np.sqrt(12.0))]))


def by_cma(p: FitProblem, start: ParameterPoint, goal: float) -> tuple[float, float, int]:
    """(processor time [s], cost, points tried)."""
    names = list(p.parameters)
    begin = time.process_time()
    es = cma.CMAEvolutionStrategy(np.zeros(len(names)), 2.0, {"seed": 1, "verbose": -9, "maxfevals": MOST})
    best = np.inf
    while not es.stop() and best > goal:
        tried = es.ask()
        costs = []
        for x in tried:
            values = {n: moved(p.parameters[n], start.values[n], float(v)) for n, v in zip(names, x, strict=True)}
            point = ParameterPoint(start.values | values, start.nuisance)
            found = p.cost(p.engine.residuals(p.logs, point, p.rung), p.given, point, 1.0)
            costs.append(found if np.isfinite(found) else 1e12)
        es.tell(tried, costs)
        best = min(best, *costs)
    return time.process_time() - begin, best, es.result.evaluations


def section(report: Report) -> None:
    task, directory = load_identification(SERVO / "identify.toml")
    lowest, load, _, direction = task.ladder
    whole = Rig(task, directory)
    task = task.model_copy(update={"ladder": (lowest, load, direction)})
    rig = Rig(task, directory)
    free = free_on(task, RUNG)
    start = ParameterPoint({n: p.start for n, p in task.parameters.items()}, {})

    many, engine = logs(rig, 100), Engine(rig)
    steps = []
    for k in range(3):  # each at other values, as in a search: nothing is at hand from the last
        point = ParameterPoint(start.values | {"coulomb_friction": 0.05 + 1e-3 * k}, {})
        begin, processor = time.perf_counter(), time.process_time()
        engine.jacobians(many, point, RUNG, free)
        gradient, of_gradient = time.perf_counter() - begin, time.process_time() - processor
        engine.residuals(many, ParameterPoint(point.values | {"armature": 0.011}, {}), RUNG)
        steps.append((time.perf_counter() - begin, time.process_time() - processor, gradient, of_gradient))
    wall, processor, gradient, of_gradient = min(steps)

    begin, processor_before = time.perf_counter(), time.process_time()
    found = identify_logs(whole, [prepared(whole.task, log.log, whole.units) for log in many])
    ladder, of_ladder = time.perf_counter() - begin, time.process_time() - processor_before

    few = logs(rig, 6)
    truth = problem(Engine(rig, 1), few)
    least = search(truth, ParameterPoint(start.values | TRUTH, {}), iterations=10).cost
    goal = NEAR * least
    exact, cost = fitted(Engine(rig, 1), few, start, goal)
    differences, cost_of_differences = fitted(ByDifferences(rig, 1), few, start, goal)
    evolution, cost_of_evolution, tried = by_cma(problem(Engine(rig, 1), few), start, goal)

    report.section(
        "Identification",
        f"The servo of examples/servo_logs, {len(free)} parameters: logs of 3.5 s at 100 Hz with noise and steps of 2 pi/4096.",
    )
    report.table(
        (
            f"one Levenberg-Marquardt step over {len(many)} logs of 12 rigs, {os.cpu_count()} threads",
            "time [s]",
            "processor time [s]",
        ),
        [
            ("the derivatives", f"{gradient:.2f}", f"{of_gradient:.2f}"),
            ("with the residuals of one step", f"{wall:.2f}", f"{processor:.2f}"),
            (f"the whole ladder, {len(found.rungs)} rungs, with intervals", f"{ladder:.0f}", f"{of_ladder:.0f}"),
        ],
    )
    report.table(
        (
            f"six logs, from the start values to {NEAR} times the least cost, one thread",
            "processor time [s]",
            "ratio",
            "cost/least",
        ),
        [
            ("exact derivatives", f"{exact:.2f}", "1", f"{cost / least:.4f}"),
            (
                "central differences",
                f"{differences:.2f}",
                f"{differences / exact:.1f}",
                f"{cost_of_differences / least:.4f}",
            ),
            (
                f"CMA-ES (cma), {tried} points",
                f"{evolution:.2f}",
                f"{evolution / exact:.1f}",
                f"{cost_of_evolution / least:.4f}",
            ),
        ],
    )


if __name__ == "__main__":
    r = Report()
    section(r)
    print(r.text())
