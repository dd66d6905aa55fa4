"""The check of a motor: speed, heat, voltage, current."""

import math

import numpy as np

from ..control.axis import driven
from ..control.continuous import ContinuousController
from ..control.controller import Controller
from ..control.loops import FirstOrderCurrent
from ..model.motor import Motor, MotorLimits
from ..units.practical import ROUNDING, RPM, told_apart
from .catalogue_formulas import WARM
from .duty_cycle import DutyCycle
from .finding import Finding, Judgement, not_judged, within
from .winding_temperature import TwoBodies, mean_square, steady_rise

WHOLE = ", that heats as the whole current"


def limits_of(m: Motor) -> MotorLimits:
    """Limits of a motor; none of them where its table has no limits."""
    return m.limits or MotorLimits()


def motor_rules(
    m: Motor,
    cycle: DutyCycle,
    ambient: float,
    command: np.ndarray,
    torque: np.ndarray,
    speed: np.ndarray,
    where: str = "motor",
    *,
    slides: bool = False,
    rise: float | None = None,
    whole: bool = False,
    oriented: tuple[np.ndarray, np.ndarray] | None = None,
) -> list[Finding]:
    """All rules of a motor but those of steppers: speed, peak torque, heat, voltage and current of a motion.

    command, torque, speed: E_C [-], torque [N·m] and speed [rad/s] of the motor, of a slide force [N] and speed [m/s].
    where: table of the motor.
    oriented: current and voltage of a phase under field-oriented control [A, V], amplitudes.
    ambient, slides, rise, whole: as in `heat`.
    """
    current_of_phase, voltage_of_phase = oriented or (None, None)
    return [
        largest_speed(m, float(np.abs(speed).max()), where, slides=slides),
        *_peak_torque(m, torque, where, slides=slides),
        *heat(m, cycle, ambient, where, rise=rise, slides=slides, whole=whole),
        voltage(m, command, torque, speed, where, oriented=voltage_of_phase),
        current(m, torque, where, oriented=current_of_phase),
    ]


def largest_speed(m: Motor, speed: float, where: str = "motor", *, slides: bool = False) -> Finding:
    """speed: the largest of the run [rad/s], of a motor that moves a slide [m/s]. where: the table of the motor."""
    limit, name, key = limits_of(m).max_speed, "largest speed of the motor", f"{where}.limits.max_speed"
    if slides:
        return within("max_motor_speed", "speed, largest", speed, limit, "m/s", name, key=key)
    what = "input speed, largest, for the motor"
    return within("max_motor_speed", what, RPM * speed, None if limit is None else RPM * limit, "rpm", name, key=key)


def _peak_torque(m: Motor, torque: np.ndarray, where: str, *, slides: bool) -> list[Finding]:
    """The largest of the run [N·m], of a motor that moves a slide [N]; nothing where no limit is known, as the limit of the current then judges."""
    limit = limits_of(m).peak_torque
    word, unit = ("force", "N") if slides else ("torque", "N·m")
    what, name, key = f"motor {word}, largest", f"peak {word} of the motor", f"{where}.limits.peak_torque"
    found = within("motor_peak_torque", what, float(np.abs(torque).max()), limit, unit, name, key=key)
    return [] if limit is None else [found]


