"""The published drive that the project starts from: its scenarios and its constants, printed and recomputed.

Source: "Simplified dynamic model of the transmission", on the transmission of a passive optoelectronic rangefinder.
It was written within grant project FT-TA3/103 of the Ministry of Industry and Trade of the Czech Republic, and
continues Čech and Jevický (2005). Equations and figures are numbered as there. docs/citing.md has what else is known
about it.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

from ..errors import InputError
from ..response.rigid import RigidConstants, rigid_constants
from ..simulation.runs.loading import load
from ..simulation.scenario.scenario import Scenario

MODELS = ("1-DOF-L", "2-DOF-L", "2-DOF-NL")
AMPLITUDES = {"large": 1.0275, "small": 0.025}

PRINTED_MOTOR_TIME_CONSTANT = 2.31e-3  # t_m0 [s]
PRINTED_TIME_CONSTANT = 0.2334  # T_RC [s]
DOES_NOT = "the printed value does not follow from the printed"


def paper_scenario(model: str, amplitude: str) -> Scenario:
    """One of the paper's runs.

    model: ``"1-DOF-L"``, ``"2-DOF-L"`` or ``"2-DOF-NL"``.
    amplitude: ``"large"`` (E_CA = 1.0275) or ``"small"`` (0.025).
    """
    if model not in MODELS or amplitude not in AMPLITUDES:
        raise InputError(f"there is no run {model!r}, {amplitude!r}; models: {MODELS}, amplitudes: {tuple(AMPLITUDES)}")
    return load(f"paper-{model.lower().replace('-', '', 1)}-{amplitude}")


@dataclass(frozen=True)
class Constant:
    """One printed constant beside two values that are computed for it."""

    name: str
    unit: str
    printed: float
    recomputed: float  # from the paper's data
    from_printed: float  # from the printed t_m0 and T_RC, where those matter
    remark: str = ""


def constants() -> list[Constant]:
    """The constants that the paper prints, recomputed."""
    rigid = paper_scenario("1-DOF-L", "large").drive()
    new = rigid_constants(rigid)
    old = rigid_constants(rigid, motor_time_constant=PRINTED_MOTOR_TIME_CONSTANT, time_constant=PRINTED_TIME_CONSTANT)
    g = paper_scenario("2-DOF-L", "large").drive().gearbox
    stiffness = g.stiffness.stiffness
    efficiency = g.losses.efficiency
    J_M, J_Z = rigid.motor.rotor_inertia, rigid.load.inertia
    J_MR = J_M + g.inertia
    f_T0 = math.sqrt(stiffness / (g.ratio**2 * efficiency * J_MR) + stiffness / J_Z) / (2.0 * math.pi)
    # A disturbance M_Z lowers the motor's steady speed by T_MZ M_Z/J_Z.
    reflection = g.ratio * efficiency / J_Z
    follows = "the printed value follows from the printed t_m0 and T_RC"
    rows: list[tuple[str, str, float, Callable[[RigidConstants], float], str]] = [
        ("f_T0", "Hz", 65.5, lambda _: f_T0, "only with eta_C inside Omega_M"),
        ("T_MR", "ms", 62.36, lambda _: 1e3 * J_MR / g.viscous_friction, ""),
        ("T_ZR", "ms", 269.4, lambda _: 1e3 * J_Z / rigid.load.viscous_friction, ""),
        ("j_RC", "1", 36.1, lambda c: c.inertia / J_M, ""),
        ("beta_RC", "1", 5.32, lambda c: c.viscous_friction / g.viscous_friction, ""),
        ("T_RC", "ms", 233.4, lambda c: 1e3 * c.time_constant, f"{DOES_NOT} j_RC and beta_RC"),
        ("t_m0", "ms", 2.31, lambda c: 1e3 * c.motor_time_constant, f"{DOES_NOT} data"),
        ("T_mc", "ms", 61.48, lambda c: 1e3 * c.system_time_constant, follows),
        ("f_RC", "Hz", 56.6, lambda c: c.natural_frequency / (2.0 * math.pi), follows),
        ("xi_RC", "1", 10.9, lambda c: c.damping_ratio, follows),
        ("omega_MRC", "rad/s", 374.8, lambda c: c.rated_speed, follows),
        ("f_-3dB", "Hz", 2.6, lambda c: c.bandwidth, follows),
        ("lambda_-3dB", "1", 0.0458, lambda c: 2.0 * math.pi * c.bandwidth / c.natural_frequency, follows),
        (
            "T_MZ",
            "s",
            5.17,
            lambda c: c.system_time_constant / (c.inertia * reflection),
            f"{DOES_NOT} data, nor from the printed t_m0 and T_RC",
        ),
    ]
    return [
        Constant(name, unit, printed, value_of(new), value_of(old), remark)
        for name, unit, printed, value_of, remark in rows
    ]
