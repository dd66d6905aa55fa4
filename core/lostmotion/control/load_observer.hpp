// The load torque from what the motor gives and how it moves, through the losses of the gear, and the gains that suit
// the inertia as the motor feels it under that load.
//
//   T_1 = LP[M - J_MR w' - b_MR w - T_10 s],  T_2 + s kappa M_2B(T_2) = i T_1,  M_Z = LP[T_2 - J_Z phi'' - b_Z phi']
//   J = J_MR + (1 + dm_2B/dmu) J_Z/i^2,  k_p = w_c J,  k_i = k_p w_c/4
#pragma once

#include <cmath>

#include "inverse_model.hpp"
#include "speed_loop.hpp"

namespace lostmotion::control {

struct LoadObserver {
    bool present = false;
    double input_time = 0.0, load_time = 0.0;    // [s] of the two low passes
    double input_share = 0.0, load_share = 0.0;  // 1 - exp(-T/time), what each takes over at a sample
    double bandwidth = 0.0;                      // w_c [rad/s] of the speed loop; 0: its gains stay

    void place(Slots& slots) { first_ = slots.take(present ? n_slots : 0); }
    void start(double speed, const InverseModel& model, double* slot) const {
        if (!present) return;
        double* s = slot + first_;
        s[input] = model.motor_inertia / input_time * speed;
        s[output] = model.load_inertia / load_time * speed / model.losses.ratio;
    }
    double load(const double* slot) const { return present ? slot[first_ + torque] : 0.0; }

    // M: torque of the motor [N m], w: its speed [rad/s], of a sample. Where it (nearly) stands,
    // its friction is not known, and the estimate stays.
    void observe(double M, double w, const InverseModel& model, double* slot) const {
        double* x = slot + first_;
        const double i = model.losses.ratio, s = std::fabs(w) > model.min_speed ? sign_of(w) : 0.0;
        const double J_1 = model.motor_inertia / input_time, J_2 = model.load_inertia / load_time;
        const double phi_rate = w / i;
        // What stands keeps both low passes in step with the speed, so that nothing jumps when it goes on.
        if (s == 0.0) {
            x[input] = x[input_torque] + J_1 * w;
            x[output] = x[torque] + J_2 * phi_rate;
            return;
        }
        const double given = M - model.motor_viscous_friction * w - model.friction_now(slot) * s;
        x[input] += input_share * (given + J_1 * w - x[input]);
        x[input_torque] = x[input] - J_1 * w;
        const double T_2 = model.losses.output_torque(x[input_torque], s, w, model.loss_factor_now(slot));
        const double left = T_2 - model.load_viscous_friction * phi_rate;
        x[output] += load_share * (left + J_2 * phi_rate - x[output]);
        x[torque] = x[output] - J_2 * phi_rate;
        x[slope] = model.losses.slope(T_2, s, w);
    }
    SpeedLoop schedule(SpeedLoop loop, const InverseModel& model, const double* slot) const {
        if (!present || bandwidth == 0.0) return loop;
        const double i = model.losses.ratio, weight = loop.reference_gain / loop.gain;
        const double J = model.motor_inertia + (1.0 + slot[first_ + slope]) * model.load_inertia / (i * i);
        loop.gain = bandwidth * J;
        loop.reference_gain = weight * loop.gain;
        loop.integral_gain = 0.25 * bandwidth * loop.gain;
        return loop;
    }

 private:
    enum Slot : int { input, input_torque, output, torque, slope, n_slots };

    int first_ = 0;
};

}  // namespace lostmotion::control
