// The speed that a controller makes of the angles that it has read.
#pragma once

#include "slots.hpp"

namespace lostmotion::control {

struct SpeedEstimate {
    enum Kind { exact, difference, observer } kind = difference;

    int span = 1;            // sample times that the difference is taken over
    double smoothing = 1.0;  // of the difference, 1 - exp(-T_s/tau): y += smoothing (x - y)
    double bandwidth = 0.0;  // w_o [rad/s] of the observer
    double damping = 1.0;    // zeta
    double inertia = 0.0;    // J [kg m2] that the observer takes the torque to accelerate; 0: it does not

    void place(Slots& slots) { first_ = slots.take(kind == observer ? 2 : 1 + span); }
    // At rest at an angle.
    void start(double angle, double speed, double sample_time, double* slot) const;
    // angle [rad], speed [rad/s] as it is, torque [N m] that the controller takes to act, of a sample.
    double operator()(double angle, double speed, double torque, double sample_time, double* slot) const;

 private:
    int first_ = 0;
};

}  // namespace lostmotion::control
