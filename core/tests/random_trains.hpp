// Random trains: chains and trees of 2 to 6 shafts with gears, motors, couplings and brakes.
#pragma once

#include "lostmotion/kernel/inputs.hpp"
#include "train_support.hpp"

namespace lostmotion::model {

class RandomTrains {
 public:
    explicit RandomTrains(unsigned seed) : random_(seed) {}

    double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(random_); }
    double spread(double a, double b) { return std::exp(uniform(std::log(a), std::log(b))); }
    bool coin(double probability = 0.5) { return uniform(0.0, 1.0) < probability; }
    int pick(int low, int high) { return std::uniform_int_distribution<int>(low, high)(random_); }

    // losses: none but dry friction, or also those that depend on the load.
    Train train(int shafts, bool losses) {
        Train t;
        t.shafts.resize(static_cast<std::size_t>(shafts));
        for (Shaft& s : t.shafts) {
            s.inertia = spread(0.3, 3.0);
            if (coin()) s.viscous_friction = spread(0.05, 0.5);
            if (coin(0.7)) s.friction.torque = spread(0.05, 1.0);
            if (coin(0.2) && s.friction.torque > 0.0)
                s.friction.breakaway_torque = s.friction.torque * uniform(1.0, 1.5);
            s.loaded = coin(0.6);
        }
        const int motors = pick(1, std::min(3, shafts));
        for (int m = 0; m < motors; ++m) {
            ShaftMotor motor;
            motor.shaft = m == 0 ? 0 : pick(0, shafts - 1);
            motor.law.kind = coin() ? Motor::dc : Motor::torque_source;
            motor.law.rated_torque = 1.0;
            motor.law.rated_speed = 5.0;
            motor.law.electrical_time_constant = 0.05;
            if (coin(0.3)) motor.law.friction_torque = spread(0.05, 0.5);
            t.motors.push_back(motor);
        }
        for (int s = 1; s < shafts; ++s) {
            const int to = pick(std::max(0, s - 2), s - 1);
            if (coin(0.2)) {
                const auto kind = static_cast<Coupling::Kind>(pick(0, 2));
                t.couplings.push_back({"coupling", kind, to, s, spread(0.2, 2.0)});
            } else {
                t.gears.push_back(gear(to, s, losses));
            }
        }
        if (coin(0.3)) t.brakes.push_back({"brake", pick(0, shafts - 1), spread(0.2, 2.0)});
        return t;
    }

    Gear gear(int input, int output, bool losses) {
        Gear g;
        g.input = input;
        g.output = output;
        g.law.ratio = spread(0.5, 3.0);
        g.law.rated_output_torque = 2.0;
        g.law.rated_input_speed = 5.0;
        if (coin(0.7)) {
            g.law.compliance = Gearbox::torsion_curve;
            const double k = spread(5.0, 100.0);
            g.law.curve = coin() ? TorsionCurve({}, {k}) : TorsionCurve({0.02, 0.05}, {0.0, k, 2.0 * k});
            if (coin(0.7)) g.law.hysteresis_efficiency = uniform(0.5, 0.95);
        }
        if (!losses) return g;
        const int kind = pick(0, 3);
        if (kind == 0) g.law.efficiency = uniform(0.6, 1.0);
        if (kind == 1) g.efficiencies = MeshEfficiency(uniform(0.5, 1.0), uniform(g.rigid() ? 0.2 : -0.5, 0.9));
        if (kind == 2) {
            g.law.losses = Gearbox::loss_map;
            g.law.map = plane_map(uniform(0.0, 0.1), uniform(0.0, 0.1), uniform(0.0, 0.4));
        }
        return g;
    }

    // For each input a sine and a step or a ramp.
    std::vector<Signal> signals(const Assembly& a, double duration) {
        std::vector<Signal> out(static_cast<std::size_t>(a.layout().inputs));
        for (Signal& s : out) {
            s.breakpoints = {{0.0, uniform(-2.0, 2.0), 0.0}};
            if (coin()) s.sines = {{uniform(0.2, 3.0), spread(0.3, 10.0), uniform(0.0, 6.28)}};
            if (coin()) s.breakpoints.push_back({uniform(0.2, 0.8) * duration, uniform(-2.0, 2.0), coin() ? 0.0 : 1.0});
        }
        return out;
    }

    // At rest, or with some shafts in motion that nothing ties to others.
    Instant instant(const Assembly& a, double moving) {
        Instant now;
        const Places& p = a.places();
        for (const MotorPlace& m : p.motors)
            if (m.torque != nowhere) now.x[m.torque] = coin() ? uniform(-2.0, 2.0) : 0.0;
        for (std::size_t s = 0; s < p.shafts.size(); ++s)
            if (coin(moving)) now.x[p.shafts[s].speed] = uniform(-1.0, 1.0);
        for (std::size_t g = 0; g < p.gears.size(); ++g) {
            const Gear& gear = a.train().gears[g];
            if (gear.rigid()) continue;
            now.x[p.gears[g].twist] = uniform(-0.1, 0.1);
            if (p.gears[g].hysteresis != nowhere) now.memory[p.gears[g].hysteresis] = uniform(0.0, 1.0);
        }
        // Rigid gears tie speeds; freewheels do not run ahead.
        for (int pass = 0; pass < 8; ++pass)
            for (const ContactPlace& c : p.contacts) {
                double &in = now.x[p.shafts[c.a].speed], *out = c.b == nowhere ? nullptr : &now.x[p.shafts[c.b].speed];
                if (c.bilateral) *out = in * c.per_a;
                if (c.one_way && in > *out) *out = in;
            }
        for (int i = 0; i < a.layout().inputs; ++i) {
            now.input[0][i] = coin(0.2) ? 0.0 : uniform(-2.0, 2.0);
            now.input[1][i] = coin() ? 0.0 : uniform(-1.0, 1.0);
            now.input_magnitudes[i] = std::fabs(now.input[0][i]);
        }
        return now;
    }

 private:
    std::mt19937_64 random_;
};

}  // namespace lostmotion::model
