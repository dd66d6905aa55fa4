"""Rows of a task: each pair is judged by the rules of the manufacturers, and run over its cycle if it passes them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...data_sheets.linear_sheets import LinearMotorSheet
from ...errors import InputError, Problem
from ...interruptible_threads import thread_pool
from ...model.gearbox import Gearbox
from ...model.gears_in_series import DIRECT
from ...model.motor import Motor
from ...model.screw import RatedScrew
from ...servo.linear_regimes import axis_of
from ...servo.margins import unstable_pole
from ...simulation.forms.key_aliases import MOTOR
from ...sizing.axis_rules import (
    derated,
    emergency_stop,
    gearbox_life,
    holding_brake,
    missing,
    motor_stop,
    output_bearing,
    stage_rules,
    stage_stop,
    with_safety,
    without_part,
)
from ...sizing.axis_task.axis_task import AxisTask, reference_of
from ...sizing.axis_task.cycle_demands import COLUMNS, Repeated, columns_of_gearbox, row_of
from ...sizing.axis_task.mass_and_price import CHOICE, lacks, value_of
from ...sizing.axis_task.mass_and_price import judged as judged_choice
from ...sizing.catalogue_formulas import derating
from ...sizing.finding import Finding, not_judged
from ...sizing.gearbox_check import input_speeds, loads, lost_motion
from ...sizing.linear_stage_demands import Stage, at_input, together
from ...sizing.motion_check import ratio_of_inertias
from ...sizing.motor_check import command_of_run, motor_rules
from ...sizing.motor_quantities import oriented_amplitudes
from ...sizing.required_motion import (
    InputDemand,
    RequiredMotion,
    check_gearbox,
    check_motor,
    input_demand,
    required_motion,
)
from ...sizing.stepper_check import speed_of_stepper, stepper_rules
from ...sizing.supply import amplifier_rules, effective_current, electrical_power, returned, supply_rules
from ..study.drive_check_columns import BETWEEN, ESTIMATED, MISSING, NO_DATA, UNSTABLE, columns_of
from ..study.drive_check_columns import TASK_COLUMNS as CHECKS
from ..study.study_definition import Study
from .candidate_cycles import until_it_repeats
from .chunk_results import Runs

HOLDS = "holds from the least to the largest losses of its kind"
"""verdict on a gearbox with estimated losses that none of them turns"""

ResultRow = dict[str, Any]


@dataclass
class Axes:
    """The pairs of a task, with what several of them have in common."""

    study: Study

    @property
    def task(self) -> AxisTask:
        task = self.study.axis
        assert task is not None
        return task

    def motion(self, row: np.ndarray) -> RequiredMotion:
        """One cycle of the load of a row."""
        base, task = self.study.base_of(row), self.task
        of_coils = self.study.part_key("motor", row) if self.study.slides_itself(row) else ()
        key = ("motion", of_coils)
        return self.study.once(key, lambda: required_motion(reference_of(base), base.load, task.cycle, task, task.rise))

    def gearbox(self, row: np.ndarray) -> tuple[InputDemand, list[Finding]]:
        """Demands on the input of the gearbox, and the rules for it and for the stage behind it."""
        key = ("demand", self.study.part_key("gearbox", row), self._stage_key(row))
        return self.study.once(key, lambda: self._demand(row))

    def _stage_key(self, row: np.ndarray) -> Any:
        kind = self.task.stage_kind
        return None if kind is None or self.study.slides_itself(row) else self.study.part_key(kind, row)

    def stage(self, row: np.ndarray) -> tuple[Stage, RequiredMotion, list[Finding]] | None:
        """The last stage of a linear axis, the motion of its shaft and what its rules say; None of a rotary load."""
        if self.task.linear is None or self.study.slides_itself(row):
            return None
        return self.study.once(("stage motion", self._stage_key(row)), lambda: self._stage(row))

    def _stage(self, row: np.ndarray) -> tuple[Stage, RequiredMotion, list[Finding]]:
        stage: Stage = self.study.part("stage", row)
        motion = self.motion(row)
        return stage, at_input(motion, stage), stage_rules(motion, stage, self.task.life)

    def _demand(self, row: np.ndarray) -> tuple[InputDemand, list[Finding]]:
        g: Gearbox = self.study.part("gearbox", row)
        stage, task = self.stage(row), self.task
        findings: list[Finding] = []
        if stage is None:
            demand = input_demand(self.motion(row), g)
        else:
            demand = input_demand(stage[1], g, together(g, stage[0]))
            findings += stage[2]
        if g != DIRECT:
            findings += check_gearbox(demand)
            if task.life is not None:
                findings.append(gearbox_life(demand, task.life))
            if task.emergency_stop is not None:
                rate = task.emergency_stop * (1.0 if stage is None else stage[0].ratio())
                findings.append(emergency_stop(demand.motion, g, rate))
            findings += output_bearing(g, task.radial_force, task.axial_force)
        else:
            findings += self._without_gearbox(stage is not None and isinstance(stage[0], RatedScrew))
        if stage is not None and task.emergency_stop is not None:
            findings += stage_stop(self.motion(row), stage[0], task.emergency_stop)
        return demand, findings

    def _without_gearbox(self, screw: bool) -> list[Finding]:
        """Findings for demands of the task on a gearbox that a candidate does not have."""
        task, found = self.task, list[Finding]()
        for key in ("radial_force", "axial_force"):
            if getattr(task, key) is not None:
                found.append(without_part("output_bearing", "gearbox", f"task.{key}"))
        if task.life is not None and not screw:
            found.append(without_part("gearbox_life", "gearbox or screw", "task.life"))
        return found

    def motor(self, row: np.ndarray) -> Motor:
        """The motor of a row."""
        return self.study.part("motor", row)  # type: ignore[no-any-return]

    def judged(self, row: np.ndarray) -> list[Finding]:
        """Findings for a pair before any run. Raises InputError: its records lack data for a run."""
        problems: list[Problem] = []
        for part in (self.gearbox, self.motor):
            try:
                part(row)
            except InputError as error:
                problems += error.problems
        if problems:
            raise InputError(problems=list(dict.fromkeys(problems)))
        (demand, findings), motor = self.gearbox(row), self.motor(row)
        findings, lacking = self._chosen(row, [*findings, *self._braked(row, demand)])
        known = motor.held_loss() if motor.kind == "stepper" else motor.copper_loss()
        if known is None and (needing := self._electrical()) is not None:
            lacking.append(
                f"the sheet of the motor lacks its winding, which select for {needing} needs; take mechanical_energy"
            )
        if lacking:
            raise InputError(problems=[Problem((), text) for text in lacking])
        task, load, slides = self.task, float(self.motion(row).inertia.max()), self.study.slides_itself(row)
        found = check_motor(
            demand,
            motor,
            load,
            task.ambient_temperature,
            task.max_inertia_ratio,
            slides=slides,
            microsteps=task.microsteps,
        )
        if task.max_lost_motion is not None:
            found.append(self._lost_motion(row, demand, motor, task.max_lost_motion))
        if slides:
            found += self._attraction(row)
            if task.emergency_stop is not None:
                found.append(motor_stop(self.motion(row), motor, task.emergency_stop))
            if task.max_inertia_ratio is not None:
                found.append(without_part("inertia_ratio", "shaft", "task.max_inertia_ratio"))
        found = [*findings, *found, *self._supplied(demand, motor)]
        judged = {f.rule for f in found}
        for rule in (rule for rule in task.safety_factors if rule not in judged):
            found.append(without_part(rule, "finding by this rule", f"task.safety_factors.{rule}"))
        return self._under_task(found, motor)

    def _lost_motion(self, row: np.ndarray, demand: InputDemand, motor: Motor, limit: float) -> Finding:
        """Lost motion under a share of the rated torque: the gearbox's, or without one the motor's."""
        stage, whole = self.stage(row), demand.whole
        if stage is not None and demand.gearbox == DIRECT:
            whole = together(DIRECT.model_copy(update={"rated_output_torque": motor.rated_torque}), stage[0])
        return lost_motion(whole, limit, slides=self.task.linear is not None)

    def _braked(self, row: np.ndarray, demand: InputDemand) -> list[Finding]:
        """The rule of the holding brake, where the load has to be held or a brake is given."""
        task = self.task
        if task.brake is None and not (task.hold_without_power and (task.gravity is not None or task.rise)):
            return []
        brake = (
            None if self.study.slides_itself(row) and not (task.brake and task.brake.force) else self.study.brake(row)
        )
        return [holding_brake(demand, brake, None if task.linear is None else self.motion(row))]

    def _attraction(self, row: np.ndarray) -> list[Finding]:
        """Not judged: the friction that the attraction of a linear motor causes on a guide of unknown friction."""
        sheet, linear = self.study.records(row)["linear_motor"], self.task.linear
        assert isinstance(sheet, LinearMotorSheet)
        assert linear is not None
        if sheet.attraction_force is None or linear.guide_friction is not None:
            return []
        what = f"friction of the guide under the attraction of {sheet.attraction_force:.4g} N"
        return [missing("guide_friction", what, "slide.friction_coefficient")]

    def choice(self, row: np.ndarray) -> dict[str, tuple[float, list[str]]]:
        """Mass, length, price and lead time of a pair, each with the kinds of record that lack it."""
        records = self.study.records(row)
        return {column: value_of(column, records) for column in CHOICE}

    def _without_run(self, row: np.ndarray) -> ResultRow:
        """The columns that need no run."""
        known = {column: value for column, (value, _) in self.choice(row).items()}
        try:
            (demand, _), motor = self.gearbox(row), self.motor(row)
        except InputError:
            return known
        slides, torque = self.study.slides_itself(row), demand.motor_torque(motor)
        required = f"required_{'force' if slides else 'torque'}"
        known |= {
            f"{required}_peak": float(np.abs(torque).max()),
            f"{required}_rms": demand.cycle(torque).rms_motor_torque,
        }
        ratio = ratio_of_inertias(motor, demand.whole, float(self.motion(row).inertia.max()))
        return known if slides else known | {"inertia_ratio": ratio}

    def _chosen(self, row: np.ndarray, findings: list[Finding]) -> tuple[list[Finding], list[str]]:
        """Findings with the findings on the limits of the choice, and the data that the records lack for limits and objectives."""
        task, select = self.task, self.study.select
        found, lacking = list(findings), []
        named = () if select is None else select.named()
        limits = {column: getattr(task, quantity.limit) for column, quantity in CHOICE.items()}
        if not any(limit is not None for limit in limits.values()) and not set(named) & set(CHOICE):
            return findings, []
        for column, (value, kinds) in self.choice(row).items():
            limit = limits[column]
            if kinds and (limit is not None or column in named):
                by = f"task.{CHOICE[column].limit}" if limit is not None else f"select for {column}"
                lacking.append(lacks(column, kinds, by))
            elif limit is not None and math.isnan(value):
                part = f"part that is a record with {CHOICE[column].key}"
                found.append(without_part(column, part, f"task.{CHOICE[column].limit}"))
            elif limit is not None:
                found.append(judged_choice(column, value, limit))
        return found, lacking

    def _electrical(self) -> str | None:
        """A column of electrical energy that the task limits or ranks by."""
        named = () if self.study.select is None else self.study.select.named()
        return next((column for column in ("energy", "energy_returned") if column in named), None)

    def _supplied(self, demand: InputDemand, motor: Motor) -> list[Finding]:
        """The rules of supply and amplifier."""
        supply, amplifier, found = self.task.supply, self.task.amplifier_of_task(), list[Finding]()
        if amplifier is not None:
            current = effective_current(motor, demand.motor_torque(motor), demand.speed)
            motion, bus = demand.motion, None if supply is None else supply.start()
            found += amplifier_rules(motion.time, current, motion.cycle, amplifier, bus, motor)
        if supply is None:
            return found
        used = ("voltage_limit", "capacitance", "brake_resistance", "brake_power")
        asked = any(getattr(supply, key) is not None for key in used)
        if asked or (supply.max_voltage is not None and (amplifier is None or amplifier.max_dc_voltage is None)):
            power = electrical_power(demand, motor)
            unknown = bool(np.isnan(power).any())
            back = None if unknown else returned(demand.motion.time, power, demand.motion.cycle)
            found += supply_rules(back, supply)
        return found

    def _under_task(self, findings: list[Finding], motor: Motor) -> list[Finding]:
        """Findings with the derating and the safety factors of the task."""
        task = self.task
        hottest = None if motor.limits is None else motor.limits.max_winding_temperature
        share = derating(task.altitude, task.ambient_temperature, hottest)
        return with_safety(derated(findings, share), task.safety_factors)

    def refused(self, row: np.ndarray) -> ResultRow | None:
        """The columns of a pair that the rules refuse; None if it is to be run."""
        try:
            found = self.judged(row)
        except InputError as error:
            lacking = BETWEEN.join(p.of_any_record() for p in error.problems)
            return CHECKS | {"violated": NO_DATA, "why": str(error), MISSING: lacking}
        if not any(f.verdict == "warning" for f in found):
            return None
        required = self._without_run(row)
        of_motor = {
            name.replace("required", "motor"): required[name] for name in required if name.startswith("required_")
        }
        columns = columns_of(found, CHECKS) | required | of_motor
        if self.study.slides_itself(row):
            return columns
        demand, _ = self.gearbox(row)
        return columns | columns_of_gearbox(demand.cycle(demand.motor_torque(self.motor(row))))

    def verdict_at_ends(self, row: np.ndarray, own: tuple[str, ...]) -> str:
        """Verdict over the range of estimated losses; empty where the losses are printed.

        own: limits that the pair violates with the estimate itself.
        """
        try:
            gearbox = self.study.part("gearbox", row)
        except InputError:
            return ""
        if gearbox.loss_range is None:
            return ""
        ends = [self._with_known_losses(row, factor).violated(row) for factor in gearbox.loss_range]
        if all(set(end) == set(own) for end in ends):
            return HOLDS
        least, most = ("fits" if not end else f"violates {' '.join(end)}" for end in ends)
        return f"not decided: {least} with the least losses of its kind, {most} with the largest"

    def _with_known_losses(self, row: np.ndarray, factor: float) -> Axes:
        """The task with a gearbox whose losses are known: so many times its estimate."""
        key = self.study.part_key("gearbox", row)

        def make() -> Axes:
            study = self.study.model_copy()
            shared = ("motor", "motion", "stage motion", self.task.stage_kind)
            # Other threads add to what is kept: a copy is made at once, and not while it changes.
            kept = {k: v for k, v in dict(self.study.kept).items() if k[0] in shared}
            study._kept = kept | {key: self.study.part("gearbox", row).with_losses(factor)}
            return Axes(study)

        return self.study.once(("known losses", key, factor), make)

    def violated(self, row: np.ndarray) -> tuple[str, ...]:
        """Limits that a pair violates, of the rules and of the selection; the pair is run if the rules pass."""
        refused = self.refused(row)
        if refused is not None:
            return tuple(str(refused["violated"]).split())
        try:
            return self.over(self.measured(row)[0])
        except (RuntimeError, ValueError):
            return ("run",)

    def over(self, columns: ResultRow) -> tuple[str, ...]:
        """The limits that the columns of a run violate."""
        select = self.study.select
        found = [rule for rule in str(columns["violated"]).split() if rule]
        for name, bound in {} if select is None else select.limits.items():
            low, high = bound.in_unit(self.study.kept_units.get(name, ""))
            if name in columns and not low <= float(columns[name]) <= high:
                found.append(name)
        return tuple(found)

    def measured(self, row: np.ndarray) -> tuple[ResultRow, int]:
        """The columns of a pair that is run, and its switchings. Raises InputError, SolverError: it cannot be run."""
        made = until_it_repeats(self.study, row)
        columns = row_of(made, slides=self.study.slides_itself(row))
        found = self._after_run(row, made, columns["winding_temperature"])
        more: ResultRow = {**columns, **self._without_run(row)}
        whole = columns_of(found, CHECKS) | more
        if made.scenario.controller is not None and (pole := unstable_pole(axis_of(made.scenario))):
            why = f"{UNSTABLE}: {pole}"
            if self.over(whole):
                whole["why"] = "; ".join(filter(None, [why, str(whole["why"])]))
            else:  # friction may hold what the loop would swing
                whole = columns_of([*found, not_judged("stability", why, "loops")], CHECKS) | more
        return whole, int(made.result.attrs["switching_count"])

    def _after_run(self, row: np.ndarray, made: Repeated, winding: float) -> list[Finding]:
        """The same rules, of the cycle that was run, and the temperature of its winding [°C]; rules that only the
        required motion has are taken from it."""
        here, task, slides, result = made.cycles.last, self.task, self.study.slides_itself(row), made.result
        duty, m = made.duty, made.scenario.motor
        command, torque, speed = (result[name][here] for name in ("command", "motor_torque", "motor_speed"))
        if m.kind == "stepper":
            of_motor = [*speed_of_stepper(m, duty.peak_input_speed), *stepper_rules(made.scenario, MOTOR, result)]
            return self._with_others(row, of_motor, made)
        command = command_of_run(m, made.scenario.controller, command, torque, speed)
        oriented = oriented_amplitudes(made.scenario, result, MOTOR)
        of_phase = None if oriented is None else (oriented[0][here], oriented[1][here])
        ambient = task.ambient_temperature
        rise = None if math.isnan(winding) else winding - ambient
        of_motor = motor_rules(m, duty, ambient, command, torque, speed, slides=slides, rise=rise, oriented=of_phase)
        if of_phase is not None and (amplifier := task.amplifier_of_task()) is not None:
            time, bus = result.time[here], None if task.supply is None else task.supply.start()
            whole = effective_current(m, torque, speed, of_phase[0])
            of_motor += amplifier_rules(time, whole, float(time[-1] - time[0]), amplifier, bus, m)
        return self._with_others(row, of_motor, made)

    def _with_others(self, row: np.ndarray, of_motor: list[Finding], made: Repeated) -> list[Finding]:
        """Findings of the motor in a run, with the findings of its gearbox, and the findings that only the required motion has."""
        g, duty = made.scenario.gearbox, made.duty
        of_gearbox: list[Finding] = []
        if self.task.linear is None:
            of_gearbox = [*loads(g, float(np.abs(duty.output_torque).max()), duty), *input_speeds(g, duty)]
        found = self._under_task([*of_gearbox, *of_motor], made.scenario.motor)
        again = {f.rule for f in found}
        return [*found, *(f for f in self.judged(row) if f.rule not in again)]


def run_axes(study: Study, parameters: np.ndarray, threads: int) -> Runs:
    """The pairs of a piece: first the rules for all of them, then the runs of the pairs that pass, on several threads."""
    n = len(parameters)
    rows: list[ResultRow | None] = [None] * n
    errors, switchings = [""] * n, np.zeros(n)
    tasks: list[tuple[Axes, np.ndarray]] = []
    for k, parameter in enumerate(parameters):
        try:
            one, own = study.at(parameter)
        except InputError as error:
            one, own, errors[k], rows[k] = study, parameter, str(error), dict(CHECKS)
        tasks.append((Axes(one), own))
        if not errors[k]:
            rows[k] = tasks[k][0].refused(own)
    waiting = [k for k, row in enumerate(rows) if row is None]

    def measure(k: int) -> ResultRow:
        axes, own = tasks[k]
        try:
            row, switchings[k] = axes.measured(own)
        except (RuntimeError, ValueError) as error:
            errors[k] = str(error)
            return dict(CHECKS)
        return row

    with thread_pool(threads) as pool:
        for k, row in zip(waiting, pool.map(measure, waiting), strict=True):
            rows[k] = row
        judged = [k for k, row in enumerate(rows) if row is not None and not errors[k] and row["violated"] != NO_DATA]
        ends = pool.map(lambda k: tasks[k][0].verdict_at_ends(tasks[k][1], tasks[k][0].over(rows[k] or {})), judged)
        for k, verdict in zip(judged, ends, strict=True):
            rows[k] = {**(rows[k] or {}), ESTIMATED: verdict}
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
