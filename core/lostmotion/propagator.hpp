// Exact propagation within one regime.
//
// Over an interval s from an anchor instant,
//     x(s) = x + G(s) x' + sum_q w_q y_q(s),     G(s) = integral of exp(A r) dr from 0 to s,
// where x' is the rate at the anchor and y_q is the response from rest to the q-th function by which the inputs
// depart from their anchor values (a ramp, cos - 1, sin). G and y_q come from their Taylor series over a short base
// interval and are doubled as often as needed:
//     E(2h) = 2 E(h) + E(h) E(h),   G(2h) = 2 G(h) + E(h) G(h),   E = exp(A h) - 1.
// It is E that is doubled, not the exponential: so slow motions keep their relative accuracy beside fast ones, and a
// state at rest stays at rest to the last bit.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "regime.hpp"
#include "signal.hpp"

namespace lostmotion {

// Column-major, with padded columns.
struct Matrix {
    std::array<State, n_states> column{};

    State operator*(const State& v) const {
        State out{};
        for (int c = 0; c < n_states; ++c)
            for (int r = 0; r < lanes; ++r) out[r] += column[c][r] * v[c];
        return out;
    }
    friend Matrix operator+(Matrix a, const Matrix& b) {
        for (int c = 0; c < n_states; ++c)
            for (int r = 0; r < lanes; ++r) a.column[c][r] += b.column[c][r];
        return a;
    }
    friend Matrix operator*(const Matrix& a, const Matrix& b) {
        Matrix out;
        for (int c = 0; c < n_states; ++c) out.column[c] = a * b.column[c];
        return out;
    }
};

inline void add_scaled(State& y, double a, const State& x) {
    for (int r = 0; r < lanes; ++r) y[r] += a * x[r];
}

// Everything needed to step by one length in one regime.
struct Step {
    double length = 0.0;  // [s]
    Matrix change;        // E(h) = exp(A h) - 1
    Matrix integral;      // G(h)
    Matrix growth;        // bound on |exp(A s)|, element by element, for 0 <= s <= h
};

class Propagator {
 public:
    static constexpr int max_levels = 40;
    static constexpr int usual_levels = 12;
    static constexpr double base_norm = 0.125;  // |A| h of the base interval, in scaled units

    // unit: a length [s] of which some power-of-two multiple or fraction is the base interval.
    // scale: natural sizes of the states; only for choosing the base interval.
    void prepare(const Regime& regime, double unit, const State& scale, const std::vector<InputBasis>& basis) {
        n_basis_ = static_cast<int>(basis.size());
        basis_ = &basis;
        for (int c = 0; c < n_states; ++c)
            for (int r = 0; r < n_states; ++r) rate_.column[c][r] = regime.rate[r].c[c];
        for (int i = 0; i < n_inputs; ++i)
            for (int r = 0; r < n_states; ++r) input_column_[i][r] = regime.rate[r].c[first_input + i];
        norm_ = 0.0;
        for (int r = 0; r < n_states; ++r) {
            double sum = 0.0;
            for (int c = 0; c < n_states; ++c) sum += std::fabs(rate_.column[c][r]) * scale[c] / scale[r];
            norm_ = std::fmax(norm_, sum);
        }
        fastest_input_ = 0.0;
        for (const InputBasis& b : basis) fastest_input_ = std::fmax(fastest_input_, b.omega);
        norm_ = std::fmax(norm_, fastest_input_);
        double h = unit;
        while (norm_ * h > base_norm) h *= 0.5;
        steps_.clear();
        responses_.clear();
        rotations_.clear();
        steps_.reserve(usual_levels);
        responses_.reserve(usual_levels * basis.size());
        add_base(h);
    }

    bool ready() const { return !steps_.empty(); }
    void reset() { steps_.clear(); }

    const State& input_column(int i) const { return input_column_[i]; }

    State rate(const State& x, const State& constant, const std::array<double, n_inputs>& u) const {
        State out = rate_ * x;
        for (int r = 0; r < lanes; ++r) out[r] += constant[r] + input_column_[0][r] * u[0] + input_column_[1][r] * u[1];
        return out;
    }
    // The next time derivative of the state from one that is at least the first.
    State higher_rate(const State& derivative, const std::array<double, n_inputs>& u) const {
        State out = rate_ * derivative;
        for (int r = 0; r < lanes; ++r) out[r] += input_column_[0][r] * u[0] + input_column_[1][r] * u[1];
        return out;
    }

