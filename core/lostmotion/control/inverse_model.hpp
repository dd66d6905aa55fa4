// Feedforward by the drive's own model, with losses that depend on load and speed, and their adaptation: what the
// reference needs of the motor through one gear.
//
//   T_2* = J_Z phi*'' + b_Z phi*' + M_Z,  d* = P^-1(T_2*),  w* = i (phi*' + d*'),  s = sgn phi*'
//   M_ff = J_MR w*' + b_MR w* + T_2*/i + s T_10 + kappa Y,  Y = s M_2B(T_2*)/i
//
// kappa and T_10 follow the error of the speed (Slotine and Li 1987): kappa' = g_1 e Y, T_10' = g_2 e s.
#pragma once

#include <algorithm>
#include <limits>

#include "../parts/torsion_curve.hpp"
#include "gear_losses.hpp"
#include "reference.hpp"
#include "slots.hpp"

namespace lostmotion::control {

// How fast a parameter follows the error, and where it has to stay.
struct Adaptation {
    double rate = 0.0;
    double min = -std::numeric_limits<double>::infinity(), max = std::numeric_limits<double>::infinity();

    void operator()(double& parameter, double error, double regressor, double sample_time) const {
        if (rate > 0.0) parameter = std::clamp(parameter + rate * sample_time * error * regressor, min, max);
    }
};

struct InverseModel {
    bool present = false;
    double motor_inertia = 0.0, motor_viscous_friction = 0.0;  // J_MR [kg m2], b_MR [N m s/rad]
    double load_inertia = 0.0, load_viscous_friction = 0.0;    // J_Z, b_Z
    double load_torque = 0.0;                                  // M_Z [N m]
    GearLosses losses;
    double loss_factor = 1.0, friction_torque = 0.0;  // kappa and T_10 [N m] at the start
    Adaptation of_losses, of_friction;
    double min_speed = 0.0;     // [rad/s] of the motor's reference, below which nothing is adapted
    bool through_gear = false;  // the encoder is on the motor: its reference is ahead by the twist
    TorsionCurve curve;
    double twist_rate = std::numeric_limits<double>::infinity();  // [rad/s]

    void place(Slots& slots) { first_ = slots.take(present ? 4 : 0); }
    void start(double* slot) const;
    double loss_factor_now(const double* slot) const { return slot[first_]; }
    double friction_now(const double* slot) const { return slot[first_ + 1]; }

    // By how much the position of the encoder's shaft, in terms of the load's, is to be ahead of the reference [rad],
    // and the rate of that.
    struct Ahead {
        double angle = 0.0, rate = 0.0;
    };
    Ahead twist(double speed, double acceleration, double observed_load, double sample_time, double* slot) const;
    // M_ff [N m] for phi*' and phi*'' of the reference's shaft, and what it adapts by.
    struct Known {
        double torque = 0.0;
        double losses = 0.0, way = 0.0;  // Y [N m] and s; 0 where nothing is adapted
    };
    Known torque(double speed, double acceleration, double observed_load, const double* slot) const;
    // error: what the speed of the motor lacks [rad/s].
    void adapt(const Known& by, double error, double sample_time, double* slot) const;

 private:
    double output_torque(double speed, double acceleration, double observed_load) const {
        return load_inertia * acceleration + load_viscous_friction * speed + load_torque + observed_load;
    }
    // P^-1; within a gap, which carries no torque, its middle.
    double inverse(double torque) const;

    int first_ = 0;
};

}  // namespace lostmotion::control
