// Taylor series of the motion in one regime about an instant.
//
// From the rate x' and the input state w at that instant the k-th time derivative of the state is
//     A^(k-1) x' + sum_q w_q D_qk,     D_q(k+1) = A D_qk + B r_q^(k),
// where r_q^(k) is the k-th derivative of the q-th function by which the inputs depart from their anchor values.
#pragma once

#include <array>
#include <cassert>
#include <vector>

#include "linear_rates.hpp"
#include "polynomial.hpp"
#include "signal.hpp"

namespace lostmotion {

// What a function of an input brings: as a state, in no more room than it needs.
using Driven = std::array<double, n_states>;

// The series of the state.
class Taylor {
 public:
    static constexpr int terms = Polynomial::degree;  // good for a base interval: 0.25^13/13! < 1e-17

    void prepare(const LinearRates& rates, const InputBasis* basis, int n_basis) {
        rates_ = &rates;
        n_basis_ = n_basis;
        squared_ = rates.rate * rates.rate;
        cubed_ = rates.rate * squared_;
        driven_.clear();
        driven_.reserve(static_cast<std::size_t>(n_basis * terms));
        for (int q = 0; q < n_basis; ++q) {
            Lanes derivative;
            for (int k = 1; k <= terms; ++k) {
                derivative.store(driven_.emplace_back().data());
                derivative =
                    rates.rate * derivative + basis[q].derivative(k) * load(rates.input_column[basis[q].input]);
            }
        }
    }

    const LinearRates& rates() const { return *rates_; }
    int n_basis() const { return n_basis_; }
    // D_qk, k = 1 .. terms
    const Driven& driven(int q, int k) const { return driven_[static_cast<std::size_t>(q * terms + k - 1)]; }

    State fourth_derivative(const State& rate, const double* weights) const {
        Lanes sum = cubed_ * load(rate);
        for (int q = 0; q < n_basis_; ++q) sum = sum + weights[q] * load(driven(q, 4));
        State out;
        sum.store(out.data());
        return out;
    }

    // By how much the state changes over s. In powers of A^3, so that few products wait for one another.
    [[gnu::always_inline]] Lanes change(double s, const State& rate, const double* weights) const {
        const Lanes v = load(rate), v1 = rates_->rate * v, v2 = squared_ * v;
        const double s2 = s * s, s3 = s2 * s;
        Lanes free{}, forced{};
        for (int k = terms - 2; k > 0; k -= 3) {
            const double c0 = s * over_factorial[k], c1 = s2 * over_factorial[k + 1], c2 = s3 * over_factorial[k + 2];
            Lanes inputs{};
            for (int q = 0; q < n_basis_; ++q) {
                const Driven* d = &driven(q, k);
                inputs = inputs + weights[q] * ((c0 * load(d[0]) + c1 * load(d[1])) + c2 * load(d[2]));
            }
            const Lanes own = (c0 * v + c1 * v1) + c2 * v2;
            free = k == terms - 2 ? own : s3 * (cubed_ * free) + own;
            forced = k == terms - 2 ? inputs : s3 * forced + inputs;
        }
        return free + forced;
    }

    // G over at most one base interval.
    Matrix integral(double h) const {
        Matrix one = rates_->rate, two = squared_, three = cubed_;
        one.scale(h);
        two.scale(h * h);
        three.scale(h * h * h);
        Matrix sum = power_series<1>(one, two, three);
        sum.scale(h);
        return sum;
    }
    // The answer from rest to the q-th function after h.
    Driven response(int q, double h) const {
        Lanes sum;
        double power = 1.0;
        for (int k = 1; k <= terms; ++k) {
            power *= h / k;
            sum = sum + power * load(driven(q, k));
        }
        Driven y;
        sum.store(y.data());
        return y;
    }

    // sum_k B^k/(k + shift)!, from the first three powers of B; its norm is at most that of a base interval.
    template <int shift>
    static Matrix power_series(const Matrix& one, const Matrix& two, const Matrix& three) {
        static_assert(terms == 12);
        Matrix sum;
        for (int k = 9; k >= 0; k -= 3) {
            if (k < 9) sum = three * sum;
            sum.add(over_factorial[k + shift], Matrix::identity());
            sum.add(over_factorial[k + 1 + shift], one);
            sum.add(over_factorial[k + 2 + shift], two);
        }
        return sum;
    }

 private:
    static constexpr std::array<double, terms + 1> over_factorial = [] {
        std::array<double, terms + 1> c{};
        double factorial = 1.0;
        for (int k = 0; k <= terms; ++k) {
            if (k > 0) factorial *= k;
            c[static_cast<std::size_t>(k)] = 1.0 / factorial;
        }
        return c;
    }();

    const LinearRates* rates_ = nullptr;
    int n_basis_ = 0;
    Matrix squared_, cubed_;      // A^2, A^3
    std::vector<Driven> driven_;  // n_basis x terms
};

// The Taylor series of a linear form of the motion, in parts of a unit of time: its coefficients are linear in the rate
// and the input state at the instant. The form must not depend on the load angle.
class FormSeries {
 public:
    bool ready() const { return unit_ > 0.0; }
    void reset() { unit_ = 0.0; }

    void prepare(const Taylor& motion, const InputBasis* basis, const LinearForm& form, double unit) {
        assert(form.c[load_angle] == 0.0);
        unit_ = unit;
        n_basis_ = motion.n_basis();
        rows_.resize(static_cast<std::size_t>(n_coupled + n_basis_));
        const Matrix& A = motion.rates().rate;
        Matrix::Column row{};  // of the k-th derivative, on x'
        for (int c = 0; c < n_coupled; ++c) row[c] = form.c[c];
        double power = 1.0;
        for (int k = 1; k <= Taylor::terms; ++k) {
            power *= unit / k;
            for (int c = 0; c < n_coupled; ++c) rows_[c][k - 1] = power * row[c];
            for (int q = 0; q < n_basis_; ++q)
                rows_[n_coupled + q][k - 1] = power * (dot(form, motion.driven(q, k)) +
                                                       form.c[first_input + basis[q].input] * basis[q].derivative(k));
            A.times_row(row).store(row.data());
        }
    }

    double unit() const { return unit_; }  // [s]
    [[gnu::always_inline]] Polynomial at(double value, const State& rate, const double* weights) const {
        Polynomial p(value);
        for (int part = 0; part < Polynomial::parts; ++part) {
            const auto row = [&](int k) { return Pack<4>::load(&rows_[static_cast<std::size_t>(k)][4 * part]); };
            Pack<4> sum = (rate[0] * row(0) + rate[1] * row(1)) + (rate[2] * row(2) + rate[3] * row(3));
            for (int q = 0; q < n_basis_; ++q) sum = sum + weights[q] * row(n_coupled + q);
            p.part[part] = sum;
        }
        return p;
    }

 private:
    static double dot(const LinearForm& form, const Driven& x) {
        double sum = 0.0;
        for (int c = 0; c < n_coupled; ++c) sum += form.c[c] * x[c];
        return sum;
    }

    double unit_ = 0.0;
    int n_basis_ = 0;
    std::vector<std::array<double, Taylor::terms>> rows_;  // by each coupled rate, by each weight
};

}  // namespace lostmotion
