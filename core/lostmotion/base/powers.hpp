// Exponential, powers and roots of our own: those of the mathematical libraries differ by their last bits, like their
// sines.
#pragma once

#include <cmath>
#include <limits>

#include "logarithm.hpp"

namespace lostmotion {

// e^x, to about one unit in the last place: x = k ln 2 + r with |r| <= ln(2)/2, then the Taylor series of r to r^13,
// whose next term is below 5e-18.
inline double exponential(double x) {
    constexpr double ln_2 = 0x1.62e42feep-1, rest = 0x1.a39ef35793c76p-33;  // 32 bits, so that k ln_2 is exact
    const double k = std::nearbyint(x * 0x1.71547652b82fep+0);
    const double r = (x - k * ln_2) - k * rest;
    double sum = 1.0;
    for (int n = 13; n > 0; --n) sum = 1.0 + r / n * sum;
    return std::ldexp(sum, static_cast<int>(k));
}

// e^x - 1, to three units in the last place: for |x| <= 1 the series without its 1, beyond it the difference, which at
// worst doubles the error of the exponential.
inline double exponential_minus_one(double x) {
    if (std::fabs(x) > 1.0) return exponential(x) - 1.0;
    double sum = 0.0;
    for (int n = 20; n > 1; --n) sum = x / n * (1.0 + sum);
    return x + x * sum;
}

// x^y of a finite x > 0, to 2 + 3 |y log x| units in the last place: the relative error of the exponential is the
// absolute one of its argument.
inline double power(double x, double y) {
    const double exponent = y * logarithm(x);
    if (exponent > 710.0) return std::numeric_limits<double>::infinity();
    return exponent < -746.0 ? 0.0 : exponential(exponent);
}

// The cube root, to 0.7 units in the last place: Halley's method on the mantissa, the last step with the rest of the
// cube by fused multiply-add.
inline double cube_root(double x) {
    if (x == 0.0 || !std::isfinite(x)) return x;
    int exponent = 0;
    double m = std::frexp(std::fabs(x), &exponent);
    const int third = static_cast<int>(std::floor(exponent / 3.0));
    m = std::ldexp(m, exponent - 3 * third);  // from 1/2 to 4
    double y = 0.5 + 0.375 * m - 0.03 * m * m;
    for (int k = 0; k < 5; ++k) {
        const double cube = y * y * y;
        y *= (cube + 2.0 * m) / (2.0 * cube + m);
    }
    const double square = y * y, rest_of_square = std::fma(y, y, -square);
    const double left = std::fma(-square, y, m) - rest_of_square * y;
    y += left / (3.0 * square);
    return std::copysign(std::ldexp(y, third), x);
}

// x^(-1/5) of x > 0, by Newton's method from a power of two below.
inline double inverse_fifth_root(double x) {
    int exponent = 0;
    std::frexp(x, &exponent);
    double y = std::ldexp(1.0, -static_cast<int>(std::floor(exponent / 5.0)) - 1);
    for (int k = 0; k < 11; ++k) y += 0.2 * y * (1.0 - x * (y * y) * (y * y) * y);
    return y;
}

}  // namespace lostmotion
