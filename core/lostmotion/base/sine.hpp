// Sine and cosine of our own: those of the mathematical libraries differ by their last bits from system to system, and
// between processors with and without fused multiply-add.
//
// x = q pi/2 + r + tail with |r| <= pi/4 (Cody and Waite 1980), then the Taylor series of r to r^17 and r^16, whose
// next terms are below 3e-18. The error is below 0.8 units in the last place.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace lostmotion {

struct SineCosine {
    double sin, cos;
};

namespace sine_series {

// pi/2 in pieces: two of 33 bits, whose products with q below 2^19 are exact, and what is left of it; and in three
// whole numbers.
inline constexpr double cut_1 = 0x1.921fb544p+0, cut_2 = 0x1.0b4611a6p-34, cut_3 = 0x1.3198a2e037073p-69;
inline constexpr double whole_1 = 0x1.921fb54442d18p+0, whole_2 = 0x1.1a62633145c07p-54,
                        whole_3 = -0x1.f1976b7ed8fbcp-110;

// (-1)^k / (2 k + first)!
inline constexpr auto coefficients = [](int first) {
    std::array<double, 9> c{};
    double factorial = 1.0;
    for (int n = 1, k = 0; k < 9; ++n) {
        if (n > 1) factorial *= n;
        if (n < first || (n - first) % 2 != 0) continue;
        c[static_cast<std::size_t>(k)] = (k % 2 == 0 ? 1.0 : -1.0) / factorial;
        ++k;
    }
    return c;
};

inline constexpr std::array<double, 9> odd = coefficients(1), even = coefficients(2);

// c[k] + c[k + 1] z + ... + c[k + 6] z^6, in pairs.
inline double seven(const std::array<double, 9>& c, std::size_t k, double z) {
    const double z2 = z * z;
    return ((c[k] + c[k + 1] * z) + (c[k + 2] + c[k + 3] * z) * z2) +
           ((c[k + 4] + c[k + 5] * z) + c[k + 6] * z2) * (z2 * z2);
}

}  // namespace sine_series

// x: [rad], magnitude below 2^42.
inline SineCosine sine_cosine(double x) {
    using namespace sine_series;
    const double q = (x * 0x1.45f306dc9c883p-1 + 0x1.8p52) - 0x1.8p52;  // to the nearest whole number
    double first, second, rest;
    if (std::fabs(q) < 0x1p19) {
        first = x - q * cut_1;
        second = q * cut_2;
        rest = q * cut_3;
    } else {
        first = std::fma(-q, whole_1, x);
        second = q * whole_2;
        rest = std::fma(q, whole_2, -second) + q * whole_3;
    }
    const double near = first - second;
    rest = ((first - near) - second) - rest;
    const double r = near + rest, tail = (near - r) + rest;

    const double z = r * r, half = 0.5 * z, one = 1.0 - half;
    // sin(r + tail) = r + (r^3 (-1/3! + ...) + tail cos r), cos(r + tail) = 1 - r^2/2 + (r^4 (1/4! - ...) - tail r)
    const double sin = r + (r * z * (odd[1] + z * seven(odd, 2, z)) + tail * one);
    const double cos = one + (((1.0 - one) - half) + (-(z * z) * seven(even, 1, z) - tail * r));
    switch (static_cast<std::int64_t>(q) & 3) {
        case 0: return {sin, cos};
        case 1: return {cos, -sin};
        case 2: return {-sin, -cos};
        default: return {-cos, sin};
    }
}

}  // namespace lostmotion
