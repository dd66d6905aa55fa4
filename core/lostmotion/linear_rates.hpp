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
    using Column = std::array<double, coupled>;

    alignas(32) std::array<Column, coupled> column{};
    Column angle{};          // row of the load angle
    double angle_own = 0.0;  // its own entry
    double unused[3] = {};

    static Matrix diagonal(double value) {
        Matrix m;
        for (int k = 0; k < coupled; ++k) m.column[k][k] = value;
        m.angle_own = value;
        return m;
    }

    [[gnu::always_inline]] State operator*(const State& v) const {
        State out;
        (*this * Quad::load(v.data())).store(out.data());
        store_single(angle_row(v.data()) + angle_own * v[coupled], &out[coupled]);
        return out;
    }
    // The coupled states alone.
    [[gnu::always_inline]] Quad operator*(const Quad& v) const {
        const Quad::Part v0 = v.spread<0>(), v1 = v.spread<1>(), v2 = v.spread<2>(), v3 = v.spread<3>();
        Quad out;
        for (int p = 0; p < Quad::parts; ++p) {
            const int r = p * Quad::width;
            // In pairs, which the processor adds side by side.
            out.part[p] = (load<Quad::Part>(&column[0][r]) * v0 + load<Quad::Part>(&column[1][r]) * v1) +
                          (load<Quad::Part>(&column[2][r]) * v2 + load<Quad::Part>(&column[3][r]) * v3);
        }
        return out;
    }
    double operator()(int row, int col) const {
        if (row < coupled) return col < coupled ? column[col][row] : 0.0;
        return col < coupled ? angle[col] : angle_own;
    }
    [[gnu::always_inline]] double angle_row(const double* v) const {
        return (angle[0] * v[0] + angle[1] * v[1]) + (angle[2] * v[2] + angle[3] * v[3]);
    }
    void add_diagonal(double value) {
        for (int k = 0; k < coupled; ++k) column[k][k] += value;
        angle_own += value;
    }
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
        for (int c = 0; c < coupled; ++c) {
            const double* v = b.column[c].data();
            (a * Quad::load(v)).store(out.column[c].data());
            out.angle[c] = a.angle_row(v) + a.angle_own * b.angle[c];
        }
        out.angle_own = a.angle_own * b.angle_own;
        return out;
    }

 private:
    static constexpr int entries = 24;  // one behind the other, so that the compiler can take several at once
};
static_assert(sizeof(Matrix) == 24 * sizeof(double));

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
            for (int c = 0; c < Matrix::coupled; ++c)
                (r < Matrix::coupled ? rate.column[c][r] : rate.angle[c]) = f.c[c];
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
        State out = higher(x, u);
        add_scaled(out, 1.0, constant);
        return out;
    }
    // The next time derivative of the state from one that is at least the first.
    [[gnu::always_inline]] State higher(const State& derivative, const std::array<double, n_inputs>& u) const {
        State out;
        higher(Quad::load(derivative.data()), u).store(out.data());
        store_single(rate.angle[load_speed] * derivative[load_speed], &out[load_angle]);
        return out;
    }
    [[gnu::always_inline]] Quad higher(const Quad& derivative, const std::array<double, n_inputs>& u) const {
        return rate * derivative +
               (u[0] * Quad::load(input_column[0].data()) + u[1] * Quad::load(input_column[1].data()));
    }
};

}  // namespace lostmotion
