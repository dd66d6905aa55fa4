// Current controller: proportional and integral with the zero on the pole of the winding, and its voltage limit.
#pragma once

#include <algorithm>
#include <limits>

#include "../parts/field.hpp"
#include "reference.hpp"
#include "slots.hpp"

namespace lostmotion::control {

// In the terms of (2): the current is M/M_R, the resistance 1/k_N, a = exp(-T/tau_a), K = g/(k_N (1 - a)):
// v = K e + I + K_e w,  u = sat(v),  I += K (1 - a) (e + (u - v)/K). With one period of delay the loop is
// g/(z (z - 1)). At the limit this is I += (1 - a) (u - K_e w - I): I follows the voltage across the resistance with
// the time constant of the winding, as the current does. So u leaves the limit as soon as e changes sign.
struct CurrentLoop {
    double gain = 1.0 / 3.0;
    double back_emf = 1.0;
    // Of the motor: M_R [N m], [rad/s], k_N, tau_a [s], and the limit of the command E.
    double rated_torque = 1.0, rated_speed = 1.0, armature_voltage_constant = 1.0, electrical_time_constant = 1.0;
    double command_limit = std::numeric_limits<double>::infinity();

    template <class Fields>
    static void describe_shares(Fields& f, double& gain, double& back_emf) {
        f.number({"gain", "g", "", Range::up_to_one, Given::has_default,
                  "g: with 1/3 and one sample time of delay it overshoots by 1/27, with a phase margin of 61 degrees"},
                 gain);
        f.number({"back_emf", "", "", Range::share, Given::has_default, "share of the back-e.m.f. that is compensated"},
                 back_emf);
    }
    template <class Fields>
    void describe(Fields& f) {
        describe_shares(f, gain, back_emf);
        f.number({"rated_torque", "M_R", "N*m", Range::positive, Given::none}, rated_torque);
        f.number({"rated_speed", "w_R", "rad/s", Range::positive, Given::none}, rated_speed);
        f.number({"armature_voltage_constant", "k_N", "", Range::positive, Given::none}, armature_voltage_constant);
        f.number({"electrical_time_constant", "tau_a", "s", Range::positive, Given::none}, electrical_time_constant);
        f.number({"command_limit", "E_max", "", Range::limit, Given::none}, command_limit);
    }

    void place(Slots& slots, double sample_time);
    double operator()(double reference, double torque, double speed, double* slot) const;
    // Sign of the torque that the voltage limit allowed no more of at the last sample, or 0.
    double at_limit(const double* slot) const { return slot[first_ + 1]; }

 private:
    double K_ = 0.0, K_i_ = 0.0, K_e_ = 0.0;  // per relative torque, K (1 - a), [s/rad]
    int first_ = 0;
};

}  // namespace lostmotion::control
