// Exact where motion dies out: speeds and rates that become very small, torques that vanish together, long rest.
#include <doctest/doctest.h>

#include <cstdio>

#include "properties.hpp"
#include "referee_compare.hpp"

namespace lostmotion::test {
using doctest::Approx;

namespace {

Drive hysteretic_drive() { return paper_drive(plane_map(0.02, 0.04, 0.06)); }

// Where the capacity of the hysteresis is in the memory of a run.
int hysteresis(const Samples& s) { return s.run.assembly().places().gears[0].hysteresis; }

// The same for all but the steps of height zero, samples or stepping: to rounding.
template <class X, class Memory>
void check_same(const Samples& a, const X& x, const Memory& m) {
    for (int k = 0; k < n_coupled; ++k) CHECK(x[k] == Approx(a.report.x[k]).epsilon(1e-12));
    const int h = hysteresis(a);
    CHECK(m[h] == Approx(a.report.memory[h]).epsilon(1e-12));
}

}  // namespace

TEST_SUITE("dying_out") {
    // At constant speed the twist rate decays as exp(-16.4 t) and keeps its sign for ever: (16) sets nothing anew.
    TEST_CASE("constant speed: steps of height zero, sampled constants and stepping change nothing") {
        const Drive drive = hysteretic_drive();
        const Samples plain = run(drive, {constant(0.3), Signal{}}, 3.0);
        CHECK(plain.report.memory[hysteresis(plain)] == Approx(1.00868926882631));
        for (const double at : {0.5, 1.0, 1.33, 1.5, 2.0, 2.9}) {
            const Samples step = run(drive, {lines({{0.0, 0.3, 0.0}, {at, 0.3, 0.0}}), Signal{}}, 3.0);
            check_same(plain, step.report.x, step.report.memory);
            CHECK(step.report.switching_count == plain.report.switching_count);
        }
        std::vector<Breakpoint> samples;
        for (int k = 0; k < 3000; ++k) samples.push_back({1e-3 * k, 0.3, 0.0});
        const Samples sampled = run(drive, {lines(samples), lines({{0.0, 0.0, 0.0}, {1.5, 0.0, 0.0}})}, 3.0);
        check_same(plain, sampled.report.x, sampled.report.memory);
        for (const double step : {1e-3, 0.0137}) {
            Simulation simulation(drive, step);
            while (simulation.train.motion().time() < 3.0 - 1e-9)
                REQUIRE(simulation.advance(std::min(step, 3.0 - simulation.train.motion().time()), 0.3, 0.3, 0.0,
                                           0.0) == Status::done);
            const model::Instant end = point(simulation.train).now;
            check_same(plain, end.x, end.memory);
        }
    }
    // A load torque of 1e-9 N m is no step of height zero: in 40 digits it carries the twist rate, then -4.8e-13 rad/s,
    // through zero 0.98 ms later, and that is a turning point; one of -1e-9 N m does not.
    TEST_CASE("constant speed: a tiny load torque turns the twist where it does so in forty digits") {
        const Drive drive = hysteretic_drive();
        for (const double torque : {1e-9, -1e-9, 1e-11}) {
            const Signals signals{constant(0.3), lines({{0.0, 0.0, 0.0}, {1.5, torque, 0.0}})};
            const Samples s = run(drive, signals, 2.0);
            bool turned = false;
            for (const TrainSwitching& w : s.report.switchings)
                if (w.kind == model::Guard::speed && !w.input_jump && w.time > 1.5 && w.time < 1.6) {
                    turned = true;
                    CHECK(w.time == Approx(1.50098).epsilon(1e-5));
                    break;
                }
            CHECK(turned == (torque == 1e-9));
            referee::Agreement a;
            CHECK(referee::referee_agrees(drive, signals, 2.0, 0.1, run(drive, signals, 2.0, 0.1), 1e-9, &a));
        }
    }
    // The load rings down on the gear's soft zone, each half swing a smaller copy of the last, for ever.
    TEST_CASE("run, stop, wait: no error, no slow-down, no dependence on sampling") {
        const Drive drive = hysteretic_drive();
        const Signals signals{lines({{0.0, 0.4, 0.0}, {1.0, 0.0, 0.0}}), Signal{}};
        const Samples early = run(drive, signals, 60.0, 0.1);
        REQUIRE(early.report.status == Status::done);
        for (const auto& [duration, interval] : {std::pair{201.0, 0.1}, {201.0, 1e-2}, {3600.0, 1.0}, {3600.0, 7.3}}) {
            const Samples s = run(drive, signals, duration, interval);
            REQUIRE(s.report.status == Status::done);
            CHECK(s.report.steps < 20000);
            CHECK(std::fabs(s.report.x[load_speed]) < 1e-100);
            CHECK(s.report.x[load_angle] == Approx(early.report.x[load_angle]).epsilon(1e-12));
        }
    }
    TEST_CASE("constant inputs may last for ever") {
        Drive plain = hysteretic_drive();
        plain.gearbox.hysteresis_efficiency = 1.0;
        Drive rigid = hysteretic_drive();
        rigid.gearbox.compliance = Gearbox::rigid;
        for (const Drive& drive : {hysteretic_drive(), plain, rigid}) {
            const Samples s = run(drive, {constant(0.3), Signal{}}, 1e9, 1e6);
            REQUIRE(s.report.status == Status::done);
            CHECK(s.report.steps < 2000);
            CHECK(s.report.x[motor_speed] == Approx(90.0 * s.report.x[load_speed]).epsilon(1e-12));
            CHECK(s.report.x[load_angle] == Approx(1e9 * s.report.x[load_speed]).epsilon(1e-6));
        }
    }
    TEST_CASE("splitting a run of random drives at a random instant changes nothing beyond rounding") {
        RandomDrives random(20261122);
        double worst = 0.0;
        for (int n = 0; n < cases(2000); ++n) {
            const Drive drive = random.drive();
            const int kind = n % 4;
            const double duration = kind < 2 ? 0.25 : 2.0, at = duration * random.uniform(0.02, 0.98);
            Signals signals = random.signals(drive, 0.25);
            if (drive.jams()) continue;
            if (kind > 0) signals = that_end(signals, kind == 1 ? 0.02 : 0.2, kind == 3);
            const Splitting s = split_run(drive, signals, duration, at);
            CAPTURE(n);
            CHECK_MESSAGE(same_beyond_rounding(s), "status ", static_cast<int>(s.status), " at ", s.time, ", split ",
                          static_cast<int>(s.split), ", gap ", s.gap, ", amplification ", s.amplification);
            worst = std::fmax(worst, s.amplification > 1e-10 ? 0.0 : s.gap);
        }
        std::printf("dying out: random drives split, largest gap of a motion that amplifies nothing %.1e\n", worst);
    }
    TEST_CASE("stick-slip that dies out, and ringing about zero torque, go on as long as there is anything left") {
        // 2007: a self-locking gear creeps down in slips whose torques fall by a sixth each, from 1e-10 N m on beside
        // 5 N m. 17186, 89382: a free load rings at the edge of a backlash, in the end with 1e-12 N m beside 1 N m.
        RandomDrives random(1);
        for (long n = 0; n <= 89382; ++n) {
            const SplitCase c(random, n);
            if (n != 2007 && n != 17186 && n != 89382) continue;
            CAPTURE(n);
            const Splitting s = split_run(c.drive, c.signals, c.duration, c.at);
            CHECK(s.status == Status::done);
            CHECK(s.split == Status::done);
            CHECK(s.gap < 1e-9);
            const Samples start = run(c.drive, c.signals, 0.5, 0.05);
            CHECK(referee::referee_agrees(c.drive, c.signals, 0.5, 0.05, start, 1e-8));
        }
    }
    TEST_CASE("self-locking gears whose load reverses stay stuck or go on, but do not jam") {
        for (const bool hysteresis : {false, true}) {
            SelfLockingDrives random(7, hysteresis);
            for (int n = 0; n < cases(2000); ++n) {
                const Drive drive = random.drive();
                const Signals signals = random.reversing(drive);
                const Samples s = run(drive, signals, 0.5, 0.05);
                CAPTURE(n);
                CAPTURE(hysteresis);
                CHECK(s.report.status == Status::done);
                if (n % 100 == 0)
                    CHECK(referee::referee_agrees(drive, signals, 0.05, 0.005, run(drive, signals, 0.05, 0.005), 1e-8));
            }
        }
    }
    TEST_CASE("drives that nothing holds start from rest as with a friction of 1e-12 of the rated torque") {
        UnloadedDrives random(7);
        double worst = 0.0;
        for (int n = 0; n < cases(2000); ++n) {
            const Drive drive = random.drive();
            const Signals signals = random.from_zero(drive);
            Drive held = drive;
            held.motor.friction_torque = 1e-12 * drive.motor.rated_torque;
            const Samples s = run(drive, signals, 0.02, 1e-3), h = run(held, signals, 0.02, 1e-3);
            CAPTURE(n);
            CHECK(s.report.status == Status::done);
            REQUIRE(h.report.status == Status::done);
            const double gap = difference_at_end(drive, s, h.report.x);
            CHECK(gap < 1e-6);
            worst = std::fmax(worst, gap);
            if (n % 50 == 0) {
                CHECK(run(drive, signals, 0.02, 1e-3, {}, 1e-8).report.status == Status::done);
                CHECK(referee::referee_agrees(drive, signals, 0.01, 1e-3, run(drive, signals, 0.01, 1e-3), 1e-8));
            }
        }
        std::printf("dying out: 2000 drives start from rest, largest effect of a friction of 1e-12 %.1e\n", worst);
    }
    TEST_CASE("everything that holds a load vanishes with it: a swinging load on a locked input") {
        // w = 0.25 cos 8 t; capacity b |T_2|/i and held torque |T_2|/i pass zero together at t = pi/16 k.
        Drive d = plain_drive(2.0, 1.0, 4.0);
        set_curve(d, {}, {256.0});
        d.gearbox.losses = Gearbox::loss_map;
        d.gearbox.rated_output_torque = 4.0;
        for (const double b : {1.1, 2.0}) {
            d.gearbox.map = LossMap({0.0, 1.0}, {-1.0, 0.0, 1.0}, {b, b, 0.0, 0.0, 0.5, 0.5});
            const Start start = start_at({{load_speed, 0.25}});
            const Samples s = run(d, {}, 20.0, 0.01, start);
            REQUIRE(s.report.status == Status::done);
            for (std::size_t k = 0; k < s.samples; ++k) {
                CHECK(s(load_speed, k) ==
                      Approx(0.25 * std::cos(0.08 * static_cast<double>(k))).epsilon(1e-11).scale(0.25));
                CHECK(s(motor_speed, k) == 0.0);
            }
        }
    }
    TEST_CASE("ripple of 300 kHz to 1 MHz: the sample interval does not matter") {
        RandomDrives random(5);
        for (int n = 0; n < 40; ++n) {
            const Drive drive = random.drive();
            if (drive.jams()) continue;
            Signals signals = random.signals(drive, 0.01);
            const bool load = random.coin();
            signals[load ? 1 : 0].sines.push_back(
                {load ? drive.gearbox.rated_output_torque * random.spread(1e-3, 0.3) : random.spread(0.01, 0.3),
                 random.spread(3e5, 1e6), 0.0});
            const Samples first = run(drive, signals, 2e-3, 2e-6);  // fine enough to show how far the ripple swings
            CAPTURE(n);
            REQUIRE(first.report.status == Status::done);
            for (const double interval : {1e-3, 1e-4, 3e-4, 7e-5}) {
                const Samples s = run(drive, signals, 2e-3, interval);
                REQUIRE(s.report.status == Status::done);
                CHECK(difference_at_end(drive, first, s.report.x) < 1e-9);
            }
        }
    }
    TEST_CASE("the ledger of a stiff drive closes, and long panels make it quick") {
        for (const double tau : {1e-6, 1e-8, 1e-10}) {
            Drive d = hysteretic_drive();
            d.motor.electrical_time_constant = tau;
            const Samples s = run(d, {sine(1.0275, 1.0), Signal{}}, 1.0, 1e-2);
            REQUIRE(s.report.status == Status::done);
            CHECK(std::fabs(s.report.residual()) < 1e-10 * s.report.turned_over);
        }
        Drive d = hysteretic_drive();
        d.load.viscous_friction = 1e6;
        const Samples s = run(d, {sine(1.0275, 1.0), Signal{}}, 1.0, 1e-2);
        CHECK(std::fabs(s.report.residual()) < 1e-10 * s.report.turned_over);
    }
    TEST_CASE("the ledger closes however fast the motor's torque follows its voltage") {
        RandomDrives random(23);
        for (int n = 0; n < cases(120); ++n) {
            Drive d = random.drive();
            if (d.jams()) continue;
            d.motor.electrical_time_constant = std::pow(10.0, -4 - n % 7);
            const Samples s = run(d, random.signals(d, 0.4), 0.4, 1e-2);
            if (s.report.status != Status::done) continue;
            CAPTURE(n);
            CHECK(std::fabs(s.report.residual()) <= 1e-10 * s.report.turned_over);
        }
    }
    TEST_CASE("adaptive solver: a sample at a jump has the inputs and the modes after it") {
        Drive d = hysteretic_drive();
        const Signals signals{lines({{0.0, 0.05, 0.0}, {0.1, 0.9, 0.0}, {0.2, -0.9, 0.0}}),
                              lines({{0.0, 0.0, 0.0}, {0.15, 20.0, 0.0}})};
        for (const double end : {0.3, 0.2}) {  // a jump at the end belongs to what comes after
            const Samples exact = run(d, signals, end, 0.01), fine = run(d, signals, end, 0.01, {}, 1e-12);
            REQUIRE(exact.samples == fine.samples);
            for (std::size_t k = 0; k < exact.samples; ++k) {
                CHECK(fine(command, k) == exact(command, k));
                CHECK(fine(load_torque, k) == exact(load_torque, k));
                CHECK(fine(output_torque, k) == Approx(exact(output_torque, k)).epsilon(1e-7).scale(1.0));
                CHECK(fine(input_contact, k) == exact(input_contact, k));
            }
        }
    }
    TEST_CASE("adaptive solver: a very light load is stiff, but no accumulation") {
        for (const double inertia : {1e-9, 1e-7}) {
            Drive d = hysteretic_drive();
            d.load.inertia = inertia;
            d.load.viscous_friction = 0.04 * std::sqrt(0.65 * 26.5e3 * inertia);
            const Signals signals{sine(1.0275, 1.0), Signal{}};
            const Samples exact = run(d, signals, 0.02), adaptive = run(d, signals, 0.02, 1e-3, {}, 1e-8);
            REQUIRE(adaptive.report.status == Status::done);
            CHECK(adaptive.report.x[motor_speed] == Approx(exact.report.x[motor_speed]).epsilon(1e-6));
        }
    }
}

}  // namespace lostmotion::test
