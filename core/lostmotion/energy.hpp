// Energy ledger of a run: every flow integrated on its own, so that the balance is a check and not an identity.
//
// Between switchings each power is a product of two linear forms of an analytic state, whose time derivatives at both
// ends of a panel are known. They are integrated by the two-point Hermite rule with derivatives up to order four
// (exact for polynomials of degree nine); its difference from the rule with one derivative less sets the panel length.
#pragma once

#include "exact_solver.hpp"

namespace lostmotion {

enum EnergyFlow : int {
    from_source,        // M_D w_M
    in_input_damper,    // b_MR w_M^2
    in_motor_friction,  // T_10 |w_M|
    in_gear,           // (T_1 - T_2/i) w_M: the losses of the mesh; negative where a constant efficiency creates energy
    in_hysteresis,     // H dd/dt
    in_load_damper,    // b_ZR w^2
    in_load_friction,  // dry friction of the load's bearing
    to_load,           // M_Z w
    n_flows
};

struct EnergyLedger {
    std::array<double, n_flows> flow{};                                                     // [J] since the start
    double kinetic_begin = 0.0, kinetic_end = 0.0, elastic_begin = 0.0, elastic_end = 0.0;  // [J]
    double turned_over = 0.0;  // [J] sum of the magnitudes of all flows, panel by panel

    // What the balance fails by [J].
    double residual() const {
        double sum = flow[from_source] - (kinetic_end - kinetic_begin) - (elastic_end - elastic_begin);
        for (int k = from_source + 1; k < n_flows; ++k) sum -= flow[k];
        return sum;
    }
};

class EnergyMeter {
 public:
    explicit EnergyMeter(const Drive& drive) : drive_(drive) {}
    EnergyLedger ledger;

    void begin(const State& x) { store(x, ledger.kinetic_begin, ledger.elastic_begin); }
    void end(const State& x) { store(x, ledger.kinetic_end, ledger.elastic_end); }

    bool segment(const Segment<SwitchedDrive>& s, const std::vector<InputBasis>& basis) {
        if (!(s.end > s.begin)) return true;
        const Regime& r = s.entry.regime;
        if (r.at_rest[input_contact] && r.at_rest[load_contact]) return true;
        Propagator& p = s.entry.propagator;
        Cursor cursor(p, s.signals, basis, s.constant, s.begin, s.x), end = cursor;
        Powers here, there;
        powers(r, p, cursor, s.memory, here);
        int level = std::min(level_, p.level_below(s.end - s.begin));
        double t = s.begin;
        for (long count = 1; t < s.end; ++count) {
            if (count % 64 == 0) cursor.anchor(t);
            double length = p.level(level).length;
            const bool whole = length <= s.end - t;
            if (!whole) length = s.end - t;
            end = cursor;
            if (whole)
                end.step(level);
            else
                end.advance(length);
            powers(r, p, end, s.memory, there);
            const double error = add_panel(here, there, length, level == 0);
            if (error > 1.0) {
                --level;
                continue;
            }
            t = whole ? t + length : s.end;
            std::swap(cursor, end);
            std::swap(here, there);
            // Twice the length has 2^9 times the error.
            if (error < 0x1p-9 && p.can_double(level, s.end - t)) ++level;
        }
        level_ = level;
        return true;
    }
    void switching(const Switching&) {}

 private:
    static constexpr int orders = 5;  // value and four derivatives
    using Jet = std::array<double, orders>;
    using Powers = std::array<Jet, n_flows>;

    void store(const State& x, double& kinetic, double& elastic) const {
        kinetic = 0.5 * drive_.input_inertia() * x[motor_speed] * x[motor_speed] +
                  0.5 * drive_.load.inertia * x[load_speed] * x[load_speed];
        elastic = drive_.rigid() ? 0.0 : drive_.gearbox.curve.energy(x[twist]);
    }

