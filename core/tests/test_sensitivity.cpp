// Derivatives of runs with respect to parameters, through switchings and under controllers.
#include <doctest/doctest.h>

#include "lostmotion/analysis/tangent_propagator.hpp"
#include "random_sensitivities.hpp"

TEST_SUITE_BEGIN("sensitivity");

namespace lostmotion::model {

// Gears between shafts that stand. In the first group the friction of the shaft that a gear turns bounds its torque; in
// the second a contact reaches its limit at the switching, where the torques are those of its slipping.
TEST_CASE("derivatives of torques that rest leaves open") {
    SensitivityTally tally;
    for (const unsigned seed : {20183u, 20291u, 20489u, 22152u, 22549u, 22554u, 23471u})
        compare_one(seed, false, tally);
    compare_one(60938, true, tally);
    for (const unsigned seed : {20324u, 20379u, 20392u}) compare_one(seed, false, tally);
    CHECK(tally.failed_runs == 0);
    CHECK(tally.wrong == 0);
    CHECK(tally.ended == 0);
    CHECK(tally.compared > 4000);
}

// x' = -a x + u from rest: dx/da and dx/du are known, also where exp(-a h) is lost in 1.
TEST_CASE("the derivative of an exponential, over nine decades of time") {
    for (const double a : {1e-6, 1.0, 1e3}) {
        for (const double t : {1e-6, 1.0, 1e3}) {
            Varied dM(2, 2, 2);
            dM.at(0, 0)[0] = -1.0;  // by a
            dM.at(0, 1)[1] = 1.0;   // by u
            TangentPropagator propagator;
            propagator.prepare(2, 1, 1, {-a, 3.0, 0.0, 0.0}, dM, 0.25 / std::fmax(a, 1.0));
            std::vector<double> w{0.0, 1.0}, derivative(4);
            propagator.advance(w.data(), derivative.data(), t);
            const double e = std::expm1(-a * t);
            CHECK(w[0] == doctest::Approx(-3.0 * e / a).epsilon(1e-12));
            CHECK(derivative[1] == doctest::Approx(-e / a).epsilon(1e-12));
            const double z = a * t;  // 1 - (1 + z) exp(-z), by its series where that cancels
            const double by_a = z < 1e-2 ? z * z * (0.5 - z * (1.0 / 3.0 - z * (0.125 - z * (1.0 / 30.0 - z / 144.0))))
                                         : 1.0 - (1.0 + z) * std::exp(-z);
            CHECK(derivative[0] == doctest::Approx(-3.0 * by_a / (a * a)).epsilon(1e-11));
        }
    }
}

}  // namespace lostmotion::model

TEST_SUITE_END();
