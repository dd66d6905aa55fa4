// Why is it stuck? What each contact holds, what it could hold, and the command that would move the load.
#pragma once

#include <limits>

#include "../drive/contact.hpp"

namespace lostmotion {

struct ContactReport {
    bool present = false;
    int mode = 0;                    // -1, 0, +1
    double speed = 0.0;              // [rad/s]
    double torque = 0.0;             // what the contact holds or takes [N m]
    double capacity_forward = 0.0;   // largest torque it holds before it slips forward [N m]
    double capacity_backward = 0.0;  // ... and backward, as a magnitude [N m]
};

ContactReport explain_contact(const Drive& drive, const Regime& r, Contact c, const State& x, const Memory& m,
                              const std::array<double, n_inputs>& u);

// Motor torque [N m] that just turns the input shaft from rest, forward (s = +1) or backward (s = -1), against T_2.
double breakaway_motor_torque(const Drive& drive, double T_2, int s);

// Constant command that, from rest with output torque T_2 and load torque M_Z, just moves the load forward (s = +1) or
// backward (s = -1), the inertia forces left out: the shaft winds up the gear from T_2 to the torque that frees the
// load, and the hardest point on the way counts. The requirement is piecewise linear in T_2.
double smallest_command(const Drive& drive, double T_2, double M_Z, int s);

}  // namespace lostmotion
