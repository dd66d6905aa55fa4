// The variables of the drive and linear expressions in them.
#pragma once

#include <array>
#include <cmath>

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

// State vector with one lane of padding, so that a column of a matrix is three pairs of doubles.
inline constexpr int lanes = 6;
using State = std::array<double, lanes>;

// What the solver must remember beside the state: the two piecewise-constant torques of the twist contact.
struct Memory {
    double hysteresis_capacity = 0.0;  // h [N m]
    double held_torque = 0.0;          // T_2 [N m], used while all three contacts are stuck
};

// Value and time derivatives of the two inputs at one instant: u[k][input] is the k-th derivative.
inline constexpr int n_derivatives = 6;
using InputJet = std::array<std::array<double, n_inputs>, n_derivatives>;

// The part of a form that depends on neither state nor inputs: constant within a regime.
inline double constant_part(const LinearForm& f, const Memory& m) {
    return f.c[one] + f.c[hysteresis_capacity] * m.hysteresis_capacity + f.c[held_torque] * m.held_torque;
}

inline double evaluate(const LinearForm& f, const State& x, const Memory& m, const std::array<double, n_inputs>& u) {
    double sum = f.c[one] + f.c[hysteresis_capacity] * m.hysteresis_capacity + f.c[held_torque] * m.held_torque +
                 f.c[command] * u[0] + f.c[load_torque] * u[1];
    for (int k = 0; k < n_states; ++k) sum += f.c[k] * x[k];
    return sum;
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

}  // namespace lostmotion
