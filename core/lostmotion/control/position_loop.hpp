// Position controller: proportional, with feedforward of the speed and, if wanted, an integrator with a dead zone.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "reference.hpp"
#include "slots.hpp"

namespace lostmotion::control {

// w* = sat(K_v e + I + k_ff dphi*/dt). The integrator holds while |e| < inner and the reference stands, until
// |e| > outer, so that an encoder step or a play does not keep the axis hunting. It also holds where e pushes further
// into a limit, that of the speed here or one of the torque in a loop within.
struct PositionLoop {
    double gain = 0.0;                                             // K_v [1/s]
    double integral_gain = 0.0;                                    // [1/s2]
    double speed_feedforward = 0.0;                                // k_ff [-]
    double speed_limit = std::numeric_limits<double>::infinity();  // [rad/s], of the reference's shaft
    double inner = 0.0, outer = 0.0;                               // [rad]

    void place(Slots& slots) { first_ = slots.take(2); }
    // e: phi* - phi [rad]. at_limit: sign of the torque, as it turns the reference's shaft, that is limited, or 0.
    double operator()(double e, double reference_rate, double at_limit, double sample_time, double* slot) const;

 private:
    int first_ = 0;
};

}  // namespace lostmotion::control
