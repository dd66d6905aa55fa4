#include <doctest/doctest.h>
#include <quadmath.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <initializer_list>
#include <limits>
#include <random>
#include <string>

#include "lostmotion/base/arctangent.hpp"
#include "lostmotion/base/decimal.hpp"
#include "lostmotion/base/powers.hpp"
#include "lostmotion/base/sine.hpp"

using namespace lostmotion;

namespace {

// The error of a value in units of its last place.
double error(double value, __float128 exact) {
    int exponent;
    std::frexp(static_cast<double>(exact), &exponent);
    const double ulp = std::ldexp(1.0, exponent - std::numeric_limits<double>::digits);
    return static_cast<double>(fabsq(value - exact)) / ulp;
}

double worst_error(double reach, int count) {
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> share(-1.0, 1.0);
    double worst = 0.0;
    for (int k = 0; k < count; ++k) {
        const double x = reach * share(random);
        const auto [sine, cosine] = sine_cosine(x);
        worst = std::fmax(worst, std::fmax(error(sine, sinq(x)), error(cosine, cosq(x))));
    }
    return worst;
}

}  // namespace

TEST_SUITE("sine") {
    // The last sum rounds by half a unit; the three roundings of the cubic term, a ninth of the sine, bring the rest.
    TEST_CASE("sine and cosine are exact to 0.8 units in the last place") {
        for (const double reach : {1e-3, 0.1, 0.8, 3.2, 20.0, 1e3, 8e5, 1e7, 1e12, 4e12}) {
            CAPTURE(reach);
            CHECK(worst_error(reach, 20000) < 0.8);
        }
    }
    TEST_CASE("close to their zeros, too") {
        for (int q = 1; q < 2000000; q += 997) {
            const double x = static_cast<double>(q * acosq(0.0));
            const auto [sine, cosine] = sine_cosine(x);
            CHECK(error(sine, sinq(x)) < 0.8);
            CHECK(error(cosine, cosq(x)) < 0.8);
        }
    }
    TEST_CASE("sine is odd, cosine even, to the last bit") {
        std::mt19937_64 random(8);
        std::uniform_real_distribution<double> share(0.0, 100.0);
        for (int k = 0; k < 1000; ++k) {
            const double x = share(random);
            CHECK(sine_cosine(-x).sin == -sine_cosine(x).sin);
            CHECK(sine_cosine(-x).cos == sine_cosine(x).cos);
        }
        CHECK(sine_cosine(0.0).cos == 1.0);
    }
}

