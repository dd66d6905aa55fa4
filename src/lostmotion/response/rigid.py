"""Constants of a drive with a rigid gearbox: gain and lag."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..inputs.argument_checks import checked
from ..inputs.quantities import Time
from ..model.drive import Drive
from ..model.gear import Gear
from ..model.losses import ConstantEfficiency, TwoEfficiencies
from ..model.motor import ShaftMotor
from ..model.train import DriveTrain, TrainElements
from ..simulation.scenario.requirements import need_free_motion
from ..simulation.scenario.scenario import Scenario

OTHERS = tuple(table for table in TrainElements.model_fields if table not in ("motors", "gears"))


@dataclass(frozen=True)
class RigidConstants:
    """Constants of the linear rigid drive (8) to (11), from the data of its parts."""

    inertia: float  # J_RC [kg·m²] on the input shaft
    viscous_friction: float  # b_RC [N·m·s/rad]
    time_constant: float  # T_RC [s], mechanical
    motor_time_constant: float  # t_m0 [s], J_M omega_DR/(M_DR (k_N - 1))
    system_time_constant: float  # T_mc [s]
    natural_frequency: float  # Omega_RC [rad/s]
    damping_ratio: float  # xi_RC [-]
    rated_speed: float  # omega_MRC [rad/s], steady motor speed at E = 1
    bandwidth: float  # f_-3dB [Hz]

    def response(self, frequency: np.ndarray, ratio: float) -> np.ndarray:
        """F(w)/F(E) [rad/s] at the load, by (10) and (11)."""
        x = 2.0 * np.pi * np.asarray(frequency) / self.natural_frequency
        return self.rated_speed / ratio / (1.0 - x**2 + 2j * self.damping_ratio * x)


@checked
def rigid_constants(
    drive: Drive | DriveTrain | Scenario, *, motor_time_constant: Time | None = None, time_constant: Time | None = None
) -> RigidConstants:
    """Return the constants of (8) to (11) of a rigid drive.

    Parameters
    ----------
    drive : Drive, DriveTrain or Scenario
        A DC motor that turns loads through any number of gears of constant efficiency.
    motor_time_constant, time_constant : float, optional
        Time constants [s] that replace computed ones.

    Returns
    -------
    RigidConstants
        Gain, damping and time constants.

    Raises
    ------
    InputError
        The motor is a torque source, a gear has no constant efficiency, or something else acts.

    Examples
    --------
    >>> import lostmotion as lm
    >>> f"{lm.response.rigid_constants(lm.load('paper-1dof-l-large')).bandwidth:.3f} Hz"
    '2.451 Hz'
    """
    scenario = Scenario.of_any(drive)
    for name, value in (("motor_time_constant", motor_time_constant), ("time_constant", time_constant)):
        if value is not None and not value > 0.0:
            raise InputError(f"{name}: {value:g} s must be greater than 0")
    motor, J, b = _at_motor(scenario)
    m = motor.as_dc()
    if m.rated_speed is None or m.electrical_time_constant is None or m.armature_voltage_constant is None:
        raise InputError("the closed form needs a DC or a synchronous motor")
    if not m.rotor_inertia > 0.0:
        raise InputError(
            "the closed form needs the rotor_inertia of the motor, whose time constant is one of its numbers"
        )
    k_N, tau = m.armature_voltage_constant, m.electrical_time_constant
    T_RC = (J / b if b > 0.0 else math.inf) if time_constant is None else time_constant
    if motor_time_constant is None:
        motor_time_constant = m.rotor_inertia * m.rated_speed / (m.rated_torque * (k_N - 1.0))
    back_emf = motor_time_constant * J / m.rotor_inertia  # time constant of the whole inertia against the back e.m.f.
    T_mc = 1.0 / (1.0 / T_RC + 1.0 / back_emf)
    natural = 1.0 / math.sqrt(tau * T_mc)
    damping = (1.0 / tau + 1.0 / T_RC) / (2.0 * natural)
    # (1 - x^2)^2 + 4 xi^2 x^2 = 2
    p = 2.0 * damping**2 - 1.0
    x = math.sqrt(-p + math.sqrt(p * p + 1.0)) if p < 0.0 else math.sqrt(1.0 / (p + math.sqrt(p * p + 1.0)))
    return RigidConstants(
        inertia=J,
        viscous_friction=b,
        time_constant=T_RC,
        motor_time_constant=motor_time_constant,
        system_time_constant=T_mc,
        natural_frequency=natural,
        damping_ratio=damping,
        rated_speed=k_N / (k_N - 1.0) * m.rated_speed * T_mc / back_emf,
        bandwidth=x * natural / (2.0 * math.pi),
    )


def _at_motor(scenario: Scenario) -> tuple[ShaftMotor, float, float]:
    """The one motor, inertia [kg·m²] and viscous friction [N·m·s/rad] at its shaft, all gears rigid.

    Raises InputError: they are not constant.
    """
    need_free_motion(scenario, "rigid_constants")
    train = scenario.train()
    if len(train.motors) != 1:
        raise InputError(f"the closed form is for one motor, and {len(train.motors) or 'no'} motors turn it")
    if others := [f"{table}.{name}" for table in OTHERS for name in getattr(train, table)]:
        raise InputError(
            "acts too, and the closed form has inertia and viscous friction alone; leave it out", others[0]
        )
    (motor,) = train.motors.values()
    shares, waiting = {motor.shaft: 1.0}, [motor.shaft]  # of each shaft's values at the motor
    while waiting:
        shaft = waiting.pop()
        for name, gear in train.gears.items():
            if gear.input == shaft and gear.output not in shares:
                ratio = gear.ratio * gear.ratio
                shares[gear.output] = shares[shaft] / (ratio * _efficiency(scenario.gear_key(name), gear))
                waiting.append(gear.output)
    if len(train.gears) != len(train.shafts) - 1 or len(shares) != len(train.shafts):
        raise InputError(
            "the closed form is for gears that branch out from the motor, and here some join or drive back"
        )
    shafts, gears = train.shafts.items(), train.gears.values()
    J = sum(s.inertia * shares[name] for name, s in shafts) + sum(g.inertia * shares[g.input] for g in gears)
    b = sum(s.viscous_friction * shares[name] for name, s in shafts)
    return motor, J + motor.rotor_inertia, b + sum(g.viscous_friction * shares[g.input] for g in gears)


def _efficiency(key: str, gear: Gear) -> float:
    """Efficiency of a gear that drives. Raises InputError: it is not constant, or its housing turns."""
    if gear.housing is not None:
        raise InputError("turns, and the closed form is for gears whose housing stands", f"{key}.housing")
    losses = gear.losses
    if isinstance(losses, ConstantEfficiency):
        return losses.efficiency
    if isinstance(losses, TwoEfficiencies):
        return losses.efficiencies()[0]
    raise InputError("the closed form needs a constant efficiency", f"{key}.losses")
