// Whole runs of trains: the exact solver against the adaptive one and closed forms, and the ledger.
#include <doctest/doctest.h>

#include "random_train_runs.hpp"

TEST_SUITE_BEGIN("train_runs");

namespace lostmotion::model {

namespace {

double value_at(const Signal& s, double time) {
    const Breakpoint& b = s.breakpoints[s.segment(time)];
    double value = b.value + b.slope * (time - b.time);
    for (const Sine& w : s.sines) value += w.amplitude * std::sin(2.0 * pi * w.frequency * time + w.phase);
    return value;
}

}  // namespace

// All is at rest: a clutch holds shaft 1, whose bearing takes 1 N m more. What the clutch takes is all that acts on
// shaft 1, followed with a play of that: two motors, one of which has a state, a load, and a brake whose capacity comes
// and goes. Turning points of any sum of these count. Between instants dt apart one is missed by less than
// 800 N m/s2 dt^2/8.
TEST_CASE("the torque between two shafts at rest is a play of all that drives it") {
    Train t;
    t.shafts = {shaft(1.0), shaft(1.0)};
    t.shafts[0].friction.torque = 100.0;
    t.shafts[1].friction.torque = 1.0;
    t.shafts[1].loaded = true;
    t.clutches = {{"clutch", 0, 1, 50.0, 0.0, true}};
    t.motors = {torque_motor(1), torque_motor(1)};
    t.motors[1].law.kind = Motor::dc;
    for (ShaftMotor& m : t.motors) m.law.rated_torque = 1.0;
    t.motors[1].law.electrical_time_constant = 0.02;
    t.brakes = {{"brake", 1, 0.5}};
    constexpr double interval = 0.0125, duration = 2.5;
    constexpr int steps = 500;
    for (const bool brakes : {false, true}) {
        const std::vector<Signal> inputs{{{Breakpoint{}}, {{2.0, 1.3, 0.4}}},
                                         {{Breakpoint{}}, {{1.5, 2.1, 0.0}}},
                                         {{{0.0, 0.0, 0.0}, {0.4, 0.0, 1.0}, {1.6, -0.5, 0.0}}, {{1.2, 3.0, 1.0}}},
                                         {{{0.0, brakes ? 0.5 : 0.0, 0.0}}, {{brakes ? 0.4 : 0.0, 1.7, 0.0}}}};
        const Recorded dense(t, inputs, duration, interval / steps), exact(t, inputs, duration, interval),
            adaptive(t, inputs, duration, interval, 1e-10);
        REQUIRE(dense.done());
        REQUIRE(exact.done());
        REQUIRE(adaptive.done());
        const double* state = dense.channel("motor1_torque");  // a first-order lag: no event has a part in it
        double torque = 0.0, worst = 0.0, worst_adaptive = 0.0;
        for (std::size_t k = 0; k < dense.samples; ++k) {
            const double time = interval / steps * static_cast<double>(k);
            const double needed = value_at(inputs[2], time) - value_at(inputs[0], time) - state[k],
                         half = 1.0 + 0.5 * value_at(inputs[3], time);
            torque = std::clamp(torque, needed - half, needed + half);
            if (k % steps != 0) continue;
            worst = std::max(worst, std::fabs(exact.channel("clutch_contact_torque")[k / steps] - torque));
            worst_adaptive =
                std::max(worst_adaptive, std::fabs(adaptive.channel("clutch_contact_torque")[k / steps] - torque));
        }
        CAPTURE(brakes);
        CHECK(worst < 1e-6);
        CHECK(worst_adaptive < 1e-6);
        CHECK(exact.channel("shaft1_speed")[exact.samples - 1] == 0.0);
        CHECK(exact.report.switching_count > 15);
    }
}

// A bearing that holds 1.5 N m and takes 1 N m while it slips, on a shaft that a clutch ties to one that stands.
// Neither moves: the clutch takes what is above 1.5 N m, without a jump to 1 N m when that limit is reached, and keeps
// it until the bearing is at its other limit.
TEST_CASE("a contact at its limit gives what it holds, since it does not slip") {
    Train t;
    t.shafts = {shaft(1.0), shaft(1.0)};
    t.shafts[0].friction.torque = 100.0;
    t.shafts[1].friction.torque = 1.0;
    t.shafts[1].friction.breakaway_torque = 1.5;
    t.clutches = {{"clutch", 0, 1, 50.0, 0.0, true}};
    t.motors = {torque_motor(1)};
    t.motors[0].law.rated_torque = 1.0;
    const std::vector<Signal> inputs{{{{0.0, 0.0, 1.0}, {2.0, 2.0, -1.0}}, {}}};
    for (const double tolerance : {0.0, 1e-10}) {
        const Recorded r(t, inputs, 6.0, 0.1, tolerance);
        REQUIRE(r.done());
        double clutch = 0.0;
        for (std::size_t k = 0; k < r.samples; ++k) {
            const double time = 0.1 * static_cast<double>(k), motor = time < 2.0 ? time : 4.0 - time;
            clutch = std::clamp(clutch, -1.5 - motor, 1.5 - motor);
            CHECK(r.channel("clutch_contact_torque")[k] == doctest::Approx(clutch).scale(1.0).epsilon(1e-9));
        }
        CHECK(clutch == doctest::Approx(0.5));
    }
}

namespace {

// A pendulum of 0.8 kg m2 and 25 N m, its gravity by chords that depart by `error`; let go at `angle`.
Recorded swing(double friction, double error, double angle, double duration, double tolerance) {
    Train t;
    t.shafts = {shaft(0.8)};
    t.shafts[0].friction.torque = friction;
    t.angle_torques = {{"gravity", 0, PeriodicCurve::sine(-25.0, 1, 0.0, error)}};
    const double start[] = {0.0, angle, angle};  // speed, angle, that of its part
    return Recorded(t, {}, duration, duration / 10.0, tolerance, start);
}

}  // namespace

TEST_CASE("the adaptive solver takes gravity as it is, however coarse the chords are") {
    const double angle = 2.0, period = 4.0 * std::sqrt(0.8 / 25.0) * std::comp_ellint_1(std::sin(0.5 * angle));
    for (const double error : {0.5, 0.05}) {
        const Recorded sine = swing(0.0, error, angle, period, 1e-11), chords = swing(0.0, error, angle, period, 0.0);
        REQUIRE(sine.done());
        REQUIRE(chords.done());
        // Back at rest where it was; the chords make the period another.
        CHECK(std::fabs(sine.report.x[0]) < 1e-7);
        CHECK(sine.report.x[1] == doctest::Approx(angle).epsilon(1e-8));
        CHECK(std::fabs(chords.report.x[0]) > 1e-3 * error);
    }
}

TEST_CASE("a pendulum held by friction stays; once it slips, chords and sine differ by the stated error") {
    for (const double tolerance : {0.0, 1e-10}) {
        const Recorded held = swing(100.0, 0.5, 1.2, 3.0, tolerance);
        REQUIRE(held.done());
        CHECK(held.report.x[0] == 0.0);
        CHECK(held.report.x[1] == 1.2);
        CHECK(held.report.switchings.empty());
    }
    // It slips where 25 sin exceeds 20, and comes to rest once.
    const double friction = 20.0, angle = 1.5, duration = 1.0;
    for (const double error : {0.1, 0.001}) {
        const Recorded chords = swing(friction, error, angle, duration, 0.0),
                       sine = swing(friction, error, angle, duration, 1e-11);
        REQUIRE(chords.done());
        REQUIRE(sine.done());
        REQUIRE(chords.report.switching_count > 0);
        CHECK(chords.report.x[0] == 0.0);
        CHECK(sine.report.x[0] == 0.0);
        // Where it stops: 25 (cos phi - cos 1.5) = 20 (1.5 - phi); an error of the torque moves that by no more than
        // its work over the way, divided by what decelerates it there.
        double low = 0.0, high = 1.3;
        for (int b = 0; b < 60; ++b) {
            const double middle = 0.5 * (low + high);
            (25.0 * (std::cos(middle) - std::cos(angle)) < friction * (angle - middle) ? low : high) = middle;
        }
        CHECK(sine.report.x[1] == doctest::Approx(low).epsilon(1e-8));
        const double brakes = friction - 25.0 * std::sin(low);
        CHECK(std::fabs(chords.report.x[1] - low) < error * (angle - low) / brakes);
        CHECK(std::fabs(chords.report.x[1] - low) > 1e-9);
    }
}

// What the input takes of 10 N m steps at 0 or h of each period 2h: from 9 N m behind to 11 N m ahead, as the slope of
// the transmission error jumps, (1 - e') T_2, or the stiffness of the mesh.
void put_step(Gear& g, bool mesh, double h, bool at_zero = false) {
    if (mesh)
        g.mesh_stiffness = PeriodicCurve(2.0 * h, {0.0, h}, {at_zero ? 1.1 : 0.9, at_zero ? 0.9 : 1.1});
    else
        g.transmission_error = PeriodicCurve(2.0 * h, {0.0, h}, {at_zero ? 0.1 * h : 0.0, at_zero ? 0.0 : 0.1 * h});
}

// Two shafts of 1 kg m2, the second held, on a mesh that begins with 10 N m and has such a step at 0.7 rad.
struct CorneredShaft {
    Train train;
    std::vector<double> x;

