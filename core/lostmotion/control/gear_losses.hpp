// What the controller knows of the losses of a gear, and the load that follows from the torque at its input.
#pragma once

#include <cmath>

#include "../parts/loss_map.hpp"

namespace lostmotion::control {

// Losses at the input of a gear whose input turns in direction s, at output torque T_2 and speed w of the input.
struct GearLosses {
    enum Kind { none, constant_efficiency, loss_map } kind = none;

    double ratio = 1.0;                            // i; below 0 the output turns against the input
    double efficiency = 1.0;                       // driving and in reverse
    LossMap map;                                   // m_2B
    double rated_torque = 1.0, rated_speed = 1.0;  // T_2R [N m], n_1R [rad/s]

    // M_2B/|i| >= 0 [N m].
    double operator()(double T_2, double s, double w) const { return at(T_2, s, w).torque; }

    // dm_2B/dmu: how much of a change of the load the gear takes for itself.
    double slope(double T_2, double s, double w) const { return at(T_2, s, w).per_load; }

    // T_2 that solves T_2/i + s factor M_2B(T_2)/|i| = T_1. The left side rises with T_2 (a loss that fell faster than
    // the load rises would drive the gear).
    double output_torque(double T_1, double s, double w, double factor) const;

 private:
    struct Loss {
        double torque = 0.0;    // [N m] at the input
        double per_load = 0.0;  // dM_2B/d(s T_2 sgn i)
    };

    Loss at(double T_2, double s, double w) const;
};

}  // namespace lostmotion::control
