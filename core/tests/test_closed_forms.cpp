// One effect at a time against its closed form.
#include <doctest/doctest.h>

#include "drive_runs.hpp"

namespace lostmotion::test {
using doctest::Approx;

TEST_SUITE("closed_forms") {
    TEST_CASE("motor step response is that of two real poles") {
        Drive d = plain_drive(1.0, 80e-7, 67e-7);
        d.motor.kind = Motor::dc;
        d.motor.rated_torque = 0.521;
        d.motor.rated_speed = 345.6;
        d.motor.electrical_time_constant = 0.1286e-3;
        d.motor.armature_voltage_constant = 3.1169;
        const double J = 147e-7, k_N = 3.1169, E = 0.7, tau = 0.1286e-3;
        // tau s^2 + s + (k_N - 1) M_DR/(omega_DR J) = 0
        const double c = (k_N - 1.0) * 0.521 / (345.6 * J), root = std::sqrt(1.0 - 4.0 * tau * c);
        const double p = (-1.0 + root) / (2.0 * tau), q = (-1.0 - root) / (2.0 * tau);
        const double steady = k_N * E * 345.6 / (k_N - 1.0);
        const Samples s = run(d, {constant(E), Signal{}}, 0.05, 1e-4);
        for (std::size_t k = 0; k < s.samples; ++k) {
            const double t = 1e-4 * k;
            const double w = steady * (1.0 - (q * std::exp(p * t) - p * std::exp(q * t)) / (q - p));
            CHECK(s(motor_speed, k) == Approx(w).epsilon(1e-12).scale(steady));
        }
    }

    TEST_CASE("two masses: resonance 84.217 Hz, anti-resonance 59.550 Hz") {
        Drive d = plain_drive(1.0, 0.005, 0.005);
        set_curve(d, {}, {700.0});
        // Free: the twist from rest swings with the resonance, and nothing else.
        const Start start = start_at({{twist, 1e-3}});
        const Samples free = run(d, {}, 1.0, 1e-3, start);
        const double resonance = std::sqrt(700.0 * 2.0 / 0.005);
        CHECK(resonance / (2.0 * pi) == Approx(84.217).epsilon(1e-5));
        for (std::size_t k = 0; k < free.samples; ++k)
            CHECK(free(twist, k) == Approx(1e-3 * std::cos(resonance * 1e-3 * k)).epsilon(1e-11).scale(1e-3));
        // Driven with the anti-resonance, the steady motion of the input is zero: start on it.
        const double anti = std::sqrt(700.0 / 0.005), torque = 0.7;
        CHECK(anti / (2.0 * pi) == Approx(59.550).epsilon(1e-5));
        const Start driven = start_at({{load_speed, -torque * anti / 700.0}});
        const Samples s = run(d, {sine(torque, anti / (2.0 * pi)), Signal{}}, 1.0, 1e-3, driven);
        for (std::size_t k = 0; k < s.samples; ++k)
            CHECK(s(motor_speed, k) == Approx(0.0).scale(torque * anti / 700.0).epsilon(1e-9));
    }

    TEST_CASE("free oscillation decays with its damping") {
        // The input shaft is far too heavy to move: one mass on a spring.
        Drive d = plain_drive(1.0, 1e18, 2.0);
        set_curve(d, {}, {800.0});
        d.load.viscous_friction = 4.0;
        const Start start = start_at({{twist, -0.01}});
        const Samples s = run(d, {}, 2.0, 1e-3, start);
        const double a = 4.0 / (2.0 * 2.0), w = std::sqrt(800.0 / 2.0 - a * a);
        for (std::size_t k = 0; k < s.samples; ++k) {
            const double t = 1e-3 * k;
            const double d_t = -0.01 * std::exp(-a * t) * (std::cos(w * t) + a / w * std::sin(w * t));
            CHECK(s(twist, k) == Approx(d_t).epsilon(1e-12).scale(0.01));
        }
    }

    TEST_CASE("Coulomb friction coasts to a stop at the exact instant, and stays") {
        Drive d = plain_drive(1.0, 2e-3, 3e-3);
        d.motor.friction_torque = 0.05;
        const Start start = start_at({{motor_speed, 4.0}, {load_speed, 4.0}});
        const Samples s = run(d, {}, 1.0, 1e-3, start);
        REQUIRE(s.report.switching_count == 1);
        CHECK(s.report.switchings[0].time == Approx(5e-3 * 4.0 / 0.05).epsilon(1e-14));
        CHECK(s.report.x[motor_speed] == 0.0);
        CHECK(s.report.x[load_speed] == 0.0);
        CHECK(s.report.x[load_angle] == Approx(0.5 * 4.0 * 0.4).epsilon(1e-13));
    }

    TEST_CASE("a ramp breaks the shaft away at the exact instant") {
        Drive d = plain_drive(1.0, 2e-3, 3e-3);
        d.motor.friction_torque = 0.05;
        const Samples s = run(d, {lines({{0.0, 0.0, 0.2}}), Signal{}}, 1.0);
        REQUIRE(s.report.switching_count == 1);
        CHECK(s.report.switchings[0].time == Approx(0.25).epsilon(1e-14));
        CHECK(s.report.x[motor_speed] == Approx(0.5 * 0.2 * 0.75 * 0.75 / 5e-3).epsilon(1e-13));
    }

    TEST_CASE("backlash is traversed in the exact time") {
        Drive d = plain_drive(10.0, 1e-4, 2.0);
        set_curve(d, {2e-3}, {0.0, 5e4});
        const Start start = start_at({{twist, -2e-3}});
        const Samples s = run(d, {constant(0.3), Signal{}}, 0.006, 1e-4, start);
        // The input accelerates alone through the whole gap: 4 mrad at the output.
        REQUIRE(s.report.switching_count >= 1);
        CHECK(s.report.switchings[0].time == Approx(std::sqrt(2.0 * 4e-3 * 10.0 * 1e-4 / 0.3)).epsilon(1e-13));
    }

    TEST_CASE("hysteresis loop has the area that its capacity and width give") {
        // Load held almost still by its inertia, input swinging slowly: T_2 = P + h, a parallelogram.
        Drive d = plain_drive(1.0, 1e-6, 1e9);
        set_curve(d, {}, {1000.0});
        d.gearbox.hysteresis_efficiency = 0.9;
        d.gearbox.viscous_friction = 0.05;
        const double amplitude = 2.0;
        const Samples s = run(d, {sine(amplitude, 0.05), Signal{}}, 60.0, 0.01);
        // Every turning point has |P| = D: between two of them h = 0.05 D is constant and dissipates 2 d h.
        double top = 0.0;
        const std::size_t from = s.samples - 2001;  // the last period
        for (std::size_t k = from; k < s.samples; ++k) top = std::fmax(top, s(twist, k));
        double area = 0.0;
        for (std::size_t k = from; k + 1 < s.samples; ++k)
            area += 0.5 * (s(output_torque, k) + s(output_torque, k + 1)) * (s(twist, k + 1) - s(twist, k));
        CHECK(area == Approx(2.0 * (2.0 * top) * 0.05 * 1000.0 * top).epsilon(2e-3));
        // The ledger knows the same to rounding: count the last whole loops by their twists.
        double dissipated = 0.0, turn = 0.0, h = 0.0;
        for (const TrainSwitching& w : s.report.switchings) {
            if (w.kind != model::Guard::speed) continue;
            const double reached = run(d, {sine(amplitude, 0.05), Signal{}}, w.time, 0.01).report.x[twist];
            dissipated += h * std::fabs(reached - turn);
            turn = reached;
            h = 0.05 * 1000.0 * std::fabs(turn);
        }
        dissipated += h * std::fabs(s.report.x[twist] - turn);
        CHECK(s.energy(in_hysteresis) == Approx(dissipated).epsilon(1e-9));
    }

    TEST_CASE("viscous friction gives its steady speed") {
        Drive d = plain_drive(5.0, 1e-4, 2e-3);
        d.gearbox.viscous_friction = 0.01;
        d.load.viscous_friction = 0.2;
        const Samples s = run(d, {constant(0.4), Signal{}}, 20.0, 0.1);
        CHECK(s.report.x[motor_speed] == Approx(0.4 / (0.01 + 0.2 / 25.0)).epsilon(1e-13));
        CHECK(s.report.x[load_speed] == Approx(s.report.x[motor_speed] / 5.0).epsilon(1e-13));
    }

    TEST_CASE("a rigid gear with constant efficiency follows (9)") {
        Drive d = paper_drive(plane_map(0.0, 0.0, 0.0));
        d.motor.friction_torque = 0.0;
        d.gearbox.compliance = Gearbox::rigid;
        d.gearbox.hysteresis_efficiency = 1.0;
        d.gearbox.losses = Gearbox::constant_efficiency;
        d.gearbox.efficiency = 0.9;
        const double J = d.input_inertia() + 2.0 / (8100.0 * 0.9);
        const double b = d.gearbox.viscous_friction + d.load.viscous_friction / (8100.0 * 0.9);
        const double tau = d.motor.electrical_time_constant, k_N = d.motor.armature_voltage_constant;
        const double c = (k_N - 1.0) * 0.521 / 345.6;
        // J tau w'' + (J + b tau) w' + (b + c) w = k_N M_DR E
        const double omega2 = (b + c) / (J * tau), two_xi_omega = (J + b * tau) / (J * tau);
        for (const double f : {0.1, 1.0, 10.0, 100.0, 1000.0}) {
            const double w = 2.0 * pi * f;
            const double re = omega2 - w * w, im = two_xi_omega * w, gain = k_N * 0.521 / (J * tau);
            const double real = gain * re / (re * re + im * im), imag = -gain * im / (re * re + im * im);
            // Start on the periodic solution w_M = Im(H e^(i w t)).
            const Start start =
                start_at({{motor_speed, imag}, {load_speed, imag / 90.0}, {motor_torque, J * w * real + b * imag}});
            const Samples s = run(d, {sine(1.0, f), Signal{}}, 3.0 / f, 0.01 / f, start);
            for (std::size_t k = 0; k < s.samples; ++k) {
                const double t = k * 0.01 / f;
                const double expected = real * std::sin(w * t) + imag * std::cos(w * t);
                CHECK(s(motor_speed, k) == Approx(expected).epsilon(1e-11).scale(std::hypot(real, imag)));
            }
        }
    }

    // Known as LossyGearDemo1 of the Modelica Standard Library; the instants are its closed form.
    TEST_CASE("lossy rigid gear between two inertias switches at the closed-form instants") {
        Drive d = plain_drive(2.0, 1.0, 1.5);
        d.gearbox.losses = Gearbox::loss_map;
        // Efficiency 0.5 both ways: m = mu (1/0.5 - 1) driving, |mu| (1 - 0.5) overrunning.
        d.gearbox.map = LossMap({0.0, 1.0}, {-1.0, 0.0, 1.0}, {0.5, 0.5, 0.0, 0.0, 1.0, 1.0});
        d.gearbox.rated_output_torque = 10.0;
        // In the published case both torques act on their flanges: tau_2 accelerates the load, M_Z brakes it.
        const Samples s = run(d, {sine(10.0, 1.0), lines({{0.0, 10.0, -2.5}})}, 0.5, 0.01);
        REQUIRE(s.report.status == Status::done);
        std::vector<double> instants;
        const int contact = s.contact(input_contact);
        for (const TrainSwitching& w : s.report.switchings)
            if (w.before[contact] != w.after[contact]) instants.push_back(w.time);
        const double expected[] = {0.0804771339, 0.1995199008, 0.3713427780, 0.4645394616};
        REQUIRE(instants.size() == 4);
        for (int k = 0; k < 4; ++k) CHECK(std::fabs(instants[k] - expected[k]) < 1e-9);
        CHECK(std::fabs(s.report.x[load_speed] - -0.01626192938) < 1e-10);
    }

    TEST_CASE("stiffness from a data book: 60 N m on a gear of size 32 twist it by 7.15e-4 rad") {
        const double T_1 = 29.0, K_1 = 6.7e4, K_2 = 1.1e5;
        const TorsionCurve curve({T_1 / K_1}, {K_1, K_2});
        const double twist = T_1 / K_1 + (60.0 - T_1) / K_2;
        CHECK(twist == Approx(7.15e-4).epsilon(1e-3));
        CHECK(curve.torque(twist) == Approx(60.0).epsilon(1e-14));
        CHECK(curve.torque(-twist) == Approx(-60.0).epsilon(1e-14));
    }
}

}  // namespace lostmotion::test
