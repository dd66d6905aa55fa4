// Moving along one regime: a point by any length, or by equal strides.
#pragma once

#include <vector>

#include "propagator.hpp"
#include "signal.hpp"

namespace lostmotion {

// A point that moves along one regime.
class Cursor {
 public:
    explicit Cursor(const InputState& input) : input_(input) {}

    // On a regime, at a state and the inputs of its instant.
    void place(Propagator& propagator, const State& constant, const InputState& input, const State& x) {
        propagator_ = &propagator;
        constant_ = &constant;
        input_ = input;
        x_ = x;
        rate_known_ = false;
    }

    double time() const { return input_.time(); }
    const State& x() const { return x_; }
    const InputState& input() const { return input_; }
    const State& rate() {
        if (!rate_known_) rate_ = propagator_->rates()(x_, *constant_, input_.values());
        rate_known_ = true;
        return rate_;
    }
    State fourth_derivative() { return propagator_->fourth_derivative(rate(), input_.weights()); }

    void anchor(double time) {
        input_.follow(time);
        rate_known_ = false;
    }
    // To a state of the same stretch that is known already.
    void move_to(double time, const State& x) {
        x_ = x;
        anchor(time);
    }

    // To one step beyond where another stands on the same stretch.
    void step_from(Cursor& from, int level) {
        propagator_ = from.propagator_;
        constant_ = from.constant_;
        x_ = propagator_->step(level, from.x_, from.rate(), from.input_.weights());
        input_.advance_from(from.input_, propagator_->level(level).length, propagator_->rotations(level));
        rate_known_ = false;
    }
    // By whole levels, from the longest down, as long as they fit into h >= 0. Returns what is left of it.
    double advance_by_levels(double h) {
        Propagator& p = *propagator_;
        const std::uint64_t n = p.intervals(h);
        if (n == 0) return h;
        rate_ = rate();
        Quad x = Quad::load(x_.data()), rate = Quad::load(rate_.data());
        double angle = x_[load_angle];
        const auto step = [&](int k) {
            p.step(k, x, rate, angle, input_.weights());
            input_.advance(p.length(k), p.rotations(k));
        };
        const int top = p.longest_level();
        for (std::uint64_t m = n >> top; m > 0; --m) step(top);
        for (std::uint64_t bits = n & ((1ull << top) - 1); bits != 0;) {
            const int k = static_cast<int>(std::bit_width(bits)) - 1;
            step(k);
            bits ^= 1ull << k;
        }
        x.store(x_.data());
        store_single(angle, &x_[load_angle]);
        rate.store(rate_.data());
        store_single(p.rates().rate.angle[load_speed] * x_[load_speed], &rate_[load_angle]);
        return h - p.length(0) * static_cast<double>(n);
    }
    // By any length: whole levels, then the Taylor series. Backward by two base intervals at most.
    void advance(double h) {
        if (h > 0.0) h = advance_by_levels(h);
        if (h == 0.0) return;
        Expansion about;
        expand(h, about);
        nudge(h, about);
    }
    // The Taylor series from here, with as many terms as count over s.
    void expand(double s, Expansion& about) {
        about.terms = propagator_->terms(s);
        input_.jet(about.terms + 1, about.u.data());
        propagator_->expand(rate(), about);
    }
    // By a small part along that series; the inputs turn on from where they are.
    void nudge(double s, const Expansion& about) {
        x_ = Propagator::series(about, s, x_);
        input_.turn(s);
        rate_known_ = false;
    }

 private:
    Propagator* propagator_ = nullptr;
    const State* constant_ = nullptr;
    InputState input_;
    State x_{}, rate_{};
    bool rate_known_ = false;
};

// Equal steps along one regime, as sampling takes them. Everything that does not change from step to step is summed up
// beforehand:
//     x(t + h) = x + E x + f + sum_q w_q Y_q,
// with f from all that is constant (growing by a constant if the inputs ramp) and Y_q the whole answers to the sines.
class Stride {
 public:
    explicit Stride(const InputState& input) : input_(input), answers_(input.size()) {}

    // On a regime, with steps of one level, from the instant of the inputs on.
    void place(Propagator& propagator, int level, const State& constant, const InputState& input) {
        step_ = &propagator.level(level);
        rotations_ = propagator.rotations(level);
        input_ = input;
        forced_ = constant;
        const Response* responses = propagator.responses(level);
        State ramp{};
        for (int i = 0; i < n_inputs; ++i) {
            add_scaled(forced_, input_.linear()[i], propagator.rates().input_column[i]);
            add_scaled(ramp, input_.slope()[i] * step_->length, propagator.rates().input_column[i]);
        }
        forced_ = step_->integral * forced_;
        growth_ = step_->integral * ramp;
        for (int q = 0; q < input_.size(); ++q) {
            const InputBasis& basis = input_.basis(q);
            answers_[q] = responses[q].x;
            if (basis.kind == InputBasis::ramp) {
                add_scaled(forced_, input_.weights()[q], responses[q].x);
                answers_[q] = {};
            } else if (basis.kind == InputBasis::cosine) {
                add_scaled(answers_[q], 1.0, step_->integral * propagator.rates().input_column[basis.input]);
            }
        }
    }

    const InputState& input() const { return input_; }
    void anchor(double time) { input_.follow(time); }

    [[gnu::always_inline]] void advance(State& x) {
        const State change = step_->change * x;
        for (int r = 0; r < n_states; r += vec_width)
            store(load(&x[r]) + (load(&change[r]) + load(&forced_[r])), &x[r]);
        for (std::size_t q = 0; q < answers_.size(); ++q) add_scaled(x, input_.weights()[q], answers_[q]);
        add_scaled(forced_, 1.0, growth_);
        input_.advance(step_->length, rotations_);
    }

 private:
    const Step* step_ = nullptr;
    const double* rotations_ = nullptr;
    InputState input_;
    State forced_{}, growth_{};
    std::vector<State> answers_;
};

}  // namespace lostmotion
