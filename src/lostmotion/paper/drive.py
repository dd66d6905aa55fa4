"""The published drive that the project starts from: its scenarios and its constants, printed and recomputed.

Source: "Simplified dynamic model of the transmission", on the transmission of a passive optoelectronic rangefinder, written
within grant project FT-TA3/103 of the Ministry of Industry and Trade of the Czech Republic; a continuation of Čech and
Jevický (2005). Equations and figures are numbered as there. docs/citing.md says what else is known of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..errors import InputError
from ..response.linear import RigidConstants, rigid_constants
from ..simulation.scenario import Scenario
from ..simulation.sources import load_drive

MODELS = ("1-DOF-L", "2-DOF-L", "2-DOF-NL")
AMPLITUDES = {"large": 1.0275, "small": 0.025}

PRINTED_MOTOR_TIME_CONSTANT = 2.31e-3  # t_m0 [s]
PRINTED_TIME_CONSTANT = 0.2334  # T_RC [s]


def paper_scenario(model: str, amplitude: str) -> Scenario:
    """One of the paper's runs.

    Parameters
    ----------
    model
        ``"1-DOF-L"``, ``"2-DOF-L"`` or ``"2-DOF-NL"``.
    amplitude
        ``"large"`` (E_CA = 1.0275) or ``"small"`` (0.025).
    """
    if model not in MODELS or amplitude not in AMPLITUDES:
        raise InputError(f"there is no run {model!r}, {amplitude!r}; models: {MODELS}, amplitudes: {tuple(AMPLITUDES)}")
    return load_drive(f"paper-{model.lower().replace('-', '', 1)}-{amplitude}")


@dataclass(frozen=True)
class Constant:
    """One printed constant beside two computations of it."""

    name: str
    unit: str
    printed: float
    recomputed: float  # from the paper's data
    from_printed: float  # from the printed t_m0 and T_RC, where those matter
    remark: str = ""


def constants() -> list[Constant]:
    """The constants that the paper prints, recomputed."""
    rigid = paper_scenario("1-DOF-L", "large").drive()
    g = paper_scenario("2-DOF-L", "large").drive().gearbox
    stiffness = g.stiffness.stiffness  # type: ignore[union-attr]
    efficiency = g.losses.efficiency  # type: ignore[union-attr]
    J_MR = rigid.motor.rotor_inertia + g.inertia
    omega_M2 = stiffness / (g.ratio**2 * efficiency * J_MR)
    omega_Z2 = stiffness / rigid.load.inertia
    new = rigid_constants(rigid)
    old = rigid_constants(rigid, motor_time_constant=PRINTED_MOTOR_TIME_CONSTANT, time_constant=PRINTED_TIME_CONSTANT)
    f_T0 = math.sqrt(omega_M2 + omega_Z2) / (2.0 * math.pi)
    T_MR, T_ZR = J_MR / g.viscous_friction, rigid.load.inertia / rigid.load.viscous_friction
    j_RC, beta_RC = new.inertia / rigid.motor.rotor_inertia, new.viscous_friction / g.viscous_friction

    def both(value: RigidConstants, attribute: str) -> float:
        return float(getattr(value, attribute))

    def row(name: str, unit: str, printed: float, attribute: str, factor: float = 1.0, remark: str = "") -> Constant:
        return Constant(name, unit, printed, factor * both(new, attribute), factor * both(old, attribute), remark)

    not_from_data = "the printed value does not follow from the printed data"
    per_turn = 0.5 / math.pi
    return [
        Constant("f_T0", "Hz", 65.5, f_T0, f_T0, "only with eta_C inside Omega_M"),
        Constant("T_MR", "ms", 62.36, 1e3 * T_MR, 1e3 * T_MR),
        Constant("T_ZR", "ms", 269.4, 1e3 * T_ZR, 1e3 * T_ZR),
        Constant("j_RC", "1", 36.1, j_RC, j_RC),
        Constant("beta_RC", "1", 5.32, beta_RC, beta_RC),
        row(
            "T_RC",
            "ms",
            233.4,
            "time_constant",
            1e3,
            "the printed value does not follow from the printed j_RC and beta_RC",
        ),
        row("t_m0", "ms", 2.31, "motor_time_constant", 1e3, not_from_data),
        row("T_mc", "ms", 61.48, "system_time_constant", 1e3, "follows from the printed t_m0 and T_RC"),
        row("f_RC", "Hz", 56.6, "natural_frequency", per_turn, "likewise"),
        row("xi_RC", "1", 10.9, "damping_ratio", 1.0, "likewise"),
        row("omega_MRC", "rad/s", 374.8, "rated_speed", 1.0, "likewise"),
        row("f_-3dB", "Hz", 2.6, "bandwidth", 1.0, "likewise"),
        Constant(
            "lambda_-3dB",
            "1",
            0.0458,
            2.0 * math.pi * new.bandwidth / new.natural_frequency,
            2.0 * math.pi * old.bandwidth / old.natural_frequency,
            "likewise",
        ),
    ]