    const Step& level(int k) {
        while (static_cast<int>(steps_.size()) <= k) add_doubled();
        return steps_[k];
    }
    const State* responses(int k) const { return responses_.data() + static_cast<std::size_t>(k) * n_basis_; }
    const double* rotations(int k) const { return rotations_.data() + static_cast<std::size_t>(k) * n_basis_; }

    // The highest level not longer than s (level 0 even if it is longer). Computes no level.
    int level_below(double s) const {
        const double base = steps_[0].length, longest = fastest_input_ > 0.0 ? std::min(s, 1.0 / fastest_input_) : s;
        int k = longest > base ? std::min(std::ilogb(longest / base), max_levels - 1) : 0;
        while (k > 0 && std::ldexp(base, k) > longest) --k;  // the quotient may have been rounded up
        return k;
    }
    // Whether twice the level is a step within s. Steps stay below a sixth of the fastest input period: the doubling
    // formula of a sine loses accuracy beyond it.
    bool can_double(int k, double s) const {
        const double next = 2.0 * steps_[k].length;
        return k + 1 < max_levels && next <= s && next * fastest_input_ <= 1.0;
    }

    // x after the step of level k; `rate` is x' at the anchor, `weights` the input state there.
    State step(int k, const State& x, const State& rate, const std::vector<double>& weights) {
        const Step& s = level(k);
        State y = s.integral * rate;
        const State* response = responses(k);
        for (int q = 0; q < n_basis_; ++q) add_scaled(y, weights[q], response[q]);
        for (int r = 0; r < lanes; ++r) y[r] += x[r];
        return y;
    }

    // G(h) for any length: whole levels from the longest down, then the Taylor series.
    Matrix integral(double h) {
        Matrix sum;
        const auto append = [&sum](const Matrix& change, const Matrix& integral) {
            sum = sum + change * sum + integral;  // G(s + h) = G(h) + exp(A h) G(s)
        };
        for (int k = level_below(h); k >= 0; --k)
            for (const double length = level(k).length; h >= length; h -= length)
                append(steps_[k].change, steps_[k].integral);
        if (h > 0.0) {
            const Matrix rest = integral_series(h);
            append(rate_ * rest, rest);
        }
        return sum;
    }

    // Taylor series over at most one base interval, forward or backward.
    State series(double s, const State& x, const State& rate, const InputState& input) const {
        double left = norm_ * std::fabs(s);  // bound on the relative size of what follows
        int terms = 1;
        while (left >= 1e-19 && terms < series_terms) left *= norm_ * std::fabs(s) / ++terms;
        return terms < n_derivatives ? series<n_derivatives>(terms, s, x, rate, input)
                                     : series<series_terms + 1>(terms, s, x, rate, input);
    }

 private:
    static constexpr int series_terms = 12;  // 0.125^13/13! < 1e-21

    template <int N>
    State series(int terms, double s, const State& x, const State& rate, const InputState& input) const {
        const auto u = input.jet<N>();
        State term = rate, sum = x;
        double power = s;
        for (int k = 1;; ++k) {
            add_scaled(sum, power, term);
            if (k == terms) return sum;
            term = rate_ * term;
            for (int i = 0; i < n_inputs; ++i)
                if (u[k][i] != 0.0) add_scaled(term, u[k][i], input_column_[i]);
            power *= s / (k + 1);
        }
    }

    // G over at most one base interval.
    Matrix integral_series(double h) const {
        Matrix term, sum;
        for (int c = 0; c < n_states; ++c) term.column[c][c] = h;
        for (int k = 1; k <= series_terms; ++k) {
            for (int c = 0; c < n_states; ++c) add_scaled(sum.column[c], 1.0, term.column[c]);
            term = rate_ * term;
            for (int c = 0; c < n_states; ++c)
                for (double& v : term.column[c]) v *= h / (k + 1);
        }
        return sum;
    }

