// Signals and drives shared by the tests.
#pragma once

#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>
#include <vector>

#include "drive.hpp"

namespace lostmotion {

inline constexpr double pi = std::numbers::pi;

// Share of the random cases that are tried. Faults were found within the first fifth; `make soak` tries all.
inline double share_of_cases() {
    const char* given = std::getenv("LOSTMOTION_CASES");
    return given == nullptr ? 0.2 : std::atof(given);
}
inline int cases(int all) { return static_cast<int>(std::ceil(all * share_of_cases())); }
// At least nine tenths of what all cases give are to be found in that share.
inline int share(int of_all) { return static_cast<int>(0.9 * of_all * share_of_cases()); }

// m_2B = at_zero + per_speed v + per_load |mu|.
inline LossMap plane_map(double at_zero, double per_speed, double per_load) {
    const std::vector<double> speeds{0.0, 2.0}, loads{-2.0, 0.0, 2.0};
    std::vector<double> values;
    for (const double mu : loads)
        for (const double v : speeds) values.push_back(at_zero + per_speed * v + per_load * std::fabs(mu));
    return LossMap(speeds, loads, values);
}

inline Signal sine(double amplitude, double frequency, double phase = 0.0) {
    Signal s;
    s.sines.push_back({amplitude, frequency, phase});
    return s;
}
inline Signal constant(double value) {
    Signal s;
    s.breakpoints[0].value = value;
    return s;
}
inline Signal lines(std::vector<Breakpoint> breakpoints) {
    Signal s;
    s.breakpoints = std::move(breakpoints);
    return s;
}

namespace test {

// The published drive, with omega_DR = 345.6 rad/s and n_1R = 3630 rpm exactly.
inline Drive paper_drive(const LossMap& map) {
    Drive d;
    d.motor.rotor_inertia = 80e-7;
    d.motor.friction_torque = 0.016;
    d.motor.rated_torque = 0.521;
    d.motor.rated_speed = 345.6;
    d.motor.electrical_time_constant = 0.1286e-3;
    d.motor.armature_voltage_constant = 3.1169;
    d.gearbox.ratio = 90.0;
    d.gearbox.inertia = 67e-7;
    d.gearbox.compliance = Gearbox::torsion_curve;
    d.gearbox.curve = TorsionCurve({0.6e-3, 3e-3}, {2.65e3, 21.2e3, 26.5e3});
    d.gearbox.hysteresis_efficiency = 0.93;
    d.gearbox.losses = Gearbox::loss_map;
    d.gearbox.map = map;
    d.gearbox.rated_input_speed = 3630.0 * pi / 30.0;
    d.gearbox.rated_output_torque = 51.6;
    const double k_20 = 0.65 * 26.5e3, J_MR = 147e-7;
    d.gearbox.viscous_friction = 2.0 * 0.02 * std::sqrt(k_20 / (90.0 * 90.0 * 0.9 * J_MR)) * J_MR;
    d.load.inertia = 2.0;
    d.load.viscous_friction = 2.0 * 0.02 * std::sqrt(k_20 / 2.0) * 2.0;
    return d;
}

// A torque source on an input shaft, rigidly or through a curve on a load; no losses, no friction.
inline Drive plain_drive(double ratio, double J_1, double J_2) {
    Drive d;
    d.motor.kind = Motor::torque_source;
    d.motor.rotor_inertia = J_1;
    d.gearbox.ratio = ratio;
    d.load.inertia = J_2;
    return d;
}

inline void set_curve(Drive& d, const std::vector<double>& edges, const std::vector<double>& slopes) {
    d.gearbox.compliance = Gearbox::torsion_curve;
    d.gearbox.curve = TorsionCurve(edges, slopes);
}
inline Signal mirrored(Signal s) {
    for (Breakpoint& b : s.breakpoints) b = {b.time, -b.value, -b.slope};
    for (Sine& w : s.sines) w.amplitude = -w.amplitude;
    return s;
}

// Random drives that mix all parts and signals. Sizes are drawn by the logarithm, over what real drives have.
class RandomDrives {
 public:
    explicit RandomDrives(unsigned seed) : random_(seed) {}

    double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }
    double spread(double a, double b) { return std::exp(uniform(std::log(a), std::log(b))); }
    bool coin(double probability = 0.5) { return uniform(0.0, 1.0) < probability; }

