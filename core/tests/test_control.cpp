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
    axis.law.speed_loop.gain = gain;
    axis.law.delay.samples = delay;
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

// After samples of a run-up at the limit, whatever their number, the first ones with the other sign lead out of it.
TEST_CASE("no integrator of a limited loop runs further into its limit") {
    for (const double way : {1.0, -1.0})
        for (const double share : {1e-3, 0.1, 0.5, 0.999})  // 1 - exp(-T/tau_a)
            for (const int samples : {1, 10, 10000}) {
                CAPTURE(way);
                CAPTURE(share);
                CAPTURE(samples);
                std::array<double, 2> current{}, speed{}, position{};
                control::Slots slots;
                control::CurrentLoop loop;
                loop.gain = 1.0 / 3.0;  // K = 1/(6 share), K (1 - a) = 1/6, K_e = 0.5
                loop.armature_voltage_constant = 2.0;
                loop.electrical_time_constant = -1.0 / std::log1p(-share);
                loop.command_limit = 1.0;
                loop.place(slots, 1.0);
                // The current of a motor that runs up at the limit; its speed rises by at most 1e-3 in a sample.
                double i = 0.0, w = 0.0;
                for (int k = 0; k < samples; ++k) {
                    CHECK(loop(way * 100.0, i, w, current.data()) == way);
                    CHECK(loop.at_limit(current.data()) == way);
                    w += way * std::fmin(1e-3, std::fabs(2.0 * way - w));
                    i += share * (2.0 * (way - 0.5 * w) - i);
                }
                CHECK(way * loop(i - 4e-3 * way, i, w, current.data()) < 1.0);
                CHECK(loop(i - way * 10.0 * share - way, i, w, current.data()) * way < 0.9);

                slots = {};
                control::SpeedLoop outer;
                outer.gain = 2.0;
                outer.integral_gain = 5.0;
                outer.place(slots);
                const control::TorqueRange all{-1e9, 1e9}, some{-3.0, 3.0};
                for (int k = 0; k < samples; ++k) outer(way * 10.0, 0.0, 0.0, all, way, 0.1 * share, speed.data());
                CHECK(speed[0] == 0.0);
                outer(way * -1.0, 0.0, 0.0, all, way, 0.1 * share, speed.data());
                CHECK(way * speed[0] < 0.0);
                for (int k = 0; k < samples; ++k) outer(way * 10.0, 0.0, 0.0, some, 0.0, 0.1 * share, speed.data());
                CHECK(way * speed[0] <= 3.0 * (1.0 + 1e-12));
                CHECK(way * outer(way * -1e-3, 0.0, 0.0, some, 0.0, 0.1 * share, speed.data()) < 3.0);

                slots = {};
                control::PositionLoop outermost;
                outermost.gain = 2.0;
                outermost.integral_gain = 5.0;
                outermost.place(slots);
                for (int k = 0; k < samples; ++k) outermost(way * 10.0, 0.0, way, share, position.data());
                CHECK(position[0] == 0.0);
                outermost(way * -1.0, 0.0, way, share, position.data());
                CHECK(way * position[0] < 0.0);
            }
}

// The rotor at 60 rad/s, no current, a voltage of 5 V in q that stands still in the stator.
TEST_CASE("the power series of a winding is the solution of its equations, by small steps of fourth order") {
    const SynchronousWinding w{3.0, 1.5, 4e-3, 7e-3, 0.08};
    WindingCourse course = WindingCourse::at(w, 0.0, {0.3, -0.8}, {1.0, 5.0}, 60.0);
    course.end = 4e-4;
    course.speed = parabola(60.0, 75.0, 69.0);
    course.solve(w);
    using Four = std::array<double, 4>;  // i_d, i_q, u_d, u_q
    const auto rates = [&](double t, const Four& x) {
        const double w_e = w.pole_pairs * course.speed(t / course.end);
        return Four{(x[2] - w.resistance * x[0] + w_e * w.inductance_q * x[1]) / w.inductance_d,
                    (x[3] - w.resistance * x[1] - w_e * (w.inductance_d * x[0] + w.flux_linkage)) / w.inductance_q,
                    w_e * x[3], -w_e * x[2]};
    };
    Four x{0.3, -0.8, 1.0, 5.0};
    const int n = 1000;
    const double h = course.end / n;
    double impulse = 0.0, moment = 0.0, heat = 0.0;
    for (int k = 0; k < n; ++k) {
        const double t = k * h;
        const auto at = [&](const Four& slope, double share) {
            Four out = x;
            for (std::size_t j = 0; j < 4; ++j) out[j] += share * h * slope[j];
            return out;
        };
        const Four a = rates(t, x), b = rates(t + 0.5 * h, at(a, 0.5)), c = rates(t + 0.5 * h, at(b, 0.5)),
                   d = rates(t + h, at(c, 1.0));
        const Four middle = at(b, 0.5);  // by the midpoint rule, h^2/24 of it wrong
        impulse += h * w.torque(middle[0], middle[1]);
        moment += h * (t + 0.5 * h) * w.torque(middle[0], middle[1]);
        heat += h * 1.5 * w.resistance * (middle[0] * middle[0] + middle[1] * middle[1]);
        for (std::size_t j = 0; j < 4; ++j) x[j] += h / 6.0 * (a[j] + 2.0 * b[j] + 2.0 * c[j] + d[j]);
    }
    const auto [i_d, i_q] = course.current(course.end);
    const auto [u_d, u_q] = course.voltage(course.end);
    CHECK(i_d == doctest::Approx(x[0]).epsilon(1e-12));
    CHECK(i_q == doctest::Approx(x[1]).epsilon(1e-12));
    CHECK(u_d == doctest::Approx(x[2]).epsilon(1e-12));
    CHECK(u_q == doctest::Approx(x[3]).epsilon(1e-12));
    const Ramp line = course.torque;
    CHECK(line.value * course.end + line.slope * course.end * course.end / 2.0 ==
          doctest::Approx(impulse).epsilon(1e-6));
    CHECK(line.value * course.end * course.end / 2.0 + line.slope * std::pow(course.end, 3) / 3.0 ==
          doctest::Approx(moment).epsilon(1e-6));
    CHECK(course.energy(w, 0.0, course.end).heat == doctest::Approx(heat).epsilon(1e-6));
}

TEST_CASE("exact and adaptive solver agree on random axes, also under field-oriented control") {
    for (const bool windings : {false, true}) {
        CAPTURE(windings);
        RandomTrains random(windings ? 67 : 61);
        SolverTally tally;
        const int axes = cases(windings ? 750 : 2500);
        for (int n = 0; n < axes; ++n) {
            CAPTURE(n);
            compare_solvers(random, 4, 0.3, tally, windings ? "winding" : "axis", true, windings);
        }
        MESSAGE(tally.text());
        CHECK(tally.compared > (windings ? cases(650) : share(2500)));
        CHECK(tally.failed() == 0);
    }
}

}  // namespace lostmotion::model

TEST_SUITE_END();
