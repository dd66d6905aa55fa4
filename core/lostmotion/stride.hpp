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
    void place(Propagator& propagator, int level, const Column& constant, const Cursor& from) {
        step_ = &propagator.level(level);
        const double length = propagator.length(level);
        const InputState& input = from.input();
        const LinearRates& rates = propagator.rates();
        const Response* responses = propagator.responses(level);
        const Turn* turns = propagator.turns(level);
        turning_ = rates.turning * step_->integral.coupled.row(load_speed);
        x_ = from.x();
        linear_ = input.linear();
        Coupled driving = load(constant), ramp{};
        for (int i = 0; i < n_inputs; ++i) {
            increase_[i] = input.slope()[i] * length;
            driving = driving + linear_[i] * load(rates.input_column[i]);
            ramp = ramp + increase_[i] * load(rates.input_column[i]);
        }
        forced_ = step_->integral * Lanes{driving};
        growth_ = step_->integral * Lanes{ramp};
        std::size_t sines = 0;
        sines_.resize(static_cast<std::size_t>(input.size() / 2));
        sines_of_first_ = 0;
        for (int q = 0; q < input.size(); q += 2) {
            const InputBasis& basis = input.basis(q);
            const Response& response = responses[q / 2];
            const double* weights = input.weights() + q;
            if (basis.kind == InputBasis::cosine) {
                if (basis.input == 0) ++sines_of_first_;
                Turning& t = sines_[sines++];  // in place, for the sake of speed
                t.sine_cosine = Pack<2>::load(weights);
                t.turn = turns[q / 2];
                t.by_sine = step_->integral * rates.input_column[basis.input] + response.of(0);
                t.by_cosine = response.of(1);
            } else {
                forced_ = forced_ + response * weights;
            }
        }
        sines_.resize(sines);
    }

    // Where the cursor stood and n - 1 steps on from there.
    void run(int n, Instants& to) {
        Lanes x = load(x_), forced = forced_;
        for (int k = 0;; ++k) {
            std::array<double, n_inputs> u = linear_;
            for (std::size_t q = 0; q < sines_of_first_; ++q) u[0] += sines_[q].sine_cosine[0];
            for (std::size_t q = sines_of_first_; q < sines_.size(); ++q) u[1] += sines_[q].sine_cosine[0];
            to.set(k, x, u);
            if (k + 1 == n) {
                x.store(x_.data());
                return;
            }
            Lanes driven = forced;
            for (Turning& t : sines_) {
                driven = driven + (t.sine_cosine[0] * t.by_sine + t.sine_cosine[1] * t.by_cosine);
                t.sine_cosine = t.turn * t.sine_cosine;
            }
            const Lanes own{step_->change * x.coupled, (turning_ * x.coupled).sum()};
            x = own + (x + driven);  // so that one sum less waits for the step before
            forced = forced + growth_;
            for (int i = 0; i < n_inputs; ++i) linear_[i] += increase_[i];
        }
    }
    // At the last of them.
    const State& x() const { return x_; }

 private:
    struct Turning {
        Pack<2> sine_cosine;  // the sine itself, and its derivative over omega
        Turn turn;
        Lanes by_sine, by_cosine;
    };

    const Step* step_ = nullptr;
    Coupled turning_;  // the row of the load angle in exp(A h) - 1
    State x_{};
    Lanes forced_, growth_;
    std::array<double, n_inputs> linear_{}, increase_{};
    std::vector<Turning> sines_;  // those of the first input before those of the second
    std::size_t sines_of_first_ = 0;
};

}  // namespace lostmotion
