// Energy ledger of a run: every flow integrated on its own, so that the balance is a check and not an identity.
//
// Between switchings each power is a product of two linear forms of an analytic state, whose time derivatives at both
// ends of a panel are known. They are integrated by the two-point Hermite rule with derivatives up to order four
// (exact for polynomials of degree nine); its difference from the rule with one derivative less sets the panel length.
// Where the panel spans many of the shortest time constants, rounding spoils the derivatives: of a fast part of the
// motion that has died out they are nothing but rounding times its rate to the fourth. There the powers are taken at
// the nodes of the Gauss-Kronrod pair of 7 and 15 points (Kronrod 1965; R. Piessens et al., QUADPACK, Springer 1983).
// Segments of thousands of periods are taken at once (long_step.hpp).
#pragma once

#include <optional>

#include "../drive/contact.hpp"
#include "../solver/exact_solver.hpp"
#include "energy_ledger.hpp"
#include "quadrature.hpp"

namespace lostmotion {

class EnergyMeter {
 public:
    explicit EnergyMeter(const Drive& drive) : drive_(drive) {}
    EnergyLedger ledger;

    void begin(const State& x) { measure(x, ledger.kinetic_begin, ledger.elastic_begin); }
    void end(const State& x) { measure(x, ledger.kinetic_end, ledger.elastic_end); }

    bool segment(const Segment<SwitchedDrive>& s) {
        if (!(s.end > s.begin)) return true;
        const Regime& r = s.entry.regime;
        if (r.at_rest[input_contact] && r.at_rest[load_contact]) return true;
        Propagator<DriveDims>& p = s.entry.propagator;
        if (LongStep<DriveDims>::pays(p, s.end - s.begin)) {
            add_long(s);
            return true;
        }
        if (!cursor_) end_ = cursor_.emplace(s.at.input());
        Cursor<DriveDims>&cursor = *cursor_, &end = *end_;
        cursor = s.at;
        const Factors factors(drive_, r, s.memory);
        Powers here, there;
        factors.powers(p, cursor, here);
        int level = std::min(level_, p.level_below(s.end - s.begin));
        double t = s.begin;
        for (long count = 1; t < s.end; ++count) {
            if (count % 64 == 0) cursor.anchor(t);
            double length = p.length(level);
            const bool whole = length <= s.end - t;
            if (!whole) length = s.end - t;
            if (whole) {
                end.step_from(cursor, level);
            } else {
                end = cursor;
                end.move_to(s.end, s.x_end);
            }
            factors.powers(p, end, there);
            const double error = level < first_stiff_level ? add_panel(here, there, length, level == 0)
                                                           : add_stiff_panel(factors, cursor, length);
            if (error > 1.0) {
                --level;
                continue;
            }
            t = whole ? t + length : s.end;
            cursor = end;
            here = there;
            // Twice the length has 2^9 times the error.
            if (error < 0x1p-9 && p.can_double(level, s.end - t)) ++level;
        }
        level_ = level;
        return true;
    }

 private:
    static constexpr int orders = 5;  // value and four derivatives
    using Powers = std::array<std::array<double, n_flows>, orders>;

    using Flows = std::array<double, n_flows>;

    // Every power is a product of two linear forms; all are evaluated at once, as columns.
    struct Factors {
        FormTable<DriveDims, n_flows> left, right;
        std::array<double, n_flows> left_constant, right_constant;

        Factors(const Drive& drive, const Regime& r, const Memory& m) {
            const LinearForm w_M = LinearForm::unit(motor_speed), w = LinearForm::unit(load_speed);
            const auto set = [this](EnergyFlow flow, const LinearForm& a, const LinearForm& b) {
                left.set(flow, a);
                right.set(flow, b);
            };
            const auto friction = [&](Contact c, double torque) {
                const int mode = r.key.modes[c];
                return LinearForm::unit(one, mode == absent ? 0.0 : mode * torque);
            };
            set(from_source, r.source_torque, w_M);
            set(in_input_damper, drive.gearbox.viscous_friction * w_M, w_M);
            set(in_motor_friction, friction(input_contact, drive.motor.friction_torque), w_M);
            set(in_gear, r.input_torque - r.output_torque / drive.gearbox.ratio, w_M);
            set(in_hysteresis, r.at_rest[twist_contact] ? LinearForm{} : r.hysteresis_torque,
                drive.contact_speed(twist_contact));
            set(in_load_damper, drive.load.viscous_friction * w, w);
            set(in_load_friction, friction(load_contact, drive.load.friction_torque), w);
            set(to_load, LinearForm::unit(load_torque), w);
            left.constants(m, left_constant);
            right.constants(m, right_constant);
        }

        void powers(const Propagator<DriveDims>& p, Cursor<DriveDims>& c, Powers& out) const {
            const auto u = c.input().jet<orders>();
            Powers a, b;
            State x = c.x();
            for (int k = 0; k < orders; ++k) {
                if (k == 1) x = c.rate();
                if (k > 1) x = p.rates().higher(x, u[k - 1]);
                if (k == 0) {
                    left.evaluate(left_constant, x, u[0], a[0]);
                    right.evaluate(right_constant, x, u[0], b[0]);
                } else {
                    left.rates(x, u[k], a[k]);
                    right.rates(x, u[k], b[k]);
                }
            }
            for (int f = 0; f < n_flows; ++f) {
                out[0][f] = a[0][f] * b[0][f];
                out[1][f] = a[1][f] * b[0][f] + a[0][f] * b[1][f];
                out[2][f] = a[2][f] * b[0][f] + 2.0 * a[1][f] * b[1][f] + a[0][f] * b[2][f];
                out[3][f] = a[3][f] * b[0][f] + 3.0 * (a[2][f] * b[1][f] + a[1][f] * b[2][f]) + a[0][f] * b[3][f];
                out[4][f] = a[4][f] * b[0][f] + 4.0 * (a[3][f] * b[1][f] + a[1][f] * b[3][f]) +
                            6.0 * a[2][f] * b[2][f] + a[0][f] * b[4][f];
            }
        }

