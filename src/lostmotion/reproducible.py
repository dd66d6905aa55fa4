"""Numerical functions that give the same bits on every platform.

NumPy and the C library round sines, logarithms and powers differently from processor to processor. Whatever Python derives
from a scenario before the core sees it uses these functions, the operations + - * / and the square root, which are correctly
rounded everywhere. The error of each function is stated in ``core/lostmotion/kernel`` and tested there against quadruple
precision.

The order of operations or the use of fused multiply-add of some functions depends on the library. Not used here are
``np.dot``, ``@``, ``np.einsum``, ``np.convolve``, ``np.interp``, ``np.fft``, complex products, powers (``**``) of
floats, and ``sum`` of a list of floats. Python compensates the latter from version 3.12 on.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable
from functools import reduce
from typing import Any, overload

import numpy as np

from . import _core
from .recorded_numbers import Recorded, of_function

Numbers = float | np.ndarray

FARTHEST = 2.0**42  # [rad] up to which the core's sine reduces its argument


def _of_one(function: Callable[[np.ndarray], np.ndarray], x: Any) -> Any:
    if isinstance(x, Recorded):
        return of_function(function.__name__, lambda value: _of_one(function, value), x)
    values = np.ascontiguousarray(x, dtype=float)
    out = function(values)
    return out if np.ndim(x) else float(out.reshape(-1)[0])


def _of_two(function: Callable[[np.ndarray, np.ndarray], np.ndarray], a: Any, b: Any) -> Any:
    if isinstance(a, Recorded) and b == 1.0:
        return of_function(function.__name__, lambda value: _of_two(function, value, b), a)
    first, second = np.broadcast_arrays(np.asarray(a, float), np.asarray(b, float))
    out = function(np.ascontiguousarray(first), np.ascontiguousarray(second))
    return out if first.ndim else float(out.reshape(-1)[0])


def _within_reach(x: Any) -> Any:
    """The remainder of a turn where an angle is so large that its last digit is a thousandth of a radian."""
    if isinstance(x, Recorded):
        return x
    angle = np.asarray(x, float)
    far = np.isfinite(angle) & (np.abs(angle) >= FARTHEST)
    return np.where(far, np.fmod(angle, 2.0 * math.pi), angle) if np.any(far) else x


@overload
def sin(x: float) -> float: ...
@overload
def sin(x: np.ndarray) -> np.ndarray: ...
def sin(x: Any) -> Any:
    """Sine of an angle [rad], to 0.8 units in the last place."""
    return _of_one(_core.sine, _within_reach(x))


@overload
def cos(x: float) -> float: ...
@overload
def cos(x: np.ndarray) -> np.ndarray: ...
def cos(x: Any) -> Any:
    """Cosine of an angle [rad], to 0.8 units in the last place."""
    return _of_one(_core.cosine, _within_reach(x))


@overload
def tan(x: float) -> float: ...
@overload
def tan(x: np.ndarray) -> np.ndarray: ...
def tan(x: Any) -> Any:
    """Tangent of an angle [rad], to 2.5 units in the last place."""
    return sin(x) / cos(x)


@overload
def arctan2(y: float, x: float) -> float: ...
@overload
def arctan2(y: np.ndarray, x: Numbers) -> np.ndarray: ...
def arctan2(y: Any, x: Any) -> Any:
    """Angle of the point (x, y) [rad], from -pi to pi, to 1.5 units in the last place."""
    return _of_two(_core.arctangent, y, x)


def arctan(x: float) -> float:
    """Arctangent [rad], to 1.5 units in the last place."""
    return arctan2(x, 1.0)


@overload
def exp(x: float) -> float: ...
@overload
def exp(x: np.ndarray) -> np.ndarray: ...
def exp(x: Any) -> Any:
    """Exponential, to 1.1 units in the last place."""
    return _of_one(_core.exponential, x)


@overload
def expm1(x: float) -> float: ...
@overload
def expm1(x: np.ndarray) -> np.ndarray: ...
def expm1(x: Any) -> Any:
    """Exponential less one, to 3 units in the last place."""
    return _of_one(_core.exponential_minus_one, x)


@overload
def log(x: float) -> float: ...
@overload
def log(x: np.ndarray) -> np.ndarray: ...
def log(x: Any) -> Any:
    """Natural logarithm, to 2 units in the last place; nan below 0."""
    return _of_one(_core.logarithm, x)


def sqrt(x: float) -> float:
    """Square root, correctly rounded."""
    return of_function("root", math.sqrt, x)


def log10(x: float) -> float:
    """Decimal logarithm, to 3 units in the last place."""
    return log(x) / log(10.0)


@overload
def cbrt(x: float) -> float: ...
@overload
def cbrt(x: np.ndarray) -> np.ndarray: ...
def cbrt(x: Any) -> Any:
    """Cube root, to 0.7 units in the last place."""
    return _of_one(_core.cube_root, x)


@overload
def power(x: float, y: float) -> float: ...
@overload
def power(x: np.ndarray, y: Numbers) -> np.ndarray: ...
def power(x: Any, y: Any) -> Any:
    """x^y for x >= 0, to 2 + 3 |y log x| units in the last place; nan below 0."""
    return _of_two(_core.power, x, y)


@overload
def interpolate(x: float, points: Any, values: Any) -> float: ...
@overload
def interpolate(x: np.ndarray, points: Any, values: Any) -> np.ndarray: ...
def interpolate(x: Any, points: Any, values: Any) -> Any:
    """Straight lines between rising points; the first and the last value hold outside."""
    p, v = np.asarray(points, float), np.asarray(values, float)
    if p.size == 1:
        return np.full(np.shape(x), v[0]) if np.ndim(x) else float(v[0])
    inside = np.clip(np.asarray(x, float), p[0], p[-1])
    k = np.clip(np.searchsorted(p, inside, side="right") - 1, 0, p.size - 2)
    out = np.where(inside == p[k + 1], v[k + 1], v[k] + (v[k + 1] - v[k]) / (p[k + 1] - p[k]) * (inside - p[k]))
    return out if np.ndim(x) else float(out)


def cubic_spline(times: Iterable[float], values: np.ndarray) -> np.ndarray:
    """Cubic spline whose third derivative is continuous at the second point and at the last but one.

    Its slopes s solve, with h the intervals and d the slopes of the chords (de Boor 1978, ch. IV),
    ``h[k] s[k-1] + 2 (h[k-1] + h[k]) s[k] + h[k-1] s[k+1] = 3 (h[k] d[k-1] + h[k-1] d[k])`` at the inner points. Elimination
    needs no exchange of rows, since every pivot is positive. Three points give a parabola, two a straight line.

    times: rising instants [s], two at least.
    values: (n,) or (n, channels).

    Returns (4, n - 1, ...): value, first derivative, half the second and a sixth of the third at the beginning of each
        interval.
    """
    t, y = np.asarray(list(times), float), np.asarray(values, float)
    n = t.size
    h = np.diff(t).reshape(-1, *[1] * (y.ndim - 1))
    d = np.diff(y, axis=0) / h
    s = _slopes_of_few(h, d) if n < 4 else _slopes(h, d)
    bend = (s[:-1] + s[1:] - 2.0 * d) / h
    return np.array([y[:-1], s[:-1], (d - s[:-1]) / h - bend, bend / h])


def _slopes_of_few(h: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Slopes of the straight line through two points, or of the parabola through three."""
    bend = (d[-1] - d[0]) / (h[-1] + h[0])
    return np.array([d[0] - h[0] * bend, *(d + h * bend)])


