// The rates of one regime as arrays: what the linear forms of a Regime are turned into for reckoning.
#pragma once

#include <cassert>
#include <cmath>

#include "regime.hpp"

namespace lostmotion {

// A linear map of the states. The first four are coupled; the load angle follows the load speed and nothing depends on
// it, so its column is zero but for its own entry.
struct Matrix {
    static constexpr int coupled = 4;

    std::array<State, n_states> column{};

    static const Matrix& identity() {
        static const Matrix one = [] {
            Matrix m;
            for (int k = 0; k < n_states; ++k) m.column[k][k] = 1.0;
            return m;
        }();
        return one;
    }

    [[gnu::always_inline]] Lanes operator*(const Lanes& v) const {
        return of_coupled(v) + v.spread<load_angle>() * load(column[load_angle]);
    }
    // The same where the column of the load angle is all zero, as in A and exp(A h) - 1.
    [[gnu::always_inline]] Lanes of_coupled(const Lanes& v) const {
        // In pairs, which the processor adds side by side.
        return (v.spread<0>() * load(column[0]) + v.spread<1>() * load(column[1])) +
               (v.spread<2>() * load(column[2]) + v.spread<3>() * load(column[3]));
    }
    [[gnu::always_inline]] State operator*(const State& v) const {
        State out;
        (*this * load(v)).store(out.data());
        return out;
    }
    double operator()(int row, int col) const { return column[col][row]; }
    // factor * other, entry by entry
    void add(double factor, const Matrix& other) {
        combine(other, [factor](double own, double others) { return own + factor * others; });
    }
    void scale(double factor) {
        combine(*this, [factor](double own, double) { return own * factor; });
    }
    // f(own entry, that of the other), entry by entry
    template <class F>
    void combine(const Matrix& other, F&& f) {
        double* own = column[0].data();
        const double* others = other.column[0].data();
        for (int k = 0; k < entries; ++k) own[k] = f(own[k], others[k]);
    }
    friend Matrix operator*(const Matrix& a, const Matrix& b) {
        Matrix out;
        for (int c = 0; c < coupled; ++c) (a * load(b.column[c])).store(out.column[c].data());
        Lanes own{};  // a column that is written in one piece can be read in one
        own.set<load_angle>(a.column[load_angle][load_angle] * b.column[load_angle][load_angle]);
        own.store(out.column[load_angle].data());
        return out;
    }

 private:
    static constexpr int entries = n_states * lanes;  // one behind the other, so that several are taken at once
};
static_assert(sizeof(Matrix) == n_states * lanes * sizeof(double));
static_assert(load_angle == Matrix::coupled);

// dx/dt = A x + constant + B u of one regime. No rate depends on the load angle, and its own rate on the load speed
// alone.
struct LinearRates {
    Matrix rate;
    std::array<State, n_inputs> input_column{};
    State fixed{}, per_capacity{}, per_held{};  // the constant: its columns for 1, h and the held torque

    LinearRates() = default;
    explicit LinearRates(const Regime& regime) {
        for (int r = 0; r < n_states; ++r) {
            const LinearForm& f = regime.rate[r];
            assert(f.c[load_angle] == 0.0);
            assert(r != load_angle || (f.c[motor_torque] == 0.0 && f.c[motor_speed] == 0.0 && f.c[twist] == 0.0));
            for (int c = 0; c < Matrix::coupled; ++c) rate.column[c][r] = f.c[c];
            for (int i = 0; i < n_inputs; ++i) input_column[i][r] = f.c[first_input + i];
            fixed[r] = f.c[one];
            per_capacity[r] = f.c[hysteresis_capacity];
            per_held[r] = f.c[held_torque];
        }
    }
    // The same with the magnitudes of all coefficients.
    LinearRates magnitudes() const {
        LinearRates out = *this;
        out.rate.combine(rate, [](double, double a) { return std::fabs(a); });
        for (State* s : {&out.input_column[0], &out.input_column[1], &out.fixed, &out.per_capacity, &out.per_held})
            *s = lostmotion::magnitudes(*s);
        return out;
    }

    // The part of dx/dt that depends on neither state nor inputs.
    State constant(const Memory& m) const {
        State c = fixed;
        add_scaled(c, m.hysteresis_capacity, per_capacity);
        add_scaled(c, m.held_torque, per_held);
        return c;
    }
    [[gnu::always_inline]] State operator()(const State& x, const State& constant,
                                            const std::array<double, n_inputs>& u) const {
        State out;
        (higher(load(x), u) + load(constant)).store(out.data());
        return out;
    }
    // The next time derivative of the state from one that is at least the first.
    [[gnu::always_inline]] Lanes higher(const Lanes& derivative, const std::array<double, n_inputs>& u) const {
        return rate.of_coupled(derivative) + (u[0] * load(input_column[0]) + u[1] * load(input_column[1]));
    }
    [[gnu::always_inline]] State higher(const State& derivative, const std::array<double, n_inputs>& u) const {
        State out;
        higher(load(derivative), u).store(out.data());
        return out;
    }
};

}  // namespace lostmotion