        // The powers alone.
        void powers(const Cursor<DriveDims>& c, Flows& out) const {
            const auto u = c.input().values();
            Flows a, b;
            left.evaluate(left_constant, c.x(), u, a);
            right.evaluate(right_constant, c.x(), u, b);
            for (int f = 0; f < n_flows; ++f) out[f] = a[f] * b[f];
        }
    };

    void measure(const State& x, double& kinetic, double& elastic) const {
        kinetic = 0.5 * drive_.input_inertia() * x[motor_speed] * x[motor_speed] +
                  0.5 * drive_.load.inertia * x[load_speed] * x[load_speed];
        elastic = drive_.rigid() ? 0.0 : drive_.gearbox.curve.energy(x[twist]);
    }

    // Returns the error of the panel in units of what is allowed; beyond 1 (unless it is the shortest) nothing is
    // added.
    double add_panel(const Powers& a, const Powers& b, double h, bool shortest) {
        Flows sums;
        double difference = 0.0;
        for (int f = 0; f < n_flows; ++f) {
            const double s0 = a[0][f] + b[0][f], s1 = h * (a[1][f] - b[1][f]), s2 = h * h * (a[2][f] + b[2][f]),
                         s3 = h * h * h * (a[3][f] - b[3][f]), s4 = h * h * h * h * (a[4][f] + b[4][f]);
            sums[f] = h * (s0 / 2.0 + s1 / 9.0 + s2 / 72.0 + s3 / 1008.0 + s4 / 30240.0);
            const double lower = h * (s0 / 2.0 + 3.0 * s1 / 28.0 + s2 / 84.0 + s3 / 1680.0);
            difference += std::fabs(sums[f] - lower);
        }
        return add(sums, difference, panel_tolerance, h, shortest);
    }

    // The same of a segment that is taken at once, exact but for rounding. What is turned over is taken as the apparent
    // energy: root mean square times root mean square.
    [[gnu::noinline]] void add_long(const Segment<SwitchedDrive>& s) {
        const Factors factors(drive_, s.entry.regime, s.memory);
        const double length = s.end - s.begin;
        const LongProducts<DriveDims> products(s.entry.propagator, s.constant, s.at.x(), s.at.input(), length);
        for (int f = 0; f < n_flows; ++f) {
            const std::vector<double> a = products.step().coefficients(factors.left, f, factors.left_constant[f]),
                                      b = products.step().coefficients(factors.right, f, factors.right_constant[f]);
            ledger.flow[f] += products(a, b);
            ledger.turned_over += std::sqrt(std::fmax(0.0, products(a, a)) * std::fmax(0.0, products(b, b)));
        }
        elapsed_ += length;
        mean_power_ = ledger.turned_over / elapsed_;
    }

    // The same by the powers at nodes, from the instant of a cursor.
    double add_stiff_panel(const Factors& factors, const Cursor<DriveDims>& from, double h) {
        Cursor<DriveDims>& node = node_.emplace(from);
        Flows sums{}, coarse{}, power;
        for (int k = 0; k < kronrod_nodes; ++k)
            for (const double side : {-1.0, +1.0}) {
                if (k == kronrod_nodes - 1 && side > 0.0) continue;  // the one in the middle
                node.advance_from(from, 0.5 * h * (1.0 + side * kronrod[k].node));
                factors.powers(node, power);
                for (int f = 0; f < n_flows; ++f) {
                    sums[f] += 0.5 * h * kronrod[k].weight * power[f];
                    coarse[f] += 0.5 * h * kronrod[k].gauss_weight * power[f];
                }
            }
        double difference = 0.0;
        for (int f = 0; f < n_flows; ++f) difference += std::fabs(sums[f] - coarse[f]);
        return add(sums, difference, stiff_tolerance, h, false);
    }

    double add(const Flows& sums, double difference, double tolerance, double h, bool shortest) {
        double turnover = 0.0;
        for (const double s : sums) turnover += std::fabs(s);
        const double allowed = tolerance * std::fmax(turnover, mean_power_ * h);
        const double error = allowed > 0.0 ? difference / allowed : 0.0;
        if (!shortest && error > 1.0) return error;
        for (int f = 0; f < n_flows; ++f) ledger.flow[f] += sums[f];
        ledger.turned_over += turnover;
        elapsed_ += h;
        mean_power_ = ledger.turned_over / elapsed_;
        return std::fmin(error, 1.0);
    }

    // The rule that is used is two orders finer than this, the difference from the coarser one.
    static constexpr double panel_tolerance = 2e-9;
    // The Gauss rule of 7 points is exact to degree 13, the Kronrod rule to degree 22.
    static constexpr double stiff_tolerance = 1e-11;
    static constexpr int first_stiff_level = 8;  // 64 of the shortest time constants

    const Drive& drive_;
    std::optional<Cursor<DriveDims>> cursor_, end_, node_;  // kept from segment to segment for their memory
    int level_ = 4;
    double elapsed_ = 0.0, mean_power_ = 0.0;
};

}  // namespace lostmotion
