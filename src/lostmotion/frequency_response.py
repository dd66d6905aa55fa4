"""Frequency response of the nonlinear drive: first harmonics of periodic motions, and the closed form (10), (11)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from . import _core
from .parts import ConstantEfficiency, Drive
from .signals import CommandSignal, TorqueSignal
from .variables import CHANNELS

if TYPE_CHECKING:
    import xarray

SAMPLES_PER_PERIOD = 2048
MAX_PERIODS = 20_000
PERIODICITY = 1e-10  # largest change of a state over one period / its magnitude, for a motion to count as periodic


def frequency_response(
    drive: Drive,
    frequencies: Sequence[float],
    amplitude: float,
    *,
    load_torque: float = 0.0,
    progress: Callable[[], None] | None = None,
) -> xarray.Dataset:
    """First harmonic of the load speed under a sinusoidal command, by harmonic linearisation.

    Each point comes from a motion that repeats: the transient is followed until no state changes by more than
    `PERIODICITY` of its magnitude over one period.

    Parameters
    ----------
    frequencies
        [Hz], of the command.
    amplitude
        E_CA [-].
    load_torque
        Constant M_Z [N·m].
    progress
        Called after each frequency.

    Returns
    -------
    xarray.Dataset
        Over ``frequency`` [Hz]: complex ``response`` [rad/s], F(w)/F(E); ``distortion`` [-], harmonics above the
        first / the first; ``efficiency`` [-], mean power on the load's side of the gear / mean motor power;
        ``periods`` followed; ``periodicity``, the residual reached.

    Raises
    ------
    RuntimeError
        A motion does not become periodic within `MAX_PERIODS` periods.
    """
    import xarray as xr

    torque = TorqueSignal(mean=load_torque)
    points = []
    for frequency in frequencies:
        command = CommandSignal(amplitude=amplitude, frequency=frequency)
        table, converged, periods, residual, _ = _core.follow_to_periodic(
            drive.core(), command.core(), torque.core(), 1.0 / frequency, SAMPLES_PER_PERIOD, MAX_PERIODS, PERIODICITY
        )
        if not converged:
            raise RuntimeError(
                f"at {frequency:g} Hz and amplitude {amplitude:g} the motion is not periodic after {periods} periods: "
                f"its states still change by {residual:.1e} a period"
            )
        points.append((*_harmonics(dict(zip((v.name for v in CHANNELS), table, strict=True))), periods, residual))
        if progress is not None:
            progress()
    response, distortion, efficiency, followed, residuals = (np.array(column) for column in zip(*points, strict=True))
    dim = ("frequency",)
    return xr.Dataset(
        {
            "response": (
                dim,
                response,
                {"units": "rad/s", "long_name": "first harmonic of load speed / that of command"},
            ),
            "distortion": (dim, distortion, {"units": "1", "long_name": "harmonics above the first / first harmonic"}),
            "efficiency": (
                dim,
                efficiency,
                {"units": "1", "long_name": "mean power out of the gear / mean motor power"},
            ),
            "periods": (dim, followed, {"units": "1", "long_name": "periods followed"}),
            "periodicity": (dim, residuals, {"units": "1", "long_name": "largest relative change over one period"}),
        },
        coords={"frequency": (dim, np.asarray(frequencies, dtype=float), {"units": "Hz", "long_name": "frequency"})},
        attrs={"amplitude": amplitude, "samples_per_period": SAMPLES_PER_PERIOD},
    )


def _harmonics(data: dict[str, np.ndarray]) -> tuple[complex, float, float]:
    """First harmonic of load speed over that of the command, distortion, mean efficiency."""
    speed, command = np.fft.rfft(data["load_speed"]), np.fft.rfft(data["command"])
    first = abs(speed[1])
    distortion = float(np.sqrt(np.sum(np.abs(speed[2:]) ** 2)) / first) if first > 0.0 else math.nan
    power_in = float(np.mean(data["motor_torque"] * data["motor_speed"]))
    power_out = float(np.mean(data["output_torque"] * data["load_speed"]))
    return complex(speed[1] / command[1]), distortion, power_out / power_in if power_in > 0.0 else math.nan


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


def rigid_constants(
    drive: Drive, *, motor_time_constant: float | None = None, time_constant: float | None = None
) -> RigidConstants:
    """Constants of (8) to (11); two of them may be given instead of computed.

    Raises
    ------
    ValueError
        The drive has no DC motor, or no constant efficiency.
    """
    m, g, load = drive.motor, drive.gearbox, drive.load
    if m.rated_speed is None or m.electrical_time_constant is None or m.armature_voltage_constant is None:
        raise ValueError("the closed form needs a DC motor")
    if not isinstance(g.losses, ConstantEfficiency):
        raise ValueError("the closed form needs gearbox.losses of kind constant_efficiency")
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
