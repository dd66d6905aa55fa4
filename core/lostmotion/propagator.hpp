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
#include <cassert>
#include <cmath>
#include <vector>

#include "regime.hpp"
#include "signal.hpp"

namespace lostmotion {

// Pairs of numbers that are reckoned with at once. A state is three of them, and is always written as that: a pair that
// is read in one piece after it was written in two halts the processor.
typedef double Pair __attribute__((vector_size(16)));

inline Pair load(const double* from) {
    Pair p;
    __builtin_memcpy(&p, from, sizeof p);
    return p;
}
inline void store(Pair p, double* to) { __builtin_memcpy(to, &p, sizeof p); }

// A linear map of the states. The first four are coupled; the load angle follows the load speed and nothing depends on
// it, so its column is zero but for its own entry.
struct Matrix {
    static constexpr int coupled = 4;
    using Column = std::array<double, coupled>;

    std::array<Column, coupled> column{};
    Column angle{};          // row of the load angle
    double angle_own = 0.0;  // its own entry

    static Matrix diagonal(double value) {
        Matrix m;
        for (int k = 0; k < coupled; ++k) m.column[k][k] = value;
        m.angle_own = value;
        return m;
    }

    State operator*(const State& v) const {
        State out;
        for (const int r : {0, 2}) store(rows(r, v.data()), &out[r]);
        const double of_angle =
            (((angle[0] * v[0] + angle[1] * v[1]) + angle[2] * v[2]) + angle[3] * v[3]) + angle_own * v[coupled];
        store(Pair{of_angle, 0.0}, &out[coupled]);
        return out;
    }
    double operator()(int row, int col) const {
        if (row < coupled) return col < coupled ? column[col][row] : 0.0;
        return col < coupled ? angle[col] : angle_own;
    }
    // Rows r and r + 1 of the product with four numbers.
    Pair rows(int r, const double* v) const {
        return ((load(&column[0][r]) * v[0] + load(&column[1][r]) * v[1]) + load(&column[2][r]) * v[2]) +
               load(&column[3][r]) * v[3];
    }
    // factor * other, entry by entry
    void add(double factor, const Matrix& other) {
        for (int c = 0; c < coupled; ++c) {
            for (int r = 0; r < coupled; ++r) column[c][r] += factor * other.column[c][r];
            angle[c] += factor * other.angle[c];
        }
        angle_own += factor * other.angle_own;
    }
    void scale(double factor) {
        for (Column& c : column)
            for (double& v : c) v *= factor;
        for (double& v : angle) v *= factor;
        angle_own *= factor;
    }
    // f(own entry, that of the other), entry by entry
    template <class F>
    void combine(const Matrix& other, F&& f) {
        for (int c = 0; c < coupled; ++c) {
            for (int r = 0; r < coupled; ++r) column[c][r] = f(column[c][r], other.column[c][r]);
            angle[c] = f(angle[c], other.angle[c]);
        }
        angle_own = f(angle_own, other.angle_own);
    }
    friend Matrix operator*(const Matrix& a, const Matrix& b) {
        Matrix out;
        for (int c = 0; c < coupled; ++c) {
            const Column& v = b.column[c];
            for (const int r : {0, 2}) store(a.rows(r, v.data()), &out.column[c][r]);
            out.angle[c] = (((a.angle[0] * v[0] + a.angle[1] * v[1]) + a.angle[2] * v[2]) + a.angle[3] * v[3]) +
                           a.angle_own * b.angle[c];
        }
        out.angle_own = a.angle_own * b.angle_own;
        return out;
    }
};

inline void add_scaled(State& y, double a, const State& x) {
    for (const int r : {0, 2, 4}) store(load(&y[r]) + a * load(&x[r]), &y[r]);
}

// dx/dt = A x + constant + B u of one regime, as arrays. No rate may depend on the load angle.
struct LinearRates {
    Matrix rate;
    std::array<State, n_inputs> input_column{};

