"""Data of an axis for the tuning rules: inertias, stiffness and lags."""

import math

import numpy as np

from ..control.controller import Controller
from ..control.filters import discrete
from ..control.gain_rules import TwoInertias
from ..control.loops import Difference, FirstOrderCurrent, Observer, SampledCurrent
from ..errors import InputError
from ..model.gear import Gear
from ..model.gearbox import Gearbox
from ..model.losses import LossMap
from ..model.shaft_ratio import turns
from ..model.torsion import Rigid
from .linear_regimes import Axis, speed_of


def inertias(axis: Axis, beyond: str | None = None) -> tuple[float, float]:
    """Inertia [kg·m²] at the motor: on its side of a gear, and beyond it. Without a gear all is on its side."""
    train = axis.train
    open_train = (
        train.model_copy(update={"gears": {n: g for n, g in train.gears.items() if n != beyond}}) if beyond else train
    )
    near = far = 0.0
    turning = [name for name in train.shafts if turns(train, axis.motor_shaft, name) is not None]
    train.refuse_coupled(turning, "rules for gains take the inertia of one axis alone; give the gains by hand")
    for name in train.shafts:
        i = turns(train, axis.motor_shaft, name)
        if i is None:
            continue
        J = train.inertia_of(name) + sum(g.inertia for g in train.gears.values() if g.input == name)
        J = (J + sum(m.rotor_inertia for m in train.motors.values() if m.shaft == name)) / i**2
        if turns(open_train, axis.motor_shaft, name) is None:
            far += J
        else:
            near += J
    return near, far


def frictions(axis: Axis) -> tuple[float, float]:
    """Viscous friction [N·m·s/rad] and dry friction [N·m] of all that turns with the motor, at the motor.

    The losses of gears without load are included.
    """
    train, viscous, dry = axis.train, 0.0, 0.0
    for name, shaft in train.shafts.items():
        i = turns(train, axis.motor_shaft, name)
        if i is None:
            continue
        of_motors = sum(m.friction_torque for m in train.motors.values() if m.shaft == name)
        own = [
            _without_load(g, 2.0 * speed_of(axis) * abs(axis.ratio / i))
            for g in train.gears.values()
            if g.input == name
        ]
        viscous += (shaft.viscous_friction + sum(slope for slope, _ in own)) / i**2
        dry += (shaft.friction_torque + of_motors + sum(torque for _, torque in own)) / abs(i)
    return viscous, dry


def _without_load(gear: Gear | Gearbox, speed: float) -> tuple[float, float]:
    """Viscous [N·m·s/rad] and dry friction [N·m] at the input of a gear without load.

    They are the straight line that is nearest to its losses up to a speed [rad/s], and does not fall.
    """
    losses, rated = gear.losses, gear.rated_input_speed or 1.0
    if not isinstance(losses, LossMap):
        return gear.viscous_friction, 0.0
    table, w = losses.core(), np.linspace(0.0, speed or rated, 101)
    torque = np.array([table(0.0, x / rated) for x in w]) * (gear.rated_output_torque or 1.0) / abs(gear.ratio)
    slope, dry = np.polyfit(w, torque, 1)
    if slope < 0.0:  # losses that fall with the speed, or rounding where they are constant
        slope, dry = 0.0, torque.mean()
    return gear.viscous_friction + float(slope), float(max(dry, 0.0))


def secant(gear: Gear | Gearbox) -> float:
    """Stiffness of a gear up to its rated torque, without its gap [N·m/rad]; without a rated torque, the stiffness of its last segment.

    If the directions differ, the softer one counts.
    """
    if isinstance(gear.stiffness, Rigid):
        return math.inf
    curve, T = gear.stiffness.core(), gear.rated_output_torque
    sides = [curve.side(forward) for forward in (True, False)]
    if T is None:
        return min(slopes[-1] for _, slopes in sides)
    gap = sides[0][0][0] if gear.stiffness.has_gap else 0.0
    return T / (max(curve.twist(T), -curve.twist(-T)) - gap)


def two_inertias(axis: Axis) -> TwoInertias:
    """Motor, load, and the main gear between them, with its secant stiffness up to rated torque.

    Raises InputError: all gears are rigid.
    """
    main = axis.main_gear()
    if main is None:
        raise InputError(
            "rule: all gears are rigid, and this rule is for two inertias with a spring; take symmetrical_optimum"
        )
    near, far = inertias(axis, main)
    gear = axis.train.gears[main]
    i = turns(axis.train, axis.motor_shaft, gear.output) or 1.0
    return TwoInertias(near, far, secant(gear) / i**2)


def lag_sum(controller: Controller) -> float:
    """Sum of all lags in the speed loop [s], each as its delay at low frequency.

    Delay and hold of the output (1.5 sample times with the usual delay of one), current loop, estimate of the speed, encoder, and
    filters of the torque. Lag of the current loop g/(z (z - 1)) when closed: T/g, its delay included.
    """
    c, speed = controller, controller.speed
    if speed is None:
        raise InputError("the controller has no speed loop, whose lags are asked for; add one")
    T = c.loop_time("speed")
    by_output = c.delay * c.sample_time
    lag = c.loop_time("current") / c.current.gain if isinstance(c.current, SampledCurrent) else by_output
    if isinstance(c.current, FirstOrderCurrent):
        lag += c.current.time_constant
    lag += 0.5 * T + (0.0 if c.encoder is None else c.encoder.delay * c.sample_time)
    e = speed.estimate
    if isinstance(e, Difference):
        lag += 0.5 * e.span * T + (T / math.expm1(T / e.time_constant) if e.time_constant > 0.0 else 0.0)
    elif isinstance(e, Observer) and e.inertia is None:
        lag += e.damping / (math.pi * e.bandwidth)
    for f in speed.torque_filters:
        numerator, denominator = map(np.array, discrete(f, T)[:2])
        slopes = [float(np.polyval(np.polyder(p), 1.0) / p.sum()) for p in (denominator, numerator)]
        lag += T * (slopes[0] - slopes[1])  # of the phase at z = 1
    return lag
