// Random trains: chains and trees of 2 to 6 shafts with gears, motors, couplings and brakes.
#pragma once

#include "lostmotion/base/signal.hpp"
#include "train_support.hpp"

namespace lostmotion::model {

class RandomTrains {
 public:
    // housings: those of some gears turn; such a train may not be possible. dampers: between some shafts.
    explicit RandomTrains(unsigned seed, bool housings = false, bool dampers = false, bool meshes = false)
        : housings_(housings), dampers_(dampers), meshes_(meshes), random_(seed) {}

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
                const auto kind = static_cast<CouplingKind>(pick(0, 2));
                add_coupling(t, kind, to, s, spread(0.2, 2.0), 0.0);
            } else {
                t.gears.push_back(gear(to, s, losses));
            }
        }
        if (coin(0.3)) t.brakes.push_back({"brake", pick(0, shafts - 1), spread(0.2, 2.0)});
        put_housings(t);
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

    // Any elements anywhere: gears in either direction and in loops, several brakes, laws over speed and angle, limits.
    Train any(int shafts) {
        Train t;
        std::vector<double> turns(static_cast<std::size_t>(shafts), 1.0);  // speed of each shaft for that of the first
        for (int s = 0; s < shafts; ++s) t.shafts.push_back(any_shaft());
        for (int m = pick(1, std::min(3, shafts)); m > 0; --m) t.motors.push_back(any_motor(pick(0, shafts - 1)));
        for (int s = 1; s < shafts; ++s) {
            const int to = pick(0, s - 1);
            const bool forward = coin(0.7);
            const int input = forward ? to : s, output = forward ? s : to;
            if (coin(0.2)) {
                const auto kind = static_cast<CouplingKind>(pick(0, 2));
                const double torque = spread(0.2, 2.0);
                add_coupling(t, kind, input, output, torque, coin(0.3) ? 1.3 * torque : 0.0);
                turns[s] = turns[to];
            } else {
                t.gears.push_back(any_gear(input, output));
                turns[s] = forward ? turns[to] / t.gears.back().law.ratio : turns[to] * t.gears.back().law.ratio;
            }
        }
        if (shafts > 2 && coin(0.2)) {  // a loop, closed by a gear that yields
            const int a = pick(0, shafts - 2), b = pick(a + 1, shafts - 1);
            Gear g = any_gear(a, b);
            if (!g.rigid()) {
                g.law.ratio = turns[a] / turns[b];
                t.gears.push_back(g);
            }
        }
        for (int b = pick(0, 3) - 1; b > 0; --b) {
            const double torque = spread(0.2, 2.0);
            t.brakes.push_back({"brake", pick(0, shafts - 1), torque, coin(0.3) ? 1.2 * torque : 0.0});
        }
        if (coin(0.2))
            t.angle_torques.push_back(
                {"gravity", pick(0, shafts - 1), chords(spread(0.2, 2.0), 1, uniform(0.0, 6.0), 0.05)});
        if (coin(0.1)) t.angle_torques.push_back({"cogging", pick(0, shafts - 1), chords(0.1, 6, 0.0, 0.02)});
        put_housings(t);
        for (Gear& g : t.gears)
            if (g.housing >= 0) g.law.viscous_friction = 0.02 * g.law.ratio;
        if (dampers_) put_dampers(t);
        if (meshes_) put_meshes(t);
        return t;
    }

    // Chains of values in wide ranges, whose gears have hysteresis beside contacts at rest on the same shafts:
    // friction, brakes that engage and release, safety clutches.
    Train braked(int shafts) {
        Train t;
        for (int s = 0; s < shafts; ++s) {
            t.shafts.push_back(shaft(spread(1e-4, 10.0)));
            t.shafts.back().loaded = true;
            if (coin(0.6)) t.shafts.back().friction.torque = spread(1e-3, 3.0);
            if (coin(0.4)) t.shafts.back().viscous_friction = spread(1e-3, 1.0);
        }
        t.motors.push_back(torque_motor(0));
        for (int s = 1; s < shafts; ++s) {
            if (coin(0.15)) {
                const double torque = spread(0.1, 3.0);
                t.clutches.push_back({"clutch", s - 1, s, torque, coin() ? torque * uniform(1.1, 2.0) : 0.0, true});
                continue;
            }
            Gear g = spring(s - 1, s, spread(0.2, 30.0), TorsionCurve({}, {spread(1.0, 1e4)}));
            if (coin(0.3)) g.law.curve = TorsionCurve({spread(1e-3, 0.1)}, {0.0, spread(1.0, 1e4)});
            g.law.hysteresis_efficiency = uniform(0.3, 0.99);
            t.gears.push_back(g);
        }
        for (int b = pick(1, 2); b > 0; --b) {
            const double torque = spread(0.05, 10.0);
            t.brakes.push_back({"brake", pick(0, shafts - 1), torque, coin() ? torque * uniform(1.0, 2.0) : 0.0});
        }
        if (meshes_) put_meshes(t);
        return t;
    }

    // As they are: the adaptive solver would take the sine.
    static PeriodicCurve chords(double amplitude, int n, double phase, double error) {
        const PeriodicCurve f = PeriodicCurve::sine(amplitude, n, phase, error);
        std::vector<double> angles, values;
        for (int k = 0; k < f.pieces(); ++k) {
            angles.push_back(f.lower(k));
            values.push_back(f(f.lower(k)));
        }
        return PeriodicCurve(f.period(), std::move(angles), std::move(values));
    }

    Shaft any_shaft() {
        Shaft s;
        s.inertia = spread(0.3, 3.0);
        s.loaded = coin(0.6);
        if (coin()) s.viscous_friction = spread(0.05, 0.5);
        if (coin(0.1)) s.drag = Shaft::quadratic_drag(spread(0.01, 0.1), 8.0, 0.1);
        const double T_C = spread(0.05, 1.0);
        if (coin(0.2)) {
            s.friction = DryFriction::stribeck(T_C, T_C * uniform(1.05, 1.6), spread(0.3, 3.0), 0.05 * T_C);
        } else if (coin(0.6)) {
            s.friction.torque = T_C;
            if (coin(0.3)) s.friction.breakaway_torque = T_C * uniform(1.0, 1.5);
        }
        return s;
    }

    ShaftMotor any_motor(int shaft) {
        ShaftMotor m;
        m.shaft = shaft;
        m.law.kind = coin() ? Motor::dc : Motor::torque_source;
        m.law.rated_torque = 1.0;
        m.law.rated_speed = 5.0;
        m.law.electrical_time_constant = 0.05;
        if (coin(0.3)) m.law.friction_torque = spread(0.05, 0.5);
        if (coin(0.3)) m.law.rotor_inertia = spread(0.1, 0.5);
        if (m.law.kind == Motor::dc && coin(0.3)) m.law.voltage_limit = uniform(0.5, 1.5);
        if (m.law.kind == Motor::torque_source && coin(0.3)) m.torque_limit = uniform(0.5, 1.5);
        return m;
    }

    Gear any_gear(int input, int output) {
        Gear g = gear(input, output, true);
        if (coin(0.2)) g.law.inertia = spread(0.1, 0.5);
        if (coin(0.2)) g.law.viscous_friction = spread(0.05, 0.2);
        if (g.rigid()) return g;
        if (coin(0.25)) {
            g.mesh_damping = spread(0.1, 2.0);
            if (g.has_backlash()) {
                g.law.hysteresis_efficiency = 1.0;
                // Not drawn, so that seeds keep their trains.
                g.damping_limited = std::fmod(1e6 * g.mesh_damping, 2.0) < 1.0;
            }
        }
        if (coin(0.15)) {
            g.law.hysteresis_efficiency = 1.0;
            g.transmission_error = PeriodicCurve::sine(spread(1e-3, 1e-2), pick(1, 5), uniform(0.0, 6.0), 5e-4);
        }
        return g;
    }

    // Of the first motor: of one to three states, of reference, angle and speed of two shafts, limited or not.
    LinearController controller(const Train& t) {
        LinearController c;
        using Signal = LinearController::Signal;
        const int last = static_cast<int>(t.shafts.size()) - 1;
        const int shaft = pick(0, last), other = pick(0, last);
        c.name = t.motors[0].name;
        c.signals = {{Signal::reference, 0}, {Signal::angle, shaft}, {Signal::speed, other}};
        if (coin(0.3)) c.signals.push_back({Signal::reference_rate, 0});
        c.compared = c.signals[1];
        const int n = pick(1, 3);
        for (int k = 0; k < n; ++k) {
            c.states.push_back("state_" + std::to_string(k + 1));
            c.A.emplace_back();
            for (int j = 0; j < n; ++j) c.A.back().push_back(j == k ? -spread(0.1, 5.0) : uniform(-1.0, 1.0));
            c.B.emplace_back();
            for (std::size_t j = 0; j < c.signals.size(); ++j) c.B.back().push_back(uniform(-2.0, 2.0));
            c.C.push_back(uniform(-2.0, 2.0));
            c.back_calculation.push_back(coin() ? uniform(0.0, 5.0) : 0.0);
        }
        const double gain = spread(0.1, 3.0);
        c.D = {gain, -gain, -spread(0.1, 1.0)};
        c.D.resize(c.signals.size(), 0.3);
        if (coin(0.7)) c.limit = spread(0.3, 2.0);
        return c;
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
                if (c.bilateral && c.housing != nowhere) *out += now.x[p.shafts[c.housing].speed] * c.per_housing;
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
    enum CouplingKind { clutch, safety_clutch, freewheel };
    static void add_coupling(Train& t, CouplingKind kind, int input, int output, double torque, double breakaway) {
        if (kind == freewheel)
            t.freewheels.push_back({"freewheel", input, output});
        else
            t.clutches.push_back({"clutch", input, output, torque, breakaway, kind == safety_clutch});
    }
    // Losses and laws that act against the frame are taken out.
    void put_housings(Train& t) {
        if (!housings_ || t.shafts.size() < 3) return;
        for (Gear& g : t.gears) {
            if (!coin(0.7)) continue;
            do g.housing = pick(0, static_cast<int>(t.shafts.size()) - 1);
            while (g.housing == g.input || g.housing == g.output);
            g.efficiencies.reset();
            g.law.losses = Gearbox::constant_efficiency;
        }
    }

    void put_dampers(Train& t) {
        const int last = static_cast<int>(t.shafts.size()) - 1;
        for (int n = pick(1, 2); n > 0; --n) {
            Damper d{"damper", pick(0, last), pick(0, last)};
            while (d.output == d.input) d.output = pick(0, last);
            if (coin()) d.drag = Shaft::quadratic_drag(spread(0.05, 0.5), 4.0, 0.1);
            if (!(d.drag.max_slope() > 0.0) || coin()) d.viscous_friction = spread(0.05, 1.0);
            t.dampers.push_back(std::move(d));
        }
    }

    // Stiffnesses with two to four values in a period of a fiftieth to a fifth of a turn.
    void put_meshes(Train& t) {
        for (Gear& g : t.gears) {
            if (g.law.compliance == Gearbox::rigid) continue;
            const double period = spread(0.02, 0.2) * 2.0 * pi;
            // Not at the angle 0, where a shaft at rest could have the torque of either side.
            std::vector<double> angles{uniform(0.1, 0.3) * period}, factors{uniform(0.4, 1.0)};
            for (int n = pick(1, 3); n > 0; --n) {
                angles.push_back(angles.back() + uniform(0.2, 0.8) * (period - angles.back()));
                factors.push_back(uniform(0.4, 1.0));
            }
            g.mesh_stiffness = PeriodicCurve(period, std::move(angles), std::move(factors));
        }
    }

    bool housings_, dampers_, meshes_;
    std::mt19937_64 random_;
};

}  // namespace lostmotion::model
