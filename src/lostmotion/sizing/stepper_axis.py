"""The axis of a stepper, which has no loop: stiffness, resonance, settling, reversal error and lost steps."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ..control.references import MovesReference
from ..errors import InputError
from ..inputs.argument_checks import checked
from ..inputs.quantities import Number
from ..inputs.refusal_messages import chosen_motor
from ..model.shaft_ratio import turns
from ..model.torsion import Rigid
from ..simulation.runs.lost_steps import LostSteps, found_in
from ..simulation.runs.pointing_error import pointed, pointing_errors, pointing_names
from ..simulation.runs.run import run
from ..simulation.scenario.one_axis import OneAxis
from ..simulation.scenario.scenario import Scenario
from ..units.practical import practical
from ..verdict import Point, Verdict
from .duty_cycle import after_moves, rests_of

MICROSTEPS_OF_WINDOW = 4.0  # at the load, in the window by default
NO_LOOP = "a stepper is turned without a loop, so it has no margins and nothing to tune; of its motion see the open-loop report"


@dataclass(frozen=True)
class OpenLoop:
    """What can be said of the axis of a stepper without a loop. Values of a slide are in m and N."""

    motor: str
    shaft: str
    unit: str  #: rad, or m of a slide
    field_stiffness: float
    """stiffness of the field at the shaft, ``n T_H`` over the square of the ratio [N·m/rad, N/m]"""
    stiffness: float | None  #: the same in series with what is soft behind the motor; None where the train is no chain
    resonances: tuple[float, ...]  #: [Hz] of the rotor in its field and the load; empty where the train is no chain
    following: float  #: largest distance from the reference
    window: float
    settling: tuple[float, ...]
    """of each move: time from its end until the shaft stays within the window [s]; infinite where it does not"""
    reversal: float | None
    """at rest after moves forward less after moves backward, magnitude; None where moves go one way"""
    lost: LostSteps
    time: np.ndarray = field(repr=False, compare=False)  #: instants of the run [s]
    error: np.ndarray = field(repr=False, compare=False)  #: reference less shaft, over them
    electrical_angle: np.ndarray = field(repr=False, compare=False)  #: of the field before the rotor, over them [rad]

    @property
    def verdict(self) -> Verdict:
        """Whether steps are lost and moves settle."""
        points = [Point("does not fit", str(self.lost)) if self.lost.times else Point("fits", "no step is lost")]
        if self.settling and math.isinf(max(self.settling)):
            points.append(Point("does not fit", f"a move does not settle within {practical(self.window, self.unit)}"))
        return Verdict.of(points)

    def summary(self) -> list[tuple[str, str]]:
        """Rows of the report: what, and its value."""
        of_force = "N/m" if self.unit == "m" else "N*m/rad"
        rows = [
            ("verdict", str(self.verdict)),
            ("loop", "none: a stepper is turned without one"),
            ("steps", str(self.lost)),
        ]
        rows.append(("stiffness at rest", practical(self.stiffness or self.field_stiffness, of_force)))
        if self.resonances:
            rows.append(("resonances", ", ".join(f"{f:.4g} Hz" for f in self.resonances)))
        rows.append(("following error", f"peak {practical(self.following, self.unit)}"))
        if self.settling:
            worst = max(self.settling)
            said = "not" if math.isinf(worst) else f"{1e3 * worst:.4g} ms"
            rows.append(("settling", f"{said} within {practical(self.window, self.unit)}"))
        if self.reversal is not None:
            rows.append(("reversal error", practical(self.reversal, self.unit)))
        return rows


@checked
def open_loop(scenario: Scenario, *, motor: str | None = None, window: Number | None = None) -> OpenLoop:
    """Report on the axis of a stepper, which has no loop.

    Parameters
    ----------
    scenario : Scenario
        With a stepper whose driver makes steps of a reference.
    motor : str, optional
        The stepper. May be left out where there is one.
    window : float, optional
        How near the shaft must stay to where a move ends [rad, of a slide m]. Default: four microsteps.

    Returns
    -------
    OpenLoop
        Stiffness, resonances, following error, settling, reversal error and lost steps.

    Raises
    ------
    InputError
        There is no such stepper.

    Examples
    --------
    >>> import lostmotion as lm
    >>> found = lm.sizing.open_loop(lm.load("stepper-belt-axis"))
    >>> [f"{f:.1f} Hz" for f in found.resonances]
    ['65.2 Hz', '350.7 Hz']
    """
    if window is not None and not 0.0 < window < math.inf:
        raise InputError(f"window: {window:g} must be above 0")
    axes = [name for name in pointed(scenario) if scenario.train().motors[name].kind == "stepper"]
    without = "the scenario has no stepper that follows a reference; give command.stepping"
    name = chosen_motor(motor, axes, "steppers", without)
    train, (reference, shaft) = scenario.train(), pointed(scenario)[name]
    m, ratio = train.motors[name], turns(train, train.motors[name].shaft, shaft)
    assert m.steps_per_revolution is not None
    assert m.holding_torque is not None
    assert ratio is not None
    result = run(scenario, energy=False)
    error = pointing_errors(scenario, result)[dict(pointing_names(scenario))[name]]
    stepping = scenario.tables.command[name].stepping
    assert stepping is not None
    within = MICROSTEPS_OF_WINDOW * m.full_step / stepping.microsteps / abs(ratio) if window is None else window
    rests = rests_of(reference, result.time) if isinstance(reference, MovesReference) else []
    settling, reversal = after_moves(rests, result.time, error, within)
    spring = 0.25 * m.steps_per_revolution * m.holding_torque * ratio * ratio
    stiffness, resonances = _chain(scenario, spring)
    (lost,) = (found for found in found_in(scenario, result) if found.motor == name)
    return OpenLoop(
        name,
        shaft,
        train.angle_unit(shaft),
        spring,
        stiffness,
        resonances,
        float(np.abs(error).max()),
        within,
        tuple(settling),
        None if math.isnan(reversal) else reversal,
        lost,
        result.time,
        error,
        result[train.variable(name, "electrical_angle")],
    )


def _chain(scenario: Scenario, field: float) -> tuple[float | None, tuple[float, ...]]:
    """Stiffness at the load [N·m/rad, N/m] and resonances [Hz] of rotor and load on the springs of field and gears.

    field: stiffness of the field at the load.
    """
    axis = OneAxis.of(scenario)
    if isinstance(axis, str):
        return None, ()
    whole, rotor = axis.whole, scenario.train().motors[axis.motor].rotor_inertia
    inertia = (rotor + whole.inertia) * whole.ratio**2
    if isinstance(whole.stiffness, Rigid) or not axis.load > 0.0:
        return field, (math.sqrt(field / (inertia + axis.load)) / (2.0 * math.pi),)
    gear = whole.stiffness.pieces()[1][-1]
    matrix = np.array([[(field + gear) / inertia, -gear / inertia], [-gear / axis.load, gear / axis.load]])
    squares = sorted(np.linalg.eigvals(matrix).real.tolist())
    return 1.0 / (1.0 / field + 1.0 / gear), tuple(math.sqrt(s) / (2.0 * math.pi) for s in squares)
