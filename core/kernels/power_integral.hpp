// Integrals over time of products of two linear forms of the motion: energies.
//
// Between switchings each power is a product of two linear forms of an analytic state, whose time derivatives at both
// ends of a panel are known. They are integrated by the two-point Hermite rule with derivatives up to order four
// (exact for polynomials of degree nine); its difference from the rule with one derivative less sets the panel length.
// Where the panel spans many of the shortest time constants, rounding spoils the derivatives: of a fast part of the
// motion that has died out they are nothing but rounding times its rate to the fourth. There the powers are taken at
// the nodes of the Gauss-Kronrod pair of 7 and 15 points (Kronrod 1965; R. Piessens et al., QUADPACK, Springer 1983).
// Segments of thousands of periods are taken at once (long_step.hpp).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "lostmotion/simulation/quadrature.hpp"
#include "lostmotion/solver/exact_solver.hpp"

namespace lostmotion {

// Up to N powers at once.
template <class D, int N>
class PowerIntegral {
 public:
    using State = StateOf<D>;
    using Flows = typename FormTable<D, N>::Values;

    Flows flow{};              // [J] so far
    double turned_over = 0.0;  // [J] sum of the magnitudes of all flows, panel by panel (or of apparent energies)
    Interruption interruption;

 private:
    static constexpr int orders = 5;  // value and four derivatives
    using Powers = std::array<Flows, orders>;
    // Of as many flows as a vector holds, from the f-th on.
    static std::array<Vec, orders> at(const Powers& p, int f) {
        const auto of = [&](int order) { return load(p[order].data() + f); };
        return {of(0), of(1), of(2), of(3), of(4)};
    }

 public:
    // Every power is a product of two linear forms; all are evaluated at once, as columns.
    class Factors {
     public:
        void set(int number, const LinearForm& a, const LinearForm& b) {
            left.set(number, a);
            right.set(number, b);
            used_ = std::max(used_, number + 1);
        }
        // How many there are: up to eight, all.
        int count() const { return N <= 8 ? N : used_; }
        void hold(const typename D::Memory& m) {
            memory_ = magnitudes(m);
            left.constants(m, left_constant);
            right.constants(m, right_constant);
        }

        void powers(const Propagator<D>& p, Cursor<D>& c, Powers& out) const {
            const auto u = c.input().template jet<orders>();
            Powers a, b;
            left.evaluate(left_constant, c.x(), u[0], a[0]);
            right.evaluate(right_constant, c.x(), u[0], b[0]);
            State rate = c.rate();
            for (int k = 1;; ++k) {
                left.rates(rate, u[k], a[k]);
                right.rates(rate, u[k], b[k]);
                if (k + 1 == orders) break;
                rate = p.rates().higher(rate, u[k]);
            }
            for (Flows& order : out) make_room(order, count());
            for (int f = 0; f < count(); f += vec_width) {
                const auto l = at(a, f), r = at(b, f);
                store(l[0] * r[0], out[0].data() + f);
                store(l[1] * r[0] + l[0] * r[1], out[1].data() + f);
                store(l[2] * r[0] + 2.0 * l[1] * r[1] + l[0] * r[2], out[2].data() + f);
                store(l[3] * r[0] + 3.0 * (l[2] * r[1] + l[1] * r[2]) + l[0] * r[3], out[3].data() + f);
                store(l[4] * r[0] + 4.0 * (l[3] * r[1] + l[1] * r[3]) + 6.0 * l[2] * r[2] + l[0] * r[4],
                      out[4].data() + f);
            }
        }

        // The powers alone.
        void powers(const Cursor<D>& c, Flows& out) const {
            const auto u = c.input().values();
            Flows a, b;
            left.evaluate(left_constant, c.x(), u, a);
            right.evaluate(right_constant, c.x(), u, b);
            for (int f = 0; f < count(); ++f) out[f] = a[f] * b[f];
        }

