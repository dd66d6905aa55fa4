"""Formulas of catalogues and standards by which axes are sized, each with its source. All values are in SI units.

They know nothing of tasks and records; `axis_rules` compares what they give with the data of parts.
"""

import math

from ..model.screw import ELASTIC_MODULUS, STEEL

BUCKLING: dict[str, float] = {
    "fixed-free": 0.25,
    "supported-supported": 1.0,
    "fixed-supported": 2.0,
    "fixed-fixed": 4.0,
}
"""Euler's factor of each mounting of a screw"""
BENDING: dict[str, float] = {
    "fixed-free": 1.875104,
    "supported-supported": math.pi,
    "fixed-supported": 3.926602,
    "fixed-fixed": 4.730041,
}
"""first eigenvalue of the bending beam for each mounting"""
BUCKLING_SAFETY = 0.5  # of Euler's load that is permitted: THK, Rexroth and HIWIN alike
CRITICAL_SAFETY = 0.8  # of the first bending speed that is permitted: THK, Rexroth and HIWIN alike
TEETH_IN_MESH = 12  # that carry at most

SEA_LEVEL = 1000.0  # [m], up to which ratings hold
HEIGHT = 1e4  # [m]: 1 % of the torque to each 100 m
WARM = 40.0  # [degC], up to which ratings of servo motors hold


def buckling_force(core_diameter: float, length: float, mounting: str, modulus: float = ELASTIC_MODULUS) -> float:
    """Permissible axial load [N] of a long screw: half of Euler's n pi^2 E I/l^2.

    Source: THK general catalogue, A-685 and A-731 (eta_2 contains the half); Rexroth R310RU3301, p. 121; HIWIN BS-08-2.

    Examples
    --------
    >>> round(buckling_force(17.5e-3, 1.1, "fixed-fixed"), -2)  # THK A-731: 15500 N
    15500.0
    """
    area_moment = math.pi / 64.0 * core_diameter**4
    return BUCKLING_SAFETY * BUCKLING[mounting] * math.pi**2 * modulus * area_moment / length**2


def compression_force(core_diameter: float) -> float:
    """Permissible axial load [N] of the section of a screw: 147 MPa, which is 116 d^2 in N and mm.

    Source: THK general catalogue, A-685.

    Examples
    --------
    >>> round(compression_force(17.5e-3), -2)
    35500.0
    """
    return 116e6 * core_diameter**2


def critical_speed(
    core_diameter: float, length: float, mounting: str, modulus: float = ELASTIC_MODULUS, density: float = STEEL
) -> float:
    """Permissible speed [rad/s] of a long screw: 0.8 of its first bending speed, (lambda/l)^2 sqrt(E I/(rho A)).

    Source: THK general catalogue, A-687 and A-731 (lambda_2 contains the 0.8); Rexroth R310RU3301, p. 120; HIWIN BS-08-2.

    Examples
    --------
    >>> from math import pi
    >>> round(critical_speed(17.5e-3, 1.1, "fixed-supported") * 30 / pi, -1)  # THK A-731: 2180 rpm
    2180.0
    """
    radius_of_gyration = 0.25 * core_diameter
    return CRITICAL_SAFETY * (BENDING[mounting] / length) ** 2 * radius_of_gyration * math.sqrt(modulus / density)


def dn_speed(ball_circle_diameter: float, dn: float = 70.0) -> float:
    """Permissible speed [rad/s] by the path of the balls: DN = D n in m rpm, 70 for THK's screws with return tubes.

    Source: THK general catalogue, A-688 (DN in mm rpm: 70000).

    Examples
    --------
    >>> from math import pi
    >>> round(dn_speed(20.75e-3) * 30 / pi)
    3373
    """
    return dn / ball_circle_diameter * math.pi / 30.0


def belt_force(circumferential: float, pretension: float | None = None) -> float:
    """Largest force [N] in a strand of a belt that moves a slide: F_v + F_u, its pretension F_v at least F_u.

    Source: Elatech and Mulco catalogues of timing belts, linear drives: F_v >= F_u, so that no strand is slack.

    Examples
    --------
    >>> belt_force(800.0)
    1600.0
    """
    return circumferential + (circumferential if pretension is None else pretension)


def tooth_forces(tooth_force: float, in_mesh: int) -> float:
    """Circumferential force [N] that the teeth of a belt in mesh carry, 12 at most.

    Source: Elatech and Mulco catalogues of timing belts.

    Examples
    --------
    >>> tooth_forces(50.0, 10), tooth_forces(50.0, 20)
    (500.0, 600.0)
    """
    return tooth_force * min(in_mesh, TEETH_IN_MESH)


def capacitor_energy(capacitance: float, voltage: float, start: float) -> float:
    """Energy [J] that the capacitors of a DC bus take from one voltage [V] up to another: C (U^2 - U_0^2)/2.

    Source: HIWIN MM99TE07-1701, p. 118.

    Examples
    --------
    >>> round(capacitor_energy(1880e-6, 390.0, 220.0 * 2**0.5), 2)
    51.98
    """
    return 0.5 * capacitance * (voltage**2 - start**2)


def bus_voltage(capacitance: float, start: float, energy: float) -> float:
    """Voltage [V] to which an energy [J] lifts the capacitors of a DC bus: sqrt(U_0^2 + 2 E/C).

    Source: the same balance.

    Examples
    --------
    >>> round(bus_voltage(1880e-6, 220.0 * 2**0.5, 51.98))
    390
    """
    return math.sqrt(start**2 + 2.0 * max(energy, 0.0) / capacitance)


def derating(altitude: float, ambient: float, winding: float | None) -> float:
    """Share of its continuous torque that a motor has left at an altitude [m] and an ambient temperature [degC].

    1 % is lost to each 100 m above 1000 m. Above 40 degC the permitted rise of the winding (from its largest
    temperature, or None) is smaller. The torque is proportional to the root of the rise, since the copper loss is
    proportional to the square of the torque. Source: IEC 60034-1, 5.1 and 6 (ratings hold up to 1000 m and 40 degC);
    the catalogues of servo motors state the 1 %.

    Examples
    --------
    >>> round(derating(2000.0, 25.0, None), 3), round(derating(0.0, 50.0, 140.0), 3)
    (0.9, 0.949)
    """
    share = 1.0 - max(altitude - SEA_LEVEL, 0.0) / HEIGHT
    if winding is not None and ambient > WARM:
        share *= math.sqrt(max(winding - ambient, 0.0) / (winding - WARM)) if winding > WARM else 0.0
    return max(share, 0.0)
