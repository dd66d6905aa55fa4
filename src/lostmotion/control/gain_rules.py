"""Rules for the gains of a servo cascade, as formulas: numbers in, numbers out, all at the motor."""

import math
from dataclasses import dataclass

from ..errors import InputError

CRITICAL = 4.0
"""times the gain of the position loop that the speed loop's bandwidth must be, so that with a lag of first order it just does not
overshoot"""
ALIKE = 0.7  # damping of both pole pairs, by the rule that suits a drive
HELD = 1.5  # sample times of the position loop: one until a result acts, and half of one since it is held


@dataclass(frozen=True)
class SpeedGains:
    """Gains of a PI speed loop in terms of the motor."""

    gain: float  # K_p [N·m·s/rad]
    integral_gain: float  # K_i [N·m/rad]
    filter_time: float = 0.0  # time constant of a first-order filter of the reference [s]; 0: none


@dataclass(frozen=True)
class TwoInertias:
    """Motor and load with the spring between them."""

    motor_inertia: float  # J_M, all on the motor's side of the spring, at the motor [kg·m²]
    load_inertia: float  # J_L, all beyond the spring, at the motor [kg·m²]
    stiffness: float  # k at the motor [N·m/rad]

    @property
    def inertia_ratio(self) -> float:
        """R = J_L/J_M"""
        return self.load_inertia / self.motor_inertia

    @property
    def antiresonance(self) -> float:
        """w_a = sqrt(k/J_L) [rad/s]"""
        return math.sqrt(self.stiffness / self.load_inertia)


def symmetrical_optimum(inertia: float, lag: float, a: float = 2.0) -> SpeedGains:
    """K_p = J/(a T), T_i = a^2 T, with a filter of the reference of a^2 T.

    inertia: J of all that turns, at the motor [kg·m²].
    lag: T, sum of the lags in the loop [s].
    a: crossover 1/(a T); 2 is the usual choice, more is better damped.

    Raises InputError: a is not above 1.
    """
    if not a > 1.0:
        raise InputError(f"a: {a:g} must be above 1; 2 is usual")
    gain, time = inertia / (a * lag), a * a * lag
    return SpeedGains(gain, gain / time, time)


def identical_damping(drive: TwoInertias, damping: float) -> SpeedGains:
    """Both pairs of poles with the same damping: K_i = J_M w_a^2, K_p = 2 zeta J_M w_a sqrt(R + 4 - 4 zeta^2).

    Raises InputError: r < 4 zeta^2, where no gains give it.
    """
    R, J, w = drive.inertia_ratio, drive.motor_inertia, drive.antiresonance
    if 4.0 * damping * damping > R:
        raise InputError(
            f"identical damping of {damping:g} needs an inertia ratio of load to motor of at least {4.0 * damping * damping:.4g}, "
            f"and it is {R:.4g}; take damping = {0.5 * math.sqrt(R):.4g} or less"
        )
    return SpeedGains(2.0 * damping * J * w * math.sqrt(R + 4.0 - 4.0 * damping * damping), J * w * w)


def identical_radius(drive: TwoInertias) -> SpeedGains:
    """Gains that place all poles at the distance w_a from 0: K_i = J_M w_a^2, K_p = 2 sqrt(R) J_M w_a; their damping is sqrt(R)/2.

    Raises InputError: r > 4, where the poles are real and part.
    """
    R, J, w = drive.inertia_ratio, drive.motor_inertia, drive.antiresonance
    if R > 4.0:
        raise InputError(
            f"identical radius needs an inertia ratio of load to motor of at most 4, and it is {R:.4g}; take the rule "
            "identical_damping"
        )
    return SpeedGains(2.0 * math.sqrt(R) * J * w, J * w * w)


def identical_real_part(drive: TwoInertias, damping: float) -> SpeedGains:
    """Gains that give all poles the same real part -s, the less damped pair with the damping zeta: K_p = 4 s J_M.

    With ``w_1^2 + w_2^2 = 2 w_a^2``, written as ``(1 -+ d) w_a^2``: ``K_i = J_M w_a^2 (1 - d^2)``, ``4 s^2 = (R -
    d^2) w_a^2``, and ``s = zeta w_2`` gives ``d = -2 zeta^2 + sqrt(4 zeta^4 - 4 zeta^2 + R)``. The other pair is
    complex while s < w_1, so that d lies from 0 to (1 - zeta^2)/(1 + zeta^2).

    Raises InputError: r is outside the range that this gives, where no gains do it.
    """
    R, J, w, z2 = drive.inertia_ratio, drive.motor_inertia, drive.antiresonance, damping * damping
    widest = (1.0 - z2) / (1.0 + z2)
    low, high = 4.0 * z2, widest * widest + 8.0 * z2 / (1.0 + z2)
    if not low <= R <= high:
        raise InputError(
            f"identical real part with a damping of {damping:g} needs an inertia ratio of load to motor from {low:.4g} to "
            f"{high:.4g}, and it is {R:.4g}; take another damping, or the rule identical_damping"
        )
    d = -2.0 * z2 + math.sqrt(4.0 * z2 * z2 - 4.0 * z2 + R)
    return SpeedGains(2.0 * math.sqrt(R - d * d) * J * w, J * w * w * (1.0 - d * d))


def position_gain(bandwidth: float) -> float:
    """K_v [1/s] for a speed loop of that bandwidth [Hz]: a quarter of its angular frequency."""
    return 2.0 * math.pi * bandwidth / CRITICAL


@dataclass(frozen=True)
class CascadeGains:
    """Gains of speed and position loop, and the rule that gave them."""

    rule: str
    speed: SpeedGains
    position: float  # K_v [1/s]


def suited(drive: TwoInertias, lag: float, position_time: float) -> CascadeGains:
    """The rule that suits a drive.

    If load and motor allow the same damping of both pole pairs, the rule gives both a damping ratio of 0.7. Otherwise
    it takes the symmetrical optimum with a = 2, without a filter of the reference. It does so too if the drive is
    almost rigid, so that equal damping takes more gain than the sampling allows. The position loop gets half of the
    reciprocal of the speed loop's equivalent time.

    drive: of infinite stiffness where it is rigid.
    lag: sum of the lags in the speed loop [s].
    position_time: sample time of the position loop [s].
    """
    optimum = symmetrical_optimum(drive.motor_inertia + drive.load_inertia, lag)
    if math.isfinite(drive.stiffness) and drive.inertia_ratio >= 4.0 * ALIKE * ALIKE:
        alike = identical_damping(drive, ALIKE)
        if alike.gain <= optimum.gain:
            # w_1 w_2 = w_a^2, w_1 + w_2 = K_p/(2 zeta J_M)
            w_a, both = drive.antiresonance, alike.gain / (2.0 * ALIKE * drive.motor_inertia)
            slow = 2.0 * w_a * w_a / (both + math.sqrt(both * both - 4.0 * w_a * w_a))
            wait = 2.0 * ALIKE / slow + HELD * position_time
            return CascadeGains("identical damping", alike, 0.5 / wait)
    wait = optimum.filter_time + HELD * position_time
    unfiltered = SpeedGains(optimum.gain, optimum.integral_gain)
    return CascadeGains("symmetrical optimum", unfiltered, 0.5 / wait)
