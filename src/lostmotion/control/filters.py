"""Filters of references and torques, as discrete-time systems."""

import math
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from .. import _core
from ..errors import InputError
from ..inputs import described
from ..inputs.arguments import checked
from ..reproducible import tan

MAX_ORDER = _core.MAX_FILTER_ORDER


class LowPass(described.LowPassFields):
    """1/(1 + s/w), or with a damping of second order, by Tustin's rule with the corner prewarped."""

    kind: Literal["low_pass"]

    def continuous(self) -> tuple[list[float], list[float]]:
        """Numerator and denominator in s/w, the highest power first."""
        return ([1.0], [1.0, 1.0]) if self.damping is None else ([1.0], [1.0, 2.0 * self.damping, 1.0])

    def discrete(self, sample_time: float) -> tuple[np.ndarray, np.ndarray]:
        """Numerator and denominator in z, the highest power first."""
        return prewarped(*self.continuous(), self.frequency, sample_time)


class Notch(described.NotchFields):
    """((s/w_z)^2 + 2 D_z s/w_z + 1)/((s/w_n)^2 + 2 D_n s/w_n + 1), by Tustin's rule with w_z prewarped."""

    kind: Literal["notch"]

    def continuous(self) -> tuple[list[float], list[float]]:
        """Numerator and denominator in s/w_z, the highest power first."""
        r = 1.0 if self.pole_frequency is None else self.frequency / self.pole_frequency
        return [1.0, 2.0 * self.depth, 1.0], [r * r, 2.0 * self.width * r, 1.0]

    def discrete(self, sample_time: float) -> tuple[np.ndarray, np.ndarray]:
        """Numerator and denominator in z, the highest power first."""
        return prewarped(*self.continuous(), self.frequency, sample_time)


class TransferFunction(described.TransferFunctionFields):
    """A transfer function in z at the sample time of its loop."""

    kind: Literal["transfer_function"] = "transfer_function"

    @model_validator(mode="after")
    def _can_be_computed(self) -> Self:
        if self.denominator[0] == 0.0:
            raise ValueError("has a denominator that begins with 0; leave the zero out")
        if len(self.numerator) > len(self.denominator):
            raise ValueError(
                "has more zeros than poles, so that it would need values of the future; lower the order of its numerator"
            )
        return self

    def discrete(self, sample_time: float) -> tuple[np.ndarray, np.ndarray]:
        """Numerator and denominator in z, the highest power first."""
        if self.sample_time is not None and not math.isclose(self.sample_time, sample_time, rel_tol=1e-9):
            raise InputError(
                f"has sample_time = {self.sample_time:g} s, but its loop runs every {sample_time:g} s; make it for that sample time"
            )
        return np.array(self.numerator), np.array(self.denominator)


Filter = Annotated[LowPass | Notch | TransferFunction, Field(discriminator="kind")]


def prewarped(
    numerator: list[float], denominator: list[float], frequency: float, sample_time: float
) -> tuple[np.ndarray, np.ndarray]:
    """Tustin's rule, s/w = (z - 1)/(z + 1)/tan(w T/2), under which both have the same value at w.

    Raises
    ------
    InputError
        The frequency is not below half the sampling frequency.
    """
    if not frequency < 0.5 / sample_time:
        raise InputError(
            f"has frequency = {frequency:g} Hz, but its loop samples at {1.0 / sample_time:g} Hz; it must be below half of that"
        )
    c = 1.0 / tan(math.pi * frequency * sample_time)
    order = len(denominator) - 1

    def in_z(coefficients: list[float]) -> np.ndarray:
        total = np.zeros(order + 1)
        factor = 1.0
        for power, a in enumerate(reversed(coefficients)):
            term = np.array([a * factor])
            for sign in [-1.0] * power + [1.0] * (order - power):  # times z + sign
                term = np.append(term, 0.0) + sign * np.append(0.0, term)
            total += term
            factor *= c
        return total

    return in_z(numerator), in_z(denominator)


@checked
def as_filter(system: "Any") -> TransferFunction:
    """Convert a discrete-time system of scipy or python-control to a filter.

    Parameters
    ----------
    system : scipy.signal.dlti or control.LTI
        Transfer function, poles and zeros, or state space, with one input, one output and the sample time `dt` [s].

    Returns
    -------
    TransferFunction
        The filter, with numerator and denominator in powers of z.

    Raises
    ------
    InputError
        The system is of continuous time, has several inputs or outputs, or is too large.

    Examples
    --------
    >>> from scipy.signal import dlti
    >>> import lostmotion as lm
    >>> lm.control.as_filter(dlti([0.5], [1.0, -0.5], dt=1e-3)).denominator
    (1.0, -0.5)
    """
    dt = getattr(system, "dt", None)
    if not isinstance(dt, float | int) or isinstance(dt, bool) or not dt > 0.0:
        raise InputError(
            "system: has no sample time dt above 0; discretise it first, such as by scipy.signal.cont2discrete or control.c2d"
        )
    if hasattr(system, "ninputs"):  # python-control
        import control

        tf = control.tf(system)
        if (tf.ninputs, tf.noutputs) != (1, 1):
            raise InputError(f"system: has {tf.ninputs} inputs and {tf.noutputs} outputs; give one of each")
        numerator, denominator = tf.num[0][0], tf.den[0][0]
    else:  # scipy, whose state space has a row for each output
        tf = system.to_tf()
        numerator, denominator = np.squeeze(tf.num), np.atleast_1d(tf.den)
    numerator = np.atleast_1d(numerator)
    if np.ndim(numerator) != 1:
        raise InputError("system: has several inputs or outputs; give one of each")
    return TransferFunction(
        numerator=tuple(map(float, numerator)), denominator=tuple(map(float, denominator)), sample_time=float(dt)
    )


def companion(numerator: np.ndarray, denominator: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """A, B, C, D of a transfer function in z, in controllable form."""
    n = len(denominator) - 1
    a = denominator / denominator[0]
    b = np.concatenate([np.zeros(n + 1 - len(numerator)), numerator]) / denominator[0]
    A = np.eye(n, k=-1)
    A[:1] = -a[1:]
    B = np.eye(n, 1).ravel()
    return A, B, b[1:] - b[0] * a[1:], float(b[0])


def core_filter(filter: LowPass | Notch | TransferFunction, sample_time: float) -> dict[str, Any]:
    """The solver's system."""
    A, B, C, D = companion(*filter.discrete(sample_time))
    return {"A": A.ravel().tolist(), "B": B.tolist(), "C": C.tolist(), "D": D}
