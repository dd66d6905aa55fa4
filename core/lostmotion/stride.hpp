// Equal steps along one regime, as sampling takes them.
//
// What does not change from step to step is summed up beforehand:
//     x(t + h) = x + (E x + f + sum_q (s_q Y_q + c_q Z_q)),
// with f from all that is constant (growing by a constant if the inputs ramp) and Y_q, Z_q the whole answers to the
// sine and the cosine of the q-th sine of the inputs. Of all this, only E x waits for the step before.
#pragma once

#include <vector>

#include "cursor.hpp"
#include "reader.hpp"

namespace lostmotion {

class Stride {
 public:
    // On a regime, with steps of one level, from where a cursor stands.
    void place(Propagator& propagator, int level, const State& constant, const Cursor& from) {
        step_ = &propagator.level(level);
        const double length = propagator.length(level);
        const InputState& input = from.input();
        const LinearRates& rates = propagator.rates();
        const Response* responses = propagator.responses(level);
        const double* rotations = propagator.rotations(level);
        x_ = from.x();
        linear_ = input.linear();
        State driving = constant, ramp{};
        for (int i = 0; i < n_inputs; ++i) {
            increase_[i] = input.slope()[i] * length;
            add_scaled(driving, linear_[i], rates.input_column[i]);
            add_scaled(ramp, increase_[i], rates.input_column[i]);
        }
        forced_ = step_->integral * driving;
        growth_ = step_->integral * ramp;
        sines_.clear();
        for (int q = 0; q < input.size(); ++q) {
            const InputBasis& basis = input.basis(q);
            if (basis.kind == InputBasis::ramp) {
                add_scaled(forced_, input.weights()[q], responses[q].x);
            } else if (basis.kind == InputBasis::cosine) {
                State whole = step_->integral * rates.input_column[basis.input];
                add_scaled(whole, 1.0, responses[q].x);
                sines_.push_back({basis.input, input.weights()[q], input.weights()[q + 1], rotations[q],
                                  rotations[q + 1], whole, responses[q + 1].x});
            }
        }
    }

    // Where the cursor stood and n - 1 steps on from there.
    void run(int n, Instants& to) {
        Lanes x = load(x_), forced = load(forced_);
        const Lanes growth = load(growth_);
        for (int k = 0;; ++k) {
            std::array<double, n_inputs> u = linear_;
            for (const Turning& t : sines_) u[t.input] += t.sine;
            to.set(k, x, u);
            if (k + 1 == n) {
                x.store(x_.data());
                return;
            }
            Lanes driven = forced;
            for (Turning& t : sines_) {
                driven = driven + (t.sine * load(t.by_sine) + t.cosine * load(t.by_cosine));
                const double sine = t.sine * t.cos + t.cosine * t.sin;
                t.cosine = t.cosine * t.cos - t.sine * t.sin;
                t.sine = sine;
            }
            x = x + (step_->change.of_coupled(x) + driven);
            forced = forced + growth;
            for (int i = 0; i < n_inputs; ++i) linear_[i] += increase_[i];
        }
    }
    // At the last of them.
    const State& x() const { return x_; }

 private:
    struct Turning {
        int input;
        double sine, cosine;  // the sine itself, and its derivative over omega
        double cos, sin;      // of omega h
        State by_sine, by_cosine;
    };

    const Step* step_ = nullptr;
    State x_{}, forced_{}, growth_{};
    std::array<double, n_inputs> linear_{}, increase_{};
    std::vector<Turning> sines_;
};

}  // namespace lostmotion
