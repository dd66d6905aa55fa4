// When a guard that falls through zero does so.
#pragma once

#include <limits>

#include "../base/polynomial.hpp"
#include "exact_run.hpp"

namespace lostmotion {

// The first instant from begin_ on at which a torque that goes along with the limit of a contact turns back, before
// `limit`; else, or if it is interrupted, `limit`. From a slope v and a curvature a of that torque follows
// v + a s - K s^2/2 <= its slope after s <= h, where K bounds how its third derivative falls, so that no turn is
// stepped over. The slope is known to its noise, and near the turn a step to where the bound is zero is shorter than
// what would change the state: then the steps grow, up to where the bound is below zero by the noise (docs/theory.md).
template <class System>
double ExactSolver<System>::first_turn(Entry& e, double limit) {
    int level = first_level;
    double ticks = 1.0;
    Coupled forced{};
    for (int i = 0; i < e.rates.n.inputs; ++i)
        forced = forced + input_bound_[i] * absolute(load(e.rates.input_column[i]));
    Cursor at = *begin_;
    while (at.time() < limit && !interruption()) {
        // A motion that grows without bound is followed to no end: a guard ends the regime before.
        if (!moderate(at.rate())) return at.time();
        level = e.propagator.by_series() ? std::min(level, e.propagator.longest_level())
                                         : e.propagator.bounded_level(level);
        const double h = e.propagator.length(level);
        const InstantOf<D> now{at.time(), at.x(), now_.memory, at.input().jet(), at.input().magnitudes()};
        Flow<D> along(e.rates, now);
        State fourth{};
        if constexpr (std::same_as<D, Any>) {
            if (e.propagator.by_series()) {
                e.propagator.series().expand(e.rates, load(at.rate()), at.input(), h, e.propagator.theta(h));
                fourth.coupled = e.propagator.series().fourth_bound();
            }
        }
        if (!e.propagator.by_series())
            store<D>(e.propagator.level(level).exponential_bound * (absolute(at.fourth_derivative()) + h * forced),
                     fourth);
        double step = std::min(h, limit - at.time()), longest = step;
        for (const auto& driver : e.regime->drivers) {
            const LinearForm& torque = driver.torque;
            const double a = along.rate(torque, 2), b = along.rate(torque, 3);
            const double noise = along.noise(along.rate_magnitude(torque, 1), a);
            const double v = along.rate(torque, 1) + 2.0 * noise;
            if (v < 0.0) return at.time();
            double bound = 0.0;
            each_state_of<D>(torque, [&](int k, double c) { bound += std::fabs(c) * fourth[k]; });
            for (const auto& [i, c] : torque.of_inputs()) bound += std::fabs(c) * input_bound_[i];
            const double K = std::fmax(0.0, -b) + bound * h / 3.0;
            if (v == 0.0 && a == 0.0 && K > 0.0) {
                // b s^2/2 - bound s^3/6 at least; without b as well, a torque that changes within rounding so soon.
                if (b < 0.0) return at.time();
                step = longest = std::min(step, b > 0.0 ? 3.0 * b / bound : 0x1p-12 * h);
                continue;
            }
            // Up to where the bound falls to zero from `above`.
            const auto shorten = [&](double& s, double above) {
                if (above + s * (a - 0.5 * K * s) >= 0.0) return;
                const double root = std::sqrt(a * a + 2.0 * K * above);
                s = a > 0.0 ? (a + root) / K : 2.0 * above / (root - a);
            };
            shorten(step, v);
            shorten(longest, v + noise);
        }
        const double tick = std::nextafter(at.time(), limit) - at.time();
        if (step < 0.5 * longest) {
            step = std::fmax(step, std::fmin(longest, ticks * tick));
            ticks *= 2.0;
        } else {
            ticks = 1.0;
            // What is fast dies out: as in an event check, a step with room is followed by one of twice the length.
            if (step == h && e.propagator.can_double(level, limit - at.time())) ++level;
        }
        at.advance(std::fmax(step, tick));
        at.anchor(std::fmin(at.time(), limit));
    }
    return limit;
}

// Earliest of the certified crossings; there_ is left at it.
template <class System>
inline auto ExactSolver<System>::first_crossing(Entry& e, const Memory& memory, const Cursor& cursor, const Ends& here,
                                                const Ends& there, double h, const Guard*& fired) -> void {
    double best = std::numeric_limits<double>::infinity();
    const auto cubic = [&](int g) { return Cubic(here.value[g], here.slope[g], there.value[g], there.slope[g], h); };
    for (int k = 0; k < n_crossing_; ++k) {
        Crossing& at = crossing_[k];
        const Cubic c = cubic(at.guard);
        at.estimate = at.grazing ? c.lowest_at() : c.zero(c.c3 < 0.0 && c.slope(1.0) <= 0.0 ? 1.0 : c.lowest_at());
    }
    if (n_crossing_ > 1)
        std::sort(crossing_.begin(), crossing_.begin() + n_crossing_,
                  [](const Crossing& a, const Crossing& b) { return a.estimate < b.estimate; });
    for (int k = 0; k < n_crossing_; ++k) {
        const auto& [g, grazing, starts_on_zero, estimate] = crossing_[k];
        // Still positive where another has crossed: later.
        if (k > 0 && cubic(g)(best / h) > bounds_.error[g]) continue;
        double s = estimate * h;
        if (grazing) {
            trial_->advance_from(cursor, s);
        } else {
            s = find_zero(e, g, memory, cursor, starts_on_zero, s, h);
        }
        if (s < best) {
            best = s;
            std::swap(there_, trial_);
            fired = &e.regime->guards[g];
        }
    }
}

// A guard that starts on zero and rises, by the derivative of this order: where it comes back to zero before `end`,
// at most one base interval on; else `end`. Leaves trial_ there.
template <class System>
inline auto ExactSolver<System>::first_return(const LinearForm& form, const Cursor& cursor, std::size_t order,
                                              double end) -> double {
    cursor.expand(expansion_);
    Polynomial guard = expansion_.polynomial(form, 0.0);
    for (std::size_t k = 1; k < order; ++k) guard.part[0].set(static_cast<int>(k - 1), 0.0);
    double low = 0.0, high = end;
    if (guard.value(end) < 0.0)
        while (high - low > 4.0 * std::numeric_limits<double>::epsilon() * high) {
            const double middle = 0.5 * (low + high);
            (guard.value(middle) > 0.0 ? low : high) = middle;
        }
    *trial_ = cursor;
    trial_->taylor_step(expansion_, high);
    return high;
}

// Where a guard falls through zero within h, near an estimate. Leaves trial_ there,
// returns when. About the nearest instant that whole levels lead to, the guard is a polynomial to rounding.
template <class System>
inline auto ExactSolver<System>::find_zero(Entry& e, int g, const Memory& memory, const Cursor& cursor,
                                           bool starts_on_zero, double estimate, double h) -> double {
    const LinearForm& form = e.regime->guards[g].form;
    const double base = e.propagator.length(0);
    double low = 0.0, high = h, s = estimate;
    if (starts_on_zero) {
        if (const auto order = departure(e, memory, cursor, g).order; order > 0) {
            const double end = std::min(h, base);
            if (const double z = first_return(form, cursor, order, end); z < end) return z;
            low = end;
            s = std::clamp(estimate, low, h);
        }
    }
    const double earliest = low;
    for (int m = 0; m < 100; ++m) {
        const double rest = trial_->advance_by_levels(cursor, s), from = s - rest;
        const auto of_rate = rate_multiple(e, *trial_, g);
        const double value = of_rate.factor != 0.0
                                 ? of_rate.factor * trial_->rate()[e.twists[of_rate.twist].state]
                                 : lostmotion::evaluate<D>(form, trial_->x(), memory, trial_->input().values());
        trial_->expand(expansion_);
        const Polynomial guard = expansion_.polynomial(form, value);
        const double reach = std::fabs(rest) + 0.25 * base, at = trial_->time();
        double z = rest;
        bool found = false;
        for (int n = 0; n < 60 && !found && std::fabs(z) <= reach; ++n) {
            // Halley's method
            const double f = guard.value(z), slope = guard.slope(z);
            const double moved = -f * slope / (slope * slope - f * guard.half_curvature(z));
            z += moved;
            found = std::fabs(moved) <= converging * std::fabs(z) || at + moved == at;
        }
        if (found && std::fabs(z) <= reach && (from + z >= earliest || earliest == 0.0)) {
            s = std::clamp(from + z, 0.0, h);
            trial_->taylor_step(expansion_, s - from);
            return s;
        }
        // The zero lies elsewhere: where the last step led, or in half of what is left.
        (value > 0.0 ? low : high) = from;
        s = from + z;
        if (!(s > low && s < high)) s = 0.5 * (low + high);
    }
    trial_->advance_from(cursor, s);
    return s;
}

}  // namespace lostmotion
