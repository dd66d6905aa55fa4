// Speed controller: proportional and integral, of two degrees of freedom, with anti-windup by back-calculation.
#pragma once

#include <algorithm>
#include <limits>

#include "slots.hpp"

namespace lostmotion::control {

// Least and largest torque [N m].
struct TorqueRange {
    double low, high;

    double operator()(double torque) const { return std::clamp(torque, low, high); }
    // Sign of the limit that a torque is at, or 0.
    double at_limit(double torque) const { return torque >= high ? 1.0 : torque <= low ? -1.0 : 0.0; }
};

// v = I - (k_p - k_t) w + M_ff,  M = sat(k_t (w* - w) + v),  I += T (k_i/k_t) (M - v)
// I holds where this would ask for more of the torque that the voltage limits already.
struct SpeedLoop {
    double gain = 0.0;            // k_p [N m s/rad], on the measured speed
    double reference_gain = 0.0;  // k_t [N m s/rad], on the reference; equal to k_p in the usual controller
    double integral_gain = 0.0;   // k_i [N m/rad]
    double torque_limit = std::numeric_limits<double>::infinity();  // [N m]

    void place(Slots& slots) { first_ = slots.take(1); }
    // at_limit: sign of the torque that the voltage allows no more of, or 0.
    double operator()(double reference, double speed, double feedforward, TorqueRange range, double at_limit,
                      double sample_time, double* slot) const;

 private:
    int first_ = 0;
};

}  // namespace lostmotion::control
