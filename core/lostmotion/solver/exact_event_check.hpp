// Event checks: no guard of a regime falls through zero unseen.
//
// An event check covers an interval of length h for a guard that becomes negative. From value and slope of the guard at
// both ends comes its cubic Hermite interpolant, which departs from the guard by at most h^4/384 max|g''''|, its slope
// by at most sqrt(3)/216 h^3 max|g''''| (Birkhoff and Priver 1967). max|g''''| is bounded through the fourth
// derivative of the state at the start and a bound on |exp(A s)|. The Bernstein coefficients of the cubic enclose
// it. So a guard is certified positive, or certified to fall through zero once, or the interval is shortened. There
// is no other step size.
#pragma once

#include <limits>

#include "../base/polynomial.hpp"
#include "exact_run.hpp"

namespace lostmotion {

// Advances within the regime until a guard reaches zero (fired) or `limit`.
template <class System>
inline auto ExactSolver<System>::run_regime(const Segment<System>& segment, double limit, const Guard*& fired)
    -> Status {
    Entry& e = segment.entry;
    Propagator& p = e.propagator;
    if (!p.resolved()) return Status::outside;
    typename GuardTable::Values constant;
    e.guards.constants(segment.memory, constant);
    Cursor *cursor = begin_, *end = there_;
    Ends *here = &ends_[0], *there = &ends_[1];
    const bool constant_inputs = cursor->constant_inputs();
    if (cursor->carries_rate() ? !course_.rate_known : e.may_graze && !course_.has_magnitudes())
        begin_in_doubt(e, *cursor, segment.memory);
    if (e.n_guards == 0 && LongStep<D>::pays(p, limit - time_) && leap(e, limit)) return Status::done;
    evaluate(e, constant, *cursor, *here);
    Coupled forced{};  // bound on what the fourth derivatives of the inputs add to that of the state, per second
    for (int i = 0; i < e.rates.depends_on.inputs; ++i)
        forced = forced + input_bound_[i] * absolute(load(e.rates.input_column[i]));
    // Every event check leads to a later instant of the clock (docs/theory.md).
    const double shortest = std::fmax(1e-7 * p.length(0), 4.0 * std::numeric_limits<double>::epsilon() * limit);
    const int lowest = p.level_above(0.5 * shortest);
    int level = std::max(lowest, std::min(last_level_, p.level_below(limit - time_)));
    for (long count = 1; time_ < limit; ++count) {
        ++event_checks_;
        if (interruption()) return Status::interrupted;
        if (count % 64 == 0) cursor->anchor(time_);
        const State& rate = cursor->rate();
        if (constant_inputs && has_settled(*e.regime, rate)) {
            rest(segment, *cursor, limit);
            return Status::done;
        }
        if (!moderate(rate)) return Status::outside;
        const Coupled fourth = p.by_series() ? Coupled{} : absolute(cursor->fourth_derivative());
        const double left = limit - time_;
        if (!p.by_series()) level = p.bounded_level(level);
        if (p.length(level) < 0.5 * shortest) [[unlikely]]
            return Status::outside;
        double h = std::min(p.length(level), left);
        while (true) {
            if (h == p.length(level)) {
                end->step_from(*cursor, level);
            } else {
                end->advance_from(*cursor, h);
            }
            evaluate(e, constant, *end, *there);
            bound_fourth(e.guards, p, level, fourth + h * forced);
            const Verdict verdict = judge(e, segment.memory, *cursor, *here, *there, h, h < shortest);
            if (verdict == Verdict::uncertain) {  // below the lowest doubling level, by plain halves
                h = level > lowest ? std::min(p.length(level = std::max(lowest, level - halvings_)), left) : 0.5 * h;
                continue;
            }
            if (verdict == Verdict::crossing) {
                first_crossing(e, segment.memory, *cursor, *here, *there, h, fired);
                time_ = there_->time();
                now_.x = there_->x();
                last_level_ = level;
                return Status::done;
            }
            time_ = h == left ? limit : time_ + h;
            break;
        }
        cursor = end;
        std::swap(here_, there_);
        end = there_;
        std::swap(here, there);
        // Twice the length has at least sixteen times the error; try it where there is room for more than that.
        if (roomy_ && p.can_double(level, limit - time_)) ++level;
    }
    now_.x = cursor->x();
    last_level_ = level;
    keep_course(e, *cursor);
    return Status::done;
}

// All the way to `limit`, where there is no guard. False if the motion leaves the range of the arithmetic: then the
// event_checks find out when.
template <class System>
auto ExactSolver<System>::leap(const Entry& e, double limit) -> bool {
    *there_ = *begin_;
    there_->leap_to(limit);
    if (!moderate(there_->rate())) return false;
    ++event_checks_;
    time_ = limit;
    now_.x = there_->x();
    keep_course(e, *there_);
    return true;
}

// Speeds that are multiples of the rate of the twist are as accurate as that.
template <class System>
inline auto ExactSolver<System>::evaluate(const Entry& e, const typename GuardTable::Values& constant, Cursor& at,
                                          Ends& out) -> void {
    e.guards.evaluate(constant, at.x(), at.rate(), at.input(), out.value, out.slope);
    if (!at.carries_rate()) return;
    for (int k = 0; k < e.n_twist_speeds; ++k) {
        const auto& s = e.twist_speeds[k];
        out.value[s.guard] = s.factor * at.rate()[e.twists[s.twist].state];
    }
}

// |g''''| over the event check, from a bound on the fourth derivative of the state that the flow carries on.
template <class System>
inline auto ExactSolver<System>::bound_fourth(const GuardTable& guards, Propagator& p, int level,
                                              const Coupled& magnitude) -> void {
    State bound;
    if constexpr (std::same_as<D, Any>)
        if (p.by_series()) bound.coupled = p.series().fourth_bound();
    if (!p.by_series()) store<D>(p.level(level).exponential_bound * magnitude, bound);
    guards.rate_magnitudes(bound, input_bound_, bounds_.fourth);
}

// Encloses all guards over an event check of length h. Returns, as bits, those that are not certain to be positive
// all through it.
template <class System>
inline auto ExactSolver<System>::enclose(int rows, const Ends& here, const Ends& there, double h) -> Guards {
    const double third = h / 3.0, share = h * h * h * h / 384.0;
    make_room(bounds_.lower, rows);
    make_room(bounds_.error, rows);
    Guards doubtful;
    unsigned tight = 0;
    for (int g = 0; g < rows; g += vec_width) {
        const Vec begin = load(here.value.data() + g), end = load(there.value.data() + g);
        const Vec c1 = begin + third * load(here.slope.data() + g), c2 = end - third * load(there.slope.data() + g);
        const Vec low = min_of(min_of(begin, end), min_of(c1, c2)), error = share * load(bounds_.fourth.data() + g);
        store(low, bounds_.lower.data() + g);
        store(error, bounds_.error.data() + g);
        const unsigned clear = above(low, error);
        if (clear != all_bits) {
            // One that starts on zero or above and rises all through is certain, too.
            const Vec rise = min_of(c1 - begin, min_of(c2 - c1, end - c2));
            const unsigned rises = above(rise, slope_share * error) & ~above(Vec{}, begin);
            doubtful.set(g, all_bits & ~(clear | rises));
        }
        tight |= clear & ~above(low, 64.0 * error);
    }
    roomy_ = tight == 0;
    return doubtful;
}

template <class System>
inline auto ExactSolver<System>::judge(Entry& e, const Memory& memory, const Cursor& cursor, const Ends& here,
                                       const Ends& there, double h, bool shortest) -> Verdict {
    Guards doubtful = enclose(e.guards.rows(), here, there, h);
    n_crossing_ = 0;
    for (int t = 0; t < e.n_twists; ++t) {
        const int g = e.twists[t].grazing_guard;
        if (g < 0) continue;
        auto& twist = course_.twist[t];
        twist.grazing_magnitude = std::max(twist.grazing_magnitude, e.grazing_magnitude(e.twists[t], cursor.x()));
        grazing_[t] = cursor.carries_rate() ? twist_speed_rounding(e, t, cursor) : rounding * twist.grazing_magnitude;
        twist.off_zero |= here.value[g] > grazing_[t];
        if (bounds_.lower[g] <= grazing_[t]) doubtful.set(g);
    }
    doubtful -= e.behind;
    if (doubtful.empty()) return Verdict::clear;
    const Memory memory_magnitudes = magnitudes(memory);
    const State state_magnitudes = magnitudes(cursor.x());
    bool certain = true;
    doubtful.each([&](int g) ALWAYS_INLINE {
        const double low = bounds_.lower[g], error = bounds_.error[g];
        const Cubic c(here.value[g], here.slope[g], there.value[g], there.slope[g], h);
        const int t = e.grazing_twist(g);
        const double near = t >= 0 ? grazing_[t] : 0.0;
        const bool grazes = t >= 0 && course_.twist[t].off_zero && low - error <= near && c.c3 > near;
        if (low > error && !grazes) return true;
        const double magnitude =
            std::fmax(e.guards.magnitude_of(g, memory_magnitudes, state_magnitudes, cursor.input()),
                      e.regime->guards[static_cast<std::size_t>(g)].size_at_least());
        const auto of_rate = rate_multiple(e, cursor, g);
        const double resolution = of_rate.factor != 0.0
                                      ? std::fabs(of_rate.factor) * twist_speed_rounding(e, of_rate.twist, cursor)
                                      : rounding * magnitude;
        const double tolerance = resolution + time_rounding * std::fabs(time_) *
                                                  std::max(std::fabs(here.slope[g]), std::fabs(there.slope[g]));
        if (low - error >= -tolerance && !grazes) return true;
        const double d0 = c.c1 - c.c0, d1 = c.c2 - c.c1, d2 = c.c3 - c.c2;
        const bool rises = std::min(d0, std::min(d1, d2)) > slope_share * error;
        const bool falls = std::max(d0, std::max(d1, d2)) < -slope_share * error;
        if (rises && c.c0 >= -tolerance && !(grazes && c.c0 <= near)) return true;
        if (falls && c.c3 >= -tolerance) return true;
        const bool starts_on_zero = c.c0 <= rounding * magnitude;
        // First of all: all through a short event check a slope may fall that is zero to rounding.
        if (c.c0 <= tolerance && !grazes && departs(e, memory, cursor, g, h)) return true;
        if (falls) {
            crossing_[n_crossing_++] = {g, false, starts_on_zero};
            return true;
        }
        const double resolved = grazes ? near : tolerance;
        if (error > resolved && !shortest) {
            // Half the length has a sixteenth of the error, which ought to be small beside what the guard does.
            const double course = std::max(std::max(std::fabs(c.c0), std::fabs(c.c3)),
                                           h * std::max(std::fabs(here.slope[g]), std::fabs(there.slope[g])));
            halvings_ = 1;
            for (double left = error / 16.0; left > 0.25 * course && halvings_ < 10; left /= 16.0) ++halvings_;
            return certain = false;
        }
        // The cubic is the guard to rounding, or as near as the shortest event check comes; does it dip below zero?
        const double lowest = c(c.lowest_at());
        if (lowest < -std::max(tolerance, error))
            crossing_[n_crossing_++] = {g, false, starts_on_zero};
        else if (grazes && lowest <= resolved)
            crossing_[n_crossing_++] = {g, true, starts_on_zero};
        return true;
    });
    if (!certain) return Verdict::uncertain;
    return n_crossing_ > 0 ? Verdict::crossing : Verdict::clear;
}

// A guard that starts on zero: does its first derivative that is not zero carry it away, all through the event
// check?
template <class System>
inline auto ExactSolver<System>::departs(const Entry& e, const Memory& memory, const Cursor& cursor, int g,
                                         double h) const -> bool {
    const auto [first, derivative] = departure(e, memory, cursor, g);
    if (first == 0) return false;
    // value = h^k (derivative_k / k! + what follows), bounded at the far end.
    double lower = derivative[first] * over_factorial[first], power = h;
    for (std::size_t k = first + 1; k < 4; ++k, power *= h)
        lower += power * std::min(0.0, derivative[k]) * over_factorial[k];
    return lower > power * bounds_.fourth[g] * over_factorial[4];
}

template <class System>
inline auto ExactSolver<System>::departure(const Entry& e, const Memory& memory, const Cursor& cursor, int g) const
    -> Departure {
    const InstantOf<D> now{time_, cursor.x(), memory, cursor.input().jet(), cursor.input().magnitudes()};
    Flow<D> flow(e.rates, now);
    const LinearForm& form = e.regime->guards[g].form;
    Departure out;
    for (std::size_t k = 1; k < 4; ++k) {
        const double value = out.derivative[k] = flow.rate(form, static_cast<int>(k));
        if (out.order > 0) continue;
        const double resolution = rounding * flow.rate_magnitude(form, static_cast<int>(k));
        if (value < -resolution) return out;
        if (value > resolution) out.order = k;
    }
    return out;
}

}  // namespace lostmotion
