// A controller of the user's own: a function that is called at each sample.
#pragma once

#include "slots.hpp"

namespace lostmotion::control {

// time [s]; measured: position [rad] of the reference's shaft, speed [rad/s] of the motor, its torque [N m], and of one
// under field-oriented control i_d and i_q [A]; reference: value, rate, acceleration and jerk of a position; state: its
// own numbers, kept from sample to sample; command: out, of one under field-oriented control u_d and u_q [V]. Returns
// 0; anything else ends the run.
using OwnLawFunction = int (*)(double time, const double* measured, const double* reference, double* state,
                               double* command, void* data);

struct OwnLaw {
    OwnLawFunction function = nullptr;
    void* data = nullptr;
    int states = 0;

    bool present() const { return function != nullptr; }
    void place(Slots& slots) { first_ = slots.take(states); }
    int operator()(double time, const double* measured, const double* reference, double* command, double* slot) const {
        return function(time, measured, reference, slot + first_, command, data);
    }

 private:
    int first_ = 0;
};

}  // namespace lostmotion::control