def _slopes(h: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Slopes of a cubic spline at its points, from its intervals and the slopes of its chords."""
    n = len(h) + 1
    diagonal, upper, right = np.empty((n, *h.shape[1:])), np.zeros((n, *h.shape[1:])), np.empty((n, *d.shape[1:]))
    first, last = h[0] + h[1], h[-1] + h[-2]
    diagonal[0], upper[0] = h[1], first
    right[0] = ((h[0] + 2.0 * first) * h[1] * d[0] + h[0] * h[0] * d[1]) / first
    for k in range(1, n - 1):
        factor = h[k] / diagonal[k - 1]
        diagonal[k], upper[k] = 2.0 * (h[k - 1] + h[k]) - factor * upper[k - 1], h[k - 1]
        right[k] = 3.0 * (h[k] * d[k - 1] + h[k - 1] * d[k]) - factor * right[k - 1]
    factor = last / diagonal[-2]
    diagonal[-1] = h[-2] - factor * upper[-2]
    end = (h[-1] * h[-1] * d[-2] + (2.0 * last + h[-1]) * h[-2] * d[-1]) / last
    s = np.empty_like(right)
    s[-1] = (end - factor * right[-2]) / diagonal[-1]
    for k in range(n - 2, -1, -1):
        s[k] = (right[k] - upper[k] * s[k + 1]) / diagonal[k]
    return s


def total(values: Iterable[float], start: float = 0.0) -> float:
    """Sum in the order given, each addition rounded."""
    return reduce(operator.add, values, start)


def fourier_sum(real: np.ndarray, imaginary: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sums over k of ``(real[k] + i imaginary[k]) exp(2 pi i j k/n)`` for j from 0 to n - 1, along the last axis.

    Mixed-radix algorithm (Cooley and Tukey 1965); its cost grows with the sum of the prime factors of n.

    real, imaginary: (..., n).

    Returns Real and imaginary parts, (..., n).
    """
    n = real.shape[-1]
    angle = 2.0 * math.pi * np.arange(n) / n
    return _fourier_sum(real, imaginary, cos(angle), sin(angle))


def _fourier_sum(
    real: np.ndarray, imaginary: np.ndarray, c: np.ndarray, s: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The sum with the cosines and sines of all multiples of ``2 pi/n``."""
    n = real.shape[-1]
    p = next((q for q in range(2, math.isqrt(n) + 1) if n % q == 0), n)
    m = n // p
    if m > 1:  # every p-th term, for each remainder
        split = [np.ascontiguousarray(np.moveaxis(x.reshape(*x.shape[:-1], m, p), -1, 0)) for x in (real, imaginary)]
        parts = _fourier_sum(split[0], split[1], c[::p], s[::p])
    else:
        parts = np.moveaxis(real, -1, 0)[..., None], np.moveaxis(imaginary, -1, 0)[..., None]
    out_real, out_imaginary = np.zeros((2, *real.shape))
    j = np.arange(n)
    for r in range(p):
        at = r * j % n
        x, y = (np.tile(part[r], p) for part in parts)
        out_real += x * c[at] - y * s[at]
        out_imaginary += x * s[at] + y * c[at]
    return out_real, out_imaginary