    static Jet product(const Jet& a, const Jet& b) {
        return {a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2],
                a[3] * b[0] + 3.0 * (a[2] * b[1] + a[1] * b[2]) + a[0] * b[3],
                a[4] * b[0] + 4.0 * (a[3] * b[1] + a[1] * b[3]) + 6.0 * a[2] * b[2] + a[0] * b[4]};
    }
    static Jet scaled(double factor, Jet j) {
        for (double& v : j) v *= factor;
        return j;
    }

    void powers(const Regime& r, const Propagator& p, Cursor& c, const Memory& m, Powers& out) const {
        const InputJet u = c.input().jet();
        std::array<State, orders> x;
        x[0] = c.x();
        x[1] = c.rate();
        for (int k = 2; k < orders; ++k) x[k] = p.higher_rate(x[k - 1], u[k - 1]);
        const auto jet = [&](const LinearForm& f) {
            Jet j;
            j[0] = evaluate(f, x[0], m, u[0]);
            for (int k = 1; k < orders; ++k) j[k] = evaluate_rate(f, x[k], u[k]);
            return j;
        };
        const auto state = [&](int k) { return Jet{x[0][k], x[1][k], x[2][k], x[3][k], x[4][k]}; };
        const Jet w_M = state(motor_speed), w = state(load_speed);
        out[from_source] = product(jet(r.source_torque), w_M);
        out[in_input_damper] = scaled(drive_.gearbox.viscous_friction, product(w_M, w_M));
        const int mode = r.key.modes[input_contact];
        out[in_motor_friction] = scaled(mode == absent ? 0.0 : mode * drive_.motor.friction_torque, w_M);
        out[in_gear] = product(jet(r.input_torque - r.output_torque / drive_.gearbox.ratio), w_M);
        out[in_hysteresis] = r.at_rest[twist_contact]
                                 ? Jet{}
                                 : product(jet(r.hysteresis_torque), jet(drive_.contact_speed(twist_contact)));
        out[in_load_damper] = scaled(drive_.load.viscous_friction, product(w, w));
        const int bearing = r.key.modes[load_contact];
        out[in_load_friction] = scaled(bearing == absent ? 0.0 : bearing * drive_.load.friction_torque, w);
        out[to_load] = product({u[0][1], u[1][1], u[2][1], u[3][1], u[4][1]}, w);
    }

    // Returns the error of the panel in units of what is allowed; beyond 1 (unless it is the shortest) nothing is
    // added.
    double add_panel(const Powers& a, const Powers& b, double h, bool shortest) {
        std::array<double, n_flows> sums;
        double difference = 0.0, size = 0.0;
        for (int f = 0; f < n_flows; ++f) {
            const double s0 = a[f][0] + b[f][0], s1 = h * (a[f][1] - b[f][1]), s2 = h * h * (a[f][2] + b[f][2]),
                         s3 = h * h * h * (a[f][3] - b[f][3]), s4 = h * h * h * h * (a[f][4] + b[f][4]);
            sums[f] = h * (s0 / 2.0 + s1 / 9.0 + s2 / 72.0 + s3 / 1008.0 + s4 / 30240.0);
            const double lower = h * (s0 / 2.0 + 3.0 * s1 / 28.0 + s2 / 84.0 + s3 / 1680.0);
            difference += std::fabs(sums[f] - lower);
            size += std::fabs(sums[f]);
        }
        const double allowed = panel_tolerance * std::fmax(size, mean_power_ * h);
        const double error = allowed > 0.0 ? difference / allowed : 0.0;
        if (!shortest && error > 1.0) return error;
        for (int f = 0; f < n_flows; ++f) ledger.flow[f] += sums[f];
        ledger.turned_over += size;
        elapsed_ += h;
        mean_power_ = ledger.turned_over / elapsed_;
        return std::fmin(error, 1.0);
    }

    // The rule that is used is two orders finer than this, the difference from the coarser one.
    static constexpr double panel_tolerance = 2e-9;

    const Drive& drive_;
    int level_ = 4;
    double elapsed_ = 0.0, mean_power_ = 0.0;
};

}  // namespace lostmotion