    LinearRates() = default;
    explicit LinearRates(const Regime& regime) {
        for (int r = 0; r < n_states; ++r) {
            const LinearForm& f = regime.rate[r];
            assert(f.c[load_angle] == 0.0);
            for (int c = 0; c < Matrix::coupled; ++c)
                (r < Matrix::coupled ? rate.column[c][r] : rate.angle[c]) = f.c[c];
            for (int i = 0; i < n_inputs; ++i) input_column[i][r] = f.c[first_input + i];
        }
    }
    State operator()(const State& x, const State& constant, const std::array<double, n_inputs>& u) const {
        State out = rate * x;
        for (int r = 0; r < lanes; ++r) out[r] += constant[r] + input_column[0][r] * u[0] + input_column[1][r] * u[1];
        return out;
    }
    // The next time derivative of the state from one that is at least the first.
    State higher(const State& derivative, const std::array<double, n_inputs>& u) const {
        State out = rate * derivative;
        for (int r = 0; r < lanes; ++r) out[r] += input_column[0][r] * u[0] + input_column[1][r] * u[1];
        return out;
    }
};

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
        linear_ = LinearRates(regime);
        norm_ = 0.0;
        for (int r = 0; r < n_states; ++r) {
            double sum = 0.0;
            for (int c = 0; c < n_states; ++c) sum += std::fabs(regime.rate[r].c[c]) * scale[c] / scale[r];
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

    const State& input_column(int i) const { return linear_.input_column[i]; }
    State rate(const State& x, const State& constant, const std::array<double, n_inputs>& u) const {
        return linear_(x, constant, u);
    }
    State higher_rate(const State& derivative, const std::array<double, n_inputs>& u) const {
        return linear_.higher(derivative, u);
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
            sum.add(1.0, change * sum);  // G(s + h) = G(h) + exp(A h) G(s)
            sum.add(1.0, integral);
        };
        for (int k = level_below(h); k >= 0; --k)
            for (const double length = level(k).length; h >= length; h -= length)
                append(steps_[k].change, steps_[k].integral);
        if (h > 0.0) {
            const Matrix rest = integral_series(h);
            append(linear_.rate * rest, rest);
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
            term = linear_.rate * term;
            for (int i = 0; i < n_inputs; ++i)
                if (u[k][i] != 0.0) add_scaled(term, u[k][i], linear_.input_column[i]);
            power *= s / (k + 1);
        }
    }

    // G over at most one base interval.
    Matrix integral_series(double h) const {
        Matrix term = Matrix::diagonal(h), sum;
        for (int k = 1; k <= series_terms; ++k) {
            sum.add(1.0, term);
            term = linear_.rate * term;
            term.scale(h / (k + 1));
        }
        return sum;
    }

    void add_base(double h) {
        Step& s = steps_.emplace_back();
        s.length = h;
        s.integral = integral_series(h);
        s.change = linear_.rate * s.integral;
        // |exp(A s)| from the powers of a matrix without negative entries beside its diagonal.
        Matrix positive = linear_.rate;
        positive.combine(Matrix{}, [h](double a, double) { return h * std::fabs(a); });
        for (int k = 0; k < Matrix::coupled; ++k) positive.column[k][k] = h * std::fmax(linear_.rate.column[k][k], 0.0);
        s.growth = Matrix::diagonal(1.0);
        Matrix bound = s.growth;
        for (int k = 1; k <= 8; ++k) {
            bound = positive * bound;
            bound.scale(1.0 / k);
            s.growth.add(1.0, bound);
        }
        for (int q = 0; q < n_basis_; ++q) {
            const InputBasis& b = (*basis_)[q];
            // y' = A y + b r(s), r = s, cos(omega s) - 1 or sin(omega s), by the series of r.
            State y{}, coefficient{};
            double r = b.kind == InputBasis::cosine ? -b.omega * b.omega : b.kind == InputBasis::sine ? b.omega : 1.0;
            const int first = b.kind == InputBasis::cosine ? 2 : 1;
            double power = h;
            for (int k = 0; k < series_terms; ++k) {
                // coefficient: k-th derivative of y at 0; the next is A times it plus b times the derivative of r.
                coefficient = linear_.rate * coefficient;
                if (k == first || (b.kind != InputBasis::ramp && k > first && (k - first) % 2 == 0)) {
                    if (k > first) r *= -b.omega * b.omega;
                    add_scaled(coefficient, r, linear_.input_column[b.input]);
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
        b.change.add(2.0, a.change);
        b.integral = a.change * a.integral;
        b.integral.add(2.0, a.integral);
        // |exp(A (h + s))| <= |exp(A s)| |exp(A h)|, of which the second is known.
        Matrix size = Matrix::diagonal(1.0);
        size.combine(a.change, [](double one, double change) { return std::fabs(one + change); });
        b.growth = a.growth * size;
        b.growth.combine(a.growth, [](double x, double y) { return std::max(x, y); });
        responses_.resize(responses_.size() + n_basis_);
        const State* from = responses(k);
        for (int q = 0; q < n_basis_; ++q) {
            const InputBasis& basis = (*basis_)[q];
            State y = a.change * from[q];
            add_scaled(y, 1.0, from[q]);
            const State constant = a.integral * linear_.input_column[basis.input];
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

    LinearRates linear_;
    double norm_ = 0.0;           // of A in scaled units, or the highest input frequency [1/s]
    double fastest_input_ = 0.0;  // [rad/s]
    int n_basis_ = 0;
    const std::vector<InputBasis>* basis_ = nullptr;
    std::vector<Step> steps_;        // one a level
    std::vector<State> responses_;   // levels x n_basis
    std::vector<double> rotations_;  // levels x n_basis: cos and sin of omega * length
};

}  // namespace lostmotion
