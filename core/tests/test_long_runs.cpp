// Linear drives under sines for up to thirty years, against closed forms in quadruple precision.
#include <doctest/doctest.h>
#include <quadmath.h>

#include <cstdio>

#include "properties.hpp"

namespace lostmotion::test {
using doctest::Approx;

namespace {

using Quad = __float128;
const Quad pi_q = acosq(-1);

template <std::size_t n>
std::array<Quad, n> solved(std::array<std::array<Quad, n>, n> a, std::array<Quad, n> b) {
    for (std::size_t k = 0; k < n; ++k) {
        std::size_t pivot = k;
        for (std::size_t r = k + 1; r < n; ++r)
            if (fabsq(a[r][k]) > fabsq(a[pivot][k])) pivot = r;
        std::swap(a[k], a[pivot]);
        std::swap(b[k], b[pivot]);
        for (std::size_t r = 0; r < n; ++r) {
            if (r == k) continue;
            const Quad factor = a[r][k] / a[k][k];
            for (std::size_t c = k; c < n; ++c) a[r][c] -= factor * a[k][c];
            b[r] -= factor * b[k];
        }
    }
    for (std::size_t k = 0; k < n; ++k) b[k] /= a[k][k];
    return b;
}

// The paper's drive with one linear spring, a constant efficiency and no dry friction: no condition ends its regime.
Drive linear_drive() {
    Drive d = paper_drive({});
    d.motor.friction_torque = 0.0;
    d.gearbox.hysteresis_efficiency = 1.0;
    d.gearbox.losses = Gearbox::constant_efficiency;
    d.gearbox.efficiency = 0.9;
    d.gearbox.curve = TorsionCurve({}, {0.65 * 26.5e3});
    return d;
}
Drive rigid_drive() {
    Drive d = linear_drive();
    d.gearbox.compliance = Gearbox::rigid;
    return d;
}

// The motion of such a drive from rest long after its start: a constant, the answers to the sines, and what the
// transient has left in the load angle. n: 4 states (M_D, w_M, w, d), or 2 (M_D, w_M) where the gear is rigid.
template <std::size_t n>
class Steady {
 public:
    using Vector = std::array<Quad, n>;

    Steady(const Drive& d, const Signals& signals) : signals_(signals) {
        const Quad J = Quad(d.motor.rotor_inertia) + Quad(d.gearbox.inertia), i = d.gearbox.ratio,
                   eta = d.gearbox.efficiency, tau = d.motor.electrical_time_constant, M_R = d.motor.rated_torque,
                   k_N = d.motor.armature_voltage_constant, b_M = d.gearbox.viscous_friction,
                   b_Z = d.load.viscous_friction, J_Z = d.load.inertia;
        A_[0][0] = -1 / tau;
        A_[0][1] = -(k_N - 1) * M_R / (Quad(d.motor.rated_speed) * tau);
        B_[0][0] = k_N * M_R / tau;
        if constexpr (n == 4) {
            const Quad k = d.gearbox.curve.max_slope();
            A_[1] = {1 / J, -b_M / J, 0, -k / (i * eta * J)};
            A_[2] = {0, 0, -b_Z / J_Z, k / J_Z};
            A_[3] = {0, 1 / i, -1, 0};
            B_[1][2] = -1 / J_Z;
            speed_[2] = 1;
        } else {
            const Quad all = J + J_Z / (i * i * eta);
            A_[1] = {1 / all, -(b_M + b_Z / (i * i * eta)) / all};
            B_[1][1] = -1 / (i * eta * all);
            speed_[1] = 1 / i;
        }
        Vector left{};  // of what the motion begins with, the share that dies out
        for (std::size_t u = 0; u < n_inputs; ++u) {
            const Vector still = settled(u, signals[u].breakpoints[0].value);
            for (std::size_t r = 0; r < n; ++r) mean_[r] += still[r], left[r] -= still[r];
            for (const Sine& s : signals[u].sines) {
                answers_.push_back(answer(u, s));
                const Answer& a = answers_.back();
                for (std::size_t r = 0; r < n; ++r) left[r] -= a.sine[r] * sinq(a.phase) + a.cosine[r] * cosq(a.phase);
            }
        }
        angle_left_ = turned_by(left);
    }