        // Rounding of the powers, all together [W]: that of the terms, which may cancel.
        [[gnu::cold]] double rounding_at(const Cursor<D>& c) const {
            const auto u = c.input().values(), input_size = c.input().magnitudes();
            const State state_size = magnitudes(c.x());
            Flows a, b, a_size, b_size;
            left.evaluate(left_constant, c.x(), u, a);
            right.evaluate(right_constant, c.x(), u, b);
            left.magnitudes(memory_, state_size, input_size, a_size);
            right.magnitudes(memory_, state_size, input_size, b_size);
            double sum = 0.0;
            for (int f = 0; f < count(); ++f) sum += std::fabs(a[f]) * b_size[f] + std::fabs(b[f]) * a_size[f];
            return 4.0 * std::numeric_limits<double>::epsilon() * sum;
        }

        FormTable<D, N> left, right;
        Flows left_constant{}, right_constant{};

     private:
        typename D::Memory memory_{};
        int used_ = 0;
    };

    // A segment with these factors. False if it is interrupted.
    template <class Segment>
    bool add(const Segment& s, const Factors& factors) {
        Propagator<D>& p = s.entry.propagator;
        if (LongStep<D>::pays(p, s.end - s.begin)) {
            add_long(s, factors);
            return true;
        }
        if (!cursor_) end_ = cursor_.emplace(s.at.input());
        Cursor<D>&cursor = *cursor_, &end = *end_;
        cursor = s.at;
        Powers here, there;
        factors.powers(p, cursor, here);
        // A transient that dies out before the first node of a stiff panel would not be seen.
        int level = std::min({level_, first_stiff_level - 1, p.level_below(s.end - s.begin)});
        // Every panel leads to a later instant of the clock.
        const int lowest = p.level_above(2.0 * std::numeric_limits<double>::epsilon() * s.end);
        level = std::max(level, lowest);
        double t = s.begin;
        for (long count = 1; t < s.end; ++count) {
            if (interruption()) return false;
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
            double error = level < first_stiff_level ? add_panel(factors.count(), here, there, length, level == lowest)
                                                     : add_stiff_panel(factors, cursor, length, level == lowest);
            if (error > 1.0) [[unlikely]]
                error = add_rounded_panel(factors, cursor, end, length, error);
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
    // Returns the error of the panel in units of what is allowed; beyond 1 (unless it is the shortest) nothing is
    // added.
    double add_panel(int n, const Powers& a, const Powers& b, double h, bool shortest) {
        Flows sums, apart;
        make_room(sums, n);
        make_room(apart, n);
        double difference = 0.0;
        for (int f = 0; f < n; f += vec_width) {
            const auto p = at(a, f), q = at(b, f);
            const Vec s0 = p[0] + q[0], s1 = h * (p[1] - q[1]), s2 = h * h * (p[2] + q[2]),
                      s3 = h * h * h * (p[3] - q[3]), s4 = h * h * h * h * (p[4] + q[4]);
            const Vec sum = h * (s0 / 2.0 + s1 / 9.0 + s2 / 72.0 + s3 / 1008.0 + s4 / 30240.0);
            const Vec lower = h * (s0 / 2.0 + 3.0 * s1 / 28.0 + s2 / 84.0 + s3 / 1680.0);
            store(sum, sums.data() + f);
            store(absolute(sum - lower), apart.data() + f);
        }
        for (int f = 0; f < n; ++f) difference += apart[f];
        return add(n, sums, difference, panel_tolerance, h, shortest);
    }

    // The same of a segment that is taken at once, exact but for rounding. What is turned over is the apparent energy:
    // root mean square times root mean square.
    template <class Segment>
    [[gnu::noinline]] void add_long(const Segment& s, const Factors& factors) {
        const double length = s.end - s.begin;
        const int n = factors.count();
        const LongProducts<D> products(s.entry.propagator, s.constant, s.at.x(), s.at.input(), length);
        for (int f = 0; f < n; ++f) {
            const std::vector<double> a = products.step().coefficients(factors.left, f, factors.left_constant[f]),
                                      b = products.step().coefficients(factors.right, f, factors.right_constant[f]);
            flow[f] += products(a, b);
            turned_over += std::sqrt(std::fmax(0.0, products(a, a)) * std::fmax(0.0, products(b, b)));
        }
        elapsed_ += length;
        mean_power_ = turned_over / elapsed_;
    }

    // The same where the two rules may differ by rounding alone, which a shorter panel does not make smaller: terms of
    // powers that cancel, or what rounding leaves of the fourth derivatives. The powers at nodes then count as exact if
    // they fit a polynomial to their rounding, and the next panel may be longer. error: of the panel that was not
    // added.
    [[gnu::cold]] [[gnu::noinline]] double add_rounded_panel(const Factors& factors, const Cursor<D>& from,
                                                             const Cursor<D>& to, double h, double error) {
        const double noise = h * std::fmax(factors.rounding_at(from), factors.rounding_at(to));
        if (missed_ > 1024.0 * noise) return error;
        return add_stiff_panel(factors, from, h, false, noise) <= 1.0 ? 0.0 : error;
    }

    // The same by the powers at nodes, from where a cursor is.
    double add_stiff_panel(const Factors& factors, const Cursor<D>& from, double h, bool shortest, double noise = 0.0) {
        Cursor<D>& node = node_.emplace(from);
        Flows sums{}, coarse{}, power;
        const int n = factors.count();
        for (int k = 0; k < kronrod_nodes; ++k)
            for (const double side : {-1.0, +1.0}) {
                if (k == kronrod_nodes - 1 && side > 0.0) continue;  // the one in the middle
                node.advance_from(from, 0.5 * h * (1.0 + side * kronrod[k].node));
                factors.powers(node, power);
                for (int f = 0; f < n; ++f) {
                    sums[f] += 0.5 * h * kronrod[k].weight * power[f];
                    coarse[f] += 0.5 * h * kronrod[k].gauss_weight * power[f];
                }
            }
        double difference = 0.0;
        for (int f = 0; f < n; ++f) difference += std::fabs(sums[f] - coarse[f]);
        return add(n, sums, difference, stiff_tolerance, h, shortest, noise);
    }

    double add(int n, const Flows& sums, double difference, double tolerance, double h, bool shortest,
               double noise = 0.0) {
        double size = 0.0;
        for (int f = 0; f < n; ++f) size += std::fabs(sums[f]);
        const double allowed = std::fmax(tolerance * std::fmax(size, mean_power_ * h), noise);
        const double error = allowed > 0.0 ? difference / allowed : 0.0;
        if (!shortest && error > 1.0) {
            missed_ = difference;
            return error;
        }
        for (int f = 0; f < n; ++f) flow[f] += sums[f];
        turned_over += size;
        elapsed_ += h;
        mean_power_ = turned_over / elapsed_;
        return std::fmin(error, 1.0);
    }

    // The rule that is used is two orders finer than this, the difference from the coarser one.
    static constexpr double panel_tolerance = 2e-9;
    // The Gauss rule of 7 points is exact to degree 13, the Kronrod rule to degree 22.
    static constexpr double stiff_tolerance = 1e-11;
    // 128 of the shortest time constants. One level below, what rounding does to the fourth derivatives at the ends is
    // 64^4/30240 roundings of the power, 1.2e-13.
    static constexpr int first_stiff_level = 9;

    std::optional<Cursor<D>> cursor_, end_, node_;  // kept from segment to segment for their memory
    int level_ = 4;
    double elapsed_ = 0.0, mean_power_ = 0.0;
    double missed_ = 0.0;  // [J] difference of the rules on the panel that was refused last
};

}  // namespace lostmotion
