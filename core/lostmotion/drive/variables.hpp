// The variables of the drive, and the kernel's types for it.
#pragma once

#include <cstdint>

#include "../kernel/inputs.hpp"
#include "../kernel/rates.hpp"

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
    locked_torque,        // T_2 [N m] frozen while all contacts are at rest
    command,              // E_C [-]
    load_torque,          // M_Z [N m]
    n_terms
};

// The dry contacts of the drive.
enum Contact : int { input_contact, twist_contact, load_contact, n_contacts };

// What the solver must remember beside the state: the two piecewise-constant torques of the twist contact.
struct Memory {
    double hysteresis_capacity = 0.0;  // h [N m]
    double locked_torque = 0.0;        // T_2 [N m], used while all three contacts are stuck

    double operator[](int k) const { return k == 0 ? hysteresis_capacity : locked_torque; }
};
inline Memory magnitudes(const Memory& m) { return {std::fabs(m.hysteresis_capacity), std::fabs(m.locked_torque)}; }

inline constexpr int max_guards = 16;

struct DriveDims : Dims<4, 1, 2, 2, n_contacts, max_guards> {
    static constexpr int first_angle_speed = load_speed, twists = 1;
    using Memory = lostmotion::Memory;
    using Contact = lostmotion::Contact;
};
static_assert(load_angle == DriveDims::coupled && one == DriveDims::one &&
              hysteresis_capacity == DriveDims::first_memory && command == DriveDims::first_input &&
              n_terms == DriveDims::terms);

inline constexpr int n_coupled = DriveDims::coupled, n_states = DriveDims::states, n_inputs = DriveDims::inputs,
                     first_input = DriveDims::first_input;
using LinearForm = LinearFormOf<DriveDims>;
using Coupled = CoupledOf<DriveDims>;
using State = StateOf<DriveDims>;
using Column = ColumnOf<DriveDims>;
using Lanes = LanesOf<DriveDims>;
using Instant = InstantOf<DriveDims>;
using InputJet = InputJetOf<DriveDims>;
using Signals = SignalsOf<DriveDims>;  // command, load torque
using Matrix = MatrixOf<DriveDims>;
using LinearRates = LinearRatesOf<DriveDims>;

// Of the drive's forms; in the kernel the sizes are a template argument.
inline double constant_part(const LinearForm& f, const Memory& m) { return constant_part<DriveDims>(f, m); }
inline double evaluate(const LinearForm& f, const State& x, const Memory& m, const std::array<double, n_inputs>& u) {
    return evaluate<DriveDims>(f, x, m, u);
}
inline double magnitude(const LinearForm& f, const State& x, const Memory& m, const std::array<double, n_inputs>& u) {
    return magnitude<DriveDims>(f, x, m, u);
}
inline double evaluate_rate(const LinearForm& f, const State& rate, const std::array<double, n_inputs>& input_rate) {
    return evaluate_rate<DriveDims>(f, rate, input_rate);
}

}  // namespace lostmotion
