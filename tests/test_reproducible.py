"""Functions that give the same bits on every platform, against NumPy and SciPy; their errors are tested in the core."""

import math

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from lostmotion import reproducible as r

RANDOM = np.random.default_rng(5)
ULP = 2.0**-52  # relative, at most
ANGLES = np.concatenate([RANDOM.uniform(-20.0, 20.0, 2000), RANDOM.uniform(-1e9, 1e9, 200), [0.0, -0.0]])
POSITIVE = np.exp(RANDOM.uniform(-300.0, 300.0, 2000))
NEAR_ONE = RANDOM.uniform(0.1, 10.0, 2000)


# The functions of NumPy are good to 4 units in the last place or better.
@pytest.mark.parametrize(
    ("own", "other", "x", "units"),
    [
        (r.sin, np.sin, ANGLES, 5.0),
        (r.cos, np.cos, ANGLES, 5.0),
        (r.tan, np.tan, ANGLES, 7.0),
        (r.exp, np.exp, ANGLES[:2000], 6.0),
        (r.expm1, np.expm1, np.concatenate([ANGLES[:2000], 1e-9 * ANGLES]), 7.0),
        (r.log, np.log, POSITIVE, 6.0),
        (r.cbrt, np.cbrt, np.concatenate([POSITIVE, -POSITIVE]), 5.0),
    ],
)
def test_functions_of_one_number_are_those_of_numpy(own, other, x, units) -> None:
    wanted = other(x)
    assert np.all(np.abs(own(x) - wanted) <= units * ULP * np.abs(wanted))
    assert own(float(x[3])) == own(x)[3]
    assert isinstance(own(float(x[3])), float)
    assert own(x.reshape(2, -1)).shape == (2, x.size // 2)


def test_functions_of_two_numbers_are_those_of_numpy() -> None:
    y, x = RANDOM.uniform(-1.0, 1.0, (2, 2000))
    wanted = np.arctan2(y, x)
    assert np.all(np.abs(r.arctan2(y, x) - wanted) <= 6.0 * ULP * np.abs(wanted))
    assert r.arctan2(0.0, -1.0) == math.pi
    assert r.arctan(1.0) == math.pi / 4.0
    exponent = 3.0 * x
    bound = (6.0 + 3.0 * np.abs(exponent * np.log(NEAR_ONE))) * ULP
    assert np.all(np.abs(r.power(NEAR_ONE, exponent) / NEAR_ONE**exponent - 1.0) <= bound)
    assert r.log10(1000.0) == pytest.approx(3.0, rel=4.0 * ULP)


def test_ends_of_the_range() -> None:
    with np.errstate(all="ignore"):
        assert np.isnan(r.sin(np.array([np.nan, np.inf]))).all()
        assert r.exp(np.array([-np.inf, 800.0, -800.0])).tolist() == [0.0, math.inf, 0.0]
        assert r.log(np.array([0.0, np.inf])).tolist() == [-math.inf, math.inf]
        assert np.isnan(r.log(-1.0))
        assert r.power(np.array([0.0, 0.0]), np.array([2.0, 0.0])).tolist() == [0.0, 1.0]
    assert abs(r.sin(1e13)) <= 1.0


def test_straight_lines_are_those_of_numpy() -> None:
    points, values = np.cumsum(RANDOM.uniform(0.1, 1.0, 12)), RANDOM.normal(size=12)
    x = np.concatenate([RANDOM.uniform(-1.0, points[-1] + 1.0, 500), points])
    assert np.allclose(r.interpolate(x, points, values), np.interp(x, points, values), rtol=0.0, atol=1e-14)
    assert r.interpolate(points, points, values).tolist() == values.tolist()
    assert r.interpolate(5.0, [1.0], [7.0]) == 7.0


@pytest.mark.parametrize("points", [2, 3, 4, 5, 40])
@pytest.mark.parametrize("channels", [(), (3,)])
def test_cubic_splines_are_those_of_scipy(points: int, channels: tuple[int, ...]) -> None:
    times = np.cumsum(RANDOM.uniform(0.05, 1.0, points))
    values = RANDOM.normal(size=(points, *channels))
    # Slopes are rounded to about the condition of the system, below 10, times the values over the least interval.
    assert np.allclose(r.cubic_spline(times, values), CubicSpline(times, values).c[::-1], rtol=1e-10, atol=1e-9)


@pytest.mark.parametrize("n", [1, 2, 7, 16, 60, 97, 360, 1024])
def test_fourier_sums_are_those_of_numpy(n: int) -> None:
    x, y = RANDOM.normal(size=(2, n))
    real, imaginary = r.fourier_sum(x, y)
    wanted = n * np.fft.ifft(x + 1j * y)
    # Each of n terms is rounded a few times, of the size of the numbers summed.
    assert np.abs(real + 1j * imaginary - wanted).max() <= 4.0 * ULP * n * math.log2(n + 1)


def test_sums_are_made_one_by_one() -> None:
    """Python compensates `sum` from 3.12 on: 1 + 1e-16 + 1e-16 would be 1 + 2.2e-16."""
    assert r.total([1.0, 1e-16, 1e-16]) == 1.0
    assert r.total([0.1, 0.2], 0.3) == (0.3 + 0.1) + 0.2
