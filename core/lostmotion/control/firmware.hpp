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
//
// The goal comes through a filter of first order and then within limits of its rate and acceleration. The limited goal
// brakes so that it ends on the filtered one: with n steps of h^2 a left, the distance is h^2 a n(n + 1)/2.
struct Firmware {
    bool present = false;
    double dead_band = 0.0;
    double filter_time = 0.0;
    double goal_filter_time = 0.0;
    double goal_rate_limit = std::numeric_limits<double>::infinity();
    double goal_acceleration_limit = std::numeric_limits<double>::infinity();
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
        f.number({"goal_filter_time", "tau_g", "s", Range::not_negative, Given::has_default,
                  "tau_g of the first-order filter of the goal"},
                 goal_filter_time);
        f.number({"goal_rate_limit", "v_g", "rad/s", Range::limit, Given::may_be_left_out,
                  "v_g: largest rate of the goal that the loop follows"},
                 goal_rate_limit);
        f.number({"goal_acceleration_limit", "a_g", "rad/s^2", Range::limit, Given::may_be_left_out,
                  "a_g: largest rate of that rate"},
                 goal_acceleration_limit);
    }

    void place(Slots& slots, double sample_time) {
        first_ = slots.take(present ? n_own_slots : 0);
        angle_filter_.place(sample_time, filter_time);
        goal_filter_.place(sample_time, goal_filter_time);
    }
    // At rest on its goal.
    void start(double angle, double goal, double* slot) const {
        if (!present) return;
        slot[first_ + seen_angle] = angle;
        slot[first_ + filtered_goal] = slot[first_ + limited_goal] = goal;
    }
    // The angle as the firmware sees it.
    double filtered(double angle, double* slot) const { return angle_filter_(angle, slot[first_ + seen_angle]); }
    // The goal that the loop follows, a sample time h after the last one.
    double followed(double goal, double h, double* slot) const;

    double duty(double error) const;
    // [N m] of the motor; the duty cycle turns it the way of its sign.
    double torque(double duty, double speed) const {
        const double current =
            (duty * supply_voltage - torque_constant * speed) / (resistance + duty * duty * supply_resistance);
        return torque_constant * std::clamp(current, -max_current, max_current);
    }

 private:
    enum OwnSlot : int { seen_angle, filtered_goal, limited_goal, goal_rate, n_own_slots };

    LowPass angle_filter_, goal_filter_;
    int first_ = 0;
};

}  // namespace lostmotion::control
