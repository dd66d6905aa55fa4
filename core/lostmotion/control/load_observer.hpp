// The load torque from what the motor gives and how it moves, through the losses of the gear, and the gains that suit
// the inertia as the motor feels it under that load.
//
//   T_1 = LP[M - J_MR w' - b_MR w - T_10 s],  T_2/i + s kappa M_2B(T_2)/|i| = T_1,
//   M_Z = LP[T_2 - J_Z phi'' - b_Z phi']
//   J = J_MR + (1 + dm_2B/dmu) J_Z/i^2,  k_p = w_c J,  k_i = k_p w_c/4
#pragma once

#include <cmath>

#include "inverse_model.hpp"
#include "speed_loop.hpp"

namespace lostmotion::control {

struct LoadObserver {
    bool present = false;
    double input_time = 1.0, load_time = 1.0;
    double speed_bandwidth = std::numeric_limits<double>::infinity();

    template <class Fields>
    void describe(Fields& f) {
        f.number({"input_time", "", "s", Range::positive, Given::needed,
                  "of the low pass on the torque at the gear's input"},
                 input_time);
        f.number({"load_time", "", "s", Range::positive, Given::needed, "of the low pass on the load torque"},
                 load_time);
        f.number({"speed_bandwidth", "w_c", "Hz", Range::limit, Given::may_be_left_out,
                  "w_c/(2 pi): the gains of the speed loop become k_p = w_c J and k_i = k_p w_c/4, with the inertia\n"
                  "J = J_MR + (1 + dm_2B/dmu) J_Z/i^2 that the motor feels under that load; left out, they stay"},
                 speed_bandwidth);
    }

    void place(Slots& slots, double sample_time);
    void start(double speed, const InverseModel& model, double* slot) const;
    double load(const double* slot) const { return present ? slot[first_ + torque] : 0.0; }

    // M: torque of the motor [N m], w: its speed [rad/s], of a sample. Where it (nearly) stands,
    // its friction is not known, and the estimate stays.
    void observe(double M, double w, const InverseModel& model, double* slot) const;
    SpeedLoop schedule(SpeedLoop loop, const InverseModel& model, const double* slot) const;

 private:
    enum Slot : int { input, input_torque, output, torque, slope, n_slots };

    LowPass input_filter_, load_filter_;
    double w_c_ = 0.0;  // [rad/s]
    int first_ = 0;
};

}  // namespace lostmotion::control
