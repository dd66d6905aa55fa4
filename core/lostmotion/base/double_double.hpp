// Numbers of twice the usual precision, as the unevaluated sum of two (T. J. Dekker, Numer. Math. 18, 1971).
#pragma once

#include <cmath>

namespace lostmotion {

struct DoubleDouble {
    double high = 0.0, low = 0.0;

    constexpr DoubleDouble() = default;
    constexpr DoubleDouble(double number) : high(number) {}
    constexpr DoubleDouble(double h, double l) : high(h), low(l) {}

    // |a| >= |b|
    static DoubleDouble sum_in_order(double a, double b) {
        const double s = a + b;
        return {s, b - (s - a)};
    }
    static DoubleDouble sum(double a, double b) {
        const double s = a + b, b_in_s = s - a;
        return {s, (a - (s - b_in_s)) + (b - b_in_s)};
    }
    static DoubleDouble product(double a, double b) {
        const double p = a * b;
        return {p, std::fma(a, b, -p)};
    }

    friend DoubleDouble operator+(const DoubleDouble& a, const DoubleDouble& b) {
        const DoubleDouble highs = sum(a.high, b.high), lows = sum(a.low, b.low),
                           most = sum_in_order(highs.high, highs.low + lows.high);
        return sum_in_order(most.high, most.low + lows.low);
    }
    friend DoubleDouble operator*(const DoubleDouble& a, const DoubleDouble& b) {
        const DoubleDouble p = product(a.high, b.high);
        return sum_in_order(p.high, p.low + (a.high * b.low + a.low * b.high));
    }
    friend DoubleDouble operator/(const DoubleDouble& a, double b) {
        const double quotient = a.high / b;
        return sum_in_order(quotient, (std::fma(-quotient, b, a.high) + a.low) / b);
    }
    friend DoubleDouble operator-(const DoubleDouble& a) { return {-a.high, -a.low}; }
    DoubleDouble& operator+=(const DoubleDouble& o) { return *this = *this + o; }
    explicit operator double() const { return high; }
};

inline constexpr DoubleDouble two_pi{6.283185307179586, 2.4492935982947064e-16};

}  // namespace lostmotion
