"""Errors of logs under a condition that the fit has not seen: the model is fitted again without them, one condition after the other."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from ..errors import InputError
from ..inputs.refusal_messages import shortened
from ..units.practical import counted
from .candidate_models import Notify, mean_errors, with_own
from .fit.least_squares import Fit, problem_of, search
from .fit.log_errors import log_errors
from .prepared_log import Prepared
from .rig.residuals import Engine


@dataclass(frozen=True)
class ConditionError:
    """Error of the logs of one condition, with these logs in the fit and without them."""

    key: str  # key of the header, or `file` or `folder`
    value: Any  # value of the key in these logs
    logs: int  # number of these logs
    fitted: float  # mean absolute error with these logs in the fit, in the unit by which models are compared
    left_out: float  # mean absolute error of the model that was fitted to the other logs; NaN without a run
    failed: str  # why there is no error; empty if there is one

    @property
    def name(self) -> str:
        """Condition, such as ``mass = 0.5``."""
        shown = f"{self.value:g}" if isinstance(self.value, float) else shortened(str(self.value))
        return f"{self.key} = {shown}"

    def text(self, unit: str, factor: float) -> str:
        """One line, with errors in a unit; one SI unit has so many of it."""
        unit = f" {unit}".rstrip()
        without = self.failed or f"{factor * self.left_out:.4g}{unit} when fitted without them"
        return f"{self.name} ({counted(self.logs, 'log')}): mean absolute error {factor * self.fitted:.4g}{unit}, {without}"


def left_out_errors(
    engine: Engine, logs: Sequence[Prepared], fit: Fit, rung: int, notify: Notify
) -> list[ConditionError]:
    """Errors of the fitted logs of each condition that ``fit.leave_out`` names, with and without them in the fit.

    logs: all that were fitted or held out; held-out logs take no part.
    fit: of the model that is taken: the search without some of the logs begins there.
    """
    train = [log for log in logs if not log.held_out]
    found = []
    task = engine.rig.task
    for key in task.fit.leave_out:
        for value in sorted({log.facts[key] for log in train}, key=lambda v: (isinstance(v, str), v)):
            out = [log for log in train if log.facts[key] == value]
            rest = [log for log in train if log.facts[key] != value]
            residuals = engine.residuals(out, fit.point, rung)
            before, _ = mean_errors(task, log_errors(out, residuals), fit)
            own = ConditionError(key, value, len(out), before, math.nan, "no other log was fitted")
            found.append(_fitted_without(engine, own, out, rest, fit, rung, notify) if rest else own)
    return found


def _fitted_without(
    engine: Engine,
    condition: ConditionError,
    out: Sequence[Prepared],
    rest: Sequence[Prepared],
    fit: Fit,
    rung: int,
    notify: Notify,
) -> ConditionError:
    """The condition with the error of the model that was fitted to the other logs."""
    unseen = [replace(log, held_out=True) for log in out]
    name = f"without {condition.name}"
    try:
        again = search(
            problem_of(engine, rest, rung), fit.point, notify=lambda iteration, cost: notify(name, iteration, cost)
        )
        point = with_own(engine, unseen, again.point, rung)
        residuals = engine.residuals(unseen, point, rung)
    except InputError as problem:
        return replace(condition, failed=f"no fit without them: {problem}")
    if engine.failed:
        log, why = next(iter(engine.failed.items()))
        return replace(condition, failed=f"no run when fitted without them ({log}: {why})")
    _, error = mean_errors(engine.rig.task, log_errors(unseen, residuals), fit)
    return replace(condition, left_out=error, failed="")
