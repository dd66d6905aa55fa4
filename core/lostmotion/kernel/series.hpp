// The motion of a large train over one step by its Taylor series, without a matrix: docs/theory.md, "Large trains".
//
// With the rate x' at an instant, c_1 = x' h, and
//     c_{k+1} = h/(k + 1) (A c_k + B u^(k) h^k/k!),     x(h) = x + sum_k c_k.
// A is sparse, so that a term costs as much as the train has elements. In scaled units |c_{k+1}| <= theta/(k + 1) times
// the larger of |c_k| and what the inputs bring, theta = |A| h, and what is left out after K terms is at most
// |c_1| theta^K/(K + 1)! 1/(1 - theta/(K + 2)).
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "inputs.hpp"
#include "rates.hpp"

namespace lostmotion {

class Series {
 public:
    using Lanes = LanesOf<Any>;
    // The longest step: beyond it, terms that cancel grow above the motion.
    static constexpr double longest = 4.0;  // theta
    static constexpr int most_terms = 34;

    // So many that what is left out is below 2^-60 |c_1|.
    static int terms(double theta) {
        double term = 0.5 * theta;
        int k = 1;
        for (; k < most_terms && term * (k + 2) > 0x1p-60 * (k + 2 - theta); ++k) term *= theta / (k + 2);
        return k;
    }

    // From an instant with this rate and these inputs, over h. theta: at least |A| h, in scaled units.
    void expand(const LinearRatesOf<Any>& rates, const Lanes& rate, const InputState<Any>& input, double h,
                double theta) {
        begin(rates, rate, h, theta);
        see_inputs(input);
        add_terms();
    }
    // The same under constant inputs.
    void expand(const LinearRatesOf<Any>& rates, const Lanes& rate, double h, double theta) {
        begin(rates, rate, h, theta);
        varying_.clear();
        add_terms();
    }

    // By how much the state changes over the step; the small terms first.
    Lanes change() const {
        Lanes out;
        out.coupled = sum([](int) { return 1.0; });
        for (int j = 0; j < rates_->n.angles; ++j) {
            const int speed = rates_->angle_speed[j];
            double turned = 0.0;
            for (int k = count_; k >= 1; --k) turned += term(k)[speed] / (k + 1);
            out.angle[j] = h_ * (angle_rate_[j] + rates_->angle_coefficient[j] * turned);
        }
        return out;
    }
    // By how much the rate of the coupled states does.
    Numbers rate_change() const {
        return sum([this](int k) { return k > 1 ? k / h_ : 0.0; });
    }
    // Bound on |exp(A s)| times these magnitudes for 0 <= s <= h, |A| h <= theta.
    static Numbers exponential_bound(const LinearRatesOf<Any>& rates, const Numbers& magnitudes, double h,
                                     double theta) {
        Numbers sum = magnitudes, last;
        sum.reach(rates.n.coupled);
        last = sum;
        for (int k = 1, count = terms(theta); k <= count; ++k) {
            last = h / k * rates.sparse().product(last, true);
            sum = sum + last;
        }
        return sum;
    }
    // Bound on their fourth derivatives all through the step.
    Numbers fourth_bound() const {
        const double h4 = h_ * h_ * h_ * h_;
        return sum([h4](int k) { return k * (k - 1.0) * (k - 2.0) * (k - 3.0) / h4; }, 4,
                   [](const Pack<4>& c) ALWAYS_INLINE { return absolute(c); });
    }

 private:
    struct Varying {
        int input;
        std::array<double, most_terms + 1> derivative;  // [k]: the k-th, times h^k/k!
    };

    void begin(const LinearRatesOf<Any>& rates, const Lanes& rate, double h, double theta) {
        n_ = (static_cast<std::size_t>(rates.n.coupled) + 3) / 4 * 4;
        h_ = h;
        count_ = terms(theta);
        rates_ = &rates;
        angle_rate_ = rate.angle;
        c_.resize(SparseRates::slack + stride() * static_cast<std::size_t>(count_));
        each_four([&](std::size_t j)
                      ALWAYS_INLINE { (h * rate.coupled.four(static_cast<int>(j))).store(term(1) + j); });
    }
    void add_terms() {
        for (int k = 1; k < count_; ++k) {
            const double* from = term(k);
            double* to = term(k + 1);
            const double factor = h_ / (k + 1);
            rates_->sparse().multiply(from, to);
            for (const Varying& v : varying_) {
                const double u = v.derivative[static_cast<std::size_t>(k)];
                for (const auto& [row, share] : rates_->sparse().of_input[static_cast<std::size_t>(v.input)])
                    to[row] += share * u;
            }
            each_four([&](std::size_t j) ALWAYS_INLINE { (factor * Pack<4>::load(to + j)).store(to + j); });
        }
    }

    // Each term has the slack that the product with A needs, which it shares with its neighbours.
    std::size_t stride() const { return n_ + SparseRates::slack; }
    std::size_t place(int k) const { return SparseRates::slack + static_cast<std::size_t>(k - 1) * stride(); }
    double* term(int k) { return c_.data() + place(k); }
    const double* term(int k) const { return c_.data() + place(k); }
    // sum_k factor(k) of(c_k), down to the term `last`.
    template <class Factor, class Of = std::identity>
    Numbers sum(Factor&& factor, int last = 1, Of&& of = {}) const {
        Numbers out = Numbers::zeros(static_cast<int>(n_));
        double* to = out.data();
        for (int k = count_; k >= last; --k) {
            const double* c = term(k);
            const double f = factor(k);
            each_four([&](std::size_t j)
                          ALWAYS_INLINE { (Pack<4>::load(to + j) + f * of(Pack<4>::load(c + j))).store(to + j); });
        }
        return out;
    }
    template <class Use>
    [[gnu::always_inline]] void each_four(Use&& use) const {
        for (std::size_t j = 0; j < n_; j += 4) use(j);
    }
    void see_inputs(const InputState<Any>& input) {
        std::size_t used = 0;
        for (int i = 0; i < rates_->depends_on.inputs; ++i) {
            if (!input.varies(i)) continue;
            if (used == varying_.size()) varying_.emplace_back();
            Varying& v = varying_[used++];
            v.input = i;
            input.derivatives(i, count_, v.derivative.data());
            double factor = 1.0;
            for (int k = 1; k <= count_; ++k) v.derivative[static_cast<std::size_t>(k)] *= factor *= h_ / k;
        }
        varying_.resize(used);
    }

    std::size_t n_ = 0;  // states, in whole fours
    double h_ = 0.0;
    int count_ = 0;
    const LinearRatesOf<Any>* rates_ = nullptr;
    AnglesOf<Any> angle_rate_;
    std::vector<double> c_;  // term by term
    std::vector<Varying> varying_;
};

}  // namespace lostmotion
