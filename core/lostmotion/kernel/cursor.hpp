// Moving along one regime by any length.
//
// Under constant inputs x'(t + s) = exp(A s) x'(t): the rate is carried on beside the state, so that it keeps its
// relative accuracy however small it becomes; computed from the state it would end in the rounding of what cancels.
// Where nothing drives the motion, x' = A x, nothing but x cancels, and it is the state that keeps its accuracy.
#pragma once

#include "long_step.hpp"
#include "propagator.hpp"

namespace lostmotion {

// A point that moves along one regime.
template <class D>
class Cursor {
 public:
    using Coupled = CoupledOf<D>;
    using Column = ColumnOf<D>;
    using State = StateOf<D>;
    using Lanes = LanesOf<D>;

    explicit Cursor(const InputState<D>& input) : input_(input) {}

    // On a regime, at a state; the inputs are those of the instant already. rate: if it is known better than from x.
    void place(Propagator<D>& propagator, const Column& constant, const State& x, const State* rate = nullptr) {
        propagator_ = &propagator;
        constant_ = &constant;
        carries_rate_ = false;
        if (rate != nullptr) {
            x_ = x;
            rate_ = *rate;
            rate_known_ = true;
        } else {
            arrive(load(x));
        }
        constant_inputs_ = input_.constant();
        carries_rate_ = constant_inputs_ && (rate != nullptr || driven());
    }
    bool constant_inputs() const { return constant_inputs_; }  // where it was placed
    bool carries_rate() const { return carries_rate_; }
    // From now on nothing moves but the angles.
    void settle() {
        Lanes rate{};
        rate.angle = propagator_->rates().angle_rate(coupled(x_));
        rate.store(rate_);
        rate_known_ = carries_rate_ = true;
    }
    InputState<D>& inputs() { return input_; }
    const std::vector<GivenState>* given() const { return propagator_->rates().given; }
    // From now on the constant, which is the same, is in another place.
    void keep(const Column& constant) { constant_ = &constant; }

    double time() const { return input_.time(); }
    const State& x() const { return x_; }
    const InputState<D>& input() const { return input_; }
    [[gnu::always_inline]] const State& rate() const {
        if (!rate_known_) propagator_->rates()(coupled(x_), *constant_, input_).store(rate_);
        rate_known_ = true;
        return rate_;
    }
    [[gnu::always_inline]] Coupled fourth_derivative() const {
        return propagator_->taylor().fourth_derivative(coupled(rate()), input_);
    }

    void anchor(double time) {
        input_.follow(time);
        set_given();
        rate_known_ = rate_known_ && carries_rate_;
    }
    // To a state of the same stretch that is known already.
    void move_to(double time, const State& x) {
        x_ = x;
        input_.follow(time);
        set_given();
        rate_known_ = false;
    }

