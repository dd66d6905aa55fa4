// Values and time derivatives of linear forms along the flow of one regime.
#pragma once

#include <cmath>
#include <utility>

#include "../elements/row.hpp"
#include "../kernel/flow.hpp"

namespace lostmotion::model {

// All that a regime's equations depend on at one instant. The kernel's is the same with its own dimensions.
struct Instant {
    double time = 0.0;  // [s]
    Few<double, 20> x;
    Few<double, 12> memory;
    std::array<Few<double, 8>, n_derivatives> input;  // [k]: k-th derivatives
    Few<double, 8> input_magnitudes;
};

// Added up as the kernel does: the constants, the inputs, the coupled states in fours, the angles.
template <class Sizes, class F, class Now>
double evaluate(const Sizes& n, const F& f, const Now& now) {
    double constant = f.c[n.one], input = 0.0, state = 0.0;
    for (int k = 0; k < n.memory; ++k) constant += f.c[n.first_memory + k] * now.memory[k];
    for (int k = 0; k < n.inputs; ++k) input += f.c[n.first_input + k] * now.input[0][k];
    for (int k = 0; k < n.coupled; k += 4) {
        double part[4] = {};
        for (int j = k; j < n.coupled && j < k + 4; ++j) part[j - k] = f.c[j] * now.x[j];
        state += (part[0] + part[1]) + (part[2] + part[3]);
    }
    for (int k = n.coupled; k < n.states; ++k) state += f.c[k] * now.x[k];
    return (constant + input) + state;
}
// Sum of the magnitudes of the terms, with those of the inputs' parts.
template <class Sizes, class F, class Now>
double magnitude(const Sizes& n, const F& f, const Now& now) {
    double sum = std::fabs(f.c[n.one]);
    for (int k = 0; k < n.memory; ++k) sum += std::fabs(f.c[n.first_memory + k] * now.memory[k]);
    for (int k = 0; k < n.inputs; ++k)
        sum += std::fabs(f.c[n.first_input + k]) * std::fmax(std::fabs(now.input[0][k]), now.input_magnitudes[k]);
    for (int k = 0; k < n.states; ++k) sum += std::fabs(f.c[k] * now.x[k]);
    return sum;
}

// The same in the places of the kernel for trains of any size.
template <class Now>
double evaluate(const Any&, const AnyForm& f, const Now& now) {
    return lostmotion::evaluate<Any>(f, now.x, now.memory, now.input[0]);
}
template <class Now>
double magnitude(const Any&, const AnyForm& f, const Now& now) {
    double sum = 0.0;
    f.each_term([&](int place, double factor) {
        if (place < Any::states)
            sum += std::fabs(factor * now.x[place]);
        else if (place == Any::one)
            sum += std::fabs(factor);
        else if (place < Any::first_input)
            sum += std::fabs(factor * now.memory[place - Any::first_memory]);
        else
            sum += std::fabs(factor) * std::fmax(std::fabs(now.input[0][place - Any::first_input]),
                                                 now.input_magnitudes[place - Any::first_input]);
    });
    return sum;
}

// Calls use(place, factor) for each state of a form, use(number, factor) for each of its inputs.
template <class Sizes, class F, class Use>
void each_state_of(const Sizes& n, const F& f, Use&& use) {
    for (int k = 0; k < n.states; ++k) use(k, f.c[k]);
}
template <class Sizes, class F, class Use>
void each_input_of(const Sizes& n, const F& f, Use&& use) {
    for (int k = 0; k < n.inputs; ++k) use(k, f.c[n.first_input + k]);
}
template <class Use>
void each_state_of(const Any&, const AnyForm& f, Use&& use) {
    lostmotion::each_state_of<Any>(f, use);
}
template <class Use>
void each_input_of(const Any&, const AnyForm& f, Use&& use) {
    lostmotion::each_input_of<Any>(f, use);
}

// Time derivatives along the flow of one regime, computed as far as they are asked for: the kernel's Flow for forms of
// a run-time layout.
template <class Sizes, class Regime, class Now>
class RowFlow {
 public:
    RowFlow(const Sizes& sizes, const Regime& regime, const Now& now) : n_(sizes), regime_(regime), now_(now) {}

    double noise(double size, double rate) const {
        return rounding * size + time_rounding * std::fabs(now_.time * rate);
    }
    // Value of the k-th derivative of a form, k > 0, and the sum of the magnitudes of its terms.
    template <class F>
    double rate(const F& f, int k) {
        return derivative(f, k).first;
    }
    template <class F>
    double rate_magnitude(const F& f, int k) {
        return derivative(f, k).second;
    }

 private:
    template <class F>
    std::pair<double, double> derivative(const F& f, int k) {
        while (order_ < k) extend();
        double sum = 0.0, size = 0.0;
        for (int i = 0; i < n_.inputs; ++i) {
            sum += f.c[n_.first_input + i] * now_.input[k][i];
            size += std::fabs(f.c[n_.first_input + i] * now_.input[k][i]);
        }
        for (int j = 0; j < n_.states; ++j) {
            sum += f.c[j] * x_[k][j];
            size += std::fabs(f.c[j]) * size_[k][j];
        }
        return {sum, size};
    }
    void extend() {
        const int k = order_++;
        for (int r = 0; r < n_.states; ++r) {
            const auto& f = regime_.rate[r];
            if (k == 0) {
                x_[1][r] = evaluate(n_, f, now_);
                size_[1][r] = magnitude(n_, f, now_);
                continue;
            }
            const auto [value, size] = derivative(f, k);
            x_[k + 1][r] = value;
            size_[k + 1][r] = size;
        }
    }

    const Sizes& n_;
    const Regime& regime_;
    const Now& now_;
    int order_ = 0;
    std::array<Few<double, 20>, n_derivatives + 1> x_, size_;  // as far as they are known
};

}  // namespace lostmotion::model
