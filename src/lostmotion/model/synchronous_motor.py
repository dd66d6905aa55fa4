"""The synchronous motor under ideal field orientation: from what its data sheet prints to the law of a DC motor.

In amplitudes of a phase, with rotor coordinates d (along the magnets) and q, p pole pairs and w_e = p w_M:

    L_d di_d/dt = u_d - R i_d + w_e L_q i_q
    L_q di_q/dt = u_q - R i_q - w_e (L_d i_d + psi)
    M_D = 1.5 p (psi i_q + (L_d - L_q) i_d i_q)

The decoupling u_d = -w_e L_q i_q keeps i_d = 0, and what remains is

    L_q di_q/dt = u_q - R i_q - p psi w_M,    M_D = 1.5 p psi i_q,

the DC motor of (2) where command 1 is the voltage u_R and 1 of m_D the torque M_R:

    tau_a = L_q/R,    k_N = 1.5 p psi u_R/(R M_R),    omega_DR = (u_R - R M_R/(1.5 p psi))/(p psi).
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from ..inputs.part import Part, rule
from ..inputs.quantities import (
    Current,
    Inductance,
    Positive,
    Resistance,
    Temperature,
    TorqueConstant,
    VoltageConstant,
    Whole,
)
from ..inputs.refusal_messages import shown
from ..units.conversion import Unit

AGREEMENT = 0.05  # between constants that say the same; beyond it one of them is misread


class Forms(NamedTuple):
    """A quantity that data sheets print in several ways."""

    question: str
    unit: str
    common: str  # form to which all others are converted
    factors: dict[str, float]  # key of a form: the common value in SI


PHASE_OR_LINES = "between two terminals or of one phase"
RMS_OR_PEAK = "rms or peak"

RESISTANCE = Forms(
    PHASE_OR_LINES, "ohm", "ohm of a phase", {"resistance_phase": 1.0, "resistance_line_to_line": 1.0 / 2.0}
)
INDUCTANCE = Forms(PHASE_OR_LINES, "H", "H of a phase", {"inductance_phase": 1.0, "inductance_line_to_line": 1.0 / 2.0})
# p psi, the amplitude of the voltage of a phase to one rad/s of the shaft.
VOLTAGE = Forms(
    "line to line or phase, rms or peak",
    "V*s/rad",
    "V·s/rad of a phase, peak",
    {
        "voltage_constant_line_to_line_rms": math.sqrt(2.0 / 3.0),
        "voltage_constant_line_to_line_peak": math.sqrt(1.0 / 3.0),
        "voltage_constant_phase_rms": math.sqrt(2.0),
        "voltage_constant_phase_peak": 1.0,
    },
)
# The torque is 1.5 p psi to one ampere of amplitude. With block commutation two phases carry the current, and over the 60° of
# a block the voltage between them has the mean (3 sqrt(3)/pi) p psi w_M.
TORQUE = Forms(
    "to one ampere rms, to one ampere peak, or with block commutation",
    "N*m/A",
    "N·m to one ampere peak",
    {
        "torque_constant_rms": 1.0 / math.sqrt(2.0),
        "torque_constant_peak": 1.0,
        "torque_constant_block": 1.5 * math.pi / (3.0 * math.sqrt(3.0)),
    },
)
CONTINUOUS = Forms(
    RMS_OR_PEAK, "A", "A rms", {"continuous_current_rms": 1.0, "continuous_current_peak": 1.0 / math.sqrt(2.0)}
)
LARGEST = Forms(RMS_OR_PEAK, "A", "A rms", {"max_current_rms": 1.0, "max_current_peak": 1.0 / math.sqrt(2.0)})

# Keys that do not say which of its forms a quantity has.
UNCLEAR = {
    "resistance": RESISTANCE,
    "inductance": INDUCTANCE,
    "voltage_constant": VOLTAGE,
    "back_emf_constant": VOLTAGE,
    "torque_constant": TORQUE,
    "continuous_current": CONTINUOUS,
    "rated_current": CONTINUOUS,
    "max_current": LARGEST,
    "peak_current": LARGEST,
}

# By which factor two constants differ if one of them is misread.
MISREADINGS = {
    math.sqrt(2.0): "as between rms and peak",
    math.sqrt(3.0): "as between line to line and phase",
    math.sqrt(6.0): "as between line to line, rms, and phase, peak",
    1.0 / TORQUE.factors["torque_constant_block"]: "as between block commutation and one ampere peak",
    math.sqrt(2.0) * TORQUE.factors["torque_constant_block"]: "as between one ampere rms and block commutation",
}


@dataclass(frozen=True)
class PhaseValues:
    """The winding and the magnets in the quantities of the equations above."""

    pole_pairs: float
    """p"""
    resistance: float
    """R of a phase [ohm]"""
    inductance_d: float
    """L_d [H]"""
    inductance_q: float
    """L_q [H]"""
    flux_linkage: float
    """psi of the magnets, amplitude of a phase [V·s]"""

    @property
    def voltage_constant(self) -> float:
        """p psi, the amplitude of a phase to one rad/s of the shaft [V·s/rad]."""
        return self.pole_pairs * self.flux_linkage

    @property
    def torque_constant(self) -> float:
        """1.5 p psi, to one ampere peak, with i_d = 0 [N·m/A]."""
        return 1.5 * self.voltage_constant

    @property
    def copper_loss(self) -> float:
        """Heat of the three phases to a torque squared, 1.5 R i² = 1.5 R (M/(1.5 p psi))² [W/(N·m)²]."""
        return 1.5 * self.resistance / (self.torque_constant * self.torque_constant)

    def torque(self, i_d: Any, i_q: Any) -> Any:
        """1.5 p (psi i_q + (L_d - L_q) i_d i_q) [N·m], of currents [A]."""
        return 1.5 * self.pole_pairs * (self.flux_linkage + (self.inductance_d - self.inductance_q) * i_d) * i_q

    def direct_current(self, voltage: float, torque: float) -> tuple[float, float, float]:
        """Electrical time constant tau_a [s], k_N and omega_DR [rad/s] of (2), for u_R [V] and M_R [N·m]."""
        current = torque / self.torque_constant
        rated_speed = (voltage - self.resistance * current) / self.voltage_constant
        return self.inductance_q / self.resistance, voltage / (self.resistance * current), rated_speed

    def voltage(self, u_q: Any, torque: Any, speed: Any) -> Any:
        """Amplitude of the voltage of a phase [V], with the decoupling voltage u_d = -w_e L_q i_q, for u_q [V],
        torque [N·m] and speed [rad/s]."""
        u_d = self.pole_pairs * speed * self.inductance_q * torque / self.torque_constant
        return np.sqrt(u_q * u_q + u_d * u_d)


class Winding(Part):
    """Winding and magnets of a synchronous motor as data sheets print them: each value in one of its forms.

    Values refer to the star connection; the value of a delta connection between two terminals is the same. Of several constants
    that say the same (flux linkage, voltage and torque constant) the first given in this order is taken.
    """

    pole_pairs: Annotated[Whole, Field(ge=1)] | None = None
    """p"""
    poles: Annotated[Whole, Field(ge=1)] | None = None
    """2 p, in place of pole_pairs"""
    resistance_phase: Annotated[Resistance, Positive] | None = None
    """R"""
    resistance_line_to_line: Annotated[Resistance, Positive] | None = None
    """between two terminals, 2 R"""
    resistance_temperature: Temperature = 25.0
    """at which the resistance holds"""
    inductance_phase: Annotated[Inductance, Positive] | None = None
    """L_d = L_q; also called rotating field inductance"""
    inductance_line_to_line: Annotated[Inductance, Positive] | None = None
    """between two terminals, 2 L_d = 2 L_q"""
    inductance_line_to_line_min: Annotated[Inductance, Positive] | None = None
    """least inductance of a salient rotor over its angle, 2 L_d"""
    inductance_line_to_line_max: Annotated[Inductance, Positive] | None = None
    """largest inductance of a salient rotor over its angle, 2 L_q"""
    inductance_d: Annotated[Inductance, Positive] | None = None
    """L_d"""
    inductance_q: Annotated[Inductance, Positive] | None = None
    """L_q"""
    flux_linkage: Annotated[float, Unit("V*s"), Positive] | None = None
    """psi, amplitude of a phase"""
    voltage_constant_line_to_line_rms: Annotated[VoltageConstant, Positive] | None = None
    """k_E, sqrt(3/2) p psi; as "87 V/krpm" too"""
    voltage_constant_line_to_line_peak: Annotated[VoltageConstant, Positive] | None = None
    """sqrt(3) p psi"""
    voltage_constant_phase_rms: Annotated[VoltageConstant, Positive] | None = None
    """p psi/sqrt(2)"""
    voltage_constant_phase_peak: Annotated[VoltageConstant, Positive] | None = None
    """p psi"""
    torque_constant_rms: Annotated[TorqueConstant, Positive] | None = None
    """k_T to one ampere rms, (3/sqrt(2)) p psi"""
    torque_constant_peak: Annotated[TorqueConstant, Positive] | None = None
    """to one ampere peak, 1.5 p psi"""
    torque_constant_block: Annotated[TorqueConstant, Positive] | None = None
    """to one ampere of the supply with block commutation, (3 sqrt(3)/pi) p psi"""
    continuous_current_rms: Annotated[Current, Positive] | None = None
    """current that the motor withstands permanently, at rest"""
    continuous_current_peak: Annotated[Current, Positive] | None = None
    """the same as amplitude"""
    max_current_rms: Annotated[Current, Positive] | None = None
    """smaller limit of motor and amplifier, effective value of a phase"""
    max_current_peak: Annotated[Current, Positive] | None = None
    """the same as amplitude"""

    @model_validator(mode="before")
    @classmethod
    def _says_which(cls, table: Any) -> Any:
        for key in UNCLEAR if isinstance(table, Mapping) else ():
            if key in table:
                raise ValueError(_readings(key, table[key]))
        return table

    @rule
    def _complete(self) -> Iterator[str]:
        self._check_poles()
        for forms, needed in ((RESISTANCE, True), (CONTINUOUS, False), (LARGEST, False)):
            given = [key for key in forms.factors if getattr(self, key) is not None]
            if len(given) > 1 or (needed and not given):
                yield f"needs {'one' if needed else 'at most one'} of {', '.join(forms.factors)}"
        self._inductances()
        yield from self._check_constants()

    def _check_poles(self) -> None:
        if self.pole_pairs is None and self.poles is None:
            raise ValueError("needs pole_pairs, or poles, which are twice as many")
        if self.poles is not None:
            if self.poles % 2:
                both = f"pole_pairs = {self.poles}, which are {2 * self.poles} poles"
                raise ValueError(f"has poles = {self.poles}, but poles come in pairs; if pairs are meant, write {both}")
            if self.pole_pairs is not None and self.poles != 2 * self.pole_pairs:
                raise ValueError(
                    f"has pole_pairs = {self.pole_pairs} and poles = {self.poles}, but two poles make a pair; give one: "
                    f"pole_pairs = {self.pole_pairs}, or poles = {self.poles}, which are {self.poles // 2} pairs"
                )

    def _inductances(self) -> tuple[float, float]:
        """L_d and L_q [H].

        Raises
        ------
        ValueError
            They are missing, or given in more than one way.
        """
        ways = [
            *(((key, key), factor) for key, factor in INDUCTANCE.factors.items()),
            (("inductance_line_to_line_min", "inductance_line_to_line_max"), 1.0 / 2.0),
            (("inductance_d", "inductance_q"), 1.0),
        ]
        given = [(keys, factor) for keys, factor in ways if any(getattr(self, key) is not None for key in keys)]
        names = [" and ".join(dict.fromkeys(keys)) for keys, _ in ways]
        if len(given) != 1:
            raise ValueError(f"needs its inductance in one way: {', or '.join(names)}")
        (d, q), factor = given[0]
        for key, other in ((d, q), (q, d)):
            if getattr(self, key) is None:
                raise ValueError(f"has {other} and lacks {key}; give both, or {names[0]} of a rotor without saliency")
        L_d, L_q = factor * getattr(self, d), factor * getattr(self, q)
        if d.endswith("min") and L_d > L_q:
            raise ValueError(f"has {d} above {q}; exchange them")
        return L_d, L_q

    def _constants(self) -> dict[str, float]:
        """p psi [V·s/rad] as each of the constants says that is given."""
        found = {} if self.flux_linkage is None else {"flux_linkage": self._pairs() * self.flux_linkage}
        for forms, share in ((VOLTAGE, 1.0), (TORQUE, 2.0 / 3.0)):
            for key, factor in forms.factors.items():
                if (value := getattr(self, key)) is not None:
                    found[key] = share * factor * value
        return found

    def _check_constants(self) -> Iterator[str]:
        constants = self._constants()
        if not constants:
            keys = ", ".join(("flux_linkage", *VOLTAGE.factors, *TORQUE.factors))
            yield f"needs the strength of the magnets, one of {keys}"
        low, high = (pick(constants, key=lambda key: constants[key]) for pick in (min, max))
        ratio = constants[high] / constants[low]
        if ratio <= 1.0 + AGREEMENT:
            return
        per_ampere = [f"{1.5 * math.sqrt(2.0) * constants[key]:.4g}" for key in (low, high)]
        why = next(
            (
                f" They differ by {factor:.3f}, {how}."
                for factor, how in MISREADINGS.items()
                if abs(ratio / factor - 1.0) < 0.02
            ),
            " If both are printed so (hot magnets, saturation), leave one out.",
        )
        yield (
            f"has {low} and {high}, which make {' and '.join(per_ampere)} N·m to one ampere rms: {100 * (ratio - 1):.1f} % apart, "
            f"more than {100 * AGREEMENT:.0f} %.{why}"
        )

    def _pairs(self) -> float:
        return self.pole_pairs if self.pole_pairs is not None else (self.poles or 0) // 2

    def _one(self, forms: Forms) -> float | None:
        """The common value of a quantity, from the form that is given."""
        values = ((getattr(self, key), factor) for key, factor in forms.factors.items())
        return next((factor * value for value, factor in values if value is not None), None)

    def phase_values(self) -> PhaseValues:
        """The values in the quantities of the equations."""
        L_d, L_q = self._inductances()
        resistance = self._one(RESISTANCE)
        assert resistance is not None
        pairs = self._pairs()
        return PhaseValues(pairs, resistance, L_d, L_q, next(iter(self._constants().values())) / pairs)

    @property
    def continuous_current(self) -> float | None:
        """[A rms]"""
        return self._one(CONTINUOUS)

    @property
    def max_current(self) -> float | None:
        """[A rms]"""
        return self._one(LARGEST)


def _readings(key: str, value: Any) -> str:
    """Possible meanings of an ambiguous key."""
    forms = UNCLEAR[key]
    try:
        number = Unit(forms.unit).read(value)
        each = [f"{name} ({factor * number:.4g} {forms.common})" for name, factor in forms.factors.items()]
    except ValueError:
        each = list(forms.factors)
    return f"has {key} = {shown(value)}: {forms.question}? Write {' or '.join(each)}"
