"""The answer of an identification: values, intervals, errors, and what limits their use."""

import math
from dataclasses import dataclass, field

from ..errors import InputError
from ..simulation.scenario.scenario import Scenario
from ..simulation.scenario.scenario_files import scenario_text
from ..units.practical import OF_ERRORS, counted
from ..verdict import Point, Verdict
from .candidate_models import GAIN, RungResult
from .fit.intervals import Interval
from .fit.least_squares import Fit
from .fit.log_errors import LogError, total
from .fit.start_values import Regression
from .left_out_conditions import ConditionError
from .prepared_log import Prepared
from .result_as_scenario import gear_sheet, sheet_text
from .rig.rig_scenario import Rig
from .task.identification_file import Identification
from .verdicts.disagreeing_logs import OddLog
from .verdicts.identifiability import Undetermined
from .verdicts.residual_tests import Misfit
from .verdicts.shared_faults import KindError, SharedFault

HALF = 0.5  # of the standard deviation of what was measured: a model that leaves more does not describe the motion


@dataclass
class IdentificationResult:
    """Values, intervals and errors of an identification, with the unidentifiable parameters."""

    task: Identification
    rungs: list[RungResult]  #: candidate models, from the first
    chosen: int  #: index of the chosen model
    intervals: dict[str, Interval]  #: 95 % intervals of the parameters, SI
    undetermined: list[Undetermined]  #: unidentifiable parameters
    at_bounds: list[str]  #: parameters that have ended at a bound
    notes: dict[str, tuple[str, ...]]  #: by log: notes on dropped samples, and on what looks wrong
    left_out: dict[str, str] = field(default_factory=dict, kw_only=True)  #: by log that cannot be used: why
    inputs: list[str] = field(default_factory=list, kw_only=True)
    """course of inputs between samples, if the task leaves it open, with the reason"""
    misfits: list[Misfit] = field(default_factory=list, kw_only=True)
    """channels whose residuals are structured, or far above the stated deviation"""
    conditions: list[ConditionError] = field(default_factory=list, kw_only=True)
    """errors of the logs of each condition of ``fit.leave_out``, with and without them in the fit"""
    odd: list[OddLog] = field(default_factory=list, kw_only=True)
    """logs that disagree with the others, and the fault that explains each"""
    shared: list[SharedFault] = field(default_factory=list, kw_only=True)
    """faults that several logs share, which are the model's"""
    kinds: list[KindError] = field(default_factory=list, kw_only=True)
    """errors of the logs by the values of their headers"""
    scenario: Scenario  #: the rig with the values that were found, of the first log
    profiles: dict[str, list[tuple[float, float]]] = field(default_factory=dict)
    """by parameter, (value, rise of the loss)"""
    by_differences: dict[str, str] = field(default_factory=dict)
    """parameters whose derivatives were differences of runs, not exact: why"""
    touching: dict[str, str] = field(default_factory=dict)
    """logs whose derivatives were so from some instant on, at the values found: why"""
    start: Regression = field(default_factory=Regression)  #: start of the search
    rig: Rig | None = field(default=None, repr=False)
    logs: list[Prepared] = field(default_factory=list, repr=False)

    @property
    def fit(self) -> Fit:
        """Fit of the chosen model."""
        return self.rungs[self.chosen].fit

    @property
    def values(self) -> dict[str, float]:
        """Values of all parameters, SI."""
        return dict(self.fit.point.values)

    @property
    def errors(self) -> list[LogError]:
        """Errors of each log and channel."""
        return self.rungs[self.chosen].errors

    def error(self, channel: str | None = None, *, held_out: bool = False) -> tuple[float, float]:
        """(MAE, RMSE) of a channel over all logs fitted, or held out [SI]; NaN without such."""
        name = channel or next(iter(self.task.measured))
        return total(self.errors, held_out=held_out, channel=name)

    def unit(self, channel: str) -> str:
        """SI unit of the errors of a channel; empty where neither its file nor the rig gives one."""
        return next((log.log.channels[self.task.measured[channel].channel].unit for log in self.logs), "")

    def error_unit(self, channel: str | None = None) -> tuple[str, float]:
        """Unit in which errors of a channel are printed, and how many of them one SI unit is; left out, for the models that are compared."""
        first, *more = self.task.measured
        if channel is None and more:
            return "standard deviations", 1.0
        unit = self.unit(channel or first)
        return OF_ERRORS.get(unit, (unit, 1.0))

    def errors_text(self, *, held_out: bool) -> str:
        """MAE and RMSE of each channel that has errors, with its unit."""
        found = {channel: self._error_text(channel, held_out=held_out) for channel in self.task.measured}
        return "; ".join(f"{channel} {text}" for channel, text in found.items() if text)

    def _error_text(self, channel: str, *, held_out: bool) -> str:
        mae, rmse = self.error(channel, held_out=held_out)
        unit, factor = self.error_unit(channel)
        shown = [f"{name} {factor * value:.4g} {unit}".rstrip() for name, value in (("MAE", mae), ("RMSE", rmse))]
        return "" if math.isnan(mae) else ", ".join(shown)

    def values_for(self, log: str) -> dict[str, float]:
        """Values of all parameters, and of the nuisances of one log by its name."""
        return self.values | self.fit.point.nuisance.get(log, {})

    def __str__(self) -> str:
        return "\n".join(self.lines())

    def lines(self) -> list[str]:
        """The answer as text."""
        lines = [
            *self.warnings(),
            f"chosen model: {self.rungs[self.chosen].name}",
            *(f"  {text}" for text in [*self.failures(), *self.passed_over()]),
        ]
        for name, p in self.task.parameters.items():
            if name not in self.intervals:
                continue
            i = self.intervals[name]
            unit = f" {p.unit}" if p.unit else ""
            flag = f"; {i.flag}" if i.flag else ""
            lines.append(f"  {name} = {p.shown(self.values[name])} ({p.shown(i.low)} to {p.shown(i.high)}){unit}{flag}")
        for channel in self.task.measured:
            for held_out, what in ((False, "fitted"), (True, "held out")):
                if text := self._error_text(channel, held_out=held_out):
                    own = [e for e in self.errors if e.held_out == held_out and e.channel == channel]
                    lines.append(
                        f"  {channel}, {counted(sum(not math.isnan(e.mae) for e in own), 'log')} {what}: {text}"
                    )
        lines += [f"  {condition.text(*self.error_unit())}" for condition in self.conditions]
        lines += [f"  {u.text}" for u in self.undetermined] + [f"  {text}" for text in self.at_bounds]
        return lines + [f"  {text}" for text in [*self.differences(), *self.inputs, *self.starts()]]

    def warnings(self) -> list[str]:
        """Why the values and their intervals are to be doubted; nothing where the residuals are noise."""
        lost = [name for name, i in self.intervals.items() if i.method == "bounds"]
        text = (
            "may have any value within its bounds: the motion does not depend smoothly on it, and no start led to residuals of the "
            "stated deviation"
        )
        own = [o for o in self.odd if not any(o.log in s.logs for s in self.shared)]
        odd = [f"{o.text}{', so that it is left out of the fit' if o.left_out else ''}" for o in own]
        return [
            *(s.text for s in self.shared),
            *odd,
            *(m.text(*self.error_unit(m.channel)) for m in self.misfits),
            *(f"{name} {text}" for name in lost),
        ]

    @property
    def verdict(self) -> Verdict:
        """Whether the model describes the logs, and what is left of an error, of odd logs and of undetermined parameters."""
        points: list[Point] = []
        held_out = any(e.held_out and not math.isnan(e.mae) for e in self.errors)
        own = [e for e in self.errors if e.held_out == held_out and not math.isnan(e.mae)]
        sizes = []
        for channel in self.task.measured:
            mine = [e for e in own if e.channel == channel]
            if not mine:
                continue
            rms = total(self.errors, held_out=held_out, channel=channel)[1]
            spread = math.sqrt(
                sum(e.samples * (e.rmse / max(1.0 - e.fit, 1e-12)) ** 2 for e in mine if e.fit == e.fit)
                / sum(e.samples for e in mine)
            )
            sizes.append(
                f"{channel} fits to {_sized(rms, *self.error_unit(channel))} rms{' held out' if held_out else ''}"
            )
            if rms > HALF * spread:
                text = f"{channel}: an error of {_sized(rms, *self.error_unit(channel))} rms is left of a motion of {_sized(spread, *self.error_unit(channel))} rms"
                points.append(Point("does not fit", text))
        fits = "; ".join(sizes)
        loose = {name for u in self.undetermined for name in u.changes} | {
            n for n, i in self.intervals.items() if i.method == "bounds"
        }
        if self.intervals and loose >= self.intervals.keys():
            points.append(Point("not decided", f"{fits}, but these logs determine none of the parameters"))
        if self.misfits:
            points.append(Point("fits with a reservation", f"{fits}; a systematic error is left"))
        points += [Point("fits with a reservation", text) for text in self.warnings()]
        points += [
            Point("fits with a reservation", text) for text in [*(u.text for u in self.undetermined), *self.at_bounds]
        ]
        if self.left_out:
            name, why = next(iter(self.left_out.items()))
            text = f"{fits}; {len(self.left_out)} of {len(self.left_out) + len(self.logs)} logs are left out; {name}: {why.removeprefix(f'{name}: ')}"
            points.append(Point("fits with a reservation", text))
        points.append(Point("fits", f"{fits}; the residuals are noise, and the logs determine all parameters"))
        more = [p.sentence for p in points if p.state == "fits with a reservation"]
        verdict = Verdict.of(points)
        return Verdict.of(points, [text for text in more if text != verdict.lines[0]][:2])

    def passed_over(self) -> list[str]:
        """Rungs with a smaller error that were not taken, since the logs do not tell what they free."""
        taken, found = self.rungs[self.chosen], []
        for rung in self.rungs[self.chosen + 1 :]:
            gain = 1.0 - rung.error / taken.error
            if gain > GAIN and len(rung.failed) <= len(taken.failed) and rung.loose > taken.loose:
                text = "; ".join(u.text for u in rung.undetermined)
                found.append(
                    f"{rung.name}: not taken for a gain of {100 * gain:.2g} %, since these logs do not determine its parameters: {text}"
                )
        return found

    def failures(self) -> list[str]:
        """Logs held out without a run of a candidate model, and why; a model with fewer of them is preferred."""
        count = sum(log.held_out for log in self.logs)
        least = len(self.rungs[self.chosen].failed)
        found = []
        for rung in self.rungs:
            if rung.failed:
                first, why = next(iter(rung.failed.items()))
                less = ", so that this model is not chosen" if len(rung.failed) > least else ""
                found.append(
                    f"{rung.name}: {len(rung.failed)} of {count} logs held out without a run{less}: {', '.join(rung.failed)} ({first}: {why})"
                )
        return found

    def differences(self) -> list[str]:
        """Parameters and logs whose derivatives were differences of runs, with the reason."""
        found = [f"{name}: derivatives by differences, since {why}" for name, why in self.by_differences.items()]
        if self.touching:
            first = next(iter(self.touching))
            found.append(
                f"{len(self.touching)} of {len(self.logs)} logs: derivatives by differences from some instant on; {first}: "
                f"{self.touching[first]}"
            )
        return found

    def starts(self) -> list[str]:
        """Start values from a regression, and reasons for the others; empty if the task wants none."""
        return self.start.lines(self.task.parameters) if self.task.fit.regression else []

    def source(self) -> str:
        """Source of the values, for records."""
        fitted = sum(not log.held_out for log in self.logs)
        files, rung = ", ".join(self.task.logs.files), self.rungs[self.chosen].name
        text = f"identified from {counted(fitted, 'log')} ({files}), {rung}"
        if held_out := self.errors_text(held_out=True):
            return f"{text}; error of {counted(len(self.logs) - fitted, 'log')} held out: {held_out}"
        return f"{text}; error of the fit, since no log was held out: {self.errors_text(held_out=False)}"

    def scenario_text(self) -> str:
        """The identified rig as a scenario file."""
        return scenario_text(self.scenario, "\n".join([self.source(), *self.lines()]))

    def record_text(self) -> str:
        """The gear that the key `record` names, as a data sheet with the status "identified".

        Raises
        ------
        InputError
            There is no such gear.
        """
        table, _, name = self.task.record.partition(".")
        if table != "gear" or name not in self.scenario.gears:
            raise InputError(
                f"{self.task.record!r} must be gear.NAME with one of {', '.join(self.scenario.gears) or 'no gear'}",
                "record",
            )
        plain = "".join(c if c.isalnum() else "-" for c in name.lower()).strip("-")
        return sheet_text(
            gear_sheet(self.scenario.gears[name], f"{plain}-identified", self.task.title or name, self.source())
        )


def _sized(value: float, unit: str, factor: float) -> str:
    """An error with its unit."""
    return f"{factor * value:.3g} {'degrees' if unit == 'deg' else unit}".rstrip()