    // To one step beyond where another is on the same stretch.
    void step_from(const Cursor& from, int level) {
        propagator_ = from.propagator_;
        constant_ = from.constant_;
        carries_rate_ = from.carries_rate_;
        const double length = propagator_->length(level);
        if constexpr (std::same_as<D, Any>)
            if (propagator_->by_series()) return series_step(from, length);
        if (carries_rate_) {
            Lanes x = load(from.x_), rate = load(from.rate());
            propagator_->step(level, x, rate, from.input_.weights());
            input_.advance_from(from.input_, length, propagator_->rotations(level));
            arrive(x, rate);
        } else {
            const Lanes x = propagator_->step(level, load(from.x_), load(from.rate()), from.input_.weights());
            input_.advance_from(from.input_, length, propagator_->rotations(level));
            arrive(x);
        }
    }
    // To the nearest of the instants that whole doubling levels, but not the shortest, lead to from where another is;
    // the longest first. Returns what is left of h >= 0, a base interval forward or backward at most. Not inlined: the
    // code of an event must not outgrow the instruction cache by more than it does.
    [[gnu::noinline]] double advance_by_levels(const Cursor& from, double h) {
        Propagator<D>& p = *(propagator_ = from.propagator_);
        constant_ = from.constant_;
        carries_rate_ = from.carries_rate_;
        if constexpr (std::same_as<D, Any>)
            if (p.by_series()) {
                const double parts = p.series_parts(h);
                series_step(from, h / parts);
                for (double k = 1.0; k < parts; ++k) series_step(*this, h / parts);
                return 0.0;
            }
        input_ = from.input_;
        // By way of a signed number, which processors make of a floating-point one at once.
        const auto n = static_cast<std::uint64_t>(static_cast<std::int64_t>(h * p.per_first() + 0.5));
        Lanes x = load(from.x_), rate = load(from.rate());
        const auto step = [&](int k) ALWAYS_INLINE {
            p.step(k, x, rate, input_.weights());
            input_.advance(p.length(k), p.rotations(k));
        };
        const int top = p.longest_level() - 1;
        for (std::uint64_t m = n >> top; m > 0; --m) step(top + 1);
        for (std::uint64_t bits = n & ((1ull << top) - 1); bits != 0;) {
            const int k = static_cast<int>(std::bit_width(bits)) - 1;
            step(k + 1);
            bits ^= 1ull << k;
        }
        arrive(x, rate);
        return h - p.length(1) * static_cast<double>(n);
    }
    // By any length: whole levels, then the Taylor series. Backward by one base interval at most.
    void advance(double h) { advance_from(*this, h); }
    void advance_from(const Cursor& from, double h) {
        if (h > 0.0)
            h = advance_by_levels(from, h);
        else if (this != &from)
            *this = from;
        taylor_step(h);
    }
    // Over a long stretch at once, to an instant.
    [[gnu::noinline]] void leap_to(double to) {
        double length = to - input_.time();
        if (left_of(to, length) < 0.0) length = std::nextafter(length, 0.0);
        LongStep<D> step = long_step(length);
        leap_to(to, step);
    }
    // The same by a step that is no longer than the stretch.
    [[gnu::noinline]] void leap_to(double to, LongStep<D>& step) {
        advance(left_of(to, step.length()));
        x_ = step(x_, input_);
        input_.follow(to);
        set_given();
        rate_known_ = false;
    }
    [[gnu::noinline]] LongStep<D> long_step(double length) const { return {*propagator_, *constant_, input_, length}; }
    // By one base interval at most, forward or backward; the inputs turn on from where they are.
    void taylor_step(double s) {
        if (s == 0.0) return;
        if constexpr (std::same_as<D, Any>)
            if (propagator_->by_series()) return series_step(*this, s);
        Expansion<D> here;
        expand(here);
        taylor_step(here, s);
    }
    void expand(Expansion<D>& out) const {
        if constexpr (std::same_as<D, Any>)
            if (propagator_->by_series())
                return Taylor<D>::expand_by_rates(propagator_->rates(), load(rate()), input_, out);
        propagator_->taylor().expand(load(rate()), input_, out);
    }
    void taylor_step(const Expansion<D>& here, double s) {
        const Lanes x = load(x_) + here.change(s);
        input_.rotate(s);
        if (carries_rate_) {
            arrive(x, {coupled(rate_) + here.rate_change(s), propagator_->rates().angle_rate(x.coupled)});
        } else {
            x.store(x_);
            rate_known_ = false;
        }
    }

 private:
    // To h beyond where another is on the same stretch, forward or backward.
    void series_step(const Cursor& from, double h)
        requires(std::same_as<D, Any>)
    {
        Propagator<D>& p = *propagator_;
        p.series().expand(p.rates(), load(from.rate()), from.input_, h, p.theta(h));
        const Lanes x = load(from.x_) + p.series().change();
        Lanes rate{};
        if (carries_rate_) rate.coupled = coupled(from.rate_) + p.series().rate_change();
        if (this != &from) input_ = from.input_;
        input_.rotate(h);
        if (carries_rate_) {
            rate.angle = p.rates().angle_rate(x.coupled);
            arrive(x, rate);
        } else {
            arrive(x);
        }
    }
    // Given speeds are those of their signals, at an instant that the inputs were anchored to.
    void set_given() {
        if (const auto* given = propagator_->rates().given; given != nullptr) [[unlikely]]
            for (const GivenState& g : *given)
                x_[static_cast<std::size_t>(g.state)] = input_.given_at(g, input_.time());
    }
    // What a length leaves of the way to an instant, of which the rounding of the clock may be most.
    double left_of(double to, double length) const {
        return static_cast<double>(DoubleDouble::sum(to, -input_.time()) + -length);
    }
    // At a state that the inputs belong to.
    [[gnu::always_inline]] void arrive(const Lanes& x) {
        x.store(x_);
        propagator_->rates()(x.coupled, *constant_, input_).store(rate_);
        rate_known_ = true;
    }
    [[gnu::always_inline]] void arrive(const Lanes& x, const Lanes& rate) {
        x.store(x_);
        rate.store(rate_);
        rate_known_ = true;
    }
    // Whether anything but the state itself acts on the coupled states.
    bool driven() const {
        const Coupled drive = load(*constant_) + propagator_->rates().forced(input_);
        for (int k = 0; k < propagator_->rates().n.coupled; ++k)
            if (drive[k] != 0.0) return true;
        return false;
    }

    Propagator<D>* propagator_ = nullptr;
    const Column* constant_ = nullptr;
    InputState<D> input_;
    State x_{};
    mutable State rate_{};  // once it has been asked for
    mutable bool rate_known_ = false;
    bool constant_inputs_ = false, carries_rate_ = false;
};

}  // namespace lostmotion
