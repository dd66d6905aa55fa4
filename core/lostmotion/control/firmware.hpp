// The position control of a hobby servo's firmware: from the position error by a duty cycle to the voltage of a bridge.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "../parts/field.hpp"
#include "reference.hpp"
#include "slots.hpp"

namespace lostmotion::control {

// With the error e, less the dead band, the duty cycle d = table(e) puts the voltage d U on the winding, I = (d U - k
// w)/R. The supply gives the current d I (a bridge without losses), and its voltage falls by that: U = U_0 - R_s d I.
// Both together are I = (d U_0 - k w)/(R + d^2 R_s), |I| <= I_max, and the torque is k I. Error and speed are those of
// the sample, and the torque is held until the next one.
struct Firmware {
    bool present = false;
    double dead_band = 0.0;
    double filter_time = 0.0;
    double supply_voltage = 1.0, supply_resistance = 0.0;
    double resistance = 1.0, torque_constant = 1.0;
    double max_current = std::numeric_limits<double>::infinity();
    // Table of the duty cycle over the error, odd: errors [rad] rise from 0, beyond the last the duty cycle stays.
    std::vector<double> errors{0.0, 1.0}, duties{0.0, 1.0};

    template <class Fields>
    void describe(Fields& f) {
        f.number({"supply_voltage", "U_0", "V", Range::positive, Given::needed, "U_0, without current"},
                 supply_voltage);
        f.number({"resistance", "R", "ohm", Range::positive, Given::needed, "R of the winding and of the bridge"},
                 resistance);
        f.number({"torque_constant", "k", "N*m/A", Range::positive, Given::needed, "k of the motor, at its own shaft"},
                 torque_constant);
        f.number({"supply_resistance", "R_s", "ohm", Range::not_negative, Given::has_default,
                  "R_s of the supply and its cables: the voltage sags with the current of the bridge"},
                 supply_resistance);
        f.number({"max_current", "I_max", "A", Range::limit, Given::may_be_left_out, "I_max of the winding"},
                 max_current);
        f.number({"dead_band", "e_d", "rad", Range::not_negative, Given::has_default,
                  "e_d: smaller errors count as none, larger ones by what is beyond it"},
                 dead_band);
        f.number({"filter_time", "tau", "s", Range::not_negative, Given::has_default,
                  "tau of the first-order filter of the angle that is read"},
                 filter_time);
    }

    void place(Slots& slots, double sample_time) {
        first_ = slots.take(present ? 1 : 0);
        share_ = share_of(sample_time, filter_time);
    }
    void start(double angle, double* slot) const {
        if (present) slot[first_] = angle;
    }
    // The angle as the firmware sees it.
    double filtered(double angle, double* slot) const { return slot[first_] += share_ * (angle - slot[first_]); }

    double duty(double error) const;
    // [N m] of the motor; the duty cycle turns it the way of its sign.
    double torque(double duty, double speed) const {
        const double current =
            (duty * supply_voltage - torque_constant * speed) / (resistance + duty * duty * supply_resistance);
        return torque_constant * std::clamp(current, -max_current, max_current);
    }

 private:
    double share_ = 1.0;
    int first_ = 0;
};

}  // namespace lostmotion::control
