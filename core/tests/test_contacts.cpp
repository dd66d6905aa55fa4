// Sticking, sliding, jamming: the set-valued contacts.
#include <doctest/doctest.h>

#include "drive_runs.hpp"
#include "lostmotion/analysis/train_explain.hpp"

namespace lostmotion::test {
using doctest::Approx;

namespace {

Drive sticky_paper_drive() { return paper_drive(plane_map(0.02, 0.04, 0.06)); }

// That turns a drive forward from rest.
double smallest_command(const Drive& drive) {
    Simulation at_rest(drive, 1e-3);
    return explain_motors(at_rest.train.assembly(), point(at_rest.train))[0].command_forward;
}

}  // namespace

TEST_SUITE("contacts") {
    TEST_CASE("a stuck shaft does not creep in one hour") {
        const Drive drive = sticky_paper_drive();
        const double below = 0.9 * smallest_command(drive);
        const Samples s = run(drive, {sine(below, 3.0), Signal{}}, 3600.0, 60.0);
        REQUIRE(s.report.status == Status::done);
        CHECK(s.report.x[motor_speed] == 0.0);
        CHECK(s.report.x[load_angle] == 0.0);
        CHECK(s.report.x[twist] == 0.0);
        CHECK(s.report.switching_count == 0);
    }

    TEST_CASE("the smallest command that moves the load does, and a little less does not") {
        for (const double T_f : {0.0, 0.4}) {
            Drive drive = sticky_paper_drive();
            drive.load.friction_torque = T_f;
            const double smallest = smallest_command(drive);
            for (const double factor : {0.995, 1.005}) {
                // Approached slowly: the formula leaves inertia out.
                const Samples s = run(
                    drive, {lines({{0.0, 0.0, factor * smallest / 20.0}, {20.0, factor * smallest, 0.0}}), Signal{}},
                    40.0, 1.0);
                CHECK((std::fabs(s.report.x[load_speed]) > 1e-6) == (factor > 1.0));
            }
        }
    }

    TEST_CASE("the torque of a standing drive follows what pushes it, and stays where that turns back") {
        // All is at rest: T_2 is M_Z followed with a play of T_f on either side, or i M_D with one of i T_10. Between
        // instants dt apart a turning point of 2 sin(10 pi t) is missed by less than 2 (10 pi)^2 dt^2/8 = 4e-8.
        const auto check = [](const Drive& d, const Signals& signals, double half_width, auto&& centre) {
            constexpr int steps = 1000;
            const double interval = 0.0125, dt = interval / steps;
            const Samples s = run(d, signals, 3.0, interval), adaptive = run(d, signals, 3.0, interval, {}, 1e-10);
            REQUIRE(s.report.status == Status::done);
            REQUIRE(adaptive.report.status == Status::done);
            double T_2 = 0.0;
            for (std::size_t k = 0; k < s.samples; ++k) {
                for (int n = k == 0 ? steps : 1; n <= steps; ++n) {
                    const double at = centre(dt * (static_cast<double>(k) * steps - steps + n));
                    T_2 = std::clamp(T_2, at - half_width, at + half_width);
                }
                CHECK(s(output_torque, k) == Approx(T_2).epsilon(1e-7).scale(1.0));
                CHECK(adaptive(output_torque, k) == Approx(T_2).epsilon(1e-7).scale(1.0));
                CHECK(s(load_speed, k) == 0.0);
                CHECK(s(motor_speed, k) == 0.0);
            }
        };
        for (const double a : {0.0, 0.9}) {
            const auto of_time = [a](double t) { return 1.1 * std::sin(2.0 * pi * t) + a * std::sin(10.0 * pi * t); };
            const Signal signal{{Breakpoint{}}, {{1.1, 1.0, 0.0}, {a, 5.0, 0.0}}};
            Drive d = plain_drive(2.0, 1.0, 1.0);
            d.motor.friction_torque = 8.0;
            d.load.friction_torque = 0.5;
            check(d, {Signal{}, signal}, 0.5, of_time);
            std::swap(d.motor.friction_torque, d.load.friction_torque);
            check(d, {signal, Signal{}}, 1.0, [&](double t) { return 2.0 * of_time(t); });
        }
        Drive d = plain_drive(2.0, 1.0, 1.0);
        d.motor.kind = Motor::dc;
        d.motor.electrical_time_constant = 0.5;
        d.motor.armature_voltage_constant = 2.0;
        d.motor.friction_torque = 0.25;
        d.load.friction_torque = 8.0;
        const auto M_D = [](double t) {  // 2 E, by exponentials of 0.5 s
            const auto to = [](double from, double end, double span) {
                return end + (from - end) * std::exp(-2.0 * span);
            };
            return t < 0.5 ? to(0.0, 2.0, t) : to(to(0.0, 2.0, 0.5), -2.0, t - 0.5);
        };
        const Signal steps = lines({{0.0, 1.0, 0.0}, {0.5, -1.0, 0.0}});
        check(d, {steps, Signal{}}, 0.5, [&](double t) { return 2.0 * M_D(t); });
    }

    TEST_CASE("where an input jumps the torque of a standing drive leaves from what it was before") {
        Drive d = plain_drive(2.0, 1.0, 1.0);
        d.motor.friction_torque = 0.25;
        d.load.friction_torque = 8.0;
        // i M_D = 1, 1.4, 2, 0.6 with a play of 0.5
        const Signal steps = lines({{0.0, 0.5, 0.0}, {0.1, 0.7, 0.0}, {0.2, 0.9, 1.0}, {0.3, 0.3, 0.0}});
        const std::vector<double> T_2{0.5, 0.9, 1.3, 1.1};
        const Samples s = run(d, {steps, Signal{}}, 0.4, 0.1), adaptive = run(d, {steps, Signal{}}, 0.4, 0.1, {}, 1e-9);
        Simulation simulation(d, 0.1);
        for (std::size_t k = 0; k < T_2.size(); ++k) {
            CHECK(s(output_torque, k) == Approx(T_2[k]));
            CHECK(adaptive(output_torque, k) == Approx(T_2[k]));
            const Breakpoint& at = steps.breakpoints[k];
            REQUIRE(simulation.advance(0.1, at.value, at.value + 0.1 * at.slope, 0.0, 0.0) == Status::done);
            CHECK(simulation(output_torque) == Approx(k == 2 ? 1.5 : T_2[k]));
        }
    }

    TEST_CASE("a self-locking gear at rest and free of torque is wound up by the motor either way") {
        // M_D = s t (1 + a) T_2/(i T_2) until T_2 = s T_f, then both move: t = T_f (1 + a)/i.
        for (const double way : {+1.0, -1.0})
            for (const double overrunning : {1.25, 2.0}) {
                const double a = 0.5, T_f = 0.25, i = 2.0;
                Drive d = plain_drive(i, 1.0, 1.0);
                d.load.friction_torque = T_f;
                d.gearbox.losses = Gearbox::loss_map;
                d.gearbox.map = LossMap({0.0, 1.0}, {-1.0, 0.0, 1.0}, {overrunning, overrunning, 0.0, 0.0, a, a});
                const Samples s = run(d, {lines({{0.0, 0.0, way}}), Signal{}}, 0.3, 0.01);
                REQUIRE(s.report.status == Status::done);
                const double moves = T_f * (1.0 + a) / i;
                for (std::size_t k = 0; k < s.samples; ++k) {
                    const double t = 0.01 * static_cast<double>(k);
                    CHECK((s(motor_speed, k) != 0.0) == (t > moves));
                    if (t < moves)
                        CHECK(s(output_torque, k) == Approx(way * i * t / (1.0 + a)).epsilon(1e-12).scale(1e-3));
                }
            }
    }

    TEST_CASE("no contact, damper or hysteresis ever gives energy") {
        RandomDrives random(7);
        for (int n = 0; n < cases(750); ++n) {
            const Drive drive = random.drive();
            if (drive.jams()) continue;
            const Samples s = run(drive, random.signals(drive, 0.4), 0.4, 0.01);
            REQUIRE(s.report.status == Status::done);
            const double slack = -1e-12 * s.report.turned_over;
            for (const char* f : {in_input_damper, in_motor_friction, in_hysteresis, in_load_damper, in_load_friction})
                CHECK(s.energy(f) >= slack);
            if (drive.gearbox.losses == Gearbox::loss_map) CHECK(s.energy(in_gear) >= slack);
        }
    }

    TEST_CASE("a constant efficiency creates energy while the load drives, and the ledger shows it") {
        Drive d = plain_drive(10.0, 1e-4, 0.5);
        d.gearbox.efficiency = 0.8;
        const Samples s = run(d, {Signal{}, constant(-2.0)}, 1.0, 0.01);
        // T_1 w_M all goes into the input's own kinetic energy, and the gear adds a share of 1 - 0.8 to it.
        const double kinetic = 0.5 * 1e-4 * s.report.x[motor_speed] * s.report.x[motor_speed];
        CHECK(kinetic > 0.01);
        CHECK(s.energy(in_gear) == Approx(-(1.0 - 0.8) * kinetic).epsilon(1e-11));
        CHECK(std::fabs(s.report.residual()) < 1e-12 * s.report.turned_over);
    }

    TEST_CASE("self-locking: a gear with negative back-driving efficiency holds any load") {
        Drive d = plain_drive(60.0, 1e-4, 0.5);
        set_curve(d, {}, {5e3});
        d.gearbox.losses = Gearbox::loss_map;
        d.gearbox.rated_output_torque = 70.0;
        d.gearbox.rated_input_speed = 300.0;
        d.load.viscous_friction = 1.0;
        for (const double eta_back : {-0.1, 0.1}) {
            const double a = 1.0 - eta_back;
            d.gearbox.map = LossMap({0.0, 1.0}, {-1.0, 0.0, 1.0}, {a, a, 0.0, 0.0, 2.0, 2.0});
            const Samples s = run(d, {Signal{}, lines({{0.0, 0.0, 25.0}, {2.0, 50.0, 0.0}})}, 10.0, 0.1);
            REQUIRE(s.report.status == Status::done);
            if (eta_back < 0.0)
                CHECK(std::fabs(s.report.x[load_speed]) < 1e-6);
            else
                CHECK(s.report.x[load_speed] < -1.0);
        }
    }

    TEST_CASE("a rigid self-locking gear with a large load inertia jams, and a compliance cures it") {
        Drive d = plain_drive(60.0, 1e-4, 50.0);
        d.gearbox.losses = Gearbox::loss_map;
        d.gearbox.rated_output_torque = 70.0;
        const double a = 1.0 - -0.5;
        d.gearbox.map = LossMap({0.0, 1.0}, {-1.0, 0.0, 1.0}, {a, a, 0.0, 0.0, 2.0, 2.0});
        CHECK(d.jams());
        const Start start = start_at({{motor_speed, 60.0}, {load_speed, 1.0}});
        CHECK(run(d, {constant(-0.5), Signal{}}, 5.0, 0.01, start).report.status == Status::jammed);
        set_curve(d, {}, {5e4});
        const Samples s = run(d, {constant(-0.5), Signal{}}, 5.0, 0.01, start);
        CHECK(s.report.status == Status::done);
    }

    TEST_CASE("everything stuck: the load's friction takes what the twist does not, and each breaks in its turn") {
        Drive d = plain_drive(10.0, 1e-4, 0.5);
        d.motor.friction_torque = 0.5;
        d.load.friction_torque = 2.0;
        set_curve(d, {}, {1e3});
        // M_Z alone: the load holds up to T_f, then moves against the spring whose other end is held by the motor.
        const Samples s = run(d, {Signal{}, lines({{0.0, 0.0, 1.0}})}, 3.0, 0.01);
        REQUIRE(s.report.status == Status::done);
        REQUIRE(s.report.switching_count >= 1);
        CHECK(s.report.switchings[0].time == Approx(2.0).epsilon(1e-13));
        CHECK(s.report.switchings[0].contact == s.contact(load_contact));
    }

    TEST_CASE("what a stuck contact holds lies within its capacity") {
        const Drive drive = sticky_paper_drive();
        constexpr double step = 0.005;
        Simulation simulation(drive, step);
        const auto command = [](int k) { return 0.025 * std::sin(2.0 * pi * step * k); };
        int stuck = 0;
        for (int k = 1; k <= 400; ++k) {
            REQUIRE(simulation.advance(step, command(k - 1), command(k), 0.0, 0.0) == Status::done);
            const ContactReport c = explain_contacts(simulation.train.assembly(), point(simulation.train))[0];
            REQUIRE(c.name == quantity_names[input_contact]);
            if (c.mode != 0) continue;
            ++stuck;
            CHECK(c.torque <= c.capacity_forward * (1.0 + 1e-12));
            CHECK(c.torque >= -c.capacity_backward * (1.0 + 1e-12));
        }
        CHECK(stuck > 50);
    }

    TEST_CASE("mirror the inputs and the motion mirrors") {
        RandomDrives random(11);
        for (int n = 0; n < cases(300); ++n) {
            Drive drive = random.drive();
            if (drive.jams()) continue;
            const Signals signals = random.signals(drive, 0.3), image{mirrored(signals[0]), mirrored(signals[1])};
            const Samples a = run(drive, signals, 0.3, 0.01), b = run(drive, image, 0.3, 0.01);
            REQUIRE(a.report.status == Status::done);
            REQUIRE(b.report.status == Status::done);
            CAPTURE(n);
            for (const Quantity c : {motor_torque, motor_speed, load_speed, twist, output_torque}) {
                double size = 0.0, gap = 0.0;
                for (std::size_t k = 0; k < a.samples; ++k) {
                    size = std::fmax(size, std::fabs(a(c, k)));
                    gap = std::fmax(gap, std::fabs(a(c, k) + b(c, k)));
                }
                // Motions that all but come to rest may find their last turning points in their rounding.
                CHECK(gap <= 1e-9 * size);
            }
        }
    }
}

}  // namespace lostmotion::test
