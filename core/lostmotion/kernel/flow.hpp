// Time derivatives of linear forms at an instant, along the flow of one regime.
#pragma once

#include "../base/sign.hpp"
#include "rates.hpp"

namespace lostmotion {

// Time derivatives of the state along the flow of one regime, computed as far as they are asked for.
template <class D>
class Flow {
 public:
    using State = StateOf<D>;
    using LinearRates = LinearRatesOf<D>;
    using Instant = InstantOf<D>;

    Flow(const LinearRates& rates, const Instant& now) : rates_(rates), now_(now) {}

    // What counts as zero: rounding of the terms, and since the instant itself is known to its rounding only, a value
    // may be off by that times its rate.
    double noise(double magnitude, double rate) const {
        return rounding * magnitude + time_rounding * std::fabs(now_.time * rate);
    }
    // Value of the k-th derivative of a form, k > 0, and the sum of the magnitudes of its terms.
    [[gnu::always_inline]] double rate(const LinearForm& f, int k) {
        return evaluate_rate<D>(f, derivative(k), now_.input[k]);
    }
    double rate_magnitude(const LinearForm& f, int k) {
        const State& terms = magnitude(k);
        const auto& u = now_.input[k];
        double sum = 0.0;
        for (const auto& [i, c] : f.of_inputs()) sum += std::fabs(c * u[i]);
        each_state_of<D>(f, [&](int j, double c) ALWAYS_INLINE { sum += std::fabs(c) * terms[j]; });
        return sum;
    }

 private:
    [[gnu::always_inline]] const State& derivative(int k) {
        if (order_ == 0) {
            x_[1] = rates_(now_.x, rates_.constant(now_.memory), now_.input[0]);
            order_ = 1;
        }
        for (; order_ < k; ++order_) x_[order_ + 1] = rates_.higher(x_[order_], now_.input[order_]);
        return x_[k];
    }
    const State& magnitude(int k) {
        if (n_magnitudes_ == 0) {
            magnitude_[1] = rates_.magnitude(magnitudes(now_.x), magnitudes(now_.memory), now_.input_magnitudes);
            n_magnitudes_ = 1;
        }
        for (; n_magnitudes_ < k; ++n_magnitudes_)
            magnitude_[n_magnitudes_ + 1] =
                rates_.higher_magnitude(magnitude_[n_magnitudes_], magnitudes(now_.input[n_magnitudes_]));
        return magnitude_[k];
    }

    const LinearRates& rates_;
    const Instant& now_;
    int order_ = 0, n_magnitudes_ = 0;
    std::array<State, n_derivatives + 1> x_, magnitude_;  // as far as they are known
};

}  // namespace lostmotion
