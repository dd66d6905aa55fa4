// What goes on with a regime beside its state: the rate under constant inputs, with its rounding, and rest.
#pragma once

#include <utility>

#include "exact_run.hpp"

namespace lostmotion {

template <class System>
auto ExactSolver<System>::has_settled(const Regime& regime, const State& rate) const -> bool {
    for (int k = 0, n = system_.counts().coupled; k < n; ++k) {
        if (regime.following[k]) continue;
        if (!(std::fabs(rate[k]) <= settled * scale_[k])) return false;
    }
    return true;
}

// Under inputs that vary, the states that they do not reach decay for ever: once they are below what squares allow,
// they are zero. Returns whether one has become so.
template <class System>
inline auto ExactSolver<System>::rest_unforced(Entry& e, const State& rate) -> bool {
    bool changed = false;
    e.unreached([&](int i) { return begin_->input().varies(i); }).each([&](int k) {
        const double limit = settled * scale_[k];
        if (now_.x[k] == 0.0 || !(std::fabs(now_.x[k]) <= limit && std::fabs(rate[k]) <= limit)) return;
        now_.x[k] = 0.0;
        changed = true;
    });
    return changed;
}

// After a change of the inputs: if the regime goes on from the same state, without an impulse, the rate jumps by no
// more than what they bring.
template <class System>
inline auto ExactSolver<System>::follow_inputs(const Key& before, const State& x_before) -> void {
    const InputsOf<D> left = std::exchange(course_.input, now_.input[0]);
    if (!course_.rate_known || !(key_ == before) || now_.x != x_before) {
        course_.forget();
        return;
    }
    Entry& e = cache_.entry(key_);
    Lanes rate = load(course_.rate);
    for (int i = 0, n = system_.counts().inputs; i < n; ++i)
        rate.coupled = rate.coupled + (now_.input[0][i] - left[i]) * load(e.rates.input_column[i]);
    const Coupled before_jump = bound_ahead(e, coupled(course_.rate)), after_jump = bound_ahead(e, rate.coupled);
    for (int t = 0; t < e.n_twists; ++t) {
        auto& twist = course_.twist[t];
        const double was = before_jump[e.twists[t].state], is = after_jump[e.twists[t].state];
        twist.doubt = is > 0.0 ? std::fmin(1.0, twist.doubt * was / is) : 0.0;
        twist.off_zero = false;
        twist.grazing_magnitude = 0.0;
    }
    rate.store(course_.rate);
}

// Bound on the coupled states over the first event check, from what they are.
template <class System>
inline auto ExactSolver<System>::bound_ahead(Entry& e, const Coupled& x) const -> Coupled {
    if (!e.propagator.ready()) cache_.prepare(e, rotations_, scale_);
    Propagator& p = e.propagator;
    if constexpr (std::same_as<D, Any>)
        if (p.by_series()) {
            const double h = p.length(p.longest_level());
            return Series::exponential_bound(e.rates, absolute(x), h, p.theta(h));
        }
    return p.level(first_level).exponential_bound * absolute(x);
}

// Rounding of the rate where a regime begins, as far as it acts on the twists. A number that the search for the modes
// takes for zero must not be seen to fall at once. Under inputs that vary, this rounding is the least twist speed that
// counts as zero at a touch. Torques near balance move a twist by small differences of large numbers, so that the
// rounding of the speed exceeds that of its largest value.
template <class System>
inline auto ExactSolver<System>::begin_in_doubt(Entry& e, const Cursor& at, const Memory& memory) -> void {
    State magnitude = e.rates.magnitude(magnitudes(at.x()), magnitudes(memory), at.input().magnitudes());
    for (int t = 0; t < e.n_twists; ++t)
        if (const int k = e.twists[t].state; at.rate()[k] == 0.0) magnitude[k] = 0.0;  // it starts from rest
    const Coupled rounding_ahead = bound_ahead(e, coupled(magnitude));
    if (!at.carries_rate()) {
        for (int t = 0; t < e.n_twists; ++t) course_.twist[t].grazing_magnitude = rounding_ahead[e.twists[t].state];
        return;
    }
    const Coupled ahead = bound_ahead(e, coupled(at.rate()));
    for (int t = 0; t < e.n_twists; ++t) {
        auto& twist = course_.twist[t];
        const double bound = ahead[e.twists[t].state];
        twist.most_doubt = rounding * rounding_ahead[e.twists[t].state];
        twist.doubt = bound > twist.most_doubt ? twist.most_doubt / bound : 1.0;
    }
}

// Rounding of the speed of the twist where it is its rate, carried on from where the regime began. The doubt there
// dies out with the motion; where the motion grows, it is one that began with another rounding.
template <class System>
inline auto ExactSolver<System>::twist_speed_rounding(Entry& e, int t, const Cursor& at) const -> double {
    const double bound = bound_ahead(e, coupled(at.rate()))[e.twists[t].state];
    return rounding * bound + std::fmin(course_.twist[t].doubt * bound, course_.twist[t].most_doubt);
}

// The motion has settled.
template <class System>
inline auto ExactSolver<System>::rest(const Segment<System>& segment, const Cursor& at, double limit) -> void {
    now_.x = at.x();
    if (time_ == segment.begin) {
        for (int j = D::coupled; j < D::coupled + system_.counts().angles; ++j)
            now_.x[j] += at.rate()[j] * (limit - time_);
        time_ = limit;
    }
    keep_course(segment.entry, at);
    for (int k = 0, n = system_.counts().coupled; k < n; ++k) course_.rate[k] = 0.0;
    course_.rate_known = true;
}

// At the end of a stretch that no guard ends.
template <class System>
inline auto ExactSolver<System>::keep_course(const Entry& e, const Cursor& at) -> void {
    // Carried on for long, the speeds that a stuck twist ties together drift apart by rounding.
    if constexpr (requires(decltype(e.regime->at_rest) at_rest) { system_.stop(now_, at_rest); }) {
        auto at_rest = e.regime->at_rest;
        if (at.carries_rate() && e.followed) system_.stop(now_, at_rest);
    }
    course_.rate = at.rate();
    course_.rate_known = at.carries_rate();
    course_.input = at.input().values();
}

}  // namespace lostmotion