    struct State {
        Vector x{};
        Quad angle = 0;
    };
    State at(double time) const {
        State s{mean_, angle_left_ + along(mean_) * time};
        for (const Answer& a : answers_) {
            const Quad turns = Quad(a.frequency) * time, angle = 2 * pi_q * (turns - floorq(turns)) + a.phase;
            for (std::size_t r = 0; r < n; ++r) s.x[r] += a.sine[r] * sinq(angle) + a.cosine[r] * cosq(angle);
            s.angle +=
                (along(a.sine) * (cosq(a.phase) - cosq(angle)) + along(a.cosine) * (sinq(angle) - sinq(a.phase))) /
                (2 * pi_q * a.frequency);
        }
        return s;
    }
    // A step of an input, long ago.
    void add_step(State& s, std::size_t input, double height, double ago) const {
        Vector still = settled(input, height);
        for (std::size_t r = 0; r < n; ++r) s.x[r] += still[r];
        s.angle += along(still) * ago;
        for (Quad& v : still) v = -v;
        s.angle += turned_by(still);
    }
    // A ramp of an input that began long ago: x' = A x + B u is a constant.
    void add_ramp(State& s, std::size_t input, double rise, double ago) const {
        const Vector rate = settled(input, rise), behind = solved(A_, rate);
        for (std::size_t r = 0; r < n; ++r) s.x[r] += rate[r] * ago + behind[r];
    }
    // The mean of the product of two states.
    Quad mean_product(std::size_t r, std::size_t c) const {
        Quad sum = mean_[r] * mean_[c];
        for (const Answer& a : answers_) sum += (a.sine[r] * a.sine[c] + a.cosine[r] * a.cosine[c]) / 2;
        return sum;
    }
    // The same of a state and an input.
    Quad mean_power(std::size_t r, std::size_t input) const {
        Quad sum = mean_[r] * Quad(signals_[input].breakpoints[0].value);
        for (const Answer& a : answers_)
            if (a.input == input) sum += a.sine[r] * a.amplitude / 2;
        return sum;
    }

 private:
    struct Answer {
        std::size_t input;
        Quad amplitude, phase;
        double frequency;
        Vector sine, cosine;
    };

    Vector settled(std::size_t input, Quad value) const {
        Vector b;
        for (std::size_t r = 0; r < n; ++r) b[r] = -B_[input][r] * value;
        return solved(A_, b);
    }
    // x = P sin + Q cos: -omega Q = A P + B a, omega P = A Q
    Answer answer(std::size_t input, const Sine& s) const {
        const Quad omega = 2 * pi_q * s.frequency;
        std::array<std::array<Quad, 2 * n>, 2 * n> m{};
        std::array<Quad, 2 * n> b{};
        for (std::size_t r = 0; r < n; ++r) {
            for (std::size_t c = 0; c < n; ++c) m[r][c] = A_[r][c], m[n + r][n + c] = A_[r][c];
            m[r][n + r] = omega;
            m[n + r][r] = -omega;
            b[r] = -B_[input][r] * s.amplitude;
        }
        const auto both = solved(m, b);
        Answer a{input, s.amplitude, s.phase, s.frequency, {}, {}};
        for (std::size_t r = 0; r < n; ++r) a.sine[r] = both[r], a.cosine[r] = both[n + r];
        return a;
    }
    // The load speed.
    Quad along(const Vector& x) const {
        Quad sum = 0;
        for (std::size_t r = 0; r < n; ++r) sum += speed_[r] * x[r];
        return sum;
    }
    // By how much the load turns while a state dies out.
    Quad turned_by(const Vector& x) const { return -along(solved(A_, x)); }

