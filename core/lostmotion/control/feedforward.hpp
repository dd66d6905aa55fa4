// What the controller knows of the drive beforehand: torque of inertia, friction and load, and the way through the
// play.
#pragma once

#include <algorithm>

#include "reference.hpp"
#include "slots.hpp"

namespace lostmotion::control {

// M_ff = J w*' + b w* + T_c sgn w* + T_L, all at the motor.
struct TorqueFeedforward {
    double inertia = 0.0;           // J [kg m2]
    double viscous_friction = 0.0;  // b [N m s/rad]
    double friction_torque = 0.0;   // T_c [N m]
    double load_torque = 0.0;       // T_L [N m], against the motion forward
    double operator()(double speed, double acceleration) const {
        return inertia * acceleration + viscous_friction * speed + friction_torque * sign_of(speed) + load_torque;
    }
};

// With the encoder on the motor: the load is half the play ahead or behind, by the way that the reference goes.
struct BacklashCompensation {
    double backlash = 0.0;  // b [rad], total gap in the angle of the reference's shaft
    double rate = 0.0;      // [rad/s] at which the offset passes from one side to the other

    void place(Slots& slots) { first_ = slots.take(backlash > 0.0 ? 1 : 0); }
    double operator()(double reference_rate, double sample_time, double* slot) const;

 private:
    int first_ = 0;
};

}  // namespace lostmotion::control
