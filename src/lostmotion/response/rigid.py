"""Constants of a drive with a rigid gearbox: gain and lag."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..inputs.arguments import checked
from ..inputs.quantities import Time
from ..model.drive import Drive
from ..model.losses import ConstantEfficiency
from ..simulation.one_gear import drive_of
from ..simulation.scenario import Scenario


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
    drive: Drive | Scenario, *, motor_time_constant: Time | None = None, time_constant: Time | None = None
) -> RigidConstants:
    """Return the constants of (8) to (11) of a rigid drive.

    Parameters
    ----------
    drive : Drive or Scenario
        A drive with a DC motor and a constant efficiency.
    motor_time_constant, time_constant : float, optional
        Time constants [s] that replace computed ones.

    Returns
    -------
    RigidConstants
        Gain, damping and time constants.

    Raises
    ------
    InputError
        The drive has a torque source, or no constant efficiency.

    Examples
    --------
    >>> import lostmotion as lm
    >>> f"{lm.response.rigid_constants(lm.load('paper-1dof-l-large')).bandwidth:.3f} Hz"
    '2.451 Hz'
    """
    drive = drive_of(drive)
    for name, value in (("motor_time_constant", motor_time_constant), ("time_constant", time_constant)):
        if value is not None and not value > 0.0:
            raise InputError(f"{name}: {value:g} s must be greater than 0")
    m, g, load = drive.motor.as_dc(), drive.gearbox, drive.load
    if m.rated_speed is None or m.electrical_time_constant is None or m.armature_voltage_constant is None:
        raise InputError("the closed form needs a DC or a synchronous motor")
    if not isinstance(g.losses, ConstantEfficiency):
        raise InputError("the closed form needs gearbox.losses of kind constant_efficiency")
    reflect = 1.0 / (g.ratio**2 * g.losses.efficiency)
    J = m.rotor_inertia + g.inertia + load.inertia * reflect
    b = g.viscous_friction + load.viscous_friction * reflect
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
