"""The next best experiment, by the information that candidate runs would give."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..inputs.argument_checks import checked
from .fit.least_squares import slope_of
from .preparation.prepare import prepared
from .readers.log import Log
from .result import IdentificationResult
from .rig.residuals import Engine, ParameterPoint
from .task.identification_file import free_on
from .virtual_logs import virtual_log

PRIOR = 1e-3  # information on a scaled parameter that nothing else is known of: it may change by about 30 of its scales


@dataclass(frozen=True)
class Candidate:
    """An experiment with its information about the parameters, in addition to the existing logs."""

    name: str
    gain: float  #: information on all parameters in nats: half the change of the log-determinant of the information
    widths: dict[str, float]  #: by parameter, width of its interval after it over that before


@checked
def design_experiment(
    result: IdentificationResult, plans: Sequence[Log], *, deviation: Mapping[str, float] | None = None
) -> list[Candidate]:
    """Rank experiments by their information about the parameters, in addition to the existing logs.

    Parameters
    ----------
    result : IdentificationResult
        Result of `identify`.
    plans : sequence of Log
        Candidate experiments: time, header and inputs of each, as in a log. Measured channels may be missing.
    deviation : mapping of str to float, optional
        Standard deviations of the measured channels by name, SI. Default: the deviations of the residuals of the fit.

    Returns
    -------
    list of Candidate
        The candidates, the most informative first.

    Raises
    ------
    InputError
        There is no plan, or a plan lacks a channel.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import lostmotion as lm
    >>> gearbox = lm.gearbox("schaeffler-rt1-h-20-100")
    >>> with TemporaryDirectory() as folder:
    ...     result = lm.identify(lm.identification.write_campaign(folder, gearbox))
    ...     plans = [lm.identification.read_log(path) for path in sorted(Path(folder, "logs").iterdir())[:2]]
    >>> ranked = lm.identification.design_experiment(result, plans)
    >>> ranked[0].gain >= ranked[1].gain
    True
    """
    if not plans:
        raise InputError("plans: is empty; give at least one experiment, as a log with its time, header and inputs")
    assert result.rig is not None
    rig, engine = result.rig, Engine(result.rig, threads=1)
    free, names = free_on(result.task, result.chosen), list(free_on(result.task, result.chosen))
    sigma = np.array(
        [(deviation or {}).get(n, s) for n, s in zip(result.task.measured, result.fit.deviations, strict=True)]
    )
    before = result.fit.normal + PRIOR * np.eye(len(names))
    found = []
    for plan in plans:
        log = prepared(result.task, virtual_log(rig, plan, result.values, rung=result.chosen), rig.units)
        point = ParameterPoint(result.values, {log.name: {n: p.start for n, p in result.task.nuisance.items()}})
        (J,) = engine.jacobians([log], point, result.chosen, free)
        slopes = np.array([slope_of(free[n], result.values[n]) for n in names])
        A = J * slopes / sigma[:, None, None]
        after = before + np.einsum("cti,ctj->ij", A, A) / result.fit.correlation
        gain = 0.5 * (np.linalg.slogdet(after)[1] - np.linalg.slogdet(before)[1])
        was, will = (np.sqrt(np.diag(np.linalg.inv(H))) for H in (before, after))
        found.append(
            Candidate(plan.name, float(gain), {n: float(b / a) for n, a, b in zip(names, was, will, strict=True)})
        )
    if any(math.isnan(c.gain) for c in found):
        bad = next(c.name for c in found if math.isnan(c.gain))
        raise InputError(f"plans: the rig has no motion in {bad}; check its inputs and header")
    return sorted(found, key=lambda c: -c.gain)
