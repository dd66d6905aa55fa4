// Switching instants: found to rounding, and none missed.
#include <doctest/doctest.h>

#include <limits>

#include "drive_runs.hpp"
#include "least_kernel.hpp"
#include "lostmotion/solver/adaptive_solver.hpp"

namespace lostmotion::test {
using doctest::Approx;

namespace {

// Counts the torsion-piece switchings of a run.
int piece_switchings(const Samples& s) {
    int n = 0;
    for (const TrainSwitching& w : s.report.switchings) n += w.kind == model::Guard::edge;
    return n;
}

// One mass on a spring that swings with amplitude 1 mrad at 10 Hz; the curve breaks at `at` (slope unchanged, so the
// motion stays the sine and each crossing is known).
Samples swinging(double at, double duration, double interval) {
    Drive d = plain_drive(1.0, 1e18, 2.0);
    d.gearbox.compliance = Gearbox::torsion_curve;
    const double k = 2.0 * std::pow(2.0 * pi * 10.0, 2);
    d.gearbox.curve = TorsionCurve({at}, {k, k});
    const Start start = start_at({{twist, 1e-3}});
    return run(d, {}, duration, interval, start);
}

// A ball that loses half its speed at each bounce: switchings accumulate at a known time.
struct BouncingBall {
    using Dims = model::Least;
    using Key = model::Key;
    using Guard = model::SparseRegime::Guard;
    enum { height, speed };  // its states
    // A regime, as far as the solver asks.
    struct Regime {
        model::Key key;
        std::array<LinearForm, Dims::coupled> rate{};
        std::array<LinearForm, 1> angle_rate{}, output_torque{};
        std::vector<Guard> guards;
        std::array<double, 1> near_event{};
        std::vector<model::Driver<LinearForm>> drivers;
        std::vector<GivenState> given;
        model::Flags resting, following;
        int driving_input = -1;
        double driving_way = 0.0;
    };
    static constexpr int ground = 2;

    static CountsOf<Dims> counts() { return {}; }
    static int n_twists() { return 0; }
    static int twist_state(int) { return height; }
    static const LinearForm& torque_at_load(const Regime& r) { return r.output_torque[0]; }

