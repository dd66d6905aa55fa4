// Values and signs of linear forms just after an instant, along the flow of one regime.
#pragma once

#include <limits>

#include "rates.hpp"

namespace lostmotion {

// A form counts as zero within this multiple of the sum of the magnitudes of its terms. Its coefficients come from an
// elimination and carry more than one rounding.
inline constexpr double rounding = 0x1p14 * std::numeric_limits<double>::epsilon();
// Rounding of an instant, relative to the time since the start.
inline constexpr double time_rounding = 4.0 * std::numeric_limits<double>::epsilon();

// A guard that is further from zero than this share of its terms, and of what they are at rated load and speed times
// `far_from_event`, is not at zero: the rounding of the instant moves it by less. Near a zero of all its terms, the
// first share alone says nothing.
inline constexpr double clear_of_zero = 1e-3;
inline constexpr double far_from_event = 1e-6;

// Time derivatives of the state along the flow of one regime, computed as far as they are asked for.
template <class D>
class Flow {
 public:
    using State = StateOf<D>;
    using LinearForm = LinearFormOf<D>;
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
        each_input_of<D>(f, [&](int i, double c) ALWAYS_INLINE { sum += std::fabs(c * u[i]); });
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

struct Sign {
    int sign = 0;
    int order = 0;          // of the first derivative that is not zero
    double relative = 0.0;  // to the sum of the magnitudes of its terms
};
// The sign that a form has just after now, from its value and the sum of the magnitudes of its terms: that of the first
// of its derivatives that is not zero. 0 if it stays at zero or, if asked by value alone, is zero now.
template <class F, class Form>
Sign sign_after(F& flow, const Form& form, double value, double size, bool by_value_alone = false) {
    for (int k = 0; k + 1 < n_derivatives; ++k) {
        const double rate = flow.rate(form, k + 1);
        if (std::fabs(value) > flow.noise(size, rate))
            return {value > 0.0 ? +1 : -1, k, size > 0.0 ? value / size : 0.0};
        if (by_value_alone) return {};
        value = rate;
        size = flow.rate_magnitude(form, k + 1);
    }
    return {};
}

}  // namespace lostmotion
