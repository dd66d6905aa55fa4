"""Steps that steppers lose in a run: when, and how many."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ...inputs.argument_checks import checked
from ...reproducible import sin
from ..scenario.scenario import Scenario
from ..variables_of_trains import angle_of_run
from .results import RunArrays, scenario_of
from .run import run

if TYPE_CHECKING:
    import xarray

HALVINGS = 50
POINTS = 33
"""between two samples, at which a slip is looked for"""
CLOSE = 0.3
"""angle of the fastest oscillation in its field between two samples [rad], of which a cubic misses the share 2e-5, its fourth power over 384"""
MOST_SAMPLES = 2_000_000
"""of a run that is repeated for its slips"""
PERIOD = 4
"""full steps to a period of the field"""


@dataclass(frozen=True)
class LostSteps:
    """Steps of one motor that a run has lost, or has run ahead by.

    Examples
    --------
    >>> import lostmotion as lm
    >>> lm.simulation.lost_steps(lm.simulate(lm.load("stepper-belt-axis")))[0].lost
    0
    """

    motor: str
    """name of the motor"""
    times: tuple[float, ...]
    """instants at which the rotor slips from one period of the field to the next [s]"""
    slips: tuple[int, ...]
    """way of each slip: -1 where the rotor falls behind in the direction of its angle, 1 where it runs ahead"""
    largest_lag: float
    """largest angle between rotor and field before the first slip, in full steps; from 2 on the rotor slips"""

    @property
    def lost(self) -> int:
        """Full steps by which the rotor is off at the end, without sign."""
        return PERIOD * abs(sum(self.slips))

    def __str__(self) -> str:
        if not self.times:
            return f"steps of {self.motor}: none lost; largest lag {self.largest_lag:.3g} of 2 full steps"
        slips = f"{len(self.times)} slips of {PERIOD} full steps, the first at {self.times[0]:.6g} s"
        return f"steps of {self.motor}: {self.lost} full steps lost at the end; {slips}"


@checked
def lost_steps(result: xarray.Dataset) -> tuple[LostSteps, ...]:
    """Return the steps that each stepper of a run has lost.

    A rotor slips where it falls more than two full steps behind its field, half a period. The next rest is four steps away.

    Parameters
    ----------
    result : xarray.Dataset
        Result of a run. If its samples are too far apart to follow the rotor in its field, the run is repeated with closer ones.

    Returns
    -------
    tuple of LostSteps
        One for each stepper, in the order of the motors.

    Raises
    ------
    InputError
        The dataset carries no scenario.

    Examples
    --------
    >>> import lostmotion as lm
    >>> scenario = lm.load("stepper-belt-axis")
    >>> print(lm.simulation.lost_steps(lm.simulate(scenario))[0])
    steps of motor: none lost; largest lag 0.211 of 2 full steps
    """
    return found_in(scenario_of(result), result)


def found_in(
    scenario: Scenario, result: xarray.Dataset | RunArrays, *, as_sampled: bool = False
) -> tuple[LostSteps, ...]:
    """The same of a run of a known scenario, by names in its result.

    as_sampled: not from another run with closer samples.
    """
    train = scenario.train()
    found = []
    if not as_sampled:
        result = _close(scenario, result)
    for name, motor in train.motors.items():
        if motor.kind != "stepper":
            continue
        time, speed = (np.asarray(result[key]) for key in ("time", train.variable(motor.shaft, "speed")))
        field = scenario.signals()[train.variable(name, "command")]
        lines = np.array(field.breakpoint_list())
        course = _Course(
            time, angle_of_run(train, motor.shaft, result), speed, lines, field.sine_list(), motor.full_step
        )
        found.append(course.lost(name))
    return tuple(found)


def _close(scenario: Scenario, result: xarray.Dataset | RunArrays) -> xarray.Dataset | RunArrays:
    """The run with samples so close that cubics between them follow each rotor in its field; a part of a run remains as it is."""
    train, time = scenario.train(), np.asarray(result["time"])
    fastest = 0.0  # [rad/s], by the largest stiffness of field and detents, n (T_H + 4 T_D)
    for m in (m for m in train.motors.values() if m.kind == "stepper"):
        torque = (m.holding_torque or 0.0) + 4.0 * (m.detent_torque or 0.0)
        fastest = max(fastest, math.sqrt(0.5 * math.pi / m.full_step * torque / m.rotor_inertia))
    whole = time.size > 1 and time[0] == 0.0 and math.isclose(time[-1], scenario.simulation.duration)
    parts = math.ceil((time[1] - time[0]) * fastest / CLOSE) if whole else 1
    if parts < 2 or parts * time.size > MOST_SAMPLES or scenario.axes():
        return result
    _, adaptive, tolerance = str(result.attrs["solver"]).partition("relative tolerance ")
    how: dict[str, Any] = {"solver": "dormand-prince", "relative_tolerance": float(tolerance)} if adaptive else {}
    return run(scenario.with_inputs(sample_interval=float(time[1]) / parts), energy=False, **how)


@dataclass(frozen=True)
class _Course:
    """Angles of a rotor and of its field."""

    time: np.ndarray
    angle: np.ndarray
    speed: np.ndarray
    lines: np.ndarray
    """breakpoints of the field: time, value, slope"""
    sines: list[tuple[float, float, float]]
    step: float

    def lag(self, t: Any) -> np.ndarray:
        """Rotor less field at instants, in full steps; the rotor by cubics through its samples."""
        t = np.asarray(t, float)
        k = np.clip(np.searchsorted(self.time, t, side="right") - 1, 0, self.time.size - 2)
        h = self.time[k + 1] - self.time[k]
        s = (t - self.time[k]) / h
        rotor = self.angle[k] + s * s * (3.0 - 2.0 * s) * (self.angle[k + 1] - self.angle[k])
        rotor += h * s * (1.0 - s) * ((1.0 - s) * self.speed[k] - s * self.speed[k + 1])
        begin, value, slope = self.lines.T
        j = np.searchsorted(begin, t, side="right") - 1
        field = value[j] + slope[j] * (t - begin[j])
        for amplitude, frequency, phase in self.sines:
            field = field + amplitude * sin(2.0 * math.pi * frequency * t + phase)
        return np.asarray((rotor - field) / self.step)

    def lost(self, name: str) -> LostSteps:
        begin = self.lines[:, 0]
        inner = np.linspace(self.time[:-1], self.time[1:], POINTS, endpoint=False).ravel(order="F")
        begin = begin[(begin > self.time[0]) & (begin <= self.time[-1])]
        at = np.unique(np.concatenate([inner, self.time[-1:], np.nextafter(begin, -math.inf), begin]))
        lag = self.lag(at)
        period = np.floor(lag / PERIOD + 0.5).astype(int)
        changes = np.nonzero(np.diff(period))[0]
        first = int(changes[0]) + 1 if changes.size else lag.size
        times, slips = [], []
        for k in changes:
            low, high = float(at[k]), float(at[k + 1])
            for _ in range(HALVINGS):
                middle = 0.5 * (low + high)
                same = math.floor(float(self.lag(middle)) / PERIOD + 0.5) == period[k]
                low, high = (middle, high) if same else (low, middle)
            way = int(np.sign(period[k + 1] - period[k]))
            times += [high] * abs(int(period[k + 1] - period[k]))
            slips += [way] * abs(int(period[k + 1] - period[k]))
        largest = float(np.abs(lag[:first] - PERIOD * period[0]).max())
        return LostSteps(name, tuple(times), tuple(slips), largest)
