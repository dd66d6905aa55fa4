// Exponential and fifth root of our own: those of the mathematical libraries differ by their last bits, like their
// sines.
#pragma once

#include <cmath>

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

// x^(-1/5) of x > 0, by Newton's method from a power of two below.
inline double inverse_fifth_root(double x) {
    int exponent = 0;
    std::frexp(x, &exponent);
    double y = std::ldexp(1.0, -static_cast<int>(std::floor(exponent / 5.0)) - 1);
    for (int k = 0; k < 11; ++k) y += 0.2 * y * (1.0 - x * (y * y) * (y * y) * y);
    return y;
}

}  // namespace lostmotion
