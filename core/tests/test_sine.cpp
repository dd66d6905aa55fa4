#include <doctest/doctest.h>
#include <quadmath.h>

#include <cmath>
#include <limits>
#include <random>

#include "lostmotion/kernel/powers.hpp"
#include "lostmotion/kernel/sine.hpp"

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
}