def heat(
    m: Motor,
    cycle: DutyCycle,
    ambient: float,
    where: str = "motor",
    *,
    rise: float | None = None,
    slides: bool = False,
    whole: bool = False,
) -> list[Finding]:
    """Torque over the cycle, and the temperature of the winding at this ambient temperature [°C]. `rise` [K] is the
    rise over it, if it is known already. `slides`: the motor moves a slide, by a force. `whole`: the torque of the cycle heats as
    the whole current does, under field-oriented control."""
    limits = limits_of(m)
    word, unit = ("force", "N") if slides else ("torque", "N·m")
    torque = cycle.rms_motor_torque
    continuous = limits.continuous_torque
    if continuous is None and m.kind != "torque_source":  # other limits do not say that there is none
        continuous = m.rated_torque
    name = f"continuous {word} of the motor"
    key = f"{where}.limits.continuous_torque"
    what = f"motor {word}, rms{WHOLE if whole else ''}"
    findings = [within("motor_torque", what, torque, continuous, unit, name, key=key, cycle=cycle)]
    what = "winding temperature"
    permissible = limits.max_winding_temperature
    if rise is None and permissible is not None:
        rise = _rise(m, cycle, torque, ambient)
    if permissible is None or rise is None or m.copper_loss() is None:
        if ambient <= WARM:
            return findings
        lacks = f"{where}.limits.max_winding_temperature is" if permissible is None else "its resistances are"
        remark = f"{lacks} missing, and ratings hold up to {WARM:.0f} °C, not at {ambient:.3g} °C"
        return [*findings, not_judged("winding_temperature", remark)]
    if math.isinf(rise):
        remark = "the current is far too large to last"
        return [
            *findings,
            Finding("winding_temperature", what, f"thermal runaway, {cycle}", "warning", remark, math.inf),
        ]
    use = rise / (permissible - ambient) if permissible > ambient else math.inf
    verdict: Judgement = "ok" if use <= 1.0 + ROUNDING else "warning"
    hottest, limit = told_apart(ambient + rise, permissible, verdict == "warning", digits=3)
    value = f"{hottest} of {limit} °C in the long run at {ambient:.3g} °C ambient, {cycle}"
    reserve = permissible - ambient - rise
    remark = f"reserve {reserve:.3g} K" if verdict == "ok" else f"{-reserve:.3g} K too hot"
    return [*findings, Finding("winding_temperature", what, value, verdict, remark, use)]


def _rise(m: Motor, cycle: DutyCycle, torque: float, ambient: float) -> float | None:
    """Rise of the winding over the ambient [K]. It is the peak in the repeated cycle, or with fewer data the rise by
    the rms torque [N·m]. None if it is not known."""
    steady, bodies = rms_rise(m, torque, ambient), TwoBodies.of(m, ambient)
    if steady is None or bodies is None or cycle.held_longer:
        return steady
    time, torques = cycle.repeated_torque()
    course = bodies.repeated(time, mean_square(torques))
    return math.inf if course is None else float(course[0].max()) - ambient


def rms_rise(m: Motor, torque: float, ambient: float) -> float | None:
    """Rise of the winding over the ambient [K] in the long run under an rms torque [N·m]; None if unknown."""
    copper, resistance = m.copper_loss(), limits_of(m).winding_to_ambient
    if copper is None or resistance is None:
        return None
    loss, reference = copper
    return steady_rise(loss * torque**2, resistance, ambient, reference)


def needed_command(motor: Motor, torque: np.ndarray, speed: np.ndarray, rate: np.ndarray | float = 0.0) -> np.ndarray:
    """E_C of (2) under which a motor gives a torque [N·m] that changes at `rate` [N·m/s] at a speed [rad/s]; of a torque source its
    relative torque."""
    motor = motor.as_dc()
    share = torque / motor.rated_torque
    if motor.armature_voltage_constant is None or motor.rated_speed is None:
        return share
    assert motor.electrical_time_constant is not None
    k_N = motor.armature_voltage_constant
    rising = motor.electrical_time_constant * rate / motor.rated_torque
    return np.asarray((share + rising + (k_N - 1.0) * speed / motor.rated_speed) / k_N)


def command_of_run(
    m: Motor,
    controller: Controller | ContinuousController | None,
    command: np.ndarray,
    torque: np.ndarray,
    speed: np.ndarray,
) -> np.ndarray:
    """E_C over a run [-]: its command. If the command comes from a current loop whose voltage the run does not
    contain, E_C is computed from torque [N·m] and speed [rad/s]. The inductance counts under a current loop of first
    order only."""
    law = None if controller is None else driven(controller)
    if law is None:  # u_q ends at the amplifier
        return np.clip(command, -1.0, 1.0) if m.kind == "synchronous" else command
    loop = None if controller is None else controller.current
    if isinstance(loop, FirstOrderCurrent):
        return needed_command(m, torque, speed, (m.rated_torque * command - torque) / loop.time_constant)
    return needed_command(m, torque, speed)