    Signals signals_;
    std::array<std::array<Quad, n>, n> A_{};
    std::array<Vector, n_inputs> B_{};
    Vector speed_{}, mean_{};
    std::vector<Answer> answers_;
    Quad angle_left_ = 0;
};

constexpr std::array<Quantity, n_coupled> state_channels{motor_torque, motor_speed, load_speed, twist};

// Sizes that the states of these runs have.
constexpr std::array<double, n_coupled> sizes{0.5, 300.0, 3.0, 2e-3};

Signals sines() {
    Signals s{sine(1.0275, 1.0), sine(5.0, 2.9, -1.1)};
    s[0].sines.push_back({0.3, 7.3, 0.4});
    s[0].breakpoints[0].value = 0.1;
    s[1].breakpoints[0].value = -3.0;
    return s;
}

constexpr double years = 1e9;  // [s]

}  // namespace

TEST_SUITE("long_runs") {
    // 1e-13 of each size: thousand roundings. The angle has gone round 1e9 s times the mean speed.
    TEST_CASE("a linear drive under sines: state and load angle after a billion seconds") {
        const Signals signals = sines();
        for (const double interval : {years, 1e7, 12345.678, 1000.1}) {
            const Samples s = run(linear_drive(), signals, years, interval);
            REQUIRE(s.report.status == Status::done);
            CHECK(s.report.steps < 10);
            const Steady<4> steady(linear_drive(), signals);
            const auto end = steady.at(years);
            for (int k = 0; k < n_coupled; ++k) CHECK(std::fabs(s.report.x[k] - double(end.x[k])) < 1e-13 * sizes[k]);
            CHECK(s.report.x[load_angle] == Approx(double(end.angle)).epsilon(1e-14));
            // The samples hold at their instants as the clock shows them.
            for (std::size_t n = 1; n < s.samples; n += 1 + s.samples / 50) {
                const auto x = steady.at(static_cast<double>(n) * interval);
                for (int k = 0; k < n_coupled; ++k)
                    CHECK(std::fabs(s(state_channels[k], n) - double(x.x[k])) < 1e-12 * sizes[k]);
                CHECK(std::fabs(s(load_angle, n) / double(x.angle) - 1.0) < 1e-12);
            }
        }
    }
    TEST_CASE("a rigid linear drive under sines after a billion seconds") {
        const Signals signals = sines();
        const Samples s = run(rigid_drive(), signals, years, 1e7);
        const auto end = Steady<2>(rigid_drive(), signals).at(years);
        REQUIRE(s.report.status == Status::done);
        for (int k = 0; k < 2; ++k) CHECK(std::fabs(s.report.x[k] - double(end.x[k])) < 1e-13 * sizes[k]);
        CHECK(s.report.x[motor_speed] == Approx(90.0 * s.report.x[load_speed]).epsilon(1e-13));
        CHECK(s.report.x[load_angle] == Approx(double(end.angle)).epsilon(1e-14));
        CHECK(s.report.x[twist] == 0.0);
    }
    // Without a mean the load angle swings about where the transient has left it.
    TEST_CASE("a load angle that does not drift is exact after a billion periods") {
        for (const double frequency : {1.0, 1.3, 1.0 / 3.0}) {
            const Signals signals{sine(1.0275, frequency, 0.3), Signal{}};
            const Steady<4> steady(linear_drive(), signals);
            for (const double interval : {1e9, 1e6}) {
                const Samples s = run(linear_drive(), signals, years, interval);
                CHECK(std::fabs(s.report.x[load_angle] - double(steady.at(years).angle)) < 1e-13);
                for (std::size_t n = 1; n < s.samples; n += 1 + s.samples / 20)
                    CHECK(
                        std::fabs(s(load_angle, n) -
                                  double(steady.at(1e6 * std::round(interval / 1e6) * static_cast<double>(n)).angle)) <
                        1e-12);
            }
        }
    }
    // The transient, of less than 1 s, is less than 1e-9 of it.
    TEST_CASE("energies of a billion seconds are mean powers times time, and balance") {
        const Drive d = linear_drive();
        const Signals signals = sines();
        const Steady<4> steady(d, signals);
        const Samples s = run(d, signals, years, 1e7);
        const auto check = [&](const char* flow, Quad power) {
            CHECK(s.energy(flow) / years == Approx(double(power)).epsilon(1e-9));
        };
        const Quad i = d.gearbox.ratio, k = d.gearbox.curve.max_slope();
        check(from_source, steady.mean_product(motor_torque, motor_speed));
        check(in_input_damper, d.gearbox.viscous_friction * steady.mean_product(motor_speed, motor_speed));
        check(in_gear, k / i * (1 / Quad(d.gearbox.efficiency) - 1) * steady.mean_product(twist, motor_speed));
        check(in_load_damper, d.load.viscous_friction * steady.mean_product(load_speed, load_speed));
        check(to_load, steady.mean_power(load_speed, 1));
        CHECK(s.energy(in_hysteresis) == 0.0);
        CHECK(std::fabs(s.report.residual()) < 1e-13 * s.report.turned_over);
    }
    // Steps of 1e-13 make stretches so short that they are taken look after look and panel after panel; a voltage limit
    // that is never reached makes a condition, and with it event_checks. Their clock sums up 1e5 steps of 10 ms, each
    // rounded to 1e-13 s.
    TEST_CASE("a long run is what one look after another finds") {
        Drive limited = linear_drive();
        limited.motor.voltage_limit = 10.0;
        Signals signals = sines();
        signals[0].breakpoints.push_back({5.5, 0.2, 0.0});
        Signals chopped = signals;
        for (int k = 1; k < 12; ++k) chopped[0].breakpoints.push_back({50.0 * k, 0.2 + 1e-13 * (k % 2), 0.0});
        const auto same = [](double a, double b, double size) { return std::fabs(a - b) < 1e-8 * size; };
        for (const double interval : {2.7, 27.0, 300.0}) {
            const Samples a = run(linear_drive(), signals, 600.0, interval);
            for (const Samples& b :
                 {run(limited, signals, 600.0, interval), run(linear_drive(), chopped, 600.0, interval)}) {
                CHECK(a.report.steps < b.report.steps / 10);
                for (int k = 0; k < n_coupled; ++k) CHECK(same(a.report.x[k], b.report.x[k], sizes[k]));
                CHECK(same(a.report.x[load_angle], b.report.x[load_angle], a.report.x[load_angle]));
                for (std::size_t k = 1; k < a.samples; ++k) {
                    for (int c = 0; c < n_coupled; ++c)
                        CHECK(same(a(state_channels[c], k), b(state_channels[c], k), sizes[c]));
                    CHECK(same(a(load_angle, k), b(load_angle, k), a(load_angle, k)));
                    CHECK(same(a(command, k), b(command, k), 1.0));
                }
                for (const char* f : flows) CHECK(std::fabs(a.energy(f) - b.energy(f)) < 1e-10 * a.report.turned_over);
            }
        }
    }
    TEST_CASE("a step and a ramp after half a billion seconds") {
        const double at = 5e8, rise = 1e-10;
        Signals signals = sines();
        const Steady<4> steady(linear_drive(), signals);
        signals[0].breakpoints.push_back({at, 0.35, 0.0});
        signals[1].breakpoints.push_back({at + 0.125, -3.0, rise});
        for (const double interval : {years, 1e6}) {
            const Samples s = run(linear_drive(), signals, years, interval);
            REQUIRE(s.report.status == Status::done);
            auto end = steady.at(years);
            steady.add_step(end, 0, 0.25, years - at);
            Steady<4>::State ramp;
            steady.add_ramp(ramp, 1, rise, years - at - 0.125);
            for (int k = 0; k < n_coupled; ++k)
                CHECK(std::fabs(s.report.x[k] - double(end.x[k] + ramp.x[k])) < 1e-13 * sizes[k]);
            CHECK(std::fabs(s.report.residual()) < 1e-13 * s.report.turned_over);
        }
        signals[1].breakpoints.pop_back();
        const Samples s = run(linear_drive(), signals, years, 1e6);
        auto end = steady.at(years);
        steady.add_step(end, 0, 0.25, years - at);
        CHECK(s.report.x[load_angle] == Approx(double(end.angle)).epsilon(1e-14));
    }
    TEST_CASE("splitting a run of a billion seconds changes nothing") {
        for (const double at : {1e-3, 77.7, 123456789.0, 999990000.0})
            for (const Drive& drive : {linear_drive(), rigid_drive()}) {
                const Splitting s = split_run(drive, sines(), years, at);
                CHECK(s.status == Status::done);
                CHECK(s.split == Status::done);
                CHECK(s.gap < 1e-12);
            }
    }
    // Two inertias on a spring and nothing that damps: momentum follows the torque's impulse, and so does the angle
    // of the centre of mass. J_1 w_1 + J_2 w_2 = a (1 - cos)/omega.
    TEST_CASE("a free undamped drive keeps its momentum for a billion seconds") {
        for (const bool rigid : {true, false}) {
            Drive d = plain_drive(1.0, 0.7, 1.9);
            if (!rigid) {
                set_curve(d, {}, {4e4});
            }
            const double a = 2.5;
            const Samples s = run(d, {sine(a, 1.3), Signal{}}, years, 1e7);
            REQUIRE(s.report.status == Status::done);
            const Quad omega = 2 * pi_q * 1.3, turns = Quad(1.3) * years, phase = 2 * pi_q * (turns - floorq(turns));
            const Quad momentum = a * (1 - cosq(phase)) / omega,
                       angle = a * (years - sinq(phase) / omega) / omega / 2.6;
            CHECK(0.7 * s.report.x[motor_speed] + 1.9 * s.report.x[load_speed] ==
                  Approx(double(momentum)).epsilon(1e-12));
            CHECK(s.report.x[load_angle] + 0.7 / 2.6 * s.report.x[twist] == Approx(double(angle)).epsilon(1e-14));
            CHECK(std::fabs(s.report.residual()) < 1e-13 * s.report.turned_over);
        }
    }
    // 1e-13: five hundred roundings, of coefficients and of the sums of some ten terms.
    TEST_CASE("300 random linear drives for up to a billion seconds") {
        RandomDrives random(20261122);
        double worst = 0.0;
        for (int n = 0; n < cases(300); ++n) {
            Drive d = random.drive();
            d.motor.kind = Motor::dc;
            d.motor.friction_torque = d.load.friction_torque = 0.0;
            d.motor.voltage_limit = std::numeric_limits<double>::infinity();
            d.gearbox.hysteresis_efficiency = 1.0;
            d.gearbox.losses = Gearbox::constant_efficiency;
            d.gearbox.efficiency = random.uniform(0.4, 1.0);
            const double swing = 2.0 * pi * random.spread(5.0, 150.0),
                         J = d.input_inertia() * d.gearbox.ratio * d.gearbox.ratio;
            set_curve(d, {}, {swing * swing * J});
            d.load.viscous_friction = d.load.inertia * random.spread(0.01, 10.0);
            Signals signals;
            const double duration = random.spread(1e6, 1e9);
            for (int i = 0; i < n_inputs; ++i) {
                const double size = i == 0 ? 1.0 : 0.2 * d.gearbox.rated_output_torque;
                if (random.coin()) signals[i].breakpoints[0].value = size * random.uniform(-1.0, 1.0);
                for (int k = random.coin() ? 2 : 1; k > 0; --k)
                    signals[i].sines.push_back(
                        {size * random.uniform(0.1, 1.0), random.spread(0.05, 200.0), random.uniform(-pi, pi)});
            }
            const Samples s = run(d, signals, duration, duration / random.uniform(1.0, 1000.0));
            CAPTURE(n);
            REQUIRE(s.report.status == Status::done);
            CHECK(s.report.steps == 1);
            const Steady<4> steady(d, signals);
            const auto end = steady.at(duration);
            for (int k = 0; k < n_coupled; ++k) {
                const double gap =
                    std::fabs(s.report.x[k] - double(end.x[k])) / double(sqrtq(steady.mean_product(k, k)));
                CHECK(gap < 1e-13);
                worst = std::fmax(worst, gap);
            }
            CHECK(std::fabs(s.report.x[load_angle] - double(end.angle)) <
                  1e-13 * (std::fabs(double(end.angle)) + double(sqrtq(steady.mean_product(2, 2)))));
            CHECK(std::fabs(s.report.residual()) < 1e-12 * s.report.turned_over);
            CHECK(std::fabs(s.energy(from_source) / duration - double(steady.mean_product(0, 1))) <
                  1e-4 * s.report.turned_over / duration);
        }
        std::printf("long runs: 300 random linear drives, largest gap %.1e\n", worst);
    }
    // Time constants from 1e-7 s to 1e3 s, and 60 sines.
    TEST_CASE("stiff drives and many sines for a billion seconds") {
        for (const double tau : {1e-7, 1e-3, 1e3}) {
            Drive d = linear_drive();
            d.motor.electrical_time_constant = tau;
            const Samples s = run(d, sines(), years, 1e7);
            const auto end = Steady<4>(d, sines()).at(years);
            for (int k = 0; k < n_coupled; ++k) CHECK(std::fabs(s.report.x[k] - double(end.x[k])) < 1e-12 * sizes[k]);
            CHECK(s.report.x[load_angle] == Approx(double(end.angle)).epsilon(1e-12));
            CHECK(std::fabs(s.report.residual()) < 1e-12 * s.report.turned_over);
        }
        Signals many{Signal{}, Signal{}};
        for (int k = 0; k < 30; ++k) {
            many[0].sines.push_back({0.03, 0.1 + 0.37 * k, 0.1 * k});
            many[1].sines.push_back({0.3, 1e-7 * std::pow(2.0, k), -0.2 * k});
        }
        const Samples s = run(linear_drive(), many, years, 1e7);
        const auto end = Steady<4>(linear_drive(), many).at(years);
        for (int k = 0; k < n_coupled; ++k) CHECK(std::fabs(s.report.x[k] - double(end.x[k])) < 1e-12 * sizes[k]);
        CHECK(std::fabs(s.report.residual()) < 1e-13 * s.report.turned_over);
    }
}

}  // namespace lostmotion::test
