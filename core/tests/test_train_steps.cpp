// Trains against time stepping, which shares no code with the model.
#include <doctest/doctest.h>

#include "random_train_runs.hpp"
#include "train_steps.hpp"

TEST_SUITE_BEGIN("train_steps");

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

TEST_CASE("the exact solver follows what time stepping converges to, on random trains of all elements") {
    RandomTrains random(61);
    SteppingTally tally;
    for (int n = 0; n < cases(120); ++n) compare_with_steps(random, 4, 0.4, 1000, tally);
    MESSAGE(tally.compared << " trains compared, " << tally.undecided << " undecided, " << tally.open
                           << " whose break-away rigid bodies leave open; largest difference " << tally.worst);
    CHECK(tally.compared > share(110));
    CHECK(tally.wrong == 0);
}

TEST_CASE("the exact solver follows what time stepping converges to, on random trains with dampers") {
    RandomTrains random(62, false, true);
    SteppingTally tally;
    for (int n = 0; n < 60; ++n) compare_with_steps(random, 4, 0.4, 1000, tally);
    MESSAGE(tally.compared << " trains compared, " << tally.undecided << " undecided, " << tally.open
                           << " whose break-away rigid bodies leave open; largest difference " << tally.worst);
    CHECK(tally.compared > 55);
    CHECK(tally.wrong == 0);
}

TEST_CASE("the exact solver follows what time stepping converges to, where the mesh stiffness steps over the angle") {
    RandomTrains random(63, false, false, true);
    SteppingTally tally;
    for (int n = 0; n < 60; ++n) compare_with_steps(random, 3, 0.4, 1000, tally, std::to_string(n).c_str());
    MESSAGE(tally.compared << " trains compared, " << tally.undecided << " undecided, " << tally.open
                           << " whose break-away rigid bodies leave open; largest difference " << tally.worst);
    CHECK(tally.compared > 50);
    CHECK(tally.wrong == 0);
}

}  // namespace lostmotion::model

TEST_SUITE_END();
