// Speed controller: proportional and integral, of two degrees of freedom, with anti-windup by back-calculation.
#pragma once

#include <algorithm>
#include <limits>

#include "../parts/field.hpp"
#include "slots.hpp"

namespace lostmotion::control {

// Least and largest torque [N m].
struct TorqueRange {
    double low, high;

    double operator()(double torque) const { return std::clamp(torque, low, high); }
    // Sign of the limit that a torque is at, or 0.
    double at_limit(double torque) const { return torque >= high ? 1.0 : torque <= low ? -1.0 : 0.0; }
};

// v = I - (k_p - k_t) w + M_ff,  M = sat(k_t (w* - w) + v),  I += T (k_i/k_t) (M - v),  in terms of the motor
// I holds where this would ask for more of the torque that the voltage limits already.
struct SpeedLoop {
    double gain = 0.0;
    double integral_gain = 0.0, integral_time = std::numeric_limits<double>::infinity();  // one of them
    double reference_weight = 1.0;
    double torque_limit = std::numeric_limits<double>::infinity();

    template <class Fields>
    void describe(Fields& f) {
        f.number({"gain", "k_p", "N*m*s/rad", Range::positive, Given::needed,
                  "k_p, torque of the motor per speed of the motor"},
                 gain);
        f.number({"integral_gain", "k_i", "N*m/rad", Range::not_negative, Given::may_be_left_out,
                  "k_i; left out, as integral_time says"},
                 integral_gain);
        f.number({"integral_time", "T_i", "s", Range::limit, Given::may_be_left_out,
                  "k_p/k_i; left out with integral_gain, there is no integrator"},
                 integral_time);
        f.number({"reference_weight", "k_t/k_p", "", Range::up_to_one, Given::has_default,
                  "k_t/k_p: below 1 steps of the reference overshoot less"},
                 reference_weight);
        f.number({"torque_limit", "M_max", "N*m", Range::limit, Given::may_be_left_out}, torque_limit);
    }
    double k_i() const { return integral_gain + gain / integral_time; }

    void place(Slots& slots) { first_ = slots.take(1); }
    // at_limit: sign of the torque that the voltage allows no more of, or 0.
    double operator()(double reference, double speed, double feedforward, TorqueRange range, double at_limit,
                      double sample_time, double* slot) const;

 private:
    int first_ = 0;
};

}  // namespace lostmotion::control
