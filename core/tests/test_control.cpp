// Sampled controllers: closed forms of the loop, both solvers on random axes, and what sampling must not change.
#include <doctest/doctest.h>

#include "random_train_runs.hpp"

TEST_SUITE_BEGIN("control");

namespace lostmotion::model {

namespace {

using control::Axis;

// A torque source on one shaft of 1e-3 kg m2, whose speed an axis controls.
Train one_shaft() {
    Train t;
    t.shafts.push_back(shaft(1e-3));
    t.shafts[0].name = "rotor";
    t.motors.push_back(torque_motor(0));
    return t;
}

constexpr double T = 125e-6;

Control proportional_speed(double gain, control::SpeedEstimate::Kind kind, int delay) {
    Control c;
    c.tick = T;
    ControlledAxis axis;
    axis.law.estimate.kind = kind;
    axis.law.speed_loop.gain = axis.law.speed_loop.reference_gain = gain;
    axis.law.delay.ticks = delay;
    c.axes.push_back(axis);
    return c;
}

// 2 s from 1 rad/s on, sampled at the ticks.
Recorded from_speed(const Control& control) {
    const Assembly a(named(one_shaft()));
    std::vector<double> start(static_cast<std::size_t>(a.layout().states));
    start[static_cast<std::size_t>(a.places().shafts[0].speed)] = 1.0;
    return Recorded(one_shaft(), {Signal{}}, 2.0, T, 0.0, start, {}, control);
}

// Growth of the oscillation from its first to its second half.
double growth(const Recorded& r) {
    const double* w = r.channel("rotor_speed");
    REQUIRE(w != nullptr);
    const std::size_t half = r.samples / 2;
    double first = 0.0, second = 0.0;
    for (std::size_t k = half - 800; k < half; ++k) first = std::fmax(first, std::fabs(w[k]));
    for (std::size_t k = r.samples - 800; k < r.samples; ++k) second = std::fmax(second, std::fabs(w[k]));
    return second / first;
}

}  // namespace

// z^2 (z - 1) + (K T/J)(z + 1)/2 = 0 has a pair on the unit circle at K T/J = 2 (sqrt 2 - 1), z = exp(i pi/4).
TEST_CASE("a proportional speed loop with backward difference and one tick of delay is stable up to f_s/8") {
    const double limit = 2.0 * (std::sqrt(2.0) - 1.0) * 1e-3 / T;
    for (const double share : {0.999, 1.001}) {
        const Control control = proportional_speed(share * limit, control::SpeedEstimate::difference, 1);
        const Recorded r = from_speed(control);
        REQUIRE(r.report.status == Status::done);
        const double g = growth(r);
        CHECK((share < 1.0 ? g < 0.2 : g > 5.0));
        // Zero crossings of the speed: 1000.0 Hz at 8 kHz.
        const double* w = r.channel("rotor_speed");
        int crossings = 0;
        std::size_t first = 0, last = 0;
        for (std::size_t k = 801; k < r.samples; ++k)
            if (w[k - 1] < 0.0 && w[k] >= 0.0) {
                if (crossings++ == 0) first = k;
                last = k;
            }
        CHECK((crossings - 1) / (static_cast<double>(last - first) * T) == doctest::Approx(1000.0).epsilon(1e-3));
    }
}

TEST_CASE("with the true speed the limit is K T/J = 1, at f_s/6") {
    for (const double share : {0.999, 1.001}) {
        const Control control = proportional_speed(share * 1e-3 / T, control::SpeedEstimate::exact, 1);
        const Recorded r = from_speed(control);
        REQUIRE(r.report.status == Status::done);
        CHECK((share < 1.0 ? growth(r) < 0.2 : growth(r) > 5.0));
    }
}

TEST_CASE("exact and adaptive solver agree on five hundred random axes") {
    RandomTrains random(61);
    SolverTally tally;
    for (int n = 0; n < 500; ++n) {
        CAPTURE(n);
        compare_solvers(random, 4, 0.3, tally, "axis", true);
    }
    MESSAGE(tally.compared << " axes compared, largest difference " << tally.worst << "; " << tally.undecided
                           << " that the adaptive solver does not settle, " << tally.jammed << " that jam");
    CHECK(tally.compared > 450);
    CHECK(tally.jammed == 0);
    CHECK(tally.wrong == 0);
}

}  // namespace lostmotion::model

TEST_SUITE_END();