def current_voltage_power(
    m: Motor, command: np.ndarray, torque: np.ndarray, speed: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Current [A], voltage [V] and electrical power [W] of a motor at command, torque [N·m] and speed [rad/s]; NaN where its data
    do not tell. Current and voltage of a motor with a winding are amplitudes of a phase."""
    unknown = np.full_like(torque, np.nan)
    if m.winding is not None:
        phase = m.winding.phase_values()
        i = torque / phase.torque_constant
        if m.kind == "synchronous":
            u_q = m.phase_voltage * command
        else:  # a torque source gives what it takes, but for the voltage of L_q di_q/dt
            u_q = phase.resistance * i + phase.voltage_constant * speed
        return i, np.asarray(phase.voltage(u_q, torque, speed)), 1.5 * u_q * i
    k, R = limits_of(m).torque_constant, limits_of(m).resistance
    current = unknown if k is None else torque / k
    if m.kind == "dc" and m.rated_voltage is not None:
        voltage = m.rated_voltage * command
    else:
        voltage = unknown if k is None or R is None else R * current + k * speed
    return current, voltage, voltage * current


def voltage(
    m: Motor,
    command: np.ndarray,
    torque: np.ndarray,
    speed: np.ndarray,
    where: str = "motor",
    *,
    oriented: np.ndarray | None = None,
) -> Finding:
    """The largest that the command asks for, or that torque [N·m] and speed [rad/s] need; under field-oriented control the one
    that a phase had [V]."""
    peak = float(abs(current_voltage_power(m, command, torque, speed)[1] if oriented is None else oriented).max())
    if m.winding is not None:
        limit = None if m.dc_voltage is None else m.phase_voltage
        what = "voltage of a phase, largest amplitude"
        return within("voltage", what, peak, limit, "V peak", "dc voltage / √3", key=f"{where}.dc_voltage")
    if m.kind == "dc" and m.rated_voltage is None:
        return Finding("voltage", "voltage, largest", "not known", "unknown", f"{where}.rated_voltage is missing")
    if math.isnan(peak):
        missing = f"{where}.limits.resistance and {where}.limits.torque_constant are missing"
        return Finding("voltage", "voltage, largest", "not known", "unknown", missing)
    limit = (m.voltage_limit if m.kind == "dc" else None) or limits_of(m).max_voltage
    key = f"{where}.voltage_limit" if m.kind == "dc" else f"{where}.limits.max_voltage"
    of = "" if m.kind == "dc" else f", of a DC motor with {where}.limits.torque_constant"
    return within("voltage", f"voltage, largest{of}", peak, limit, "V", "limit of the amplifier", key=key)


def amperes_of(m: Motor, where: str) -> str:
    """Addition to a current whose amperes only a torque constant tells: rms, peak or dc amperes."""
    return f", in the amperes of {where}.limits.torque_constant" if m.kind != "dc" and m.winding is None else ""


def current(m: Motor, torque: np.ndarray, where: str = "motor", *, oriented: np.ndarray | None = None) -> Finding:
    """The largest of the run, for its torque [N·m]; under field-oriented control the one that a phase had [A], amplitude."""
    limits = limits_of(m)
    if m.winding is not None:
        amplitude = torque / m.winding.phase_values().torque_constant if oriented is None else oriented
        rms = float(abs(amplitude).max()) / math.sqrt(2.0)
        name, key = "limit of motor and amplifier", f"{where}.winding.max_current_rms"
        what = "current of a phase, largest, as effective value"
        return within("current", what, rms, m.winding.max_current, "A rms", name, key=key)
    if limits.torque_constant is None:
        missing = f"{where}.limits.torque_constant is missing"
        return Finding("current", "current, largest", "not known", "unknown", missing)
    peak = float(abs(torque).max()) / limits.torque_constant
    name, key = "limit of motor and amplifier", f"{where}.limits.max_current"
    return within("current", f"current, largest{amperes_of(m, where)}", peak, limits.max_current, "A", name, key=key)
