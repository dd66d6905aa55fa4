"""The linear side: exact linearisation in any regime, and the closed forms (9) to (11) of the rigid drive."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _core
from ..errors import InputError, need
from ..inputs.arguments import checked
from ..inputs.quantities import Number, Time, Torque, argument, arguments
from ..inputs.validation import shown
from ..model.drive import Drive
from ..model.losses import ConstantEfficiency
from ..model.torsion import Rigid
from ..simulation.run import start_state
from ..simulation.scenario import Initial, Scenario, drive_of
from ..simulation.variables import CONTACTS, STATES

if TYPE_CHECKING:
    import control
    import scipy.signal

INPUTS = ("command", "load_torque")
OUTPUTS = (*STATES, "output_torque", "input_torque")


@dataclass(frozen=True)
class LinearModel:
    """One regime of a drive, dx/dt = A x + B u + a, y = C x + D u + c. Exact as long as the regime lasts."""

    A: np.ndarray
    """5 x 5, over `states` (SI)"""
    B: np.ndarray
    """5 x 2, over `inputs`"""
    C: np.ndarray
    """7 x 5, `outputs` over `states`"""
    D: np.ndarray
    """7 x 2"""
    rate: np.ndarray
    """a, constant part of the rates"""
    offset: np.ndarray
    """c, constant part of the outputs"""
    contacts: dict[str, int]
    """modes of the contacts: -1, 0 stuck, +1; 2: the drive has none"""
    state: Initial
    """operating point (SI)"""
    command: float
    """at the operating point [-]"""
    load_torque: float
    """at the operating point [N·m]"""
    states: tuple[str, ...] = STATES
    inputs: tuple[str, ...] = INPUTS
    outputs: tuple[str, ...] = OUTPUTS

    def __repr__(self) -> str:
        """Which operating point and regime it is."""
        words = {-1: "slips in reverse", 0: "is stuck", 1: "slips forward"}
        modes = [f"{c.replace('_', ' ')} {words[m]}" for c, m in self.contacts.items() if m in words]
        point = {name: getattr(self.state, name) for name in (*STATES, "hysteresis_capacity")}
        point |= {"command": self.command, "load_torque": self.load_torque}
        moved = ", ".join(f"{name} {value:.6g}" for name, value in point.items() if value != 0.0)
        return f"linear model at {moved or 'rest, command 0'}: {', '.join(modes) or 'no contact'}"

    @checked
    def response(self, frequency: Any, output: str = "load_speed", source: str = "command") -> np.ndarray:
        """F(y)/F(u) at frequencies [Hz], complex."""
        b, c, d = self._pair(output, source)
        frequencies = arguments("frequency", frequency, "Hz")
        if 0.0 in frequencies:
            raise InputError(f"frequency {shown(frequency)} must not be 0 Hz, where the load angle grows without end")
        s = 2j * np.pi * np.array(frequencies)
        eye = np.eye(len(self.A))
        return np.array([c @ np.linalg.solve(x * eye - self.A, b) + d for x in s])

    def resonances(self) -> list[tuple[float, float]]:
        """(frequency [Hz], damping ratio [-]) of each pair of complex eigenvalues, rising."""
        return _pairs(np.linalg.eigvals(self.A))

    @checked
    def antiresonances(self, output: str = "load_speed", source: str = "command") -> list[tuple[float, float]]:
        """(frequency [Hz], damping ratio [-]) of each pair of complex transmission zeros, rising."""
        need("scipy", "Finding transmission zeros", "control")
        import scipy.linalg

        b, c, d = self._pair(output, source)
        n = len(self.A)
        pencil = np.block([[self.A, b[:, None]], [c[None, :], np.array([[d]])]])
        mass = np.zeros((n + 1, n + 1))
        mass[:n, :n] = np.eye(n)
        values = scipy.linalg.eigvals(pencil, mass)
        return _pairs(values[np.isfinite(values)])

    def _pair(self, output: str, source: str) -> tuple[np.ndarray, np.ndarray, float]:
        if output not in self.outputs or source not in self.inputs:
            outputs, inputs = ", ".join(self.outputs), ", ".join(self.inputs)
            raise InputError(f"there is no {shown(output)} over {shown(source)}; outputs: {outputs}; inputs: {inputs}")
        i, o = self.inputs.index(source), self.outputs.index(output)
        return self.B[:, i], self.C[o], float(self.D[o, i])

    def to_control(self) -> control.StateSpace:
        """The same for python-control, with names.

        Raises
        ------
        MissingLibraryError
            python-control is not installed.
        """
        return python_control().ss(
            self.A,
            self.B,
            self.C,
            self.D,
            states=list(self.states),
            inputs=list(self.inputs),
            outputs=list(self.outputs),
        )

    def to_scipy(self) -> scipy.signal.StateSpace:
        """The same for scipy.signal.

        Raises
        ------
        MissingLibraryError
            scipy is not installed.
        """
        need("scipy", "This conversion", "control")
        import scipy.signal

        return scipy.signal.StateSpace(self.A, self.B, self.C, self.D)


def python_control() -> Any:
    """The library python-control, where it is installed."""
    need("control", "This conversion", "control")
    import control

    return control


def _pairs(values: np.ndarray) -> list[tuple[float, float]]:
    magnitude = np.abs(values)
    complex_ones = values[values.imag > 1e-9 * (magnitude + 1e-300)]
    found = [(abs(v) / (2.0 * np.pi), -v.real / abs(v)) for v in complex_ones]
    return sorted((float(f), float(xi)) for f, xi in found)


@checked
def linearize(
    drive: Drive | Scenario,
    state: Initial | None = None,
    *,
    command: Number = 0.0,
    load_torque: Torque = 0.0,
    command_rate: float = 0.0,
    load_torque_rate: float = 0.0,
) -> LinearModel:
    """The linear model of the regime that a state is in, sticking included.

    Nothing is approximated: a regime is linear. Which one it is, is decided by the state and by where the inputs lead
    next, as in a run.

    Parameters
    ----------
    state
        The operating point in SI, such as ``Initial(motor_speed=100.0, load_speed=1.1, twist=2e-3)``, ``Initial()`` for rest, or
        the end of a run, ``Initial(**json.loads(result.attrs["end_state"]))``. May be left out only for a drive that has one
        regime, which is the same everywhere.
    command, load_torque
        Inputs [-], [N·m] at this instant, and their rates [1/s], [N·m/s].

    Raises
    ------
    InputError
        The state is missing, and the drive has several regimes.
    SolverError
        The state has no continuation.
    """
    drive = drive_of(drive)
    if state is None:
        if regimes := _why_several_regimes(drive):
            raise InputError(
                f"linearize: the linear model of this drive depends on the operating point ({regimes}); give one, such as "
                "Initial(motor_speed=100, load_speed=1, twist=2e-3) [SI], or Initial() for the drive at rest"
            )
        state = Initial()
    rates, torques, modes = _core.linearization(
        drive.core(),
        start_state(state),
        state.hysteresis_capacity,
        [command, load_torque],
        [argument("command_rate", command_rate, "1/s"), argument("load_torque_rate", load_torque_rate, "N*m/s")],
    )
    n = len(STATES)
    A, B = rates[:, :n], rates[:, n : n + 2]
    C, D, offset = np.eye(len(OUTPUTS), n), np.zeros((len(OUTPUTS), 2)), np.zeros(len(OUTPUTS))
    for name, values in torques.items():
        row = OUTPUTS.index(name)
        C[row], D[row], offset[row] = values[:n], values[n : n + 2], values[-1]
    contacts = dict(zip(CONTACTS, modes, strict=True))
    return LinearModel(A, B, C, D, rates[:, -1], offset, contacts, state, command, load_torque)


def _why_several_regimes(drive: Drive) -> str:
    """What gives a drive more than one regime; empty if it has one."""
    m, g = drive.motor, drive.gearbox
    reasons = {
        "dry friction": m.friction_torque > 0.0 or drive.load.friction_torque > 0.0,
        "a loss map": not isinstance(g.losses, ConstantEfficiency),
        "hysteresis": g.hysteresis is not None and g.hysteresis.efficiency < 1.0,
        "a torsion curve of several pieces": not isinstance(g.stiffness, Rigid) and len(g.stiffness.pieces()[1]) > 1,
        "a voltage limit": m.voltage_limit is not None,
    }
    return ", ".join(reason for reason, holds in reasons.items() if holds)


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
    """Constants of (8) to (11); two of them may be given instead of computed.

    Raises
    ------
    InputError
        The drive has no DC motor, or no constant efficiency.
    """
    drive = drive_of(drive)
    for name, value in (("motor_time_constant", motor_time_constant), ("time_constant", time_constant)):
        if value is not None and not value > 0.0:
            raise InputError(f"{name}: {value:g} s must be greater than 0")
    m, g, load = drive.motor, drive.gearbox, drive.load
    if m.rated_speed is None or m.electrical_time_constant is None or m.armature_voltage_constant is None:
        raise InputError("the closed form needs a DC motor")
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
