// Gears whose housing turns: planetary gears, gearboxes on elastic supports.
#include <doctest/doctest.h>

#include <numeric>

#include "gauss_principle.hpp"
#include "random_train_runs.hpp"

TEST_SUITE_BEGIN("train_housings");

namespace lostmotion::model {

namespace {

Gear planetary(int sun, int carrier, int ring, double ratio) {
    Gear g = rigid_gear(sun, carrier, ratio);
    g.housing = ring;
    return g;
}
Signal constant(double value) { return {{Breakpoint{0.0, value, 0.0}}, {}}; }

double at_end(const Recorded& r, const std::string& channel) { return r.channel(channel)[r.samples - 1]; }

}  // namespace

// Sun, carrier and ring are free, each under a torque. Willis: w_s - w_r = i (w_c - w_r), i = 1 + z_r/z_s; the torques
// of the gear are -T_2/i, T_2, T_2/i - T_2. So the accelerations have a T_2 in common, which keeps that.
TEST_CASE("a free planetary gear accelerates as its equations say, and its torques balance") {
    const double J[] = {0.2, 1.5, 0.7}, load[] = {-1.0, 0.4, -0.3}, i = 4.0, duration = 2.0;
    Train t;
    for (const double inertia : J) {
        t.shafts.push_back(shaft(inertia));
        t.shafts.back().loaded = true;
    }
    t.gears = {planetary(0, 1, 2, i)};
    const double per[] = {1.0 / i, -1.0, 1.0 - 1.0 / i};
    double driven = 0.0, compliance = 0.0;
    for (int s = 0; s < 3; ++s) {
        driven -= per[s] * load[s] / J[s];
        compliance += per[s] * per[s] / J[s];
    }
    const double T_2 = driven / compliance;
    for (const double tolerance : {0.0, 1e-10}) {
        const Recorded r(t, {constant(load[0]), constant(load[1]), constant(load[2])}, duration, 0.1, tolerance);
        REQUIRE(r.done());
        CHECK(at_end(r, "gear0_output_torque") == doctest::Approx(T_2).epsilon(1e-12));
        double momentum = 0.0;
        for (int s = 0; s < 3; ++s) {
            const double w = at_end(r, "shaft" + std::to_string(s) + "_speed");
            CHECK(w == doctest::Approx((-load[s] - per[s] * T_2) / J[s] * duration).epsilon(1e-12));
            momentum += J[s] * w;
        }
        CHECK(momentum == doctest::Approx(-(load[0] + load[1] + load[2]) * duration).epsilon(1e-12));
        if (tolerance == 0.0) CHECK(std::fabs(r.report.residual()) < 1e-12 * r.report.turned_over);
    }
}

// Sun to carrier 1 + z_r/z_s, with the ring at rest; sun to ring -z_r/z_s with the carrier at rest; carrier to ring
// 1 + z_s/z_r with the sun at rest. A brake on one shaft and a motor on another: the inertias at the motor.
TEST_CASE("with one of its shafts held a planetary gear has the ratio of Willis, whichever it is") {
    const double J[] = {0.2, 1.5, 0.7}, i = 4.0;
    const double per[] = {1.0 / i, -1.0, 1.0 - 1.0 / i};
    for (int held = 0; held < 3; ++held)
        for (int driven = 0; driven < 3; ++driven) {
            if (held == driven) continue;
            const int third = 3 - held - driven;
            Train t;
            for (const double inertia : J) t.shafts.push_back(shaft(inertia));
            t.shafts[held].friction.torque = 1e3;
            t.motors = {torque_motor(driven)};
            t.gears = {planetary(0, 1, 2, i)};
            const double turns = -per[driven] / per[third], inertia = J[driven] + J[third] * turns * turns;
            for (const double tolerance : {0.0, 1e-10}) {
                CAPTURE(held);
                CAPTURE(driven);
                const Recorded r(t, {constant(2.0)}, 1.0, 0.1, tolerance);
                REQUIRE(r.done());
                const auto speed = [&](int s) { return at_end(r, "shaft" + std::to_string(s) + "_speed"); };
                CHECK(speed(driven) == doctest::Approx(2.0 * t.motors[0].law.rated_torque / inertia).epsilon(1e-12));
                CHECK(speed(third) == doctest::Approx(turns * speed(driven)).epsilon(1e-12));
                CHECK(speed(held) == 0.0);
            }
        }
}

// Two compliant planetary gears on the same three shafts and a rigid one behind, free of torques: what they exchange
// changes neither momentum nor energy.
TEST_CASE("gears on housings that turn keep momentum and energy") {
    Train t;
    for (const double inertia : {0.2, 1.5, 0.7, 0.4}) t.shafts.push_back(shaft(inertia));
    t.shafts[3].loaded = true;
    Gear soft = spring(0, 1, 3.0, TorsionCurve({0.05}, {20.0, 60.0})),
         other = spring(2, 0, 1.7, TorsionCurve({}, {40.0}));
    soft.housing = 2;
    other.housing = 1;
    t.gears = {soft, other, planetary(1, 3, 2, 2.5)};
    const Assembly a(t);
    std::vector<double> x(static_cast<std::size_t>(a.layout().states));
    const auto speed = [&](std::size_t s) -> double& {
        return x[static_cast<std::size_t>(a.places().shafts[s].speed)];
    };
    speed(0) = 2.0;
    speed(1) = -1.0;
    speed(2) = 0.5;
    speed(3) = speed(1) / 2.5 + (1.0 - 1.0 / 2.5) * speed(2);
    x[static_cast<std::size_t>(a.places().gears[0].twist)] = 0.2;
    const double energy = stored_energy(a, x);
    double momentum = 0.0;
    for (std::size_t s = 0; s < 4; ++s) momentum += t.shafts[s].inertia * speed(s);
    for (const double tolerance : {0.0, 1e-12}) {
        const Recorded r(t, {constant(0.0)}, 10.0, 0.1, tolerance, x);
        REQUIRE(r.done());
        CHECK(r.report.switching_count > 20);
        double after = 0.0;
        for (std::size_t s = 0; s < 4; ++s)
            after += t.shafts[s].inertia * at_end(r, "shaft" + std::to_string(s) + "_speed");
        const double near = tolerance == 0.0 ? 1e-11 : 1e-9;
        CHECK(after == doctest::Approx(momentum).epsilon(near));
        CHECK(stored_energy(a, r.report.x) == doctest::Approx(energy).epsilon(near));
    }
}

// A transmission error over the angle of the sun relative to the ring, and viscous friction between the two.
Train with_error(bool free) {
    Train t;
    for (const double inertia : {0.2, 1.5, 0.7}) t.shafts.push_back(shaft(inertia));
    t.shafts[1].loaded = true;
    Gear g = spring(0, 1, 3.0, TorsionCurve({0.05}, {20.0, 60.0}));
    g.transmission_error = PeriodicCurve(1.0, {0.0, 0.3}, {0.0, 0.03});
    g.law.viscous_friction = 0.02;
    if (free) g.housing = 2;
    t.gears = {g};
    return t;
}

// Shafts that are free turn against one another in the same way, however fast all of them turn together. On a housing
// of great inertia a gear moves as on the frame.
TEST_CASE("a transmission error and viscous friction of a gear depend on what turns relative to its housing") {
    const auto run = [](const Train& t, double sun, double carrier, double ring, double tolerance) {
        const Assembly a(t);
        std::vector<double> x(static_cast<std::size_t>(a.layout().states));
        const double speed[] = {sun, carrier, ring};
        for (std::size_t s = 0; s < t.shafts.size(); ++s)
            x[static_cast<std::size_t>(a.places().shafts[s].speed)] = speed[s];
        x[static_cast<std::size_t>(a.places().gears[0].twist)] = 0.2;
        return Recorded(t, {constant(0.3)}, 4.0, 0.01, tolerance, x);
    };
    for (const double tolerance : {0.0, 1e-11}) {
        CAPTURE(tolerance);
        const double near = tolerance == 0.0 ? 1e-9 : 1e-7, together = 0.8;
        const Recorded still = run(with_error(true), 2.0, -1.0, 0.5, tolerance),
                       turning = run(with_error(true), 2.0 + together, -1.0 + together, 0.5 + together, tolerance);
        REQUIRE(still.done());
        REQUIRE(turning.done());
        CHECK(still.report.switching_count > 20);
        Train heavy = with_error(true), frame = with_error(false);
        heavy.shafts[2].inertia = 1e12;
        frame.shafts.pop_back();
        const Recorded on_heavy = run(heavy, 2.0, -1.0, 0.0, tolerance),
                       on_frame = run(frame, 2.0, -1.0, 0.0, tolerance);
        REQUIRE(on_heavy.done());
        REQUIRE(on_frame.done());
        for (std::size_t k = 0; k < still.samples; k += 10)
            for (const char* name : {"shaft0_speed", "shaft1_speed", "shaft2_speed"}) {
                CHECK(turning.channel(name)[k] - together ==
                      doctest::Approx(still.channel(name)[k]).scale(1.0).epsilon(near));
                if (name[5] != '2')
                    CHECK(on_heavy.channel(name)[k] ==
                          doctest::Approx(on_frame.channel(name)[k]).scale(1.0).epsilon(near));
            }
        if (tolerance == 0.0)
            for (const Recorded* r : {&still, &turning, &on_heavy})
                CHECK(std::fabs(r->report.residual()) < 1e-9 * r->report.turned_over);
        // All torques of the gear together are none.
        const auto momentum = [&](std::size_t k) {
            double sum = 0.0;
            for (std::size_t s = 0; s < 3; ++s)
                sum += with_error(true).shafts[s].inertia * still.channel("shaft" + std::to_string(s) + "_speed")[k];
            return sum;
        };
        CHECK(momentum(still.samples - 1) == doctest::Approx(momentum(0) - 0.3 * 4.0).epsilon(near));
    }
}

TEST_CASE("accelerations of trains with housings that turn are those of Gauss's principle of least constraint") {
    RandomTrains random(61, true);
    int housings = 0, at_rest = 0;
    for (int n = 0; n < 600; ++n) {
        Train t = random.train(random.pick(3, 6), false);
        if (!check(t).empty()) continue;
        for (Shaft& s : t.shafts) s.friction.breakaway_torque = 0.0;  // the principle needs one capacity
        const Assembly a(t);
        SwitchedTrain search(a);
        Instant now = random.instant(a, 0.0);
        Key key;
        CAPTURE(n);
        REQUIRE(search.start(now, key) == Found::yes);
        const std::vector<double> expected = least_constraint(a, now, 4000);
        for (std::size_t s = 0; s < expected.size(); ++s) {
            const double mine = evaluate(search.regimes()[key].rate[a.places().shafts[s].speed], now);
            CHECK(mine == doctest::Approx(expected[s]).scale(1.0).epsilon(1e-6));
            at_rest += mine == 0.0;
        }
        housings += std::any_of(t.gears.begin(), t.gears.end(), [](const Gear& g) { return g.housing != nowhere; });
    }
    CHECK(housings > 300);
    CHECK(at_rest > 200);
}

TEST_CASE("what is not possible with a housing that turns is refused in one line") {
    Train t;
    for (int s = 0; s < 3; ++s) t.shafts.push_back(shaft(1.0));
    t.motors = {torque_motor(0)};
    t.gears = {planetary(0, 1, 2, 3.0)};
    CHECK(check(named(t)).empty());
    const auto refused = [&](auto&& change, const char* words) {
        Train wrong = named(t);
        change(wrong);
        CHECK(check(wrong).reason.find(words) != std::string::npos);
    };
    refused([](Train& w) { w.gears[0].housing = 1; }, "give the housing a shaft of its own");
    refused([](Train& w) { w.gears[0].housing = 7; }, "which the train does not have");
    refused([](Train& w) { w.gears[0].efficiencies.emplace(0.9, 0.8); }, "losses");
    refused([](Train& w) { w.gears.push_back(planetary(0, 1, 2, 3.0)); }, "the same ratio");
    refused(
        [](Train& w) {
            w.gears.push_back(rigid_gear(0, 1, 2.0));
            w.gears.push_back(rigid_gear(0, 2, 5.0));
        },
        "another ratio");
    CHECK(check_start(named(t), {3.0, 1.0, 0.0}).empty());
    CHECK(check_start(named(t), {3.0, 1.0, 0.5}).find("housing") != std::string::npos);
    CHECK(check_start(named(t), {3.5, 1.5, 0.5}).empty());
}

}  // namespace lostmotion::model

TEST_SUITE_END();
