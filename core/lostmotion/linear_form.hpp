// The variables of the drive and linear expressions in them.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "vec.hpp"

namespace lostmotion {

// Everything a regime's equations may depend on. The first five are the state of the drive.
enum Term : int {
    motor_torque,         // M_D [N m], torque on the rotor (state only if the source has electrical dynamics)
    motor_speed,          // w_M [rad/s]
    load_speed,           // w [rad/s]
    twist,                // d = phi_M/i - phi [rad]
    load_angle,           // phi [rad]
    one,                  // the constant 1
    hysteresis_capacity,  // h [N m], set anew at every turning point of the twist (eq. 16)
    held_torque,          // T_2 [N m] frozen while all contacts stand
    command,              // E_C [-]
    load_torque,          // M_Z [N m]
    n_terms
};

inline constexpr int n_states = 5;
inline constexpr int n_inputs = 2;  // command, load_torque
inline constexpr int first_input = command;

// A linear expression sum_k c[k] * term[k].
template <int N>
struct Form {
    std::array<double, N> c{};

    static constexpr Form unit(int term, double factor = 1.0) {
        Form f;
        f.c[term] = factor;
        return f;
    }
    Form& operator+=(const Form& o) {
        for (int k = 0; k < N; ++k) c[k] += o.c[k];
        return *this;
    }
    Form& operator-=(const Form& o) {
        for (int k = 0; k < N; ++k) c[k] -= o.c[k];
        return *this;
    }
    Form& operator*=(double a) {
        for (int k = 0; k < N; ++k) c[k] *= a;
        return *this;
    }
    friend Form operator+(Form a, const Form& b) { return a += b; }
    friend Form operator-(Form a, const Form& b) { return a -= b; }
    friend Form operator*(double a, Form f) { return f *= a; }
    friend Form operator/(Form f, double a) { return f *= 1.0 / a; }
    friend Form operator-(Form f) { return f *= -1.0; }
};

using LinearForm = Form<n_terms>;

// The first four states are coupled with one another; the load angle follows the load speed and nothing depends on it.
inline constexpr int n_coupled = 4;
static_assert(load_angle == n_coupled);
using Coupled = Pack<n_coupled>;
struct alignas(sizeof(Coupled::Part)) State : std::array<double, n_states> {};
struct alignas(sizeof(Coupled::Part)) Column : std::array<double, n_coupled> {};  // the coupled states alone

// A state in registers.
struct Lanes {
    Coupled coupled{};
    double angle = 0.0;

    static Lanes load(const double* from) { return {Coupled::load(from), from[load_angle]}; }
    void store(double* to) const {
        coupled.store(to);
        to[load_angle] = angle;
    }
    friend Lanes operator+(const Lanes& a, const Lanes& b) { return {a.coupled + b.coupled, a.angle + b.angle}; }
    friend Lanes operator*(double a, const Lanes& b) { return {a * b.coupled, a * b.angle}; }
};
inline Lanes absolute(const Lanes& x) { return {absolute(x.coupled), std::fabs(x.angle)}; }
inline Lanes load(const std::array<double, n_states>& x) { return Lanes::load(x.data()); }
inline Coupled coupled(const State& x) { return Coupled::load(x.data()); }
inline Coupled load(const Column& x) { return Coupled::load(x.data()); }
inline void add_scaled(State& y, double a, const State& x) { (load(y) + a * load(x)).store(y.data()); }

// What the solver must remember beside the state: the two piecewise-constant torques of the twist contact.
struct Memory {
    double hysteresis_capacity = 0.0;  // h [N m]
    double held_torque = 0.0;          // T_2 [N m], used while all three contacts are stuck
};

inline State magnitudes(const State& x) {
    State size;
    absolute(load(x)).store(size.data());
    return size;
}
inline std::array<double, n_inputs> magnitudes(const std::array<double, n_inputs>& u) {
    return {std::fabs(u[0]), std::fabs(u[1])};
}
inline Memory magnitudes(const Memory& m) { return {std::fabs(m.hysteresis_capacity), std::fabs(m.held_torque)}; }

// Value and time derivatives of the two inputs at one instant: u[k][input] is the k-th derivative.
inline constexpr int n_derivatives = 6;
using InputJet = std::array<std::array<double, n_inputs>, n_derivatives>;

// All that a regime's equations depend on at one instant.
struct Instant {
    double time = 0.0;  // [s]
    State x{};
    Memory memory;
    InputJet input{};
    std::array<double, n_inputs> input_size{};  // sums of the magnitudes of the inputs' parts
};

// The part of a form that depends on neither state nor inputs: constant within a regime.
inline double constant_part(const LinearForm& f, const Memory& m) {
    return f.c[one] + f.c[hysteresis_capacity] * m.hysteresis_capacity + f.c[held_torque] * m.held_torque;
}

inline double evaluate(const LinearForm& f, const State& x, const Memory& m, const std::array<double, n_inputs>& u) {
    return (constant_part(f, m) + (f.c[command] * u[0] + f.c[load_torque] * u[1])) +
           ((Coupled::load(f.c.data()) * coupled(x)).sum() + f.c[load_angle] * x[load_angle]);
}

// Sum of the magnitudes of the terms: rounding in evaluate() is a small multiple of epsilon times this.
inline double magnitude(const LinearForm& f, const State& x, const Memory& m, const std::array<double, n_inputs>& u) {
    double sum = std::fabs(f.c[one]) + std::fabs(f.c[hysteresis_capacity] * m.hysteresis_capacity) +
                 std::fabs(f.c[held_torque] * m.held_torque) + std::fabs(f.c[command] * u[0]) +
                 std::fabs(f.c[load_torque] * u[1]);
    for (int k = 0; k < n_states; ++k) sum += std::fabs(f.c[k] * x[k]);
    return sum;
}

// The same for a time derivative of the form, where the constant terms have dropped out.
inline double evaluate_rate(const LinearForm& f, const State& rate, const std::array<double, n_inputs>& input_rate) {
    double sum = f.c[command] * input_rate[0] + f.c[load_torque] * input_rate[1];
    for (int k = 0; k < n_states; ++k) sum += f.c[k] * rate[k];
    return sum;
}

// Up to N forms as columns, so that all are evaluated at once. None may depend on the load angle.
template <int N>
class FormTable {
 public:
    static_assert(N % vec_width == 0);
    using Values = std::array<double, N>;

