// Trains against time stepping, which shares no code with the model.
#include <doctest/doctest.h>

#include "random_train_runs.hpp"
#include "time_stepping.hpp"

TEST_SUITE_BEGIN("time_stepping");

namespace lostmotion::model {

TEST_CASE("time stepping converges to the closed form of stick-slip and of a lossy gear") {
    // A mass drawn by a spring at constant speed breaks away at T_S/(k v).
    Train belt;
    belt.shafts = {shaft(1e12), shaft(0.5)};
    belt.shafts[1].friction.torque = 2.0;
    belt.shafts[1].friction.breakaway_torque = 3.0;
    belt.gears = {spring(0, 1, 1.0, TorsionCurve({}, {40.0}))};
    TrainSteps slow(belt, {});
    slow.speed[0] = 0.3;
    const double breaks = 3.0 / (40.0 * 0.3), omega = std::sqrt(40.0 / 0.5), time = 0.1;
    slow.run(breaks + time, 40000);
    // J x'' = k (v t - x) + T_S - T_C from rest.
    const double speed = 0.3 * (1.0 - std::cos(omega * time)) + 1.0 / (0.5 * omega) * std::sin(omega * time);
    CHECK(slow.speed[1] == doctest::Approx(speed).epsilon(1e-3));

    Train worm;  // that stops an overrunning load: 4000/3 rad/s^2
    worm.shafts = {shaft(1e-4), shaft(0.5)};
    worm.shafts[1].loaded = true;
    worm.gears = {rigid_gear(0, 1, 50.0)};
    worm.gears[0].efficiencies = MeshEfficiency(0.3, -0.2);
    TrainSteps stops(worm, {constant(-20.0)});
    stops.speed = {100.0, 2.0};
    stops.run(0.05, 500);
    CHECK(stops.speed[0] == doctest::Approx(100.0 - 0.05 * 4000.0 / 3.0).epsilon(1e-6));
    stops.run(0.05, 500);
    CHECK(stops.speed[0] == 0.0);
}

TEST_CASE("the exact solver follows what time stepping converges to") {
    struct Kind {
        std::string what;
        RandomTrains random;
        int shafts, trains, least;
    };
    for (Kind k : {Kind{"all elements", RandomTrains(61), 4, cases(120), share(110)},
                   Kind{"dampers", RandomTrains(62, false, true), 4, 60, 55},
                   Kind{"mesh stiffness that steps over the angle", RandomTrains(63, false, false, true), 3, 60, 50},
                   Kind{"housings that turn", RandomTrains(64, true), 4, 40, 30}}) {
        CAPTURE(k.what);
        SteppingTally tally;
        for (int n = 0; n < k.trains; ++n)
            compare_with_steps(k.random, k.shafts, 0.4, 1000, tally, (k.what + ' ' + std::to_string(n)).c_str());
        MESSAGE(tally.text());
        CHECK(tally.compared > k.least);
        CHECK(tally.wrong == 0);
    }
}

}  // namespace lostmotion::model

TEST_SUITE_END();
