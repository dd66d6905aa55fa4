// Accelerations of a train by Gauss's principle of least constraint, with nothing of the library but the parameters.
//
// Dry contacts of given capacity make the accelerations the minimum of (a - a_free)' M (a - a_free)/2 + sum cap |C a|
// over the contacts at rest. The dual problem, in their torques within the capacities, is solved by projected
// Gauss-Seidel sweeps.
#pragma once

#include "train_support.hpp"

namespace lostmotion::model {

inline std::vector<double> least_constraint(const Assembly& a, const Instant& now, int sweeps) {
    const Train& t = a.train();
    const Places& p = a.places();
    const std::size_t n = t.shafts.size();
    std::vector<double> J(n), torque(n), w(n);
    const auto input = [&](int k) { return now.input[0][k]; };
    for (std::size_t s = 0; s < n; ++s) {
        J[s] = t.shafts[s].inertia;
        w[s] = now.x[p.shafts[s].speed];
        torque[s] -= t.shafts[s].viscous_friction * w[s];
        if (t.shafts[s].loaded) torque[s] -= input(p.shafts[s].load);
    }
    for (std::size_t m = 0; m < t.motors.size(); ++m)
        torque[t.motors[m].shaft] += t.motors[m].law.kind == Motor::dc
                                         ? now.x[p.motors[m].torque]
                                         : t.motors[m].law.rated_torque * input(p.motors[m].command);
    struct Constraint {
        std::vector<double> c;
        double low, high, torque = 0.0;
    };
    std::vector<Constraint> rows;
    // A dry contact between shafts: its torque acts against its speed, c w.
    const auto between = [&](const std::vector<double>& c, double sliding, double holding, bool exact) {
        double v = 0.0;
        for (std::size_t s = 0; s < n; ++s) v += c[s] * w[s];
        if (exact || v == 0.0) {
            rows.push_back({c, -holding, holding});
            return;
        }
        for (std::size_t s = 0; s < n; ++s) torque[s] -= c[s] * (v > 0.0 ? sliding : -sliding);
    };
    const auto contact = [&](int in, double per_in, int out, double per_out, double sliding, double holding,
                             bool exact = false) {
        std::vector<double> c(n);
        c[in] = per_in;
        if (out >= 0) c[out] = per_out;
        between(c, sliding, holding, exact);
    };
    const double infinite = std::numeric_limits<double>::infinity();
    for (std::size_t g = 0; g < t.gears.size(); ++g) {
        const Gear& gear = t.gears[g];
        const double i = gear.law.ratio;
        std::vector<double> rate(n);  // of the twist
        rate[gear.input] = 1.0 / i;
        rate[gear.output] = -1.0;
        if (gear.housing >= 0) rate[gear.housing] = 1.0 - 1.0 / i;
        if (gear.rigid()) {
            between(rate, 0.0, infinite, true);
            continue;
        }
        const double P = gear.law.curve.torque(now.x[p.gears[g].twist]);
        for (std::size_t s = 0; s < n; ++s) torque[s] -= rate[s] * P;
        if (p.gears[g].hysteresis != nowhere) {
            const double h = now.memory[p.gears[g].hysteresis];
            between(rate, h, h, false);
        }
    }
    for (std::size_t s = 0; s < n; ++s) {
        double sliding = t.shafts[s].friction.torque,
               holding = std::max(sliding, t.shafts[s].friction.breakaway_torque);
        for (const ShaftMotor& m : t.motors)
            if (m.shaft == static_cast<int>(s)) {
                sliding += m.law.friction_torque;
                holding += m.law.friction_torque;
            }
        for (std::size_t b = 0; b < t.brakes.size(); ++b)
            if (t.brakes[b].shaft == static_cast<int>(s)) {
                const double more = t.brakes[b].torque * std::clamp(input(p.acting[b]->command), 0.0, 1.0);
                sliding += more;
                holding += more;
            }
        if (holding > 0.0) contact(static_cast<int>(s), 1.0, -1, 0.0, sliding, holding);
    }
    for (std::size_t k = 0; k < t.clutches.size(); ++k) {
        const Clutch& c = t.clutches[k];
        const double T = c.torque * (c.safety ? 1.0 : std::clamp(input(p.couplings[k]->command), 0.0, 1.0));
        contact(c.input, 1.0, c.output, -1.0, T, T);
    }
    for (const Freewheel& c : t.freewheels) {
        if (w[c.input] != w[c.output]) continue;
        contact(c.input, 1.0, c.output, -1.0, 0.0, infinite, true);
        rows.back().low = 0.0;
    }
    std::vector<double> acceleration(n);
    for (std::size_t s = 0; s < n; ++s) acceleration[s] = torque[s] / J[s];
    for (int sweep = 0; sweep < sweeps; ++sweep)
        for (Constraint& r : rows) {
            double v = 0.0, G = 0.0;
            for (std::size_t s = 0; s < n; ++s) {
                v += r.c[s] * acceleration[s];
                G += r.c[s] * r.c[s] / J[s];
            }
            const double next = std::clamp(r.torque + v / G, r.low, r.high), change = next - r.torque;
            r.torque = next;
            for (std::size_t s = 0; s < n; ++s) acceleration[s] -= r.c[s] * change / J[s];
        }
    return acceleration;
}

}  // namespace lostmotion::model
