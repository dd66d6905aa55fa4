// Position controller: proportional, with feedforward of the speed and, if wanted, an integrator with a dead zone.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "../parts/field.hpp"
#include "reference.hpp"
#include "slots.hpp"

namespace lostmotion::control {

// w* = sat(K_v e + I + k_ff dphi*/dt), in terms of the reference's shaft. The integrator holds while |e| is below the
// inner error of the dead zone and the reference stands, until |e| is above the outer one, so that an encoder step or a
// play does not keep the axis hunting. It also holds where e pushes further into a limit, that of the speed here or one
// of the torque in a loop within.
struct PositionLoop {
    double gain = 0.0;
    double integral_gain = 0.0;
    double feedforward = 0.0;
    double speed_limit = std::numeric_limits<double>::infinity();
    double reference_delay = 0.0;
    std::array<double, 2> dead_zone{};

    template <class Fields>
    void describe(Fields& f) {
        f.number({"gain", "K_v", "1/s", Range::positive, Given::needed, "K_v"}, gain);
        f.number({"integral_gain", "K_vI", "1/s^2", Range::not_negative}, integral_gain);
        f.number({"feedforward", "k_ff", "", Range::not_negative, Given::has_default,
                  "share of the reference's speed that is fed forward"},
                 feedforward);
        f.number({"speed_limit", "w_max", "rad/s", Range::limit, Given::may_be_left_out}, speed_limit);
        f.number(
            {"reference_delay", "T_d", "s", Range::not_negative, Given::has_default,
             "by which the reference of this loop comes later than what is fed forward: the equivalent time of the "
             "speed loop"},
            reference_delay);
        f.pair({"dead_zone", "e", "rad", Range::not_negative, Given::may_be_left_out,
                "inner and outer error: below the inner one the integrator holds while the reference stands, until the "
                "outer one is passed"},
               dead_zone);
    }

    void place(Slots& slots) { first_ = slots.take(2); }
    // e: phi* - phi [rad]. at_limit: sign of the torque, as it turns the reference's shaft, that is limited, or 0.
    double operator()(double e, double reference_rate, double at_limit, double sample_time, double* slot) const;

 private:
    int first_ = 0;
};

}  // namespace lostmotion::control
