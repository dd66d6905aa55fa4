// The rates of one regime as arrays: what the linear forms of a Regime are turned into for reckoning.
#pragma once

#include <cassert>
#include <cmath>

#include "regime.hpp"

namespace lostmotion {

// A linear map of the coupled states, column by column.
struct Matrix {
    std::array<Column, n_coupled> column{};

    static const Matrix& identity() {
        static constexpr Matrix one{{{{{1.0}}, {{0.0, 1.0}}, {{0.0, 0.0, 1.0}}, {{0.0, 0.0, 0.0, 1.0}}}}};
        return one;
    }

    [[gnu::always_inline]] Coupled at(int c) const { return load(column[c]); }
    [[gnu::always_inline]] Coupled operator*(const Coupled& v) const {
        // In pairs, which the processor adds side by side.
        return (v.spread<0>() * at(0) + v.spread<1>() * at(1)) + (v.spread<2>() * at(2) + v.spread<3>() * at(3));
    }
    // The same for a vector that is in memory.
    [[gnu::always_inline]] Coupled operator*(const Column& v) const {
        return (v[0] * at(0) + v[1] * at(1)) + (v[2] * at(2) + v[3] * at(3));
    }
    double operator()(int row, int col) const { return column[col][row]; }
    Coupled row(int r) const { return Coupled::of({column[0][r], column[1][r], column[2][r], column[3][r]}); }
    // A row times this.
    Coupled after(const Coupled& row) const { return sums(row * at(0), row * at(1), row * at(2), row * at(3)); }

    // factor * other, entry by entry
    void add(double factor, const Matrix& other) {
        for (int c = 0; c < n_coupled; ++c) (at(c) + factor * other.at(c)).store(column[c].data());
    }
    void scale(double factor) {
        for (int c = 0; c < n_coupled; ++c) (factor * at(c)).store(column[c].data());
    }
    Matrix magnitudes() const {
        Matrix out;
        for (int c = 0; c < n_coupled; ++c) absolute(at(c)).store(out.column[c].data());
        return out;
    }
    friend Matrix operator*(const Matrix& a, const Matrix& b) {
        Matrix out;
        for (int c = 0; c < n_coupled; ++c) (a * b.column[c]).store(out.column[c].data());
        return out;
    }
};

// dx/dt = A x + constant + B u of one regime. The load angle follows the load speed, and no rate depends on it.
struct LinearRates {
    Matrix rate;
    double turning = 0.0;  // 1 or, if the load stands, 0: the rate of the load angle over the load speed
    std::array<Column, n_inputs> input_column{};
    Column fixed{}, per_capacity{}, per_held{};  // the constant: its columns for 1, h and the held torque

    LinearRates() = default;
    explicit LinearRates(const Regime& regime) {
        const LinearForm& angle = regime.rate[load_angle];
        turning = angle.c[load_speed];
        for (int k = 0; k < n_terms; ++k) assert(k == load_speed || angle.c[k] == 0.0);
        for (int r = 0; r < n_coupled; ++r) {
            const LinearForm& f = regime.rate[r];
            assert(f.c[load_angle] == 0.0);
            for (int c = 0; c < n_coupled; ++c) rate.column[c][r] = f.c[c];
            for (int i = 0; i < n_inputs; ++i) input_column[i][r] = f.c[first_input + i];
            fixed[r] = f.c[one];
            per_capacity[r] = f.c[hysteresis_capacity];
            per_held[r] = f.c[held_torque];
        }
    }

    // The part of dx/dt that depends on neither state nor inputs.
    Column constant(const Memory& m) const {
        Column c;
        (load(fixed) + (m.hysteresis_capacity * load(per_capacity) + m.held_torque * load(per_held))).store(c.data());
        return c;
    }
    [[gnu::always_inline]] Lanes operator()(const Coupled& x, const Column& constant,
                                            const std::array<double, n_inputs>& u) const {
        return {(rate * x + (u[0] * load(input_column[0]) + u[1] * load(input_column[1]))) + load(constant),
                turning * x[load_speed]};
    }
    [[gnu::always_inline]] State operator()(const State& x, const Column& constant,
                                            const std::array<double, n_inputs>& u) const {
        State out;
        (*this)(coupled(x), constant, u).store(out.data());
        return out;
    }
    // The next time derivative of the state from one that is at least the first.
    [[gnu::always_inline]] State higher(const State& derivative, const std::array<double, n_inputs>& u) const {
        return (*this)(derivative, Column{}, u);
    }

    // Sums of the magnitudes of the terms of both, from magnitudes of what they depend on.
    State size(const State& x, const Memory& m, const std::array<double, n_inputs>& u) const {
        State out = higher_size(x, u);
        (coupled(out) + (absolute(load(fixed)) + (m.hysteresis_capacity * absolute(load(per_capacity)) +
                                                  m.held_torque * absolute(load(per_held)))))
            .store(out.data());
        return out;
    }
    State higher_size(const State& derivative, const std::array<double, n_inputs>& u) const {
        const auto term = [&](int k) { return derivative[k] * absolute(rate.at(k)); };
        State out;
        (((term(0) + term(1)) + (term(2) + term(3))) +
         (u[0] * absolute(load(input_column[0])) + u[1] * absolute(load(input_column[1]))))
            .store(out.data());
        out[load_angle] = turning * derivative[load_speed];
        return out;
    }
};

}  // namespace lostmotion
