// The drive of the paper as the tests describe it: a motor, a gearbox and a load.
#pragma once

#include <algorithm>
#include <array>

#include "lostmotion/base/signal.hpp"
#include "lostmotion/parts/gearbox.hpp"
#include "lostmotion/parts/motor.hpp"

namespace lostmotion::test {

// What is read of a drive. The first are its states.
enum Quantity : int {
    motor_torque,  // M_D [N m]
    motor_speed,   // w_M [rad/s]
    load_speed,    // w [rad/s]
    twist,         // d [rad]
    load_angle,    // phi [rad]
    n_states,
    command = n_states,  // E_C
    load_torque,         // M_Z [N m]
    output_torque,       // T_2 [N m]
    input_torque,        // T_1 [N m]
    input_contact,
    twist_contact,
    load_contact,
    n_quantities
};
inline constexpr int n_coupled = load_angle;  // the angle of the load acts on nothing
inline constexpr int n_inputs = 2;

using State = std::array<double, n_states>;
using Signals = std::array<Signal, n_inputs>;  // command, load torque

// The driven body.
struct Load {
    double inertia = 1.0;           // [kg m2]
    double viscous_friction = 0.0;  // [N m s/rad]
    double friction_torque = 0.0;   // dry friction [N m]; 0: no such contact
};

struct Drive {
    Motor motor;
    Gearbox gearbox;
    Load load;

    double input_inertia() const { return motor.rotor_inertia + gearbox.inertia; }
    bool rigid() const { return gearbox.compliance == Gearbox::rigid; }
    // Whether a rigid gear turns against more torque the less it is given, in some cell of its losses (Painleve): there
    // are instants with no motion or with several.
    bool jams() const {
        if (!rigid()) return false;
        const double least = gearbox.losses == Gearbox::constant_efficiency
                                 ? 1.0 / gearbox.efficiency
                                 : std::min(1.0, 1.0 + gearbox.map.least_slope_over_load());
        return input_inertia() + least * load.inertia / (gearbox.ratio * gearbox.ratio) <= 0.0;
    }
    // Sizes of the states at rated speed and torque.
    State rated_scale() const {
        const double w = gearbox.rated_input_speed;
        return {motor.rated_torque, w, w / gearbox.ratio,
                rigid() ? 1.0 : gearbox.rated_output_torque / gearbox.curve.max_slope(), 1.0};
    }
};

}  // namespace lostmotion::test