    double restitution = 0.5;
    Shared<const Regime> build(const Key& key) const {
        static constexpr LinearForm::Term of_height{height, 1.0}, of_speed{speed, 1.0};
        Regime r;
        r.key = key;
        r.rate[height] = {&of_speed, 1, 1, 1, 1, 0.0};
        r.rate[speed].one = -9.81;
        r.guards.push_back({{&of_height, 1, 1, 1, 1, 0.0}, Guard::speed, ground});
        return Shared<const Regime>::make(std::move(r));
    }
    Found start(InstantOf<Dims>&, Key&) const { return Found::yes; }
    template <class Cache>
    Found next(Cache&, InstantOf<Dims>& now, const Guard*, Key&, const InputsOf<Dims>&) const {
        now.x[height] = 0.0;
        now.x[speed] *= -restitution;
        return Found::yes;
    }
};

StateOf<model::Least> ones() {
    StateOf<model::Least> x;
    x.fill(1.0);
    return x;
}

}  // namespace

TEST_SUITE("events") {
    TEST_CASE("two crossings between two samples are both found, however close") {
        for (const double gap : {1e-3, 1e-6, 1e-9, 1e-10}) {
            // The sine rises above the break for a moment around each extreme: four crossings a period.
            const double at = 1e-3 * (1.0 - gap);
            const Samples s = swinging(at, 0.975, 0.5);
            CHECK(piece_switchings(s) == 39);  // the first extreme is at t = 0, from inside
            const double first = std::acos(1.0 - gap) / (2.0 * pi * 10.0);
            CHECK(s.report.switchings[0].time == Approx(first).epsilon(1e-4));
        }
    }
    TEST_CASE("a boundary that is not reached is not crossed, however close") {
        for (const double gap : {1e-3, 1e-6, 1e-9, 1e-11}) {
            const Samples s = swinging(1e-3 * (1.0 + gap), 0.975, 0.5);
            CHECK(piece_switchings(s) == 0);
        }
    }
    TEST_CASE("grazing changes nothing in the motion") {
        const Samples touching = swinging(1e-3, 1.0, 1e-3), free = swinging(1.0, 1.0, 1e-3);
        for (std::size_t k = 0; k < free.samples; ++k)
            CHECK(touching(twist, k) == Approx(free(twist, k)).epsilon(1e-10).scale(1e-3));
    }
    // A locked input, an undamped load on a spring k with hysteresis, a load torque that grows as a t. The twist rate
    // is (a/k)(1 - cos(Omega t)): after each period T it touches zero without changing sign. There (16) sets h anew,
    // h_n = (1 - eta)/2 a n T, and the twist rests until the load torque has grown by h_n - h_(n-1) = (1 - eta)/2 a T.
    TEST_CASE("a twist rate that touches zero has reached it: the hysteresis is set anew, the twist stands") {
        Drive d = plain_drive(1.0, 1e18, 2.0);
        d.gearbox.compliance = Gearbox::torsion_curve;
        for (const double frequency : {3.0, 7.3, 10.0, 41.7}) {
            d.gearbox.curve = TorsionCurve({}, {2.0 * std::pow(2.0 * pi * frequency, 2)});
            d.gearbox.hysteresis_efficiency = 0.8;
            const Signals signals{constant(0.0), lines({{0.0, 0.0, -37.0}})};
            const double T = 1.0 / frequency, stands = 0.1 * T;
            for (const double tolerance : {0.0, 1e-11}) {
                const Samples s = run(d, signals, 5.0 * (T + stands), 1e-3, {}, tolerance);
                REQUIRE(s.report.status == Status::done);
                REQUIRE(s.report.switchings.size() >= 8);
                for (int n = 1; n <= 4; ++n) {
                    const TrainSwitching &stop = s.report.switchings[2 * n - 2], &go = s.report.switchings[2 * n - 1];
                    const int contact = s.contact(twist_contact);
                    CHECK(stop.after[contact] == 0);
                    CHECK(stop.before[contact] == go.after[contact]);
                    // A double zero is located to the root of what one zero is.
                    CHECK(std::fabs(stop.time - (n * T + (n - 1) * stands)) < 1e-5 * T);
                    CHECK(std::fabs(go.time - n * (T + stands)) < 1e-9 * T);
                }
            }
        }
    }

    TEST_CASE("crossings are located to rounding") {
        const double at = 0.3e-3;
        const Samples s = swinging(at, 1.0, 0.5);
        for (std::size_t k = 0; k < s.report.switchings.size(); ++k) {
            const double angle = 2.0 * pi * 10.0 * s.report.switchings[k].time;
            // Tens of roundings of a phase of up to 63 rad: 1.4e-14 each.
            CHECK(std::fabs(std::fabs(std::cos(angle)) - 0.3) < 1e-12);
        }
    }
    TEST_CASE("an event at t = 0: a load that is let go falls at once") {
        Drive d = plain_drive(10.0, 1e-4, 0.5);
        d.motor.friction_torque = 0.1;
        const Samples s = run(d, {Signal{}, constant(-5.0)}, 0.1, 0.01);
        REQUIRE(s.report.status == Status::done);
        const double J = 1e-4 + 0.5 / 100.0;
        CHECK(s.report.x[motor_speed] == Approx((5.0 / 10.0 - 0.1) / J * 0.1).epsilon(1e-12));
    }
    TEST_CASE("an event that leads straight to another: breaking away into backlash, stop and reversal at a jump") {
        Drive d = plain_drive(10.0, 1e-4, 0.5);
        d.motor.friction_torque = 0.1;
        d.load.friction_torque = 0.2;
        set_curve(d, {1e-3}, {0.0, 1e4});
        d.gearbox.hysteresis_efficiency = 0.9;
        const Signals signals{lines({{0.0, 0.0, 0.0}, {0.1, 0.5, 0.0}, {0.2, -0.5, 0.0}, {0.3, 0.0, 0.0}}), Signal{}};
        const Samples exact = run(d, signals, 0.6), fine = run(d, signals, 0.6, 1e-3, {}, 1e-12);
        REQUIRE(exact.report.status == Status::done);
        CHECK(exact.report.x[load_angle] == Approx(fine.report.x[load_angle]).epsilon(1e-7));
        CHECK(exact.report.x[motor_speed] == 0.0);
    }
    TEST_CASE("simultaneous events: two contacts stop at the same instant") {
        // Input and load of the same deceleration, uncoupled within the backlash.
        Drive d = plain_drive(1.0, 1e-3, 1e-3);
        d.motor.friction_torque = 0.01;
        d.load.friction_torque = 0.01;
        set_curve(d, {1.0}, {0.0, 1e3});
        const Start start = start_at({{motor_speed, 2.0}, {load_speed, 2.0}});
        const Samples s = run(d, {}, 1.0, 0.1, start);
        REQUIRE(s.report.status == Status::done);
        CHECK(s.report.x[motor_speed] == 0.0);
        CHECK(s.report.x[load_speed] == 0.0);
        CHECK(s.report.x[load_angle] == Approx(0.2).epsilon(1e-12));
        CHECK(s.report.switching_count <= 2);
    }
    TEST_CASE("accumulating switchings end in a report of time and contact, not in a hang") {
        const BouncingBall ball;
        const SignalsOf<model::Least> none;
        ExactSolver<BouncingBall> solver(ball, none, 1e-3, ones());
        struct : Observer<BouncingBall> {
            int count = 0;
            bool wants_switching() const override { return true; }
            void switching(const SwitchingOf<BouncingBall>&) override { ++count; }
        } counter;
        StateOf<model::Least> x{};
        x[BouncingBall::height] = 1.0;
        REQUIRE(solver.begin(0.0, x, {}) == Status::done);
        CHECK(solver.advance(10.0, counter) == Status::zeno);
        const double fall = std::sqrt(2.0 / 9.81);
        CHECK(solver.time() == Approx(fall * (1.0 + 2.0 * 0.5 / (1.0 - 0.5))).epsilon(1e-12));
        CHECK(solver.stopped_at() == BouncingBall::ground);
        CHECK(counter.count < 500);
    }
    TEST_CASE("one hour at 1 Hz keeps its phase") {
        Drive d = paper_drive(plane_map(0.02, 0.04, 0.06));
        const Signals signals{sine(1.0275, 1.0), Signal{}};
        // The motion is periodic after a few seconds: the states after 20 s and after 3600 s are the same.
        const Samples early = run(d, signals, 20.0, 1.0), late = run(d, signals, 3600.0, 60.0);
        REQUIRE(late.report.status == Status::done);
        for (const int k : {motor_torque, motor_speed, load_speed, twist})
            CHECK(late.report.x[k] == Approx(early.report.x[k]).epsilon(1e-9));
    }
    TEST_CASE("the adaptive solver takes a nonlinear remainder: a pendulum under gravity") {
        // J w' = -m g l sin(phi), small friction none: period 4 K(sin(a/2)) / omega_0.
        using System = model::TrainSystem<model::Least>;
        constexpr int load_angle = model::Least::coupled;
        Drive d = plain_drive(1.0, 1e-3, 1.0);
        struct Gravity {
            void operator()(double, const System::State& x, System::State& rate) const {
                const double a = -25.0 * std::sin(x[load_angle]) / 1.001;
                rate[load_speed] += a;
                rate[motor_speed] += a;
            }
        };
        const model::Assembly assembly(train_of(d));
        const System system(assembly);
        const SignalsOf<model::Least> none;
        AdaptiveSolver<System, Gravity> solver(system, none, 1e-11, ones());
        System::State x{};
        x[load_angle] = 1.0;
        REQUIRE(solver.begin(0.0, x, {}) == Status::done);
        Observer<System> nothing;
        const double period = 4.0 * std::comp_ellint_1(std::sin(0.5)) / std::sqrt(25.0 / 1.001);
        REQUIRE(solver.advance(period, nothing) == Status::done);
        CHECK(solver.state()[load_angle] == Approx(1.0).epsilon(1e-8));
        CHECK(solver.state()[load_speed] == Approx(0.0).scale(1.0).epsilon(1e-7));
        // A pendulum that 100 N m of friction holds against 25 N m of gravity must not gain speed.
        Drive held = d;
        held.load.friction_torque = 100.0;
        const model::Assembly held_assembly(train_of(held));
        const System held_system(held_assembly);
        AdaptiveSolver<System, Gravity> refusing(held_system, none, 1e-11, ones());
        CHECK(refusing.begin(0.0, x, {}) == Status::unseen);
    }
}

}  // namespace lostmotion::test
