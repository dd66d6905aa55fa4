// Speed controller: proportional and integral, of two degrees of freedom, with anti-windup by back-calculation.
#pragma once

#include <algorithm>
#include <limits>

#include "slots.hpp"

namespace lostmotion::control {

// v = I - (k_p - k_t) w + M_ff,  M = sat(k_t (w* - w) + v),  I += T (k_i/k_t) (M - v)
struct SpeedLoop {
    double gain = 0.0;            // k_p [N m s/rad], on the measured speed
    double reference_gain = 0.0;  // k_t [N m s/rad], on the reference; equal to k_p in the usual controller
    double integral_gain = 0.0;   // k_i [N m/rad]
    double torque_limit = std::numeric_limits<double>::infinity();  // [N m]

    void place(Slots& slots) { first_ = slots.take(1); }
    // limit: of the torque, if it cannot be as large as torque_limit.
    double operator()(double reference, double speed, double feedforward, double limit, double sample_time,
                      double* slot) const;

 private:
    int first_ = 0;
};

}  // namespace lostmotion::control