TEST_SUITE("powers") {
    // The last step of Horner's scheme rounds a quotient, a product and a sum: 1/2 ulp and what r <= 0.35 leaves of
    // two.
    TEST_CASE("the exponential is exact to 1.1 units in the last place") {
        std::mt19937_64 random(9);
        std::uniform_real_distribution<double> share(-1.0, 1.0);
        for (const double reach : {1e-6, 0.3, 0.4, 5.0, 100.0, 700.0})
            for (int k = 0; k < 20000; ++k) {
                const double x = reach * share(random);
                CHECK(error(exponential(x), expq(x)) < 1.1);
            }
        CHECK(exponential(0.0) == 1.0);
        CHECK(exponential(-1e3) == 0.0);
    }
    // A fifth of the five roundings of x y^5, at most one unit in the last place, and half a unit of the last sum.
    TEST_CASE("the inverse fifth root is exact to 1.5 units in the last place") {
        std::mt19937_64 random(10);
        std::uniform_real_distribution<double> exponent(-1000.0, 1000.0);
        for (int k = 0; k < 20000; ++k) {
            const double x = std::exp2(exponent(random));
            CHECK(error(inverse_fifth_root(x), powq(x, __float128(-1) / 5)) < 1.5);
        }
        for (int k = -200; k <= 200; ++k) CHECK(inverse_fifth_root(std::ldexp(1.0, 5 * k)) == std::ldexp(1.0, -k));
    }
    // Beyond 1 the difference has at most twice the error of the exponential, and rounds once more.
    TEST_CASE("the exponential less one is exact to three units in the last place") {
        std::mt19937_64 random(11);
        std::uniform_real_distribution<double> share(-1.0, 1.0);
        for (const double reach : {1e-300, 1e-12, 1e-3, 0.34, 1.0, 1.5, 5.0, 100.0, 700.0})
            for (int k = 0; k < 20000; ++k) {
                const double x = reach * share(random);
                CHECK(error(exponential_minus_one(x), expm1q(x)) < 3.0);
            }
        CHECK(exponential_minus_one(0.0) == 0.0);
        CHECK(exponential_minus_one(-1e3) == -1.0);
    }
    // log m = 2 s + ..., |s| < 0.172, is rounded four times, the sum with k log 2 once more.
    TEST_CASE("the logarithm is exact to two units in the last place") {
        std::mt19937_64 random(12);
        std::uniform_real_distribution<double> exponent(-1000.0, 1000.0), near(0.5, 2.0);
        for (int k = 0; k < 40000; ++k) {
            const double x = k % 2 == 0 ? std::exp2(exponent(random)) : near(random);
            CHECK(error(logarithm(x), logq(x)) < 2.0);
        }
        CHECK(logarithm(1.0) == 0.0);
    }
    TEST_CASE("powers are exact to two units in the last place and three of their exponent") {
        std::mt19937_64 random(13);
        std::uniform_real_distribution<double> exponent(-60.0, 60.0), share(-4.0, 4.0);
        for (int k = 0; k < 40000; ++k) {
            const double x = std::exp2(exponent(random)), y = share(random);
            CHECK(error(power(x, y), powq(x, y)) < 2.0 + 3.0 * std::fabs(y * std::log(x)));
        }
        CHECK(power(2.0, 0.0) == 1.0);
        CHECK(power(10.0, 400.0) == std::numeric_limits<double>::infinity());
        CHECK(power(10.0, -400.0) == 0.0);
    }
    // The last step leaves the half unit of its sum and what is rounded in a correction of a few units.
    TEST_CASE("the cube root is exact to 0.7 units in the last place") {
        std::mt19937_64 random(14);
        std::uniform_real_distribution<double> exponent(-1020.0, 1020.0);
        for (int k = 0; k < 20000; ++k) {
            const double x = std::exp2(exponent(random));
            CHECK(error(cube_root(x), cbrtq(x)) < 0.7);
            CHECK(cube_root(-x) == -cube_root(x));
        }
        for (int k = -300; k <= 300; ++k) CHECK(cube_root(27.0 * std::ldexp(1.0, 3 * k)) == std::ldexp(3.0, k));
        CHECK(cube_root(0.0) == 0.0);
        CHECK(cube_root(5e-324) == std::ldexp(1.0, -358));
    }
    TEST_CASE("the arctangent is exact to 1.5 units in the last place, in all quadrants") {
        std::mt19937_64 random(15);
        std::uniform_real_distribution<double> share(-1.0, 1.0), exponent(-300.0, 300.0);
        for (int k = 0; k < 200000; ++k) {
            const double scale = k % 3 == 0 ? std::exp2(exponent(random)) : 1.0, y = share(random) * scale,
                         x = share(random);
            CHECK(error(arctangent(y, x), atan2q(y, x)) < 1.5);
        }
        for (const double y : {0.0, -0.0, 1.0, -1.0, HUGE_VAL, -HUGE_VAL, 1e300, 1e-300})
            for (const double x : {0.0, -0.0, 1.0, -1.0, HUGE_VAL, -HUGE_VAL, 1e300, 1e-300}) {
                CAPTURE(y);
                CAPTURE(x);
                CHECK(arctangent(y, x) == static_cast<double>(atan2q(y, x)));
                CHECK(std::signbit(arctangent(y, x)) == std::signbit(static_cast<double>(atan2q(y, x))));
            }
    }
    TEST_CASE("numbers are written as the C library writes them, halves and the ends of the range, too") {
        const auto check = [](double v) {
            for (const int digits : {1, 6, 10, 17}) {
                char text[40];
                std::snprintf(text, sizeof text, "%.*g", digits, v);
                CHECK(general_text(v, digits) == text);
            }
            CHECK(fixed_text(v) == std::to_string(v));
        };
        for (const double v : {0.0, 1.0, 0.5, 2.5, 9.5, 99.5, 1e5, 1e6, 1e22, 1e-4, 1e-5, 9.9999995e-5, 0.9999995, 5e-7,
                               999999.5, 5e-324, 1.7976931348623157e308, std::numeric_limits<double>::infinity()}) {
            check(v);
            check(-v);
        }
        std::mt19937_64 random(9);
        for (int k = 0; k < 3000; ++k) {
            const std::uint64_t bits = random();
            if (const auto any = std::bit_cast<double>(bits); k % 30 == 0 && !std::isnan(any)) check(any);
            check(static_cast<double>(bits % 1000000) / 1000.0);
            check(std::ldexp(static_cast<double>(bits >> 40), static_cast<int>(bits % 60) - 40));
        }
    }
}
