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
    void start(double speed, const InverseModel& model, double* slot) const;
    double load(const double* slot) const { return present ? slot[first_ + torque] : 0.0; }

    // M: torque of the motor [N m], w: its speed [rad/s], of a sample. Where it (nearly) stands,
    // its friction is not known, and the estimate stays.
    void observe(double M, double w, const InverseModel& model, double* slot) const;
    SpeedLoop schedule(SpeedLoop loop, const InverseModel& model, const double* slot) const;

 private:
    enum Slot : int { input, input_torque, output, torque, slope, n_slots };

    int first_ = 0;
};

}  // namespace lostmotion::control
