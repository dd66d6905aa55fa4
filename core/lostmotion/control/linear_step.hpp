// A sample step of a controller as matrices, for linear models.
//
// Away from its limits, from the steps of its encoders and from its dead zone, Axis::step is affine in what it
// remembers, in what is sampled and in its reference, so that its differences along unit vectors are its matrices.
// Field orientation is smooth about a steady motion; its derivatives are differences of order 6.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "axis.hpp"

namespace lostmotion::control {

// Row by row: of each output its dependence on the state (the slots) and on the inputs behind it.
struct LinearStep {
    std::size_t columns = 0;
    std::vector<double> rows;
};

// Inputs: angle of the position's encoder and of the speed's [rad], speed of the latter [rad/s], torque of the motor
// [N m]; value, rate and acceleration of the reference; and, where the loop is cut, its measured value. Outputs: the
// slots. The outermost loop is the one given: the reference is that of this loop, of the motor where it is none of the
// axis itself, and nothing is fed forward then. Without its field orientation, whose torque_reference it gives.
LinearStep linear_step(const Axis& axis, Loop outermost, bool cut, std::int64_t sample, double sample_time);

// A motion of constant speed in which currents and voltages repeat from sample to sample of the currents.
struct SteadyOrientation {
    double speed = 0.0;        // of the rotor [rad/s]
    double lag = 0.0;          // electrical angle by which the rotor is ahead of what is read [rad]
    double torque = 0.0;       // that is asked for [N m]
    double weakening = 0.0;    // of i_d* [A], not above 0
    DirectQuadrature current;  // i* [A]
    DirectQuadrature voltage;  // that is asked for [V]
};

// Of the currents, which component is looked at: its reference is an input then. Else the torque is.
enum class CurrentAxis { none, direct, quadrature };

// `since`: samples since the last sample of the currents, `every` samples apart. Inputs: torque that is asked for,
// speed, angle and true angle of the rotor, its currents; reference and, where it is cut, measured value of the current
// looked at. Outputs: the slots, the voltage u_d and u_q that acts, and both currents as they are measured.
LinearStep linear_orientation(const FieldOrientation& law, const SteadyOrientation& motion, CurrentAxis outermost,
                              bool cut, int every, int since, double sample_time);

}  // namespace lostmotion::control
