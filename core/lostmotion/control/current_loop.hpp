// Current controller: proportional and integral with the zero on the pole of the winding, and its voltage limit.
#pragma once

#include <algorithm>
#include <limits>

#include "reference.hpp"
#include "slots.hpp"

namespace lostmotion::control {

// In the terms of (2): the current is M/M_R, the resistance 1/k_N, a = exp(-T/tau_a), K = g/(k_N (1 - a)):
// v = K e + I + K_e w,  u = sat(v),  I += K (1 - a) (e + (u - v)/K). With one period of delay the loop is
// g/(z (z - 1)). At the limit this is I += (1 - a) (u - K_e w - I): I follows the voltage across the resistance with
// the time constant of the winding, as the current does. So u leaves the limit as soon as e changes sign.
struct CurrentLoop {
    double gain = 0.0;                                       // K, per relative torque
    double integral_gain = 0.0;                              // K (1 - a)
    double back_emf = 0.0;                                   // K_e [s/rad], of the speed of the motor
    double rated_torque = 1.0;                               // M_R [N m]
    double limit = std::numeric_limits<double>::infinity();  // of the command E

    void place(Slots& slots) { first_ = slots.take(2); }
    double operator()(double reference, double torque, double speed, double* slot) const;
    // Sign of the torque that the voltage limit allowed no more of at the last sample, or 0.
    double at_limit(const double* slot) const { return slot[first_ + 1]; }

 private:
    int first_ = 0;
};

}  // namespace lostmotion::control
