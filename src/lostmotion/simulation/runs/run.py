"""Runs: from a scenario, or a drive and what acts on it, to a labelled dataset."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal, overload

from ...control.axis import BoundController
from ...control.command import CommandSignal
from ...control.custom_controller import as_laws
from ...errors import InputError
from ...inputs.argument_checks import checked
from ...inputs.memory_limits import check_free
from ...inputs.quantities import Number
from ...interruptible_threads import thread_pool
from ...model.drive import Drive
from ...model.signals import TorqueSignal
from ..forms.drive_tables import Initial
from ..forms.train_tables import TrainInitial
from ..scenario.field_oriented_motors import ATTRIBUTE as ERROR_BOUND
from ..scenario.field_oriented_motors import coarser, error_bound, oriented, too_slow
from ..scenario.requirements import need_ideal_current, wound
from ..scenario.scenario import Scenario
from .core_runs import Options, core_result
from .energy_ledger import warned
from .results import RunArrays, raw_result, variables_of
from .sensitivities import run_sensitivities
from .separate_trains import SIDE_BY_SIDE

if TYPE_CHECKING:
    import xarray

SolverName = Literal["exact", "dormand-prince"]
OutputName = Literal["dataset", "arrays"]

TOLERANCE = 1e-8  # of the adaptive solver, if none is given
TOLERANCE_OF_WINDINGS = 1e-10  # the same where its steps are short anyway, and no other solver is at hand
TOLERANCES = (1e-15, 1e-3)  # beyond rounding, and beyond what finds the switching instants

MAX_SWITCHINGS = 100_000  # kept with a result; beyond it they are only counted
BYTES_PER_VALUE = 12.2  # of a result while it is made: 8.8 to 12.1 measured over drives, trains and controllers


@overload
def simulate(
    scenario_or_drive: Scenario | Drive,
    *,
    command: CommandSignal | float | None = None,
    load_torque: TorqueSignal | float | None = None,
    duration: float | None = None,
    sample_interval: float | None = None,
    initial: Initial | TrainInitial | None = None,
    solver: SolverName | None = None,
    relative_tolerance: Number | None = None,
    energy: bool | None = None,
    law: Any = None,
    sensitivities: Sequence[str] | None = None,
    output: Literal["dataset"] = "dataset",
) -> xarray.Dataset: ...
@overload
def simulate(
    scenario_or_drive: Scenario | Drive,
    *,
    command: CommandSignal | float | None = None,
    load_torque: TorqueSignal | float | None = None,
    duration: float | None = None,
    sample_interval: float | None = None,
    initial: Initial | TrainInitial | None = None,
    solver: SolverName | None = None,
    relative_tolerance: Number | None = None,
    energy: bool | None = None,
    law: Any = None,
    output: Literal["arrays"],
) -> RunArrays: ...
@checked
def simulate(
    scenario_or_drive: Scenario | Drive,
    *,
    command: CommandSignal | float | None = None,
    load_torque: TorqueSignal | float | None = None,
    duration: float | None = None,
    sample_interval: float | None = None,
    initial: Initial | TrainInitial | None = None,
    solver: SolverName | None = None,
    relative_tolerance: Number | None = None,
    energy: bool | None = None,
    law: Any = None,
    sensitivities: Sequence[str] | None = None,
    output: OutputName = "dataset",
) -> xarray.Dataset | RunArrays:
    """Simulate a drive or a drive train.

    Parameters
    ----------
    scenario_or_drive : Scenario or Drive
        A scenario, whose values the other arguments replace, or a drive alone. `Scenario.replace` changes the inputs of a train that
        has several.
    command : CommandSignal or float, optional
        The one command, E_C [-]. Default: the value in the scenario; 0 for a drive alone.
    load_torque : TorqueSignal or float, optional
        The one load torque M_Z [N·m], of a slide load force [N]. Default: the value in the scenario; 0 for a drive alone.
    duration, sample_interval : float, optional
        Times [s], required for a drive alone. They set the instants of the result and do not affect the motion.
    initial : Initial or TrainInitial, optional
        State at t = 0. Default: rest.
    solver : str
        ``"exact"``, or ``"dormand-prince"`` for the adaptive solver, which computes no energy ledger. Default: the exact solver, or the
        adaptive one where a stepper has a winding.
    relative_tolerance : float, optional
        Tolerance of the adaptive solver, 1e-15 to 1e-3. Default: 1e-8, with a winding 1e-10. The exact solver has none.
    energy : bool, optional
        Whether to compute the energy ledger with the motion, which takes about as long again. By default `energy_of`, `save` and
        reports compute it by a second run when they need it; with a law it is computed at once.
    law : callable or Law, optional
        The law of a controller with ``law = true``. For several, a mapping by the names of their motors.
    sensitivities : sequence of str, optional
        Keys of the scenario, such as ``load.inertia``. Adds the derivative of each variable with respect to their values, exact
        through switchings, as ``NAME_sensitivity`` over ``parameter`` and ``time``. It is NaN from an instant at which it does not
        exist; the attributes state the instant and the reason.
    output : str
        ``"dataset"``, or ``"arrays"`` for plain arrays by name, which take a fraction of the time to make.

    Returns
    -------
    xarray.Dataset or RunArrays
        The variables of `lostmotion.simulation.VARIABLES`, or the variables of the elements of the train, over ``time`` [s]. The attributes
        contain the end state, the scenario and, if it was computed, the energy ledger.

    Raises
    ------
    InputError
        The scenario cannot be used.
    SolverError
        The motion has no continuation (jamming, accumulating switchings). The message names time and contact.
    KeyboardInterrupt
        Ctrl-C ends the run at once.

    Examples
    --------
    >>> import lostmotion as lm
    >>> result = lm.simulate(lm.load("paper-2dof-nl-small"), duration="1 s")
    >>> f"{result['load_speed'].sel(time=0.3).item():.4g} {result['load_speed'].units}"
    '0.02915 rad/s'
    """
    changes: dict[str, Any] = {"command": command, "load_torque": load_torque, "initial": initial}
    changes |= {"duration": duration, "sample_interval": sample_interval}
    one = scenario_or_drive
    scenario = Scenario.of_drive(one, **changes) if isinstance(one, Drive) else one.with_inputs(**changes)
    if output not in ("dataset", "arrays"):
        raise InputError(f'output {output!r} is not known; it must be "dataset" or "arrays"')
    if sensitivities is not None and output == "arrays":
        raise InputError('sensitivities, output="arrays": derivatives are variables of a dataset; leave output out')
    with_ledger = law is not None if energy is None else energy
    arrays = run(scenario, solver=solver, relative_tolerance=relative_tolerance, energy=with_ledger, law=law)
    if output == "arrays":
        return arrays.frozen()
    result = arrays.dataset()
    if sensitivities is None:
        return result
    need_ideal_current(scenario, "sensitivities")
    if solver == "dormand-prince" or law is not None:
        other = f"solver={solver!r}" if solver == "dormand-prince" else "law"
        raise InputError(
            f"sensitivities, {other}: derivatives are those of the exact solver, under controllers of the scenario"
        )
    return run_sensitivities(scenario, sensitivities).add_to(result)


def run(
    scenario: Scenario,
    *,
    solver: SolverName | None = None,
    relative_tolerance: float | None = None,
    energy: bool = True,
    law: Any = None,
) -> RunArrays:
    """Run a scenario as `simulate` does, with the result as plain arrays."""
    if solver not in (None, "exact", "dormand-prince"):
        raise InputError(f'solver {solver!r} is not known; it must be "exact" or "dormand-prince"')
    exact = not any(wound(scenario)) if solver is None else solver == "exact"
    if exact:
        need_ideal_current(scenario, "exact solver")
    if exact and relative_tolerance is not None:
        raise InputError(
            f'relative_tolerance {relative_tolerance:g}: the exact solver has none; leave it out, or give solver="dormand-prince"'
        )
    usual = TOLERANCE_OF_WINDINGS if any(wound(scenario)) else TOLERANCE
    tolerance = usual if relative_tolerance is None else relative_tolerance
    low, high = TOLERANCES
    if not low <= tolerance <= high:
        raise InputError(f"relative_tolerance {tolerance:g} must lie between {low:g} and {high:g}")
    table = scenario.simulation
    check_memory(table.samples, BYTES_PER_VALUE * len(variables_of(scenario)))
    how = "exact" if exact else f"dormand-prince, relative tolerance {tolerance:g}"
    options = {
        **table.grid(),
        "energy": energy and exact,
        "tolerance": 0.0 if exact else tolerance,
        "max_switchings": MAX_SWITCHINGS,
    }
    laws = as_laws(law, scenario.axes())
    control = scenario.control(laws)
    if not any(oriented(scenario)):
        return whole_run(scenario, how, control, options)
    if not all(one.repeatable for one in laws.values()):
        return _warned(scenario, whole_run(scenario, how, control, options))
    again = (scenario, how, coarser(scenario.control(laws)), options | {"energy": False})
    if laws or table.duration > SIDE_BY_SIDE * control[0]:
        result = whole_run(scenario, how, control, options)
        coarse = whole_run(*again)
    else:
        with thread_pool(1) as beside:
            waiting = beside.submit(whole_run, *again)
            result = whole_run(scenario, how, control, options)
            coarse = waiting.result()
    bound = json.dumps(error_bound(scenario, result.values, coarse.values))
    return _warned(scenario, replace(result, attrs={**result.attrs, ERROR_BOUND: bound}))


def _warned(scenario: Scenario, result: RunArrays) -> RunArrays:
    """The result with a warning on the sampling of its currents."""
    text = too_slow(scenario, result.values)
    return replace(result, attrs=warned(result.attrs, text)) if text else result


def whole_run(scenario: Scenario, how: str, control: BoundController, options: Options) -> RunArrays:
    """One run of the core as arrays."""
    result = core_result(scenario, control, options)
    return raw_result(scenario, scenario.core(), result, how, ledger=options["energy"])


def check_memory(samples: int, width: float) -> None:
    """Refuse a run whose samples, `width` bytes each, do not fit into the memory that is free.

    Raises InputError: it says what they need and what there is.
    """
    check_free(
        samples * width,
        f"simulation.sample_interval: {samples:.3g} samples",
        "take a longer sample_interval, or a shorter duration",
    )
