// The referee against closed forms, and the exact solver against the referee.
#include <doctest/doctest.h>

#include <cstdio>

#include "referee_compare.hpp"
#include "round_drives.hpp"

namespace lostmotion::test {
using namespace referee;
using doctest::Approx;

namespace {

Result judge(const Drive& drive, const Signals& signals, double duration, double interval,
             const std::array<double, n_states>& start = {}) {
    Case c = case_of(drive, signals, duration, interval);
    c.start = start;
    return referee_run(c);
}

std::vector<double> instants(const Result& r, int ContactModes::* contact) {
    std::vector<double> times;
    for (const Switch& w : r.switchings)
        if (w.before.*contact != w.after.*contact) times.push_back(w.time);
    return times;
}

// Losses a_forward mu where the motor drives, a_back |mu| where the load drives; none at no load.
Drive proportional_losses(Drive d, double a_forward, double a_back) {
    d.gearbox.losses = Gearbox::loss_map;
    d.gearbox.map = LossMap({0.0, 1.0}, {-1.0, 0.0, 1.0}, {a_back, a_back, 0.0, 0.0, a_forward, a_forward});
    d.gearbox.rated_output_torque = 10.0;
    return d;
}

Drive sprung(Drive d, double stiffness, double eta_H = 1.0) {
    set_curve(d, {}, {stiffness});
    d.gearbox.hysteresis_efficiency = eta_H;
    return d;
}

Series polynomial_with_roots(const std::vector<Quad>& roots, Quad factor) {
    Series p(factor);
    for (const Quad root : roots) {
        Series next;
        for (int k = 0; k <= order; ++k) next[k] = (k > 0 ? p[k - 1] : Quad(0)) - root * p[k];
        p = next;
    }
    return p;
}

}  // namespace

TEST_SUITE("referee") {
    TEST_CASE("first zero: simple, double, triple, near misses and pairs") {
        const Quad tolerance = 1e-28;
        const auto gap = [&](const std::vector<Quad>& roots, Quad factor) {
            const Quad found = FirstZero::of(polynomial_with_roots(roots, factor), tolerance);
            return static_cast<double>(magnitude(found - roots[0]));
        };
        CHECK(gap({0.3, 0.7, 1.5}, -1) < 1e-31);
        CHECK(gap({0.5, 2}, 1) < 1e-31);  // where the interval is halved
        CHECK(gap({0.3, 0.3, -1}, 1) < 1e-26);
        CHECK(gap({0.5, 0.5, -1}, 1) < 1e-26);
        CHECK(gap({0.6, 0.6, 0.6}, -1) < 1e-24);
        CHECK(gap({0.4, Quad(0.4) + Quad(1e-12), 3}, -1) < 1e-18);
        // A dip to 1e-20 above zero is none.
        Series p = polynomial_with_roots({0.3, 0.3, -1}, 1);
        p[0] += Quad(1e-20);
        CHECK(FirstZero::of(p, tolerance) > 1);
        p[0] -= Quad(2e-20);
        const double at = static_cast<double>(FirstZero::of(p, tolerance));
        CHECK(0.3 - at == Approx(std::sqrt(1e-20 / 1.3)).epsilon(1e-4));
    }

    TEST_CASE("its loss map and torsion curve are those of the library") {
        RandomDrives random(11);
        for (int n = 0; n < 20; ++n) {
            const LossMap map = random.loss_map();
            const Map own(map);
            for (int k = 0; k < 100; ++k) {
                const double mu = random.uniform(-4.0, 4.0), v = random.uniform(0.0, 3.0);
                CHECK(static_cast<double>(own(mu, v)) == Approx(map(mu, v)).epsilon(1e-12));
            }
            for (const StandstillCell& cell : own.standstill()) {
                const double lower = cell.range.open_below ? -3.0 : static_cast<double>(cell.range.lower);
                const double upper = cell.range.open_above ? 3.0 : static_cast<double>(cell.range.upper);
                const double mu = random.uniform(std::fmin(lower, upper), std::fmax(lower, upper));
                if ((cell.range.open_below && mu > static_cast<double>(cell.range.upper)) ||
                    (cell.range.open_above && mu < static_cast<double>(cell.range.lower)))
                    continue;
                CHECK(static_cast<double>(cell.at_zero + cell.per_load * mu) == Approx(map(mu, 0.0)).epsilon(1e-12));
            }
        }
        const TorsionCurve curve({0.1, 0.2, 0.5}, {0.0, 3.0, 10.0, 8.0});
        Drive d;
        d.gearbox.compliance = Gearbox::torsion_curve;
        d.gearbox.curve = curve;
        const Model model({d.motor, d.gearbox, d.load});
        for (int k = -50; k <= 50; ++k) {
            const double twist = 0.0171 * k;
            CHECK(static_cast<double>(model.spring_torque(twist)) == Approx(curve.torque(twist)).epsilon(1e-13));
        }
    }

    // model.md, section 7.
    TEST_CASE("lossy rigid gear between two inertias (LossyGearDemo1)") {
        const Drive d = proportional_losses(plain_drive(2.0, 1.0, 1.5), 1.0, 0.5);
        const Result r = judge(d, {sine(10.0, 1.0), lines({{0.0, 10.0, -2.5}})}, 0.5, 0.01);
        REQUIRE_MESSAGE(r.outcome == Outcome::done, r.details);
        const std::vector<double> times = instants(r, &ContactModes::input);
        const double expected[] = {0.0804771339, 0.1995199008, 0.3713427780, 0.4645394616};
        REQUIRE(times.size() == 4);
        for (int k = 0; k < 4; ++k) CHECK(std::fabs(times[k] - expected[k]) < 1e-10);  // all digits given
        CHECK(std::fabs(r.x[load_speed] - -0.01626192938) < 1e-11);
    }

    // model.md, section 6; two methods agree on the digits given, so half of the last one is allowed.
    TEST_CASE("the published drive: end states after two seconds") {
        const Drive d = paper_drive(plane_map(0.02, 0.04, 0.06));
        const Result large = judge(d, {sine(1.0275, 1.0), Signal{}}, 2.0, 0.1);
        REQUIRE_MESSAGE(large.outcome == Outcome::done, large.details);
        CHECK(std::fabs(large.x[motor_torque] / 0.521 - 0.700518217) < 1e-9);
        CHECK(std::fabs(large.x[motor_speed] - -114.514141) < 1e-6);
        CHECK(std::fabs(large.x[load_speed] - -1.28593174) < 1e-8);
        CHECK(std::fabs(large.x[twist] - 2.29187762e-3) < 1e-11);
        CHECK(std::fabs(large.x[load_angle] - 0.0627650372) < 1e-10);
        const Result small = judge(d, {sine(0.025, 1.0), Signal{}}, 2.0, 0.1);
        REQUIRE_MESSAGE(small.outcome == Outcome::done, small.details);
        CHECK(std::fabs(small.x[motor_torque] / 0.521 - -6.296271e-5) < 1e-11);
        CHECK(small.x[motor_speed] == 0.0);
        CHECK(std::fabs(small.x[load_speed] - 6.2675017e-3) < 1e-10);
        CHECK(std::fabs(small.x[twist] - -1.8302935917e-4) < 1e-14);
        CHECK(std::fabs(small.x[load_angle] - -5.9571e-5) < 1e-9);
    }

    // J dw/dt = -b w - T stops at (J/b) ln(1 + b w_0/T), after the angle J/b (w_0 - T t/J).
    TEST_CASE("coasting to a stop") {
        Drive d = plain_drive(4.0, 3e-3, 0.08);
        d.motor.friction_torque = 0.07;
        d.gearbox.viscous_friction = 0.002;
        const double J = 3e-3 + 0.08 / 16.0, b = 0.002, T = 0.07, w_0 = 50.0;
        const Result r = judge(d, {}, 4.0, 0.1, {0.0, w_0, w_0 / 4.0, 0.0, 0.0});
        REQUIRE_MESSAGE(r.outcome == Outcome::done, r.details);
        const double stop = J / b * std::log1p(b * w_0 / T);
        REQUIRE(r.switchings.size() == 1);
        CHECK(r.switchings[0].time == Approx(stop).epsilon(1e-14));
        CHECK(r.x[motor_speed] == 0.0);
        CHECK(r.x[load_speed] == 0.0);
        CHECK(4.0 * r.x[load_angle] == Approx(J / b * (w_0 - T * stop / J)).epsilon(1e-13));
    }

    // A constant torque M carries the input through the play, d = M t^2/(2 J i). Then with D = d - d_1 the twist obeys
    // D'' + W^2 D = M/(J i), W^2 = k (1/(J i^2) + 1/J_Z), until it comes back to d_1.
    TEST_CASE("play is traversed, taken up and left again") {
        Drive d = plain_drive(10.0, 2e-4, 0.05);
        const double k = 300.0, d_1 = 2e-3, M = 0.4, i = 10.0, J = 2e-4, J_Z = 0.05;
        set_curve(d, {d_1}, {0.0, k});
        const double a = M / (J * i), W = std::sqrt(k * (1.0 / (J * i * i) + 1.0 / J_Z));
        const double contact = std::sqrt(2.0 * d_1 / a), v = a * contact;
        // D = a/W^2 (1 - cos W s) + v/W sin W s is zero again where tan(W s/2) = -v W/a.
        const double leave = contact + 2.0 / W * (pi - std::atan(v * W / a));
        const Result r = judge(d, {constant(M), Signal{}}, 0.999 * leave + 0.001, 1e-4);
        REQUIRE_MESSAGE(r.outcome == Outcome::done, r.details);
        REQUIRE(r.switchings.size() >= 2);
        CHECK(r.switchings[0].time == Approx(contact).epsilon(1e-14));
        CHECK(r.switchings[1].time == Approx(leave).epsilon(1e-13));
        for (std::size_t n = 0; n < r.samples.size(); ++n) {
            const double t = 1e-4 * n, s = t - contact;
            if (t > leave) break;
            const double twist_now =
                t < contact ? 0.5 * a * t * t : d_1 + a / (W * W) * (1.0 - std::cos(W * s)) + v / W * std::sin(W * s);
            CHECK(r.samples[n][twist] == Approx(twist_now).epsilon(1e-13).scale(d_1));
            CHECK(i * J * r.samples[n][motor_speed] + J_Z * r.samples[n][load_speed] ==
                  Approx(i * M * t).epsilon(1e-13).scale(i * M * leave));
        }
    }

    // A mass with dry friction T_f under A sin(W t) (Den Hartog, no spring): it breaks away where A sin W t = T_f and
    // moves with J w = A/W (cos W t_0 - cos W t) - T_f (t - t_0) until that is zero.
    TEST_CASE("stick-slip under a sine") {
        Drive d = plain_drive(1.0, 0.4, 0.6);
        const double A = 3.0, T_f = 2.0, W = 2.0 * pi;
        for (const bool at_load : {false, true}) {
            (at_load ? d.load.friction_torque : d.motor.friction_torque) = T_f;
            (at_load ? d.motor.friction_torque : d.load.friction_torque) = 0.0;
            const Result r = judge(d, {sine(A, 1.0), Signal{}}, 1.2, 0.01);
            REQUIRE_MESSAGE(r.outcome == Outcome::done, r.details);
            const double start = std::asin(T_f / A) / W;
            double low = start + 0.1, high = start + 0.5;
            for (int n = 0; n < 60; ++n) {
                const double t = 0.5 * (low + high);
                (A / W * (std::cos(W * start) - std::cos(W * t)) - T_f * (t - start) > 0.0 ? low : high) = t;
            }
            const std::vector<double> times = instants(r, at_load ? &ContactModes::load : &ContactModes::input);
            const double expected[] = {start, low, start + 0.5, low + 0.5, start + 1.0};
            REQUIRE(times.size() == 5);
            for (int n = 0; n < 5; ++n) CHECK(times[n] == Approx(expected[n]).epsilon(1e-13));
        }
    }

    // Two masses and a spring with hysteresis. h = 0 at first; from each turning point d_n on, the twist swings about
    // +-h/k with h = (1 - eta)/2 k |d_n|, to d_{n+1} = -(|d_n| - 2 h/k) sign d_n = -eta d_n.
    TEST_CASE("hysteresis: each swing is eta_H times the one before") {
        const double k = 500.0, eta = 0.8, d_0 = 1e-2;
        const Drive d = sprung(plain_drive(5.0, 1e-3, 0.1), k, eta);
        const double W = std::sqrt(k * (1.0 / (1e-3 * 25.0) + 1.0 / 0.1)), half = pi / W;
        const Result r = judge(d, {}, 10.5 * half, half, {0.0, 0.0, 0.0, d_0, 0.0});
        REQUIRE_MESSAGE(r.outcome == Outcome::done, r.details);
        const std::vector<double> times = instants(r, &ContactModes::twist);
        REQUIRE(times.size() == 10);
        double amplitude = d_0;
        for (std::size_t n = 0; n < 10; ++n) {
            CHECK(times[n] == Approx((n + 1) * half).epsilon(1e-14));
            CHECK(r.switchings[n].h == Approx(0.5 * (1.0 - eta) * k * amplitude).epsilon(1e-13));
            amplitude *= eta;
        }
        CHECK(r.samples[10][twist] == Approx(d_0 * std::pow(eta, 9)).epsilon(1e-12));
    }

    // The load is pulled by a ramp c t against a spring whose other end a self-locking gear holds: at the first instant
    // both the torque to hold and the capacity are zero, and grow alike. The twist goes with (c/k)(1 - cos W t), which
    // touches zero at 2 pi/W without changing its sign. There h is set to (1 - eta)/2 c t; the spring balances the
    // load, and the twist sticks until the ramp has grown by h.
    TEST_CASE("zero capacity holds zero torque; a twist rate that touches zero sets the hysteresis anew") {
        const double k = 40.0, eta = 0.7, c = 2.0, J_Z = 0.1, W = std::sqrt(k / J_Z);
        const double touch = 2.0 * pi / W, h = 0.5 * (1.0 - eta) * c * touch;
        const Drive locking = proportional_losses(sprung(plain_drive(3.0, 1e-3, J_Z), k, eta), 0.3, 1.1);
        const Result r = judge(locking, {Signal{}, lines({{0.0, 0.0, c}})}, touch + h / c + 0.01, touch / 10.0);
        REQUIRE_MESSAGE(r.outcome == Outcome::done, r.details);
        REQUIRE(r.switchings.size() == 2);
        CHECK(r.switchings[0].time == Approx(touch).epsilon(1e-15));
        CHECK(r.switchings[0].h == Approx(h).epsilon(1e-15));
        CHECK(r.switchings[0].after.text() == "00.");
        CHECK(r.switchings[1].time == Approx(touch + h / c).epsilon(1e-15));
        CHECK(r.switchings[1].h == Approx(h).epsilon(1e-15));
        CHECK(r.switchings[1].after.text() == "0+.");
        CHECK(r.samples[3][twist] == Approx(c / k * (0.3 * touch - std::sin(W * 0.3 * touch) / W)).epsilon(1e-14));
        CHECK(r.x[motor_speed] == 0.0);

        // A gear that the load can turn gives way at once.
        const Drive yielding = proportional_losses(sprung(plain_drive(3.0, 1e-3, J_Z), k), 0.3, 0.9);
        const Result s = judge(yielding, {Signal{}, lines({{0.0, 0.0, c}})}, 0.01, 0.01);
        REQUIRE_MESSAGE(s.outcome == Outcome::done, s.details);
        CHECK(s.x[motor_speed] < 0.0);
    }

    // Held by the friction of both shafts against a ramp c t from the motor, the spring is wound by nothing: T_2 has no
    // reason to change until the input alone can no longer hold, and then goes with the ramp.
    TEST_CASE("torque between standing contacts keeps its value until one of them pushes it") {
        Drive d = plain_drive(2.0, 1e-3, 0.1);
        d.motor.friction_torque = 0.5;
        d.load.friction_torque = 2.0;
        const double c = 1.0;
        const Result r = judge(d, {lines({{0.0, 0.0, c}}), Signal{}}, 1.6, 0.1);
        REQUIRE_MESSAGE(r.outcome == Outcome::done, r.details);
        CHECK(r.output_torque[3] == 0.0);
        CHECK(r.output_torque[10] == Approx(2.0 * (c * 1.0 - 0.5)).epsilon(1e-14));
        // It moves when c t = T_10 + T_f/i.
        REQUIRE(!instants(r, &ContactModes::input).empty());
        CHECK(instants(r, &ContactModes::input)[0] == Approx(1.5).epsilon(1e-14));
    }

    // J_MR + (1 + dm/dmu) J_Z/i^2 < 0 where the load drives (dm/dmu = -3).
    TEST_CASE("a rigid self-locking gear with a large load jams or has several motions") {
        const Drive d = proportional_losses(plain_drive(2.0, 1e-3, 4.0), 0.5, 3.0);
        const Result none = judge(d, {Signal{}, constant(-1.0)}, 0.1, 0.1, {0.0, 1.0, 0.5, 0.0, 0.0});
        const Result several = judge(d, {constant(0.1), Signal{}}, 0.1, 0.1, {0.0, 1.0, 0.5, 0.0, 0.0});
        CHECK(none.outcome != Outcome::done);
        CHECK(several.outcome != Outcome::done);
        CHECK(!none.details.empty());
    }

    TEST_CASE("exact solver agrees with the referee on 40 random drives") {
        constexpr double duration = 0.1, interval = 1e-3;
        RandomDrives random(20260202);
        double worst = 0.0;
        int compared = 0;
        std::size_t switchings = 0;
        for (int n = 0; n < 40; ++n) {
            const Drive drive = random.drive();
            const Signals signals = random.signals(drive, duration);
            if (drive.jams()) continue;
            CAPTURE(n);
            const Samples exact = run(drive, signals, duration, interval);
            // Double precision, some hundred switchings, each of which multiplies what was before.
            Agreement a;
            CHECK_MESSAGE(referee_agrees(drive, signals, duration, interval, exact, 1e-10, &a), "differences ",
                          a.gap[0], " ", a.gap[1], " ", a.gap[2], " ", a.gap[3], " ", a.gap[4], ", ", a.truth.details);
            worst = std::fmax(worst, a.worst);
            switchings += a.truth.switchings.size();
            ++compared;
        }
        CHECK(compared >= 35);
        std::printf("referee: %d drives, %zu switchings, largest difference %.1e\n", compared, switchings, worst);
    }

    // Self-locking gears are left out: there more than one motion may be consistent.
    TEST_CASE("exact solver agrees with the referee where events coincide") {
        constexpr double duration = 2.0, interval = 1.0 / 32.0;
        RoundDrives random(1);
        int compared = 0;
        double worst = 0.0;
        for (int n = 0; n < cases(200); ++n) {
            const RoundDrives::Run r = random.next(duration);
            if (RoundDrives::self_locking(r.drive)) continue;
            CAPTURE(n);
            const Samples exact = run(r.drive, r.signals, duration, interval, r.start);
            Agreement a;
            CHECK_MESSAGE(referee_agrees(r.drive, r.signals, duration, interval, exact, 1e-10, &a, r.start),
                          "differences ", a.gap[0], " ", a.gap[1], " ", a.gap[2], " ", a.gap[3], " ", a.gap[4], ", ",
                          a.truth.details);
            worst = std::fmax(worst, a.worst);
            ++compared;
        }
        CHECK(compared >= share(100));
        std::printf("referee: %d round drives, largest difference %.1e\n", compared, worst);
    }
}

}  // namespace lostmotion::test
