// The speed that a controller makes of the angles that it has read.
#pragma once

#include <limits>

#include "../parts/field.hpp"
#include "slots.hpp"

namespace lostmotion::control {

struct SpeedEstimate {
    enum Kind { exact, difference, observer } kind = difference;

    int span = 1;
    double time_constant = 0.0;
    double bandwidth = 0.0;  // of the observer, as the rest
    double damping = 1.0;
    double inertia = std::numeric_limits<double>::infinity();

    template <class Fields>
    void describe_difference(Fields& f) {
        f.integer({.key = "span", .meaning = "sample times that the difference is taken over"}, span, 1, 1000);
        f.number({"time_constant", "tau", "s", Range::not_negative, Given::has_default,
                  "of the filter: y += (1 - exp(-T/tau)) (x - y)"},
                 time_constant);
    }
    template <class Fields>
    void describe_observer(Fields& f) {
        f.number({"bandwidth", "w_o", "Hz", Range::positive, Given::needed, "w_o/(2 pi)"}, bandwidth);
        f.number({"damping", "zeta", "", Range::positive}, damping);
        f.number({"inertia", "J", "kg*m^2", Range::limit, Given::may_be_left_out,
                  "J at the motor that the torque accelerates; left out, the observer does not know of the torque"},
                 inertia);
    }
    template <class Fields>
    void describe(Fields& f) {
        f.choice("kind", kind, {"exact", "difference", "observer"});
        if (kind == difference) describe_difference(f);
        if (kind == observer) describe_observer(f);
    }

    void place(Slots& slots, double sample_time);
    // At rest at an angle.
    void start(double angle, double speed, double sample_time, double* slot) const;
    // angle [rad], speed [rad/s] as it is, torque [N m] that the controller takes to act, of a sample.
    double operator()(double angle, double speed, double torque, double sample_time, double* slot) const;

 private:
    LowPass filter_;
    double w_o_ = 0.0;  // [rad/s]
    int first_ = 0;
};

}  // namespace lostmotion::control
