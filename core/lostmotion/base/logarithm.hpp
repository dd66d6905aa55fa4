// Natural logarithm of our own, for the same bits everywhere; as sine.hpp.
//
// x = 2^k m with sqrt(1/2) <= m < sqrt 2, then log m = 2 artanh s = 2 (s + s^3/3 + ... ), s = (m - 1)/(m + 1), |s| <
// 0.172: the first term left out, s^23/23, is below 2e-19. The error is below 2 units in the last place.
#pragma once

#include <cmath>

namespace lostmotion {

// Of a finite x > 0.
inline double logarithm(double x) {
    int k = 0;
    double m = std::frexp(x, &k);
    if (m < 0x1.6a09e667f3bcdp-1) {
        m *= 2.0;
        --k;
    }
    const double s = (m - 1.0) / (m + 1.0), q = s * s;
    double tail = 0.0;
    for (int n = 21; n >= 3; n -= 2) tail = q * (tail + 1.0 / n);
    // log 2 in two pieces, the product of the first of which with k is exact.
    constexpr double upper = 0x1.62e42fefap-1, lower = 0x1.cf79abc9e3b3ap-40;
    return k * upper + (2.0 * s + (2.0 * s * tail + k * lower));
}

}  // namespace lostmotion