    void add_base(double h) {
        Step& s = steps_.emplace_back();
        s.length = h;
        s.integral = integral_series(h);
        Matrix positive;
        for (int c = 0; c < n_states; ++c) {
            for (int r = 0; r < n_states; ++r) {
                const double a = rate_.column[c][r];
                positive.column[c][r] = h * (r == c ? std::fmax(a, 0.0) : std::fabs(a));
            }
            s.growth.column[c][c] = 1.0;
        }
        Matrix bound = s.growth;
        for (int k = 1; k <= 8; ++k) {
            bound = positive * bound;
            for (int c = 0; c < n_states; ++c) {
                for (double& v : bound.column[c]) v /= k;
                add_scaled(s.growth.column[c], 1.0, bound.column[c]);
            }
        }
        s.change = rate_ * s.integral;
        for (int q = 0; q < n_basis_; ++q) {
            const InputBasis& b = (*basis_)[q];
            // y' = A y + b r(s), r = s, cos(omega s) - 1 or sin(omega s), by the series of r.
            State y{}, coefficient{};
            double r = b.kind == InputBasis::cosine ? -b.omega * b.omega : b.kind == InputBasis::sine ? b.omega : 1.0;
            const int first = b.kind == InputBasis::cosine ? 2 : 1;
            double power = h;
            for (int k = 0; k < series_terms; ++k) {
                // coefficient: k-th derivative of y at 0; the next is A times it plus b times the derivative of r.
                coefficient = rate_ * coefficient;
                if (k == first || (b.kind != InputBasis::ramp && k > first && (k - first) % 2 == 0)) {
                    if (k > first) r *= -b.omega * b.omega;
                    add_scaled(coefficient, r, input_column_[b.input]);
                }
                add_scaled(y, power, coefficient);
                power *= h / (k + 2);
            }
            responses_.push_back(y);
        }
        add_rotations(h);
    }

    void add_doubled() {
        const int k = static_cast<int>(steps_.size()) - 1;
        steps_.emplace_back();
        const Step& a = steps_[k];
        Step& b = steps_[k + 1];
        b.length = 2.0 * a.length;
        b.change = a.change * a.change;
        b.integral = a.change * a.integral;
        for (int c = 0; c < n_states; ++c) {
            add_scaled(b.change.column[c], 2.0, a.change.column[c]);
            add_scaled(b.integral.column[c], 2.0, a.integral.column[c]);
        }
        // |exp(A (h + s))| <= |exp(A s)| |exp(A h)|, of which the second is known.
        Matrix size;
        for (int c = 0; c < n_states; ++c)
            for (int r = 0; r < n_states; ++r)
                size.column[c][r] = std::fabs(a.change.column[c][r] + (r == c ? 1.0 : 0.0));
        b.growth = a.growth * size;
        for (int c = 0; c < n_states; ++c)
            for (int r = 0; r < n_states; ++r)
                b.growth.column[c][r] = std::max(b.growth.column[c][r], a.growth.column[c][r]);
        responses_.resize(responses_.size() + n_basis_);
        const State* from = responses(k);
        for (int q = 0; q < n_basis_; ++q) {
            const InputBasis& basis = (*basis_)[q];
            State y = a.change * from[q];
            add_scaled(y, 1.0, from[q]);
            const State constant = a.integral * input_column_[basis.input];
            if (basis.kind == InputBasis::ramp) {
                add_scaled(y, 1.0, from[q]);
                add_scaled(y, a.length, constant);
            } else {
                const int cosine = basis.kind == InputBasis::cosine ? q : q - 1, sine = cosine + 1;
                const double c = rotations(k)[cosine], s = rotations(k)[sine];
                const double half = std::sin(0.5 * basis.omega * a.length);
                if (basis.kind == InputBasis::cosine) {
                    add_scaled(y, c, from[cosine]);
                    add_scaled(y, -s, from[sine]);
                    add_scaled(y, -2.0 * half * half, constant);
                } else {
                    add_scaled(y, s, from[cosine]);
                    add_scaled(y, c, from[sine]);
                    add_scaled(y, s, constant);
                }
            }
            responses_[static_cast<std::size_t>(k + 1) * n_basis_ + q] = y;
        }
        add_rotations(b.length);
    }

    void add_rotations(double h) {
        for (const InputBasis& b : *basis_)
            rotations_.push_back(b.kind == InputBasis::sine ? std::sin(b.omega * h) : std::cos(b.omega * h));
    }

    Matrix rate_;
    std::array<State, n_inputs> input_column_{};
    double norm_ = 0.0;           // of A in scaled units, or the highest input frequency [1/s]
    double fastest_input_ = 0.0;  // [rad/s]
    int n_basis_ = 0;
    const std::vector<InputBasis>* basis_ = nullptr;
    std::vector<Step> steps_;        // one a level
    std::vector<State> responses_;   // levels x n_basis
    std::vector<double> rotations_;  // levels x n_basis: cos and sin of omega * length
};

}  // namespace lostmotion