    CorneredShaft(bool mesh, double friction, double stiffness, double angle, bool at_zero = false) {
        train.shafts = {shaft(1.0), shaft(1.0)};
        train.shafts[0].friction.torque = friction;
        train.shafts[1].friction.torque = 1e3;
        train.motors = {torque_motor(0)};
        train.gears = {spring(0, 1, 1.0, TorsionCurve({}, {stiffness}))};
        put_step(train.gears[0], mesh, 0.7, at_zero);
        const Places places(train);
        x.resize(static_cast<std::size_t>(Assembly(train).layout().states));
        x[static_cast<std::size_t>(places.gears[0].twist)] = 10.0 / stiffness;
        x[static_cast<std::size_t>(places.shafts[0].angle)] = angle;
    }
};

TEST_CASE("a shaft at rest on a corner of a transmission error stays as either side of it can hold it") {
    bool mesh = false;
    SUBCASE("transmission error") {}
    SUBCASE("mesh stiffness") { mesh = true; }
    const auto run = [mesh](double motor, double corner, double tolerance) {
        const CorneredShaft c(mesh, 1.0, 100.0, corner, corner == 0.0);
        return Recorded(c.train, {constant(motor)}, 0.5, 0.1, tolerance, c.x);
    };
    for (const double corner : {0.0, 0.7, -0.7})
        for (const double tolerance : {0.0, 1e-10}) {
            CAPTURE(corner);
            CAPTURE(tolerance);
            // 8 to 10 N m hold it behind the corner, 10 to 12 ahead.
            for (const double motor : {8.1, 9.0, 9.9, 10.1, 11.0, 11.9}) {
                CAPTURE(motor);
                const Recorded r = run(motor, corner, tolerance);
                REQUIRE(r.done());
                CHECK(r.channel("shaft0_speed")[r.samples - 1] == 0.0);
            }
            const Recorded ahead = run(12.1, corner, tolerance), back = run(7.9, corner, tolerance);
            REQUIRE(ahead.done());
            REQUIRE(back.done());
            CHECK(ahead.channel("shaft0_speed")[1] > 0.0);
            CHECK(back.channel("shaft0_speed")[1] < 0.0);
        }
}

// Between 9 and 11 N m from the gear, neither side of the corner holds it with less than 1 N m of friction, and each
// pushes it to the other. Of all accelerations a, the principle of least constraint takes the one that makes
// a^2/2 - 10 a + 0.5 |a| + (9 or 11) a least: none from 8.5 to 11.5 N m of the motor, beyond that what is left over.
TEST_CASE("a shaft that both sides of a corner of a transmission error push back rests on it") {
    bool mesh = false;
    SUBCASE("transmission error") {}
    SUBCASE("mesh stiffness") { mesh = true; }
    const auto run = [mesh](const Signal& motor, double angle, double tolerance, double duration) {
        const CorneredShaft c(mesh, 0.5, 1e-3, angle);
        return Recorded(c.train, {motor}, duration, 1e-3 * duration, tolerance, c.x);
    };
    for (const double tolerance : {0.0, 1e-10}) {
        CAPTURE(tolerance);
        for (const double corner : {0.7, -0.7, 2.1})
            for (const double motor : {8.6, 9.4, 9.6, 10.0, 10.4, 10.6, 11.4}) {
                CAPTURE(motor);
                const Recorded r = run(constant(motor), corner, tolerance, 0.5);
                REQUIRE(r.done());
                CHECK(r.channel("shaft0_speed")[r.samples - 1] == 0.0);
                CHECK(r.channel("shaft0_contact")[r.samples - 1] == 0.0);
            }
        for (const double motor : {8.2, 11.8}) {
            const Recorded r = run(constant(motor), 0.7, tolerance, 1e-3);
            REQUIRE(r.done());
            // The torque of the gear changes by 1e-3 N m/rad.
            CHECK(r.channel("shaft0_speed")[r.samples - 1] ==
                  doctest::Approx(1e-3 * (motor > 10.0 ? motor - 11.5 : motor - 8.5)).epsilon(1e-6));
        }
        // It breaks away where the motor has come to 11.5 N m, and goes on with what it has more.
        const Recorded ramp = run(lines({{0.0, 10.0, 1.0}}), 0.7, tolerance, 2.0);
        REQUIRE(ramp.done());
        CHECK(ramp.channel("shaft0_speed")[749] == 0.0);
        CHECK(ramp.channel("shaft0_speed")[1000] == doctest::Approx(0.5 * 0.5 * 0.5).epsilon(1e-4));
    }
}

// It slides to the corner with 0.5 rad/s^2 and is braked behind it with 1.5: each time it goes a third as far, and
// after infinitely many passages it rests there. The times are a geometric series.
TEST_CASE("a shaft comes to rest on a corner of a transmission error that pushes it back from both sides") {
    bool mesh = false;
    SUBCASE("transmission error") {}
    SUBCASE("mesh stiffness") { mesh = true; }
    constexpr double h = 0.7, off = 0.01;
    const CorneredShaft c(mesh, 0.5, 1e-6, h + off);
    const Recorded r(c.train, {constant(10.0)}, 1.0, 1e-3, 0.0, c.x);
    REQUIRE(r.done());
    const double first = std::sqrt(2.0 * off / 0.5), back = std::sqrt(2.0 * off / 3.0 / 1.5),
                 rest = (first + back) / (1.0 - std::sqrt(1.0 / 3.0));
    for (std::size_t k = 0; k < r.samples; ++k) {
        const double t_k = 1e-3 * static_cast<double>(k), w = r.channel("shaft0_speed")[k];
        if (t_k < first) CHECK(w == doctest::Approx(-0.5 * t_k).epsilon(1e-5));
        if (t_k > 1.001 * rest) CHECK(w == 0.0);
        if (t_k > first && t_k < rest) CHECK(std::fabs(w) < 0.5 * first);
    }
    CHECK(r.report.x[static_cast<std::size_t>(Places(c.train).shafts[0].angle)] == doctest::Approx(h).epsilon(1e-11));
    // A third each time, until the angle is the corner to 3e-12: twenty passages, each with a crossing and a stop.
    CHECK(r.report.switchings.size() > 35);
}

}  // namespace lostmotion::model

TEST_SUITE_END();
