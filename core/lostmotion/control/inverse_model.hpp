// Feedforward by the drive's own model, with losses that depend on load and speed, and their adaptation: what the
// reference needs of the motor through one gear.
//
//   T_2* = J_Z phi*'' + b_Z phi*' + M_Z,  d* = P^-1(T_2*),  w* = i (phi*' + d*'),  s = sgn(i phi*')
//   M_ff = J_MR w*' + b_MR w* + T_2*/i + s T_10 + kappa Y,  Y = s M_2B(T_2*)/|i|
//
// kappa and T_10 follow the error of the speed (Slotine and Li 1987): kappa' = g_1 e Y, T_10' = g_2 e s.
#pragma once

#include <algorithm>
#include <array>
#include <limits>

#include "../parts/field.hpp"
#include "../parts/torsion_curve.hpp"
#include "gear_losses.hpp"
#include "reference.hpp"
#include "slots.hpp"

namespace lostmotion::control {

// How fast a parameter follows the error, and where it has to stay.
struct Adaptation {
    double rate = 0.0;
    std::array<double, 2> limits{0.0, 5.0};

    template <class Fields>
    void describe_of_losses(Fields& f) {
        f.number({"rate", "g_1", "1/(N*m)", Range::positive, Given::needed, "g_1"}, rate);
        f.pair({"limits", "", "", Range::not_negative, Given::has_default, "that the factor stays within"}, limits);
    }
    template <class Fields>
    void describe_of_friction(Fields& f) {
        f.number({"rate", "g_2", "N*m/rad", Range::positive, Given::needed, "g_2"}, rate);
        f.pair({"limits", "", "N*m", Range::not_negative, Given::needed, "that the torque stays within"}, limits);
    }

    void operator()(double& parameter, double error, double regressor, double sample_time) const {
        if (rate > 0.0)
            parameter = std::clamp(parameter + rate * sample_time * error * regressor, limits[0], limits[1]);
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
    double min_speed = 0.0;     // of the motor's reference
    bool through_gear = false;  // the encoder is on the motor: its reference is ahead by the twist
    TorsionCurve curve;
    double twist_rate = std::numeric_limits<double>::infinity();  // [rad/s]

    template <class Fields>
    void describe(Fields& f) {
        f.number({"efficiency", "eta", "", Range::up_to_one, Given::may_be_left_out,
                  "constant efficiency, in the place of the losses of the gear"},
                 losses.efficiency);
        f.number(
            {"loss_factor", "kappa", "", Range::not_negative, Given::has_default, "kappa at the start, on the losses"},
            loss_factor);
        f.number({"friction_torque", "T_10", "N*m", Range::not_negative, Given::may_be_left_out, "T_10 at the start"},
                 friction_torque);
        f.number({"load_inertia", "J_Z", "kg*m^2", Range::not_negative, Given::may_be_left_out}, load_inertia);
        f.number({"load_torque", "M_Z", "N*m", Range::any, Given::has_default,
                  "M_Z that is known beforehand, against the motion forward"},
                 load_torque);
        f.number(
            {"twist_rate", "", "rad/s", Range::limit, Given::may_be_left_out,
             "at which the motor passes through a gap, in terms of the load's shaft; needed where the gear has one"},
            twist_rate);
        f.number({"min_speed", "w_min", "rad/s", Range::not_negative, Given::has_default,
                  "of the motor, below which nothing is adapted or observed"},
                 min_speed);
        f.number({"motor_inertia", "J_MR", "kg*m^2", Range::not_negative, Given::none}, motor_inertia);
        f.number({"motor_viscous_friction", "b_MR", "N*m*s/rad", Range::not_negative, Given::none},
                 motor_viscous_friction);
        f.number({"load_viscous_friction", "b_Z", "N*m*s/rad", Range::not_negative, Given::none},
                 load_viscous_friction);
    }

    void place(Slots& slots) { first_ = slots.take(present ? 4 : 0); }
    void start(double* slot) const;
    double loss_factor_now(const double* slot) const { return slot[first_]; }
    double friction_now(const double* slot) const { return slot[first_ + 1]; }

    // By how much the position of the encoder's shaft, in terms of the load's, is to be ahead of the reference [rad],
    // and the rate of that.
    struct Twist {
        double angle = 0.0, rate = 0.0;
    };
    Twist twist(double speed, double acceleration, double observed_load, double sample_time, double* slot) const;
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
