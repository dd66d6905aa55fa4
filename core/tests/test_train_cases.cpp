// Whole trains whose motion is known: chains, a worm on a coupling, two motors on one ring, play with damping.
#include <doctest/doctest.h>

#include "paused_run.hpp"

TEST_SUITE_BEGIN("train_cases");

namespace lostmotion::model {

TEST_CASE("a free chain of four equal masses keeps swinging in each of its modes") {
    const double J = 0.2, k = 50.0;
    const int n = 4;
    for (int mode = 1; mode < n; ++mode) {
        Train t;
        for (int s = 0; s < n; ++s) t.shafts.push_back(shaft(J));
        for (int g = 0; g + 1 < n; ++g) t.gears.push_back(spring(g, g + 1, 1.0, TorsionCurve({}, {k})));
        TrainRun run(t);
        const auto shape = [&](int s) { return std::cos(pi * mode * (s + 0.5) / n); };
        for (int s = 0; s < n; ++s) run.speed(s) = shape(s);
        REQUIRE(run.run(3.0));
        const double omega = 2.0 * std::sqrt(k / J) * std::sin(0.5 * pi * mode / n);
        for (int s = 0; s < n; ++s)
            CHECK(run.speed(s) == doctest::Approx(shape(s) * std::cos(3.0 * omega)).scale(1.0).epsilon(1e-11));
    }
}

TEST_CASE("a stiff coupling in a chain makes a difference that falls with its stiffness") {
    // Motor - (coupling) - worm - load; the coupling is damped, so that its own swing dies out.
    Train two;
    two.shafts = {shaft(3e-4), shaft(0.5)};
    two.motors = {torque_motor(0)};
    two.gears = {spring(0, 1, 20.0, TorsionCurve({}, {2000.0}))};
    two.gears[0].efficiencies = MeshEfficiency(0.6, -0.1);
    TrainRun reference(two);
    reference.inputs[0] = constant(0.1);
    REQUIRE(reference.run(0.5));
    double before = 0.0;
    for (const double k : {1e2, 1e3, 1e4}) {
        Train three = two;
        three.shafts = {shaft(2e-4), shaft(1e-4), shaft(0.5)};
        three.gears[0].input = 1;
        three.gears[0].output = 2;
        Gear coupling = spring(0, 1, 1.0, TorsionCurve({}, {k}));
        coupling.mesh_damping = 0.01 * std::sqrt(k);
        three.gears.insert(three.gears.begin(), coupling);
        TrainRun run(three);
        run.inputs[0] = constant(0.1);
        REQUIRE(run.run(0.5));
        const double difference = std::fabs(run.speed(2) / reference.speed(1) - 1.0);
        // The rotor lags by T/k: first order in the compliance.
        if (before > 0.0) CHECK(difference < before / 5.0);
        before = difference;
    }
    CHECK(before < 2000.0 / (1e4 * 20.0 * 20.0));  // the share of the coupling in the compliance of the chain
}

TEST_CASE("the rotor rings on its coupling while a loaded self-locking worm stays locked") {
    const double J_M = 2e-4, k_1 = 5.0, swing = 0.01;
    Train t;
    t.shafts = {shaft(J_M), shaft(1e-4), shaft(0.5)};
    t.shafts[2].loaded = true;
    t.gears = {spring(0, 1, 1.0, TorsionCurve({}, {k_1})), rigid_gear(1, 2, 50.0)};
    t.gears[1].efficiencies = MeshEfficiency(0.3, -0.2);
    TrainRun run(t);
    run.inputs[run.load(2)] = constant(-20.0);
    run.twist(0) = swing;  // the worm holds |eta_b| M/i = 0.08 N m of the motor's side, the coupling brings 0.05
    REQUIRE(run.begin());
    for (const double time : {0.01, 0.037, 0.2}) {
        REQUIRE(run.run(time));
        CHECK(run.twist(0) ==
              doctest::Approx(swing * std::cos(std::sqrt(k_1 / J_M) * time)).scale(swing).epsilon(1e-10));
        CHECK(run.speed(1) == 0.0);
        CHECK(run.speed(2) == 0.0);
    }
    CHECK(run.events.empty());
}

TEST_CASE("two motors on one ring: a bias keeps the play closed until the instant of the closed form") {
    const double i = 10.0, J_M = 1e-3, J_R = 1.0, k = 4e5, gap = 1e-3, bias = 0.5, rate = 0.4;
    Train t;
    t.shafts = {shaft(J_M), shaft(J_M), shaft(J_R)};
    t.motors = {torque_motor(0), torque_motor(1)};
    const TorsionCurve play({gap}, {0.0, k});
    t.gears = {spring(0, 2, i, play), spring(1, 2, i, play)};
    TrainRun run(t);
    // Both are pressed against their flanks by i * bias from the start.
    run.twist(0) = gap + i * bias / k;
    run.twist(1) = -run.twist(0);
    run.inputs[run.command(0)] = lines({{0.0, bias, -rate}});
    run.inputs[run.command(1)] = constant(-bias);
    REQUIRE(run.run(1.5));
    // All turn together with alpha = -i rate t/J; the first mesh carries i (bias - rate t) - i^2 J_M alpha. The swing
    // that the beginning of the ramp starts shifts the instant by 1/omega at most.
    const double J = J_R + 2.0 * i * i * J_M, share = 1.0 - i * i * J_M / J, opens = bias / (rate * share);
    REQUIRE(!run.events.empty());
    CHECK(run.events[0].kind == Guard::edge);
    CHECK(run.events[0].branch == run.assembly.places().gears[0].piece);
    CHECK(std::fabs(run.events[0].time - opens) < 1.0 / std::sqrt(k / (i * i * J_M)));
}

TEST_CASE("play with damping follows an independent integration") {
    // J = 5 kg m2 on a play of 45 degrees with c = 2e4 N m/rad and d = 50 N m s/rad.
    const double J = 5.0, c = 2e4, d = 50.0, half = pi / 8.0, w_0 = 3.0;
    Train t;
    t.shafts = {shaft(J), shaft(1e15)};
    t.shafts[0].loaded = true;
    t.gears = {spring(0, 1, 1.0, TorsionCurve({half}, {0.0, c}))};
    t.gears[0].mesh_damping = d;
    TrainRun run(t);
    run.speed(0) = w_0;
    run.inputs[0] = sine(10.0, 4.0 / (2.0 * pi));
    run.inputs[0].breakpoints[0].value = 1.0;
    REQUIRE(run.begin());
    double phi = 0.0, w = w_0;
    const auto acceleration = [&](double time, double x, double v) {
        double torque = 0.0;
        if (x > half) torque = std::fmax(0.0, c * (x - half) + d * v);
        if (x < -half) torque = std::fmin(0.0, c * (x + half) + d * v);
        return -(torque + 1.0 + 10.0 * std::sin(4.0 * time)) / J;
    };
    const double h = 1e-5;
    int impacts = 0;
    for (int n = 0; n < 200000; ++n) {
        const double time = n * h, before = phi;
        const double k1 = acceleration(time, phi, w), k2 = acceleration(time + h / 2, phi + h / 2 * w, w + h / 2 * k1),
                     k3 = acceleration(time + h / 2, phi + h / 2 * w + h * h / 4 * k1, w + h / 2 * k2),
                     k4 = acceleration(time + h, phi + h * w + h * h / 2 * k2, w + h * k3);
        phi += h * w + h * h / 6 * (k1 + k2 + k3);
        w += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
        impacts += std::fabs(phi) > half && std::fabs(before) <= half;
        if ((n + 1) % 20000 != 0) continue;
        REQUIRE(run.run((n + 1) * h));
        // The steps miss the instants of impact by half their length, at a jump of d w/J in the acceleration.
        CHECK(run.twist(0) == doctest::Approx(phi).scale(1.0).epsilon(1e-4));
        CHECK(run.speed(0) == doctest::Approx(w).scale(1.0).epsilon(1e-3));
    }
    CHECK(impacts >= 4);
}

}  // namespace lostmotion::model

TEST_SUITE_END();
