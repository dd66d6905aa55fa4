"""Nominal life of gearboxes and screws: the formulas of standards and catalogues, and the life of a part in its cycle."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..model.screw import RatedScrew
from .duty_cycle import integral
from .required_motion import InputDemand, RequiredMotion

HOUR = 3600.0  # [s]
MILLION = 1e6  # revolutions, to which dynamic capacities belong


def mean_load(loads: Sequence[float], speeds: Sequence[float], times: Sequence[float], exponent: float = 3.0) -> float:
    """Equivalent load of a spectrum: (sum F^p n t / sum n t)^(1/p).

    Source: ISO 3408-5 and Rexroth R310RU3301 for screws (p = 3); Harmonic Drive, CSF & CSG catalogue, for gears (p = 3).

    Examples
    --------
    >>> round(mean_load([50e3, 25e3, 8e3, 2e3], [10, 30, 100, 1000], [6, 22, 47, 25]), -1)  # Rexroth prints 8757 N
    8760.0
    """
    turned = [n * t for n, t in zip(speeds, times, strict=True)]
    work = sum(w * abs(F) ** exponent for F, w in zip(loads, turned, strict=True))
    return (work / sum(turned)) ** (1.0 / exponent) if work > 0.0 else 0.0


def nominal_life(capacity: float, load: float, exponent: float = 3.0, load_factor: float = 1.0) -> float:
    """L10 in revolutions of a rolling contact: 1e6 (C/(f_w F))^p.

    Source: ISO 281 and ISO 3408-5; p = 3 for balls, 10/3 for rollers. THK's load factor f_w: 1.2 to 1.5 for normal motion.

    Examples
    --------
    >>> f"{nominal_life(5400, 225, load_factor=1.5):.3g}"
    '4.1e+09'
    """
    if load <= 0.0:
        return math.inf
    return float(MILLION * (capacity / (load_factor * load)) ** exponent)


def gear_life(
    rated_life: float, rated_speed: float, rated_torque: float, speed: float, torque: float, exponent: float = 3.0
) -> float:
    """L10h of a gear from its rated point: L (n_r/n_m) (T_r/T_m)^p.

    Source: Harmonic Drive, CSF & CSG catalogue, life of the wave generator (p = 3); ISO 281 for bearings of rollers
    (p = 10/3), as manufacturers of planetary and cycloidal gears use it.

    Examples
    --------
    >>> gear_life(7000.0, 2000.0, 100.0, 1000.0, 50.0)
    112000.0
    """
    if speed <= 0.0 or torque <= 0.0:
        return math.inf
    return float(rated_life * rated_speed / speed * (rated_torque / torque) ** exponent)


def life_of_gearbox(demand: InputDemand) -> float | None:
    """L10h of a gearbox in its cycle [s], for the mean torque of exponent p over its turns; None without its rated life."""
    g, m = demand.gearbox, demand.motion
    if g.limits is None or g.limits.rated_life is None:
        return None
    p = g.limits.life_exponent
    steps, speed = np.diff(m.time), np.abs(demand.speed)
    mean_speed = integral(m.time, speed) / m.cycle
    turned = 0.5 * (speed[1:] * steps + speed[:-1] * steps)
    torque = np.abs(m.torque) ** p
    work = float(np.sum(0.5 * (torque[1:] + torque[:-1]) * turned))
    mean_torque = (work / float(turned.sum())) ** (1.0 / p) if work > 0.0 else 0.0
    return gear_life(g.limits.rated_life, g.rated_input_speed, g.rated_output_torque, mean_speed, mean_torque, p)


@dataclass(frozen=True)
class AxialLoad:
    """Loads of a screw over one cycle."""

    time: np.ndarray  # [s]
    speed: np.ndarray  # speed of the slide [m/s]
    force: np.ndarray  # [N]
    cycle: float  # [s]


def axial_load(motion: RequiredMotion) -> AxialLoad:
    """The load of the screw behind a motion."""
    return AxialLoad(motion.time, motion.speed, motion.torque, motion.cycle)


def screw_mean_load(load: AxialLoad) -> float:
    """Cubic mean of the axial load [N] of the direction with the larger mean, over the whole travel.

    The balls carry one flank at a time, so each direction has its own mean. Source: THK general catalogue, A-734; ISO 3408-5.
    """
    steps = np.diff(load.time)
    speed = 0.5 * (np.abs(load.speed[1:]) + np.abs(load.speed[:-1]))
    force = 0.5 * (load.force[1:] + load.force[:-1])
    if not speed.any():
        return 0.0
    both = (np.maximum(sign * force, 0.0).tolist() for sign in (1.0, -1.0))
    return max(mean_load(forces, speed.tolist(), steps.tolist()) for forces in both)


def screw_life(load: AxialLoad, screw: RatedScrew) -> float | None:
    """L10h of a screw in its cycle [s], for the cubic mean load over its turns; None without its dynamic capacity."""
    if screw.dynamic_capacity is None:
        return None
    revolutions = nominal_life(screw.dynamic_capacity, screw_mean_load(load), 3.0, screw.load_factor)
    turns = integral(load.time, np.abs(load.speed)) / screw.travel()
    return math.inf if turns == 0.0 else revolutions / turns * load.cycle
