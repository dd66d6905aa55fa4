// The rates of one regime as arrays: what the linear forms of a Regime are turned into for reckoning.
#pragma once

#include <cassert>
#include <cmath>

#include "regime.hpp"

namespace lostmotion {

// A linear map of the states that does not depend on the load angle: A, exp(A h) - 1, and the integral of exp(A h) but
// for the length h itself, by which the rate of the load angle goes into the angle.
struct Matrix {
    using Column = std::array<double, n_coupled>;

    alignas(sizeof(Coupled::Part)) std::array<Column, n_coupled> column{};
    Column angle{};  // the row of the load angle

    // 1 where a coupled state meets itself.
    static constexpr Matrix identity() {
        Matrix m;
        for (std::size_t k = 0; k < n_coupled; ++k) m.column[k][k] = 1.0;
        return m;
    }

    [[gnu::always_inline]] Coupled coupled(int c) const { return Coupled::load(column[c].data()); }
    [[gnu::always_inline]] Coupled operator*(const Coupled& v) const {
        // In pairs, which the processor adds side by side.
        return (v.spread<0>() * coupled(0) + v.spread<1>() * coupled(1)) +
               (v.spread<2>() * coupled(2) + v.spread<3>() * coupled(3));
    }
    [[gnu::always_inline]] Lanes operator*(const Lanes& v) const { return {*this * v.coupled, angle_row(v.coupled)}; }
    [[gnu::always_inline]] State operator*(const State& v) const {
        State out;
        (*this * load(v)).store(out.data());
        return out;
    }
    [[gnu::always_inline]] double angle_row(const Coupled& v) const { return (Coupled::load(angle.data()) * v).sum(); }
    double operator()(int row, int col) const {
        return col == load_angle ? 0.0 : row == load_angle ? angle[col] : column[col][row];
    }
    // factor * other, entry by entry
    void add(double factor, const Matrix& other) {
        for (int r = 0; r < n_rows; ++r) (row(r) + factor * other.row(r)).store(row_at(r));
    }
    void scale(double factor) {
        for (int r = 0; r < n_rows; ++r) (factor * row(r)).store(row_at(r));
    }
    Matrix magnitudes() const {
        Matrix out;
        for (int r = 0; r < n_rows; ++r) absolute(row(r)).store(out.row_at(r));
        return out;
    }
    friend Matrix operator*(const Matrix& a, const Matrix& b) {
        Matrix out;
        for (int c = 0; c < n_coupled; ++c) (a * b.coupled(c)).store(out.column[c].data());
        b.times_row(a.angle).store(out.angle.data());
        return out;
    }
    // A row, on the coupled states, times this.
    Coupled times_row(const Column& row) const {
        const Coupled v = Coupled::load(row.data());
        return sums(v * coupled(0), v * coupled(1), v * coupled(2), v * coupled(3));
    }

 private:
    // Columns and the row of the angle, one behind the other.
    static constexpr int n_rows = n_coupled + 1;
    Coupled row(int r) const { return r < n_coupled ? coupled(r) : Coupled::load(angle.data()); }
    double* row_at(int r) { return r < n_coupled ? column[r].data() : angle.data(); }
};

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
            for (int c = 0; c < n_coupled; ++c) (r == load_angle ? rate.angle[c] : rate.column[c][r]) = f.c[c];
            for (int i = 0; i < n_inputs; ++i) input_column[i][r] = f.c[first_input + i];
            fixed[r] = f.c[one];
            per_capacity[r] = f.c[hysteresis_capacity];
            per_held[r] = f.c[held_torque];
        }
    }

    // The part of dx/dt that depends on neither state nor inputs.
    State constant(const Memory& m) const {
        State c = fixed;
        add_scaled(c, m.hysteresis_capacity, per_capacity);
        add_scaled(c, m.held_torque, per_held);
        return c;
    }
    [[gnu::always_inline]] Lanes operator()(const Lanes& x, const Lanes& constant,
                                            const std::array<double, n_inputs>& u) const {
        return higher(x, u) + constant;
    }
    [[gnu::always_inline]] State operator()(const State& x, const State& constant,
                                            const std::array<double, n_inputs>& u) const {
        State out;
        (*this)(load(x), load(constant), u).store(out.data());
        return out;
    }
    // 1 or, if the load stands, 0: the rate of the load angle over the load speed.
    double turning() const { return rate.angle[load_speed]; }
    // The next time derivative of the state from one that is at least the first.
    [[gnu::always_inline]] Lanes higher(const Lanes& derivative, const std::array<double, n_inputs>& u) const {
        return {rate * derivative.coupled + (u[0] * coupled(input_column[0]) + u[1] * coupled(input_column[1])),
                turning() * derivative.coupled[load_speed]};
    }
    [[gnu::always_inline]] State higher(const State& derivative, const std::array<double, n_inputs>& u) const {
        State out;
        higher(load(derivative), u).store(out.data());
        return out;
    }

    // Sums of the magnitudes of the terms of both, from magnitudes of what they depend on.
    State size(const State& x, const Memory& m, const std::array<double, n_inputs>& u) const {
        const Lanes constant = absolute(load(fixed)) + (m.hysteresis_capacity * absolute(load(per_capacity)) +
                                                        m.held_torque * absolute(load(per_held)));
        State out;
        (higher_size(load(x), u) + constant).store(out.data());
        return out;
    }
    State higher_size(const State& derivative, const std::array<double, n_inputs>& u) const {
        State out;
        higher_size(load(derivative), u).store(out.data());
        return out;
    }

 private:
    Lanes higher_size(const Lanes& derivative, const std::array<double, n_inputs>& u) const {
        return rate.magnitudes() * derivative +
               (u[0] * absolute(load(input_column[0])) + u[1] * absolute(load(input_column[1])));
    }
};

}  // namespace lostmotion