    FormTable() { column_[one].fill(1.0); }  // forms that are not there are 1

    void set(int row, const LinearForm& f) {
        assert(f.c[load_angle] == 0.0);
        for (int k = 0; k < n_terms; ++k) column_[k][row] = f.c[k];
        rows_ = std::max(rows_, (row + vec_width) / vec_width * vec_width);
        driven_ = driven_ || f.c[command] != 0.0 || f.c[load_torque] != 0.0;
    }
    int rows() const { return rows_; }  // rounded up to whole vectors
    double coefficient(int row, int term) const { return column_[term][row]; }
    LinearForm form(int row) const {
        LinearForm f;
        for (int k = 0; k < n_terms; ++k) f.c[k] = column_[k][row];
        return f;
    }

    // The parts that depend on neither state nor inputs.
    void constants(const Memory& m, Values& out) const {
        for (int g = 0; g < rows_; g += vec_width)
            store(at(one, g) + m.hysteresis_capacity * at(hysteresis_capacity, g) + m.held_torque * at(held_torque, g),
                  &out[g]);
    }
    [[gnu::always_inline]] void evaluate(const Values& constant, const State& x, const std::array<double, n_inputs>& u,
                                         Values& out) const {
        for (int g = 0; g < rows_; g += vec_width) store(load(&constant[g]) + terms(g, x, u), &out[g]);
    }
    // The same with inputs that are asked for their values or rates where the forms depend on them.
    template <class Input>
    void evaluate(const Values& constant, const State& x, const Input& input, Values& out) const {
        evaluate(constant, x, driven_ ? input.values() : std::array<double, n_inputs>{}, out);
    }
    template <class Input>
    void rates(const State& rate, const Input& input, Values& out) const {
        rates(rate, driven_ ? input.rates() : std::array<double, n_inputs>{}, out);
    }
    // Sums of the magnitudes of the terms, from magnitudes of what the forms depend on.
    void sizes(const Memory& m, const State& x, const std::array<double, n_inputs>& u, Values& out) const {
        for (int g = 0; g < rows_; g += vec_width)
            store(absolute(at(one, g)) +
                      (m.hysteresis_capacity * absolute(at(hysteresis_capacity, g)) +
                       m.held_torque * absolute(at(held_torque, g))) +
                      terms<true>(g, x, u),
                  &out[g]);
    }
    template <class Input>
    void sizes(const Memory& m, const State& x, const Input& input, Values& out) const {
        sizes(m, x, driven_ ? input.sizes() : std::array<double, n_inputs>{}, out);
    }
    void rate_sizes(const State& rate, const std::array<double, n_inputs>& input_rate, Values& out) const {
        for (int g = 0; g < rows_; g += vec_width) store(terms<true>(g, rate, input_rate), &out[g]);
    }
    // Time derivatives, from those of state and inputs.
    [[gnu::always_inline]] void rates(const State& rate, const std::array<double, n_inputs>& input_rate,
                                      Values& out) const {
        for (int g = 0; g < rows_; g += vec_width) store(terms(g, rate, input_rate), &out[g]);
    }

 private:
    Vec at(int term, int g) const { return load(&column_[term][g]); }
    template <bool magnitudes = false>
    [[gnu::always_inline]] Vec terms(int g, const State& x, const std::array<double, n_inputs>& u) const {
        const auto c = [&](int term) { return magnitudes ? absolute(at(term, g)) : at(term, g); };
        const Vec sum = (c(0) * x[0] + c(1) * x[1]) + (c(2) * x[2] + c(3) * x[3]);
        return driven_ ? sum + (c(command) * u[0] + c(load_torque) * u[1]) : sum;
    }

    alignas(64) std::array<std::array<double, N>, n_terms> column_{};
    int rows_ = 0;
    bool driven_ = false;
};

}  // namespace lostmotion
