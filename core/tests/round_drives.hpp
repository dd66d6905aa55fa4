// Random drives with round parameters, for what seldom happens else: several events at once, limits reached exactly, no
// friction at all, gears at and beyond the threshold of self-locking, long rest.
#pragma once

#include <initializer_list>

#include "drive_runs.hpp"

namespace lostmotion::test {

class RoundDrives {
 public:
    struct Run {
        Drive drive;
        Signals signals;
        Start start;
    };

    explicit RoundDrives(unsigned seed) : random_(seed) {}

    Run next(double duration) {
        Run r;
        r.drive = drive();
        const double torque = coin() ? 1.0 : 0.5;
        r.signals[0] = coin(0.85) ? signal(torque, duration) : Signal{};
        if (coin(0.6)) r.signals[1] = signal(coin() ? 1.0 : r.drive.gearbox.rated_output_torque, duration);
        r.start = start(r.drive);
        return r;
    }

    // A load can be held, or held at the threshold, by the losses that it causes itself.
    static bool self_locking(const Drive& d) {
        const LossMap& m = d.gearbox.map;
        return !m.empty() && m(-1.0, 0.0) - m(-0.5, 0.0) >= 0.5;
    }

 private:
    bool coin(double probability = 0.5) {
        return std::uniform_real_distribution<double>(0.0, 1.0)(random_) < probability;
    }
    double pick(std::initializer_list<double> of) {
        return *(of.begin() + std::uniform_int_distribution<int>(0, static_cast<int>(of.size()) - 1)(random_));
    }

    Drive drive() {
        Drive d;
        d.motor.kind = coin() ? Motor::torque_source : Motor::dc;
        d.motor.rotor_inertia = pick({0.25, 0.5, 1.0});
        d.motor.rated_torque = 1.0;
        d.motor.rated_speed = pick({1.0, 2.0, 4.0});
        d.motor.electrical_time_constant = pick({0.125, 0.03125});
        d.motor.armature_voltage_constant = pick({2.0, 3.0});
        if (coin()) d.motor.friction_torque = pick({0.125, 0.25, 0.5});
        if (d.motor.kind == Motor::dc && coin(0.3)) d.motor.voltage_limit = pick({0.25, 0.5, 1.0});
        Gearbox& g = d.gearbox;
        g.ratio = pick({1.0, 2.0, 4.0});
        g.rated_input_speed = pick({1.0, 2.0});
        g.rated_output_torque = pick({1.0, 2.0, 4.0});
        if (coin(0.4)) g.viscous_friction = pick({0.125, 0.5, 1.0});
        d.load.inertia = pick({1.0, 2.0, 4.0, 16.0});
        if (coin(0.4)) d.load.viscous_friction = pick({0.25, 1.0});
        if (coin()) d.load.friction_torque = pick({0.25, 0.5, 1.0});
        if (coin(0.85)) {
            g.compliance = Gearbox::torsion_curve;
            const double k = pick({16.0, 64.0, 256.0}), d_1 = pick({0.0625, 0.125}), pieces = pick({1.0, 2.0, 3.0});
            g.curve = pieces == 1.0   ? TorsionCurve({}, {k})
                      : pieces == 2.0 ? TorsionCurve({d_1}, {0.0, k})
                                      : TorsionCurve({d_1, 2.0 * d_1}, {0.25 * k, k, 0.5 * k});
            if (coin(0.7)) g.hysteresis_efficiency = pick({0.25, 0.5, 0.75});
        }
        if (coin(0.7)) {
            g.losses = Gearbox::loss_map;
            g.map = loss_map();
        } else {
            g.efficiency = pick({0.5, 0.75, 1.0});
        }
        return d;
    }

    LossMap loss_map() {
        const double no_load = coin() ? 0.0 : pick({0.0625, 0.25}), rise = pick({0.0, 0.25});
        const double driving = pick({0.0, 0.25, 0.5, 1.0}), overrunning = pick({0.0, 0.25, 0.5, 1.0, 1.25, 2.0});
        std::vector<double> speeds{0.0, 1.0}, loads{-1.0, 0.0, 1.0};
        if (coin()) {
            speeds = {0.0, 0.5, 1.0};
            loads = {-1.0, -0.5, 0.0, 0.5, 1.0};
        }
        std::vector<double> values;
        for (const double mu : loads)
            for (const double v : speeds)
                values.push_back(no_load + rise * v * (0.25 + std::fabs(mu)) +
                                 (mu > 0.0 ? driving : overrunning) * std::fabs(mu));
        return LossMap(speeds, loads, values);
    }

    // Constant, steps, lines or a sine.
    Signal signal(double size, double duration) {
        const int kind = static_cast<int>(pick({0.0, 1.0, 2.0, 3.0}));
        if (kind == 0) return constant(size * pick({-1.0, -0.5, 0.0, 0.25, 0.5, 1.0}));
        Signal s;
        if (kind == 3) {
            s.breakpoints[0].value = size * pick({-0.5, 0.0, 0.0, 0.5});
            s.sines.push_back({size * pick({0.5, 1.0, 2.0}), pick({0.5, 1.0, 2.0}), pick({0.0, 1.0})});
            return s;
        }
        s.breakpoints.clear();
        double t = 0.0, value = 0.0;
        while (t < duration) {
            const double span = pick({0.125, 0.25, 0.5}), next = size * pick({-1.0, -0.5, 0.0, 0.0, 0.25, 0.5, 1.0});
            s.breakpoints.push_back({t, kind == 1 ? next : value, kind == 1 ? 0.0 : (next - value) / span});
            value = next;
            t += span;
        }
        return s;
    }

    Start start(const Drive& d) {
        Start s;
        if (coin()) return s;
        if (d.motor.kind == Motor::dc && coin(0.3)) s.x[motor_torque] = pick({0.25, -0.5});
        const double w = pick({0.0, 0.25, -0.25, 0.5});
        s.x[motor_speed] = d.gearbox.ratio * w;
        s.x[load_speed] = w;
        if (d.gearbox.compliance == Gearbox::rigid) return s;
        if (coin(0.3)) s.x[coin() ? motor_speed : load_speed] = pick({0.0, 0.25, -0.5});
        if (coin()) s.x[twist] = pick({0.03125, 0.0625, -0.125, 0.25});
        return s;
    }

    std::mt19937_64 random_;
};

}  // namespace lostmotion::test
