// Truncated power series in quadruple precision, and their first zero.
#pragma once

#include <quadmath.h>

#include <array>
#include <cmath>

namespace lostmotion::test::referee {

__extension__ typedef __float128 Quad;

inline constexpr int order = 48;  // of the Taylor series

inline Quad magnitude(Quad a) { return a < 0 ? -a : a; }
inline Quad larger(Quad a, Quad b) { return a < b ? b : a; }

// c[0] + c[1] s + ... + c[order] s^order
struct Series : std::array<Quad, order + 1> {
    Series() { fill(0); }
    explicit Series(Quad constant) : Series() { (*this)[0] = constant; }
};

inline Series operator+(Series a, const Series& b) {
    for (int k = 0; k <= order; ++k) a[k] += b[k];
    return a;
}
inline Series operator-(Series a, const Series& b) {
    for (int k = 0; k <= order; ++k) a[k] -= b[k];
    return a;
}
inline Series operator*(Quad factor, Series a) {
    for (Quad& c : a) c *= factor;
    return a;
}
inline Series operator+(Series a, Quad b) {
    a[0] += b;
    return a;
}
inline Series operator-(Series a, Quad b) { return a + (-b); }
inline Series operator-(const Series& a) { return Quad(-1) * a; }

inline Quad value(const Series& c, Quad s) {
    Quad sum = 0;
    for (int k = order; k >= 0; --k) sum = sum * s + c[k];
    return sum;
}
inline Series derivative(const Series& c) {
    Series d;
    for (int k = 0; k < order; ++k) d[k] = (k + 1) * c[k + 1];
    return d;
}
// c(h s)
inline Series stretched(Series c, Quad h) {
    Quad power = 1;
    for (Quad& a : c) {
        a *= power;
        power *= h;
    }
    return c;
}
// c / s^m for a series that begins with s^m.
inline Series without_zeros(const Series& c, int m) {
    Series d;
    for (int k = m; k <= order; ++k) d[k - m] = c[k];
    return d;
}
inline Quad sum_of_magnitudes(const Series& c) {
    Quad sum = 0;
    for (const Quad a : c) sum += magnitude(a);
    return sum;
}

// Coefficients b_j = sum_{k <= j} C(j,k)/C(n,k) c_k on [0, 1]: the polynomial lies within their hull there.
template <class Real>
std::array<Real, order + 1> bernstein(const Series& c) {
    std::array<Real, order + 1> b;
    Real choose = 1;  // C(n,k)
    for (int k = 0; k <= order; ++k) {
        b[k] = static_cast<Real>(c[k]) / choose;
        choose = choose * (order - k) / (k + 1);
    }
    for (int r = 1; r <= order; ++r)
        for (int j = order; j >= r; --j) b[j] += b[j - 1];
    return b;
}

inline constexpr double nowhere = 2.0;

class FirstZero {
 public:
    // Of p on [0, 1], where p > 0 just after 0 and |p| <= tolerance counts as zero: where it falls through zero or
    // touches it; `nowhere` if it does neither.
    static Quad of(const Series& p, Quad tolerance) {
        // Most guards are far from zero, which double precision can certify.
        const auto rough = bernstein<double>(p);
        const double doubt = 1e-11 * static_cast<double>(sum_of_magnitudes(p)) + static_cast<double>(tolerance);
        bool positive = true;
        for (const double b : rough) positive = positive && b > doubt;
        if (positive) return nowhere;
        return FirstZero(p, tolerance).search(bernstein<Quad>(p), 0, 1);
    }

 private:
    using Bernstein = std::array<Quad, order + 1>;

    FirstZero(const Series& p, Quad tolerance)
        : p_(p), d1_(derivative(p)), d2_(derivative(d1_)), d3_(derivative(d2_)), tolerance_(tolerance) {}

    Quad search(const Bernstein& b, Quad from, Quad width) const {
        Quad least = b[0], greatest = b[0];
        bool falling = true;
        for (int j = 1; j <= order; ++j) {
            least = b[j] < least ? b[j] : least;
            greatest = b[j] > greatest ? b[j] : greatest;
            falling = falling && b[j] <= b[j - 1];
        }
        if (least > tolerance_) return nowhere;
        if ((greatest <= tolerance_ && least >= -tolerance_) || width < 1e-25) return settled(from + width / 2);
        if (greatest <= tolerance_) return from;  // zero there, and negative from there on
        if (falling && b[order] < -tolerance_ && b[0] > tolerance_) return crossing(from, from + width);

        // de Casteljau: halve the interval.
        Bernstein left, right = b;
        left[0] = b[0];
        for (int r = 1; r <= order; ++r) {
            for (int j = 0; j <= order - r; ++j) right[j] = (right[j] + right[j + 1]) / 2;
            left[r] = right[0];
        }
        const Quad first = search(left, from, width / 2);
        return first <= 1 ? first : search(right, from + width / 2, width / 2);
    }

    // The zero in a bracket over which p falls.
    Quad crossing(Quad a, Quad b) const {
        Quad s = (a + b) / 2;
        for (int n = 0; n < 400; ++n) {
            const Quad p = value(p_, s);
            (p > 0 ? a : b) = s;
            const Quad newton = s - p / value(d1_, s);
            const Quad next = newton > a && newton < b ? newton : (a + b) / 2;
            if (magnitude(next - s) <= Quad(1e-33) * s || b - a <= Quad(1e-33) * b) return next;
            s = next;
        }
        return s;
    }

    // |p| is within the tolerance at s, and so it is all around a multiple zero. A zero of multiplicity m is a simple
    // zero of the (m-1)-th derivative, and only as such well defined: take the lowest derivative for which it is
    // simple.
    Quad settled(Quad s) const {
        const Series* const chain[] = {&p_, &d1_, &d2_, &d3_};
        for (int m = 1; m <= 3; ++m) {
            Quad root = s;
            for (int n = 0; n < 100; ++n) {
                const Quad slope = value(*chain[m], root);
                if (slope == 0) break;
                const Quad step = value(*chain[m - 1], root) / slope;
                root -= step;
                if (magnitude(root - s) > Quad(1e-3) || magnitude(step) <= Quad(1e-33)) break;
            }
            const Quad slope = value(*chain[m], root);
            const Quad bend = m < 3 ? value(*chain[m + 1], root) : Quad(0);
            const bool simple = slope * slope > Quad(1e6) * tolerance_ * magnitude(bend);
            if (simple && magnitude(root - s) <= Quad(1e-3) && root > 0 && magnitude(value(p_, root)) <= tolerance_)
                return root < 1 ? root : Quad(1);
        }
        return s;
    }

    const Series& p_;
    Series d1_, d2_, d3_;
    Quad tolerance_;
};

}  // namespace lostmotion::test::referee
