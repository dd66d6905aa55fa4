// Moving along one regime: a point by any length, or by equal strides.
#pragma once

#include <vector>

#include "propagator.hpp"
#include "signal.hpp"

namespace lostmotion {

// A point that moves along one regime.
class Cursor {
 public:
    Cursor(const Signals& signals, const std::vector<InputBasis>& basis) : input_(signals, basis) {}
    Cursor(Propagator& propagator, const Signals& signals, const std::vector<InputBasis>& basis, const State& constant,
           double time, const State& x)
        : Cursor(signals, basis) {
        place(propagator, constant, time, x);
    }

    // On a regime, at an instant of it.
    void place(Propagator& propagator, const State& constant, double time, const State& x) {
        input_.anchor(time);
        stand(propagator, constant, x);
    }
    // The same, with inputs that are there already.
    void place(Propagator& propagator, const State& constant, const InputState& input, const State& x) {
        input_ = input;
        stand(propagator, constant, x);
    }

    double time() const { return input_.time(); }
    const State& x() const { return x_; }
    const InputState& input() const { return input_; }
    const State& rate() {
        if (!rate_known_) rate_ = propagator_->rate(x_, *constant_, input_.values());
        rate_known_ = true;
        return rate_;
    }

    void anchor(double time) {
        input_.follow(time);
        rate_known_ = false;
    }
    // To a state of the same stretch that is known already.
    void move_to(double time, const State& x) {
        x_ = x;
        anchor(time);
    }

    void step(int level) {
        x_ = propagator_->step(level, x_, rate(), input_.weights());
        input_.advance(propagator_->level(level).length, propagator_->rotations(level));
        rate_known_ = false;
    }
    // By a small part of a base interval, forward or backward; the inputs turn on from where they are.
    void nudge(double h) {
        x_ = propagator_->series(h, x_, rate(), input_);
        input_.turn(h);
        rate_known_ = false;
    }
    // By any length: whole levels from the longest down, then the Taylor series. Backward by a base interval at most.
    void advance(double h) {
        const double target = time() + h;
        for (int k = h > 0.0 ? propagator_->level_below(h) : -1; k >= 0; --k) {
            const double length = propagator_->level(k).length;
            while (h >= length) {
                step(k);
                h -= length;
            }
        }
        if (h != 0.0) x_ = propagator_->series(h, x_, rate(), input_);
        anchor(target);
    }

 private:
    void stand(Propagator& propagator, const State& constant, const State& x) {
        propagator_ = &propagator;
        constant_ = &constant;
        x_ = x;
        rate_known_ = false;
    }

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
    explicit Stride(const InputState& input) : input_(input), answers_(input.basis().size()) {}

    // On a regime, with steps of one level, from the instant of the inputs on.
    void place(Propagator& propagator, int level, const State& constant, const InputState& input) {
        step_ = &propagator.level(level);
        rotations_ = propagator.rotations(level);
        input_ = input;
        forced_ = constant;
        const State* responses = propagator.responses(level);
        const std::vector<InputBasis>& basis = input_.basis();
        State ramp{};
        for (int i = 0; i < n_inputs; ++i) {
            add_scaled(forced_, input_.linear()[i], propagator.input_column(i));
            add_scaled(ramp, input_.slope()[i] * step_->length, propagator.input_column(i));
        }
        forced_ = step_->integral * forced_;
        growth_ = step_->integral * ramp;
        for (std::size_t q = 0; q < basis.size(); ++q) {
            answers_[q] = responses[q];
            if (basis[q].kind == InputBasis::ramp) {
                add_scaled(forced_, input_.weights()[q], responses[q]);
                answers_[q] = {};
            } else if (basis[q].kind == InputBasis::cosine) {
                add_scaled(answers_[q], 1.0, step_->integral * propagator.input_column(basis[q].input));
            }
        }
    }

    const InputState& input() const { return input_; }
    void anchor(double time) { input_.follow(time); }

    void advance(State& x) {
        const State change = step_->change * x;
        for (int r = 0; r < lanes; ++r) x[r] += change[r] + forced_[r];
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
