"""Filters of references and torques, as discrete-time systems."""

import math
from collections.abc import Iterator
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from .. import _core
from ..errors import InputError
from ..inputs import core_parameters
from ..inputs.argument_checks import checked
from ..inputs.part import rule


class LowPass(core_parameters.LowPassFields):
    """1/(1 + s/w), or with a damping of second order, by Tustin's rule with the corner prewarped."""

    kind: Literal["low_pass"]


class Notch(core_parameters.NotchFields):
    """((s/w_z)^2 + 2 D_z s/w_z + 1)/((s/w_n)^2 + 2 D_n s/w_n + 1), by Tustin's rule with w_z prewarped."""

    kind: Literal["notch"]


class TransferFunction(core_parameters.TransferFunctionFields):
    """A transfer function in z at the sample time of its loop."""

    kind: Literal["transfer_function"] = "transfer_function"

    @rule
    def _can_be_computed(self) -> Iterator[str]:
        if self.denominator[0] == 0.0:
            yield "has a denominator that begins with 0; leave the zero out"
        if len(self.numerator) > len(self.denominator):
            yield "has more zeros than poles, so that it would need values of the future; lower the order of its numerator"


Filter = Annotated[LowPass | Notch | TransferFunction, Field(discriminator="kind")]


def discrete(
    filter: LowPass | Notch | TransferFunction, sample_time: float
) -> tuple[list[float], list[float], dict[str, Any]]:
    """Numerator and denominator in z, the highest power first, and the solver's system.

    Raises InputError: the filter was made for another sample time, or its frequency is not below half the sampling frequency.
    """
    if not isinstance(filter, TransferFunction):
        if not filter.frequency < 0.5 / sample_time:
            raise InputError(
                f"has frequency = {filter.frequency:g} Hz, but its loop samples at {1.0 / sample_time:g} Hz; it must be below half of that"
            )
    elif filter.sample_time is not None and not math.isclose(filter.sample_time, sample_time, rel_tol=1e-9):
        raise InputError(
            f"has sample_time = {filter.sample_time:g} s, but its loop runs every {sample_time:g} s; make it for that sample time"
        )
    return _core.discrete_filter(filter.model_dump(), sample_time)


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
