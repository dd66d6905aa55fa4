// Polynomials in place of a guard: over one event check the cubic Hermite interpolant, enclosed by its Bernstein
// coefficients; near its zero the Taylor series.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "vec.hpp"

namespace lostmotion {

// Cubic on [0, 1] in Bernstein form, from values and slopes at both ends of an interval of length h.
struct Cubic {
    double c0, c1, c2, c3;

    Cubic(double value, double slope, double end_value, double end_slope, double h)
        : c0(value), c1(value + h / 3.0 * slope), c2(end_value - h / 3.0 * end_slope), c3(end_value) {}

    double min() const { return std::min(std::min(c0, c1), std::min(c2, c3)); }  // a lower bound
    double operator()(double s) const {
        const double r = 1.0 - s;
        return r * r * (r * c0 + 3.0 * s * c1) + s * s * (3.0 * r * c2 + s * c3);
    }
    double slope(double s) const {
        const double r = 1.0 - s;
        return 3.0 * (r * r * (c1 - c0) + 2.0 * r * s * (c2 - c1) + s * s * (c3 - c2));
    }
    // Where on [0, 1] it is least.
    double lowest_at() const {
        const double d0 = c1 - c0, d1 = c2 - c1, d2 = c3 - c2;
        double best = (*this)(1.0) < (*this)(0.0) ? 1.0 : 0.0;
        // Zeros of the slope, (d0 - 2 d1 + d2) s^2 + 2 (d1 - d0) s + d0, in the form that does not cancel.
        const double a = d0 - 2.0 * d1 + d2, b = d1 - d0, discriminant = b * b - a * d0;
        if (discriminant < 0.0) return best;
        const double q = -(b + std::copysign(std::sqrt(discriminant), b));
        for (const double s : {q / a, d0 / q})
            if (s > 0.0 && s < 1.0 && (*this)(s) < (*this)(best)) best = s;
        return best;
    }
    // Zero between 0, where it is positive, and `b`, where it is negative, to two or three digits: Halley's method,
    // kept in its bracket by bisection.
    double zero(double b) const {
        // By powers, for the sake of speed: c0 + z (a1 + z (a2 + z a3)).
        const double a1 = 3.0 * (c1 - c0), a2 = 3.0 * (c0 - 2.0 * c1 + c2), a3 = c3 - c0 + 3.0 * (c1 - c2);
        double a = 0.0, z = 0.5 * b;
        if (b == 1.0) z = std::clamp(c0 / (c0 - c3), 0.25, 0.75);
        for (int k = 0; k < 60; ++k) {
            const double value = c0 + z * (a1 + z * (a2 + z * a3)), slope = a1 + z * (2.0 * a2 + z * (3.0 * a3));
            (value > 0.0 ? a : b) = z;
            const double half_curvature = a2 + 3.0 * (z * a3);
            const double next = z - value * slope / (slope * slope - value * half_curvature);
            const double moved = std::fabs(next - z);
            const bool inside = next > a && next < b;
            z = inside ? next : 0.5 * (a + b);
            if ((inside && moved < 0.1 * z) || b - a < 1e-9) break;
        }
        return z;
    }
};

// Polynomial of degree 12, four coefficients at once.
class Polynomial {
 public:
    static constexpr int degree = 12, parts = degree / 4;

    explicit Polynomial(double constant) : constant_(constant) {}
    std::array<Pack<4>, parts> part;  // the coefficients from the first degree on

    double value(double z) const { return constant_ + z * sum(part, z); }
    double slope(double z) const {
        return sum(scaled({1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0}), z);
    }
    // Half the second derivative, by its first terms.
    double half_curvature(double z) const { return part[0][1] + z * (3.0 * part[0][2] + z * (6.0 * part[0][3])); }

 private:
    std::array<Pack<4>, parts> scaled(const std::array<double, degree>& by) const {
        std::array<Pack<4>, parts> out;
        for (int p = 0; p < parts; ++p) out[p] = part[p] * Pack<4>::load(&by[4 * p]);
        return out;
    }
    // c[0] + c[1] z + ... + c[11] z^11
    static double sum(const std::array<Pack<4>, parts>& c, double z) {
        const double z2 = z * z, z4 = z2 * z2;
        const Pack<4> t = (c[0] + z4 * c[1]) + (z4 * z4) * c[2];
        return (t[0] + t[1] * z) + (t[2] + t[3] * z) * z2;
    }

    double constant_;
};

}  // namespace lostmotion
