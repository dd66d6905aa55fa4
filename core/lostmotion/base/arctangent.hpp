// Arctangent of our own, for the same bits everywhere; as sine.hpp.
//
// For 0 <= t <= 1 the nearest multiple c of 1/8 splits it: atan t = atan c + atan((t - c)/(1 + t c)), the argument of
// the second being at most 1/16, whose Taylor series to the 17th power leaves out less than 1e-24. atan c is a sum of
// two numbers. Beyond 1 it is pi/2 - atan(1/t). The error is below 1.5 units in the last place.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "double_double.hpp"

namespace lostmotion {

namespace arctangent_table {

// atan(k/8), rounded, and what the rounding left.
inline constexpr std::array<double, 9> high = {
    0x0p+0,
    0x1.fd5ba9aac2f6ep-4,
    0x1.f5b75f92c80ddp-3,
    0x1.6f61941e4def1p-2,
    0x1.dac670561bb4fp-2,
    0x1.1e00babdefeb4p-1,
    0x1.4978fa3269ee1p-1,
    0x1.700a7c5784634p-1,
    0x1.921fb54442d18p-1,
};
inline constexpr std::array<double, 9> low = {
    0x0p+0,
    -0x1.cd37686760c17p-59,
    0x1.8ab6e3cf7afbdp-57,
    -0x1.c63aae6f6e918p-56,
    0x1.a2b7f222f65e2p-56,
    -0x1.928df287a668fp-58,
    0x1.2419a87f2a458p-56,
    -0x1.8c34d25aadef6p-56,
    0x1.1a62633145c07p-55,
};
inline constexpr DoubleDouble exact_half_pi{0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54};
inline constexpr DoubleDouble exact_pi{0x1.921fb54442d18p+1, 0x1.1a62633145c07p-53};

// atan(r) - r, |r| <= 1/16.
inline double beyond_linear(double r) {
    const double q = r * r;
    double sum = 0.0;
    for (int n = 17; n >= 3; n -= 2) sum = q * (1.0 / n - sum);
    return -r * sum;
}

// atan(a/b), 0 <= a <= b, b > 0.
inline DoubleDouble up_to_one(double a, double b) {
    const double t = a / b;
    const double rest = std::fma(-t, b, a) / b;  // of the quotient
    const auto k = static_cast<std::size_t>(std::floor(8.0 * t + 0.5));
    const double c = 0.125 * static_cast<double>(k);
    const double numerator = t - c, denominator = 1.0 + t * c;  // t - c is exact
    const double r = numerator / denominator;
    const double r_rest =
        (std::fma(-r, denominator, numerator) - r * std::fma(t, c, 1.0 - denominator) + rest) / denominator;
    return {high[k], r + (low[k] + (beyond_linear(r) + r_rest))};
}

}  // namespace arctangent_table

// Angle of the point (x, y) [rad], from -pi to pi; 0 or pi, with the sign of y, where y is 0.
inline double arctangent(double y, double x) {
    using namespace arctangent_table;
    if (std::isnan(x) || std::isnan(y)) return x + y;
    double a = std::fabs(y), b = std::fabs(x);
    if (std::isinf(a) || std::isinf(b)) {
        a = std::isinf(a) ? 1.0 : 0.0;
        b = std::isinf(b) ? 1.0 : 0.0;
    }
    // So that no quotient and no rest of one is lost to the ends of the range.
    const double largest = std::fmax(a, b);
    if (largest == 0.0) return std::copysign(std::signbit(x) ? exact_pi.high : 0.0, y);
    int exponent = 0;
    std::frexp(largest, &exponent);
    a = std::ldexp(a, -exponent);
    b = std::ldexp(b, -exponent);
    const bool steep = a > b, left = std::signbit(x);
    DoubleDouble angle = steep ? up_to_one(b, a) : up_to_one(a, b);
    if (steep)
        angle = exact_half_pi + (left ? angle : -angle);
    else if (left)
        angle = exact_pi + -angle;
    return std::copysign(angle.high + angle.low, y);
}

}  // namespace lostmotion
