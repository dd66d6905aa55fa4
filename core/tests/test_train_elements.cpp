// Each element of a train against a closed form.
#include <doctest/doctest.h>

#include "paused_run.hpp"
#include "random_trains.hpp"
#include "recorded.hpp"

TEST_SUITE_BEGIN("train_elements");

namespace lostmotion::model {
namespace {

Gear worm(double eta_f, double eta_b) {
    Gear g = rigid_gear(0, 1, 50.0);
    g.efficiencies = MeshEfficiency(eta_f, eta_b);
    return g;
}
// A worm with 1e-4 kg m2 that turns a load at 2 rad/s, which drives it with 20 N m.
Train overrun_worm(double load_inertia, double stiffness) {
    Train t;
    t.shafts = {shaft(1e-4), shaft(load_inertia)};
    t.shafts[1].loaded = true;
    t.motors = {torque_motor(0)};
    t.gears = {worm(0.3, -0.2)};
    if (stiffness > 0.0) {
        t.gears[0].law.compliance = Gearbox::torsion_curve;
        t.gears[0].law.curve = TorsionCurve({}, {stiffness});
    }
    return t;
}

// The ledger of a run to `duration` from where a run has not yet begun.
TrainReport ledger_of(const TrainRun& run, double duration) {
    return Recorded(run.assembly.train(), run.inputs, duration, 0.1 * duration, 0.0, run.start(), run.start_memory())
        .report;
}
// Energies balance, and no loss gives any.
void check_energies(const TrainReport& report, double near, bool loses_only = true) {
    CHECK(std::fabs(report.residual()) <= near * report.turned_over);
    for (const TrainEnergy& e : report.energy)
        if (e.kind == PowerFlow::loss && loses_only) CHECK(e.energy >= -1e-12);
}

}  // namespace

TEST_CASE("a rigid self-locking worm stops an overrunning load and holds it") {
    TrainRun run(overrun_worm(0.5, 0.0));
    run.speed(0) = 100.0;
    run.speed(1) = 2.0;
    run.inputs[run.load(1)] = constant(-20.0);
    REQUIRE(run.begin());
    // J_1 w' = -eta_b T_2/i and J_Z w'/i = T_2 + M: |eta_b| M/i/(J_1 - |eta_b| J_Z/i^2) = 1333.33 rad/s^2.
    CHECK(run.acceleration(0) == doctest::Approx(-4000.0 / 3.0));
    CHECK(run.value(run.regime().output_torque[0]) == doctest::Approx(-100.0 / 3.0));
    REQUIRE(run.run(0.2));
    REQUIRE(run.events.size() == 1);
    CHECK(run.events[0].time == doctest::Approx(0.075));
    CHECK(run.speed(0) == 0.0);
    CHECK(run.speed(1) == 0.0);
    CHECK(run.value(run.regime().output_torque[0]) == doctest::Approx(-20.0));
}

TEST_CASE("a rigid self-locking worm with a heavy load jams: no motion is consistent") {
    TrainRun run(overrun_worm(2.0, 0.0));
    run.speed(0) = 100.0;
    run.speed(1) = 2.0;
    run.inputs[run.load(1)] = constant(-20.0);
    CHECK(!run.begin());
    CHECK(run.status == Status::jammed);
}

TEST_CASE("a compliant self-locking worm with a heavy load chatters, and gives no energy") {
    // A motor that would lower steadily at 100 rad/s: M_D = |eta_b| M/i + b w.
    Train t = overrun_worm(2.0, 1e4);
    t.shafts[0].viscous_friction = 4e-4;
    TrainRun run(t);
    run.inputs[run.command(0)] = constant(0.08 + 0.04);
    run.speed(0) = 99.0;
    run.speed(1) = 2.0;
    run.twist(0) = -2e-3;  // T_2 = -20 N m
    run.inputs[run.load(1)] = constant(-20.0);
    check_energies(ledger_of(run, 1.0), 1e-10);
    REQUIRE(run.begin());
    // d'' = lambda^2 d with lambda^2 = k (|eta_b|/(J_1 i^2) - 1/J_Z).
    const Row &in = run.regime().rate[run.assembly.places().shafts[0].speed],
              &out = run.regime().rate[run.assembly.places().shafts[1].speed];
    const int d = run.assembly.places().gears[0].twist;
    CHECK(std::sqrt(in.c[d] / 50.0 - out.c[d]) == doctest::Approx(54.772255750516614));
    REQUIRE(run.run(1.0));
    int stops = 0;
    for (const TrainRun::Switching& e : run.events) stops += e.kind == Guard::speed && e.contact == 0;
    CHECK(stops > 3);
}

TEST_CASE("the least motor torque that lowers a load on a self-locking worm is |eta_b| M/i") {
    for (const double share : {0.99, 1.01}) {
        TrainRun run(overrun_worm(0.5, 0.0));
        run.inputs[run.load(1)] = constant(-20.0);
        run.now.memory[0] = -20.0;
        run.inputs[run.command(0)] = constant(share * 0.2 * 20.0 / 50.0);
        REQUIRE(run.run(0.1));
        CHECK((run.speed(0) > 0.0) == (share > 1.0));
        CHECK((run.speed(0) == 0.0) == (share < 1.0));
    }
}

TEST_CASE("two rigid stages are one of the product ratio, losses included") {
    for (const double torque : {3.0, -3.0}) {
        Train one, two;
        one.shafts = {shaft(0.1), shaft(2.0)};
        // The shaft between counts at the input with the efficiency of the first stage in this direction.
        const double between = 0.3;
        one.shafts[0].inertia += between / 4.0 * (torque > 0.0 ? 1.0 / 0.8 : 0.6);
        two.shafts = {shaft(0.1), shaft(between), shaft(2.0)};
        one.motors = two.motors = {torque_motor(0)};
        one.gears = {rigid_gear(0, 1, 6.0)};
        two.gears = {rigid_gear(0, 1, 2.0), rigid_gear(1, 2, 3.0)};
        one.gears[0].efficiencies = MeshEfficiency(0.8 * 0.7, 0.6 * 0.5);
        two.gears[0].efficiencies = MeshEfficiency(0.8, 0.6);
        two.gears[1].efficiencies = MeshEfficiency(0.7, 0.5);
        TrainRun a(one), b(two);
        a.speed(0) = b.speed(0) = 12.0;
        a.speed(1) = b.speed(2) = 2.0;
        b.speed(1) = 6.0;
        a.inputs[0] = b.inputs[0] = constant(torque);
        REQUIRE(a.run(0.3));
        REQUIRE(b.run(0.3));
        CHECK(a.speed(0) == doctest::Approx(b.speed(0)).epsilon(1e-13));
        CHECK(a.speed(1) == doctest::Approx(b.speed(2)).epsilon(1e-13));
    }
}

TEST_CASE("stick-slip under a drive of constant speed has its closed form") {
    const double J = 0.5, k = 40.0, v = 0.3, T_S = 3.0, T_C = 2.0;
    Train t;
    t.shafts = {shaft(1e12), shaft(J)};
    t.shafts[1].friction.torque = T_C;
    t.shafts[1].friction.breakaway_torque = T_S;
    t.gears = {spring(0, 1, 1.0, TorsionCurve({}, {k}))};
    TrainRun run(t);
    run.speed(0) = v;
    REQUIRE(run.run(3.0));
    const double omega = std::sqrt(k / J), slip = (2.0 * pi - 2.0 * std::atan((T_S - T_C) / (v * J * omega))) / omega,
                 stick = 2.0 * (T_S - T_C) / (k * v);
    REQUIRE(run.events.size() >= 4);
    CHECK(run.events[0].time == doctest::Approx(T_S / (k * v)).epsilon(1e-11));
    CHECK(run.events[1].time - run.events[0].time == doctest::Approx(slip).epsilon(1e-10));
    CHECK(run.events[2].time - run.events[1].time == doctest::Approx(stick).epsilon(1e-10));
    CHECK(run.events[3].time - run.events[2].time == doctest::Approx(slip).epsilon(1e-10));
}

TEST_CASE("friction that falls with speed is followed from piece to piece") {
    Train t;
    t.shafts = {shaft(2.0)};
    t.shafts[0].friction.speeds = {0.0, 1.0, 3.0};
    t.shafts[0].friction.torques = {4.0, 1.0, 2.0};
    TrainRun run(t);
    run.speed(0) = 3.0;
    REQUIRE(run.run(10.0));
    // J w' = -(a + b w): the time from one speed to another is J/b ln of the ratio of the torques.
    REQUIRE(run.events.size() == 2);
    CHECK(run.events[0].time == doctest::Approx(2.0 / 0.5 * std::log(2.0)).epsilon(1e-11));
    CHECK(run.events[1].time - run.events[0].time == doctest::Approx(2.0 / 3.0 * std::log(4.0)).epsilon(1e-11));
    CHECK(run.speed(0) == 0.0);
}

TEST_CASE("Stribeck's curve is met within its stated error") {
    const DryFriction f = DryFriction::stribeck(1.0, 2.5, 0.2, 1e-3);
    double worst = 0.0;
    for (double w = 0.0; w < 2.0; w += 1e-4)
        worst = std::fmax(worst, std::fabs(f.sliding(w) - (1.0 + 1.5 * std::exp(-w * w / 0.04))));
    CHECK(worst <= 1e-3 * (1.0 + 1e-12));
    CHECK(worst > 5e-4);
}

TEST_CASE("quadratic drag slows a shaft down as 1/t, to the stated error") {
    const double c = 0.02, J = 0.5, error = 1e-3;
    Train t;
    t.shafts = {shaft(J)};
    t.shafts[0].drag = Shaft::quadratic_drag(c, 20.0, error);
    for (const double sign : {1.0, -1.0}) {
        TrainRun run(t);
        run.speed(0) = 20.0 * sign;
        REQUIRE(run.run(2.0));
        // A difference of the torque moves the speed by its integral over J at most: drag pulls speeds together.
        CHECK(std::fabs(sign * run.speed(0) - 20.0 / (1.0 + c * 20.0 / J * 2.0)) < error / J * 2.0);
        CHECK(run.events.size() > 3);
    }
}

TEST_CASE("a clutch brings two shafts to one speed and slips again when asked for too much") {
    Train t;
    t.shafts = {shaft(1.0), shaft(3.0)};
    t.shafts[1].loaded = true;
    t.clutches = {{"clutch", 0, 1, 6.0}};
    TrainRun run(t);
    run.speed(0) = 8.0;
    const int u = run.assembly.places().couplings[0]->command;
    run.inputs[u] = lines({{}, {1.0, 0.5}});
    run.inputs[run.load(1)] = lines({{}, {4.0, 0.0, 2.0}});
    REQUIRE(run.run(3.9));
    // T = 3 from t = 1: the speeds meet after 8/(3 (1 + 1/3)) = 2 s at 8 - 3 * 2 = 2 rad/s.
    REQUIRE(run.events.size() == 1);
    CHECK(run.events[0].time == doctest::Approx(3.0));
    CHECK(run.speed(0) == doctest::Approx(2.0));
    CHECK(run.speed(1) == run.speed(0));
    // The clutch passes on J_0/(J_0 + J_1) of the load: it slips at a load of 12, 6 s later.
    REQUIRE(run.run(11.0));
    REQUIRE(run.events.size() == 2);
    CHECK(run.events[1].time == doctest::Approx(10.0));
    CHECK(run.mode(0) == +1);
}

TEST_CASE("a freewheel takes hold when its input catches up and lets go when it falls back") {
    Train t;
    t.shafts = {shaft(1.0), shaft(2.0)};
    t.motors = {torque_motor(0)};
    t.freewheels = {{"freewheel", 0, 1}};
    TrainRun run(t);
    run.speed(1) = 4.0;
    run.inputs[run.command(0)] = lines({{0.0, 2.0}, {5.0, -3.0}});
    REQUIRE(run.begin());
    CHECK(run.mode(0) == -1);
    REQUIRE(run.run(5.0));
    REQUIRE(run.events.size() == 1);
    CHECK(run.events[0].time == doctest::Approx(2.0));
    CHECK(run.speed(1) == doctest::Approx(6.0));  // 4 + 2/3 * 3
    CHECK(run.speed(0) == run.speed(1));
    REQUIRE(run.run(6.0));
    CHECK(run.mode(0) == -1);
    CHECK(run.speed(0) == doctest::Approx(3.0));
    CHECK(run.speed(1) == doctest::Approx(6.0));
}

TEST_CASE("the slip of two shafts on a damper decays exponentially, their momentum stays, what is lost is heat") {
    const double J[] = {2.0, 3.0}, d = 0.6;
    Train t;
    t.shafts = {shaft(J[0]), shaft(J[1])};
    t.dampers = {{"damper", 0, 1, d}};
    TrainRun run(t);
    run.speed(0) = 5.0;
    run.speed(1) = -1.0;
    check_energies(ledger_of(run, 5.0), 1e-10);
    REQUIRE(run.layout().contacts == 0);
    REQUIRE(run.layout().angles == 2);  // it holds nothing together
    REQUIRE(run.begin());
    const double momentum = J[0] * 5.0 - J[1] * 1.0;
    for (int k = 1; k <= 5; ++k) {
        REQUIRE(run.run(k));
        CHECK(run.speed(0) - run.speed(1) == doctest::Approx(6.0 * std::exp(-d * (1.0 / J[0] + 1.0 / J[1]) * k)));
        CHECK(J[0] * run.speed(0) + J[1] * run.speed(1) == doctest::Approx(momentum).epsilon(1e-13));
    }
    CHECK(run.events.empty());
}

TEST_CASE("a damper with a curve passes from piece to piece of its drag at the slip of their edge") {
    const double J = 1.2, steep = 2.0, flat = 0.5, edge = 1.0, from = 4.0;  // J: both inertias in series
    for (const double way : {1.0, -1.0}) {
        Train t;
        t.shafts = {shaft(2.0), shaft(3.0)};
        t.dampers = {{"damper", 0, 1, 0.0, TorsionCurve({edge}, {steep, flat})}};
        TrainRun run(t);
        run.speed(0) = way * from;
        REQUIRE(run.run(6.0));
        // J s' = -(flat s + c) down to the edge, then -steep s.
        const double c = (steep - flat) * edge, at = J / flat * std::log((flat * from + c) / (flat * edge + c));
        REQUIRE(run.events.size() == 1);
        CHECK(run.events[0].kind == Guard::edge);
        CHECK(run.events[0].time == doctest::Approx(at).epsilon(1e-10));
        CHECK(run.speed(0) - run.speed(1) ==
              doctest::Approx(way * edge * std::exp(-steep / J * (6.0 - at))).epsilon(1e-9));
        CHECK(2.0 * run.speed(0) + 3.0 * run.speed(1) == doctest::Approx(way * 2.0 * from).epsilon(1e-13));
    }
}

TEST_CASE("a shaft behind a damper does not creep while its friction holds, and turns once the slip overcomes it") {
    const double J = 2.0, d = 0.8, M = 3.0, T = 2.0;
    Train t;
    t.shafts = {shaft(J), shaft(1.0)};
    t.shafts[1].friction.torque = T;
    t.motors = {torque_motor(0)};
    t.dampers = {{"damper", 0, 1, d}};
    TrainRun run(t);
    run.inputs[run.command(0)] = constant(M);
    REQUIRE(run.begin());
    // w = M/d (1 - exp(-d t/J)) until d w = T.
    const double at = -J / d * std::log(1.0 - T / M);
    REQUIRE(run.run(0.99 * at));
    CHECK(run.mode(0) == 0);
    CHECK(run.speed(1) == 0.0);
    CHECK(run.value(run.regime().contact_torque[0]) == doctest::Approx(d * run.speed(0)));
    REQUIRE(run.run(1.01 * at));
    REQUIRE(run.events.size() == 1);
    CHECK(run.events[0].time == doctest::Approx(at).epsilon(1e-10));
    CHECK(run.speed(1) > 0.0);
}

TEST_CASE("a damper beside a closed clutch passes nothing on until that slips") {
    Train t;
    t.shafts = {shaft(1.0), shaft(3.0)};
    t.shafts[1].loaded = true;
    t.clutches = {{"clutch", 0, 1, 6.0, 0.0, true}};
    t.dampers = {{"damper", 1, 0, 0.3, TorsionCurve({0.1}, {0.0, 2.0})}};
    TrainRun run(t);
    run.speed(0) = run.speed(1) = 1.0;
    run.inputs[run.load(1)] = lines({{}, {4.0, 0.0, 2.0}});
    REQUIRE(run.begin());
    // The clutch alone passes on a quarter of the load, up to 24 N m.
    REQUIRE(run.run(15.0));
    CHECK(run.speed(0) == run.speed(1));
    CHECK(run.value(run.regime().contact_torque[0]) == doctest::Approx(22.0 / 4.0));
    REQUIRE(run.run(20.0));
    REQUIRE(run.events.size() == 2);
    CHECK(run.events[0].time == doctest::Approx(16.0));
    CHECK(run.events[1].kind == Guard::edge);
    CHECK(run.speed(0) > run.speed(1) + 0.1);
}

TEST_CASE("a holding brake stops a shaft, holds its load and lets it go") {
    Train t;
    t.shafts = {shaft(2.0)};
    t.shafts[0].loaded = true;
    t.shafts[0].friction.torque = 1.0;
    t.brakes = {{"brake", 0, 10.0}};
    TrainRun run(t);
    run.speed(0) = 6.0;
    run.inputs[run.load(0)] = constant(5.0);
    run.inputs[run.assembly.places().acting[0]->command] = lines({{}, {0.5, 1.0}, {2.0, 0.2}});
    REQUIRE(run.run(2.5));
    // w' = -3 until 0.5 s, then -(1 + 10 + 5)/2 = -8: at rest after 4.5/8 s more.
    REQUIRE(run.events.size() == 1);
    CHECK(run.events[0].time == doctest::Approx(0.5 + 4.5 / 8.0));
    CHECK(run.speed(0) == doctest::Approx(-0.5 * (5.0 - 3.0) / 2.0));
}

TEST_CASE("a shaft flies to and fro between two elastic end stops") {
    const double J = 2.0, k = 800.0, gap = 0.3, rest = 0.1, v = 1.5;
    Train t;
    t.shafts = {shaft(J)};
    t.springs = {{"stops", 0, TorsionCurve({gap}, {0.0, k}), rest}};
    TrainRun run(t);
    run.speed(0) = v;
    REQUIRE(run.begin());
    const double flight = 2.0 * gap / v, contact = pi / std::sqrt(k / J), first = (gap + rest) / v;
    REQUIRE(run.run(first + 2.5 * flight + 3.0 * contact));
    REQUIRE(run.events.size() == 6);
    for (int n = 0; n < 6; ++n)
        CHECK(run.events[static_cast<std::size_t>(n)].time ==
              doctest::Approx(first + n / 2 * (flight + contact) + n % 2 * contact).epsilon(1e-12));
    CHECK(run.speed(0) == doctest::Approx(-v).epsilon(1e-12));
}

TEST_CASE("damped flanks part while they would pull, and fly through the gap") {
    const double k = 400.0, c = 8.0, J = 1.0, gap = 0.01, v = 0.5;
    Train t;
    t.shafts = {shaft(J), shaft(1e12)};
    t.gears = {spring(0, 1, 1.0, TorsionCurve({gap}, {0.0, k}))};
    t.gears[0].mesh_damping = c;
    TrainRun run(t);
    run.speed(0) = v;
    REQUIRE(run.run(0.5));
    // x'' + 2 delta x' + k/J x = 0 from x = 0, x' = v: k x + c x' = 0 where tan(omega t) = -c omega/(k - c delta).
    const double delta = 0.5 * c / J, omega = std::sqrt(k / J - delta * delta);
    const double touching = (pi - std::atan(c * omega / (k - c * delta))) / omega;
    const double x = v / omega * std::exp(-delta * touching) * std::sin(omega * touching),
                 rebound = v * std::exp(-delta * touching) *
                           (delta / omega * std::sin(omega * touching) - std::cos(omega * touching));
    REQUIRE(run.events.size() >= 4);
    CHECK(run.events[0].time == doctest::Approx(gap / v));
    CHECK(run.events[1].time - run.events[0].time == doctest::Approx(touching).epsilon(1e-9));
    CHECK(run.events[2].time - run.events[1].time == doctest::Approx(x / rebound).epsilon(1e-9));
    CHECK(run.events[3].time - run.events[2].time == doctest::Approx(2.0 * gap / rebound).epsilon(1e-9));
    CHECK(run.value(run.regime().output_torque[0]) <= 0.0);
}

TEST_CASE("a pendulum swings with the period of the elliptic integral, to the stated error of gravity") {
    const double J = 0.8, mgr = 25.0, angle = 2.0;
    double before = 1.0;
    for (const double error : {0.1, 0.001}) {
        Train t;
        t.shafts = {shaft(J)};
        t.angle_torques = {{"gravity", 0, PeriodicCurve::sine(-mgr, 1, 0.0, error)}};
        TrainRun run(t);
        run.shaft_angle(0) = angle;
        REQUIRE(run.begin());
        const double period = 4.0 * std::sqrt(J / mgr) * std::comp_ellint_1(std::sin(0.5 * angle));
        REQUIRE(run.run(period));
        // Starts and ends at rest: the angle departs by half the acceleration times the square of what the period is
        // off.
        const double off = std::fabs(run.speed(0)) / (mgr / J * std::sin(angle)) / period;
        CHECK(off < error / mgr * 5.0);
        CHECK(off < before);
        before = off;
    }
}

TEST_CASE("a chord of gravity departs by the stated error at most") {
    for (const double phase : {0.0, 0.7})
        for (const double error : {1.0, 0.01}) {
            const PeriodicCurve f = PeriodicCurve::sine(25.0, 3, phase, error);
            double worst = 0.0, mean = f.integral(f.period());
            for (double phi = -3.0; phi < 3.0; phi += 1e-4)
                worst = std::fmax(worst, std::fabs(f(phi) - 25.0 * std::sin(3.0 * phi + phase)));
            CHECK(worst <= error);
            CHECK(worst > 0.4 * error);
            CHECK(std::fabs(mean) < 1e-12);
        }
}

TEST_CASE("a pendulum held by friction stays") {
    Train t;
    t.shafts = {shaft(1.0)};
    t.shafts[0].friction.torque = 100.0;
    t.angle_torques = {{"gravity", 0, PeriodicCurve::sine(-25.0, 1, 0.0, 0.01)}};
    TrainRun run(t);
    run.shaft_angle(0) = 1.2;
    REQUIRE(run.run(3.0));
    CHECK(run.speed(0) == 0.0);
    CHECK(run.shaft_angle(0) == 1.2);
    CHECK(run.events.empty());
}

TEST_CASE("cogging takes nothing over whole turns, forward and backward") {
    for (const double sign : {1.0, -1.0}) {
        Train t;
        t.shafts = {shaft(1.0)};
        t.angle_torques = {{"cogging", 0, PeriodicCurve::sine(0.5, 6, 0.0, 0.05)}};
        TrainRun run(t);
        run.speed(0) = sign * 3.0;
        REQUIRE(run.begin());
        const PeriodicCurve& f = t.angle_torques[0].torque;
        const double start = 0.5 * 9.0 - f.integral(0.0);
        for (int n = 1; n < 40; ++n) {
            REQUIRE(run.run(0.1 * n));
            CHECK(0.5 * run.speed(0) * run.speed(0) - f.integral(run.shaft_angle(0)) == doctest::Approx(start));
        }
        CHECK(std::fabs(run.shaft_angle(0)) > 10.0);
    }
}

TEST_CASE("a transmission error turns the output by itself and takes no energy") {
    Train t;
    t.shafts = {shaft(1e-2), shaft(0.5)};
    t.gears = {spring(0, 1, 2.0, TorsionCurve({}, {200.0}))};
    t.gears[0].transmission_error = PeriodicCurve::sine(0.01, 5, 0.3, 1e-4);
    TrainRun run(t);
    run.speed(0) = 8.0;
    run.speed(1) = 4.0;
    REQUIRE(run.begin());
    const PeriodicCurve& e = t.gears[0].transmission_error;
    const double before = stored_energy(run.assembly, run.now.x);
    REQUIRE(run.run(2.0));
    CHECK(run.twist(0) ==
          doctest::Approx(run.shaft_angle(0) / 2.0 - run.angle(0) - e(run.shaft_angle(0)) + e(0.0)).epsilon(1e-10));
    CHECK(std::fabs(run.twist(0)) > 1e-5);
    CHECK(stored_energy(run.assembly, run.now.x) == doctest::Approx(before).epsilon(1e-11));
}

TEST_CASE("a torque source gives its limit, no more") {
    Train t;
    t.shafts = {shaft(2.0)};
    t.motors = {torque_motor(0)};
    t.motors[0].torque_limit = 3.0;
    TrainRun run(t);
    run.inputs[0] = lines({{0.0, 0.0, 2.0}});
    REQUIRE(run.run(4.0));
    // 2 t until 1.5 s, 3 from then on.
    REQUIRE(run.events.size() == 1);
    CHECK(run.events[0].time == doctest::Approx(1.5));
    CHECK(run.speed(0) == doctest::Approx((1.5 * 1.5 + 3.0 * 2.5) / 2.0));
}

TEST_CASE("the energy of random trains balances, and no loss gives energy") {
    RandomTrains random(41);
    int ran = 0;
    std::size_t switchings = 0;
    for (int n = 0; n < 40; ++n) {
        TrainRun run(random.train(random.pick(2, 6), true));
        run.now = random.instant(run.assembly, 0.3);
        for (int i = 0; i < run.layout().inputs; ++i) {
            run.inputs[i] = sine(random.uniform(0.0, 2.0), random.uniform(1.0, 9.0) / (2.0 * pi));
            run.inputs[i].breakpoints[0].value = random.uniform(-1.0, 1.0);
        }
        CAPTURE(n);
        const TrainReport report = ledger_of(run, 0.8);
        if (report.time == 0.0) continue;
        REQUIRE(report.status == Status::done);
        ++ran;
        switchings += report.switching_count;
        const auto& gears = run.assembly.train().gears;
        check_energies(report, 1e-9,
                       std::none_of(gears.begin(), gears.end(), [](const Gear& g) { return g.law.efficiency < 1.0; }));
    }
    CHECK(ran > 35);
    CHECK(switchings > 500);
}

}  // namespace lostmotion::model

TEST_SUITE_END();