    Drive drive() {
        Drive d;
        d.motor.kind = coin(0.8) ? Motor::dc : Motor::torque_source;
        const double J_1 = spread(1e-6, 1e-3), i = spread(1.0, 200.0), T_M = spread(0.02, 20.0) * J_1 * 1e4;
        d.motor.rotor_inertia = 0.6 * J_1;
        d.gearbox.inertia = 0.4 * J_1;
        d.motor.rated_torque = T_M;
        d.motor.rated_speed = spread(50.0, 600.0);
        d.motor.electrical_time_constant = spread(1e-4, 5e-3);
        d.motor.armature_voltage_constant = uniform(1.5, 20.0);
        if (coin(0.7)) d.motor.friction_torque = T_M * spread(1e-3, 0.1);
        if (d.motor.kind == Motor::dc && coin(0.25)) d.motor.voltage_limit = uniform(0.05, 0.9);
        Gearbox& g = d.gearbox;
        g.ratio = i;
        g.rated_input_speed = d.motor.rated_speed * uniform(0.8, 1.5);
        g.rated_output_torque = T_M * i * uniform(0.6, 3.0);
        if (coin(0.7)) g.viscous_friction = J_1 * spread(0.1, 30.0);
        d.load.inertia = J_1 * i * i * spread(0.1, 20.0);
        if (coin(0.7)) d.load.viscous_friction = d.load.inertia * spread(0.1, 10.0);
        if (coin(0.3)) d.load.friction_torque = g.rated_output_torque * spread(1e-3, 0.2);
        if (coin(0.8)) {
            g.compliance = Gearbox::torsion_curve;
            const double k = std::pow(2.0 * pi * spread(5.0, 150.0), 2) * J_1 * i * i;
            const double d_1 = g.rated_output_torque / k * spread(0.02, 0.5);
            switch (static_cast<int>(uniform(0.0, 4.0))) {
                case 0: g.curve = TorsionCurve({}, {k}); break;
                case 1: g.curve = TorsionCurve({d_1}, {0.0, k}); break;
                case 2: g.curve = TorsionCurve({d_1, 3.0 * d_1}, {0.1 * k, 0.7 * k, k}); break;
                default: g.curve = TorsionCurve({d_1, 2.0 * d_1, 5.0 * d_1}, {0.0, 0.3 * k, k, 0.8 * k});
            }
            if (coin(0.6)) g.hysteresis_efficiency = uniform(0.7, 0.99);
        }
        if (coin(0.7)) {
            g.losses = Gearbox::loss_map;
            g.map = loss_map();
        } else {
            g.efficiency = uniform(0.4, 1.0);
        }
        return d;
    }

    LossMap loss_map() {
        std::vector<double> speeds{0.0}, loads{0.0};
        for (double v = spread(0.005, 0.3); v < 1.2; v *= uniform(1.5, 4.0)) speeds.push_back(v);
        if (speeds.size() < 2) speeds.push_back(1.0);
        for (double mu = spread(0.02, 0.5); mu < 1.5; mu *= uniform(1.5, 4.0)) {
            loads.push_back(mu);
            loads.insert(loads.begin(), -mu);
        }
        if (loads.size() < 3) loads = {-1.0, 0.0, 1.0};
        const double m_0 = spread(0.005, 0.08), rise = uniform(0.0, 0.06), a = uniform(0.02, 0.3),
                     b = uniform(0.02, 0.5), start = uniform(1.0, 1.4);
        std::vector<double> values;
        for (const double mu : loads)
            for (const double v : speeds)
                values.push_back((m_0 + rise * std::pow(v, 0.7) + (mu > 0.0 ? a : b) * std::fabs(mu)) *
                                 (v == 0.0 ? start : 1.0));
        return LossMap(speeds, loads, values);
    }

    Signal signal(double size, double duration) {
        Signal s;
        if (coin(0.4)) s.breakpoints[0].value = size * uniform(-1.0, 1.0);
        if (coin(0.6)) {
            const int n = 1 + static_cast<int>(uniform(0.0, 3.0));
            for (int k = 0; k < n; ++k)
                s.sines.push_back({size * uniform(0.1, 1.0), spread(0.3, 30.0) / duration, uniform(-pi, pi)});
        }
        if (coin(0.4)) {
            double t = 0.0, value = s.breakpoints[0].value;
            s.breakpoints.clear();
            while (t < duration) {
                const double span = duration * uniform(0.1, 0.5), next = size * uniform(-1.0, 1.0);
                const bool jump = coin(0.3);
                s.breakpoints.push_back({t, jump ? next : value, jump ? 0.0 : (next - value) / span});
                value = next;
                t += span;
            }
        }
        return s;
    }

    Signals signals(const Drive& d, double duration) {
        return {signal(1.0, duration), coin(0.5) ? signal(0.5 * d.gearbox.rated_output_torque, duration) : Signal{}};
    }

 private:
    std::mt19937_64 random_;
};

}  // namespace test
}  // namespace lostmotion
