"""Rows of a task: each pair is judged by the rules of the manufacturers, and run over its cycle if it passes them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..model.gearbox import Gearbox
from ..model.motor import Motor
from ..simulation.results import RunArrays
from ..simulation.run import run
from ..simulation.scenario import Scenario
from ..sizing.finding import Finding
from ..sizing.gearbox_check import input_speeds, loads, lost_motion
from ..sizing.motion_check import inertia_ratio
from ..sizing.motor_check import command_of_run, current, heat, largest_speed, voltage
from ..sizing.motor_run import oriented_amplitudes
from ..sizing.required_motion import (
    InputDemand,
    RequiredMotion,
    check_gearbox,
    check_motor,
    input_demand,
    required_motion,
)
from ..worker_threads import thread_pool
from .axis import FEWEST, REPEATS, AxisTask, reference_of
from .axis_columns import COLUMNS, change, duty_cycle_of, last_cycle, row_of
from .check import COLUMNS as CHECKS
from .check import columns_of
from .runs import Runs
from .study import Study

NO_DATA = "data"
"""stands among the violated rules of a pair whose record lacks what a run needs"""

Row = dict[str, Any]


@dataclass
class Axes:
    """The pairs of a task, with what several of them have in common."""

    study: Study

    @property
    def task(self) -> AxisTask:
        task = self.study.axis
        assert task is not None
        return task

    def motion(self) -> RequiredMotion:
        """One cycle at the load of the base scenario."""
        base = self._base
        found = self._once(("motion",), lambda: required_motion(reference_of(base), base.load, self.task.cycle))
        assert isinstance(found, RequiredMotion)
        return found

    @property
    def _base(self) -> Scenario:
        assert isinstance(self.study.scenario, Scenario)
        return self.study.scenario

    def _once(self, key: tuple[Any, ...], make: Callable[[], Any]) -> Any:
        """Value that is made at most once; an error is kept as such."""
        kept = self.study.kept
        if key not in kept:
            try:
                kept[key] = make()
            except InputError as error:
                kept[key] = error
        return kept[key]

    def gearbox(self, row: np.ndarray) -> tuple[InputDemand, list[Finding]] | InputError:
        """Demands on the input of the gearbox, and the rules for it alone."""
        key = ("demand", *self.study.part_key("gearbox", row))
        return self._once(key, lambda: self._demand(self.study.part("gearbox", row)))  # type: ignore[no-any-return]

    def _demand(self, g: Gearbox) -> tuple[InputDemand, list[Finding]]:
        demand = input_demand(self.motion(), g)
        findings = check_gearbox(demand)
        if self.task.max_lost_motion is not None:
            findings.append(lost_motion(g, self.task.max_lost_motion))
        return demand, findings

    def motor(self, row: np.ndarray) -> Motor | InputError:
        """The motor of a row."""
        key = ("checked", *self.study.part_key("motor", row))
        return self._once(key, lambda: self.study.part("motor", row))  # type: ignore[no-any-return]

    def refused(self, row: np.ndarray) -> Row | None:
        """The columns of a pair that the rules refuse; None if it is to be run."""
        gearbox, motor = self.gearbox(row), self.motor(row)
        lacking = [str(error) for error in (gearbox, motor) if isinstance(error, InputError)]
        if lacking:
            return CHECKS | {"violated": NO_DATA, "why": "; ".join(lacking)}
        assert not isinstance(gearbox, InputError)
        assert not isinstance(motor, InputError)
        demand, findings = gearbox
        load = self._base.load.inertia
        found = [
            *findings,
            *check_motor(demand, motor, load, self.task.ambient_temperature, self.task.max_inertia_ratio),
        ]
        return columns_of(found) if any(f.verdict == "warning" for f in found) else None

    def measured(self, row: np.ndarray) -> tuple[Row, int]:
        """The columns of a pair that is run, and its switchings.

        Raises
        ------
        InputError, SolverError
            It cannot be run.
        """
        scenario, result, count = self.until_it_repeats(row)
        columns = row_of(scenario, self.task, result, count)
        found = self._after_run(scenario, result, count, columns["winding_temperature"])
        return columns_of(found) | columns, int(result.attrs["switching_count"])

    def until_it_repeats(self, row: np.ndarray) -> tuple[Scenario, RunArrays, int]:
        """Runs twice as many cycles again and again, until the last two agree, or there are as many as the task permits."""
        count = FEWEST
        while True:
            scenario = self.study.axis_at(row, count)
            result = run(scenario, energy=False)
            if count >= self.task.max_cycles or change(result, count) <= REPEATS:
                return scenario, result, count
            count = min(2 * count, self.task.max_cycles)

    def _after_run(self, scenario: Scenario, result: RunArrays, count: int, winding: float) -> list[Finding]:
        """The same rules, of the cycle that was run, and the temperature of its winding [°C]."""
        here, task = last_cycle(result, count), self.task
        duty, g, m = duty_cycle_of(result, here, task.cycle), scenario.gearbox, scenario.motor
        command, torque, speed = (result[name][here] for name in ("command", "motor_torque", "motor_speed"))
        command = command_of_run(m, scenario.controller, command, torque, speed)
        oriented = oriented_amplitudes(result, "motor")
        found = [
            *loads(g, float(np.abs(duty.output_torque).max()), duty),
            *input_speeds(g, duty),
            largest_speed(m, duty.peak_input_speed),
            *heat(
                m,
                duty,
                task.ambient_temperature,
                rise=None if math.isnan(winding) else winding - task.ambient_temperature,
            ),
            voltage(m, command, torque, speed, oriented=None if oriented is None else oriented[1][here]),
            current(m, torque),
            inertia_ratio(m, g, scenario.load.inertia, task.max_inertia_ratio),
        ]
        return [*found, lost_motion(g, task.max_lost_motion)] if task.max_lost_motion is not None else found


def run_axes(study: Study, parameters: np.ndarray, threads: int) -> Runs:
    """The pairs of a piece: first the rules for all of them, then the runs of those that pass, on several threads."""
    axes, n = Axes(study), len(parameters)
    rows = [axes.refused(row) for row in parameters]
    errors, switchings = [""] * n, np.zeros(n)
    waiting = [k for k, row in enumerate(rows) if row is None]

    def measure(k: int) -> Row:
        try:
            row, switchings[k] = axes.measured(parameters[k])
        except (RuntimeError, ValueError) as error:
            errors[k] = str(error)
            return dict(CHECKS)
        return row

    with thread_pool(threads) as pool:
        for k, row in zip(waiting, pool.map(measure, waiting), strict=True):
            rows[k] = row
    whole = [row or {} for row in rows]
    return Runs(
        parameters=parameters,
        samples={},
        kept={name: np.array([row.get(name, math.nan) for row in whole], float) for name in COLUMNS},
        energy={},
        checks={name: [row[name] for row in whole] for name in CHECKS},
        switchings=switchings,
        errors=errors,
        ratio=np.full(n, math.nan),
    )
