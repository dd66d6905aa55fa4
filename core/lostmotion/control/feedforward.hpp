// What the controller knows of the drive beforehand: torque of inertia, friction and load, and the way through the
// play.
#pragma once

#include <algorithm>
#include <limits>

#include "../parts/field.hpp"
#include "reference.hpp"
#include "slots.hpp"

namespace lostmotion::control {

// M_ff = J w*' + b w* + T_c sgn w* + T_L, all at the motor. With the encoder on the motor, the load is half the play
// ahead or behind, by the way that the reference goes.
struct Feedforward {
    double inertia = 0.0;
    double viscous_friction = 0.0;
    double friction_torque = 0.0;
    double load_torque = 0.0;
    double backlash = 0.0;
    double backlash_rate = std::numeric_limits<double>::infinity();

    template <class Fields>
    void describe(Fields& f) {
        f.number({"inertia", "J", "kg*m^2", Range::not_negative, Given::has_default, "total, at the motor"}, inertia);
        f.number({"viscous_friction", "b", "N*m*s/rad", Range::not_negative}, viscous_friction);
        f.number({"friction_torque", "T_c", "N*m", Range::not_negative}, friction_torque);
        f.number({"load_torque", "T_L", "N*m"}, load_torque);
        f.number({"backlash", "b", "rad", Range::not_negative, Given::has_default,
                  "total gap at the reference's shaft; with the encoder on the motor the reference is moved by half of "
                  "it, by the way it goes"},
                 backlash);
        f.number({"backlash_rate", "", "rad/s", Range::limit, Given::may_be_left_out,
                  "at which it is passed; needed with backlash"},
                 backlash_rate);
    }

    double torque(double speed, double acceleration) const {
        return inertia * acceleration + viscous_friction * speed + friction_torque * sign_of(speed) + load_torque;
    }
    void place(Slots& slots) { first_ = slots.take(backlash > 0.0 ? 1 : 0); }
    // By how much the reference of the position is moved [rad].
    double offset(double reference_rate, double sample_time, double* slot) const;

 private:
    int first_ = 0;
};

}  // namespace lostmotion::control
