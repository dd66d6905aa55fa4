// A continuous controller of a motor: a linear system of a reference and of measured angles and speeds, whose output is
// limited.
//
//     x' = A x + B y + back_calculation (u - v),   v = C x + D y,   u = v within +-limit, else the limit
//
// The term with u - v is anti-windup by back-calculation (docs/theory.md, continuous controllers). Each of the three
// ranges of v is a regime; v is continuous, and so are the rates of x where it passes a limit.
//
// The firmware of a servo puts a curve before the limit: v = curve(C x + D y) - droop w, with the speed w of the motor.
// The curve is odd and piecewise linear, and each of its pieces is a regime as well.
#pragma once

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "torsion_curve.hpp"

namespace lostmotion::model {

struct LinearController {
    // One of the y.
    struct Signal {
        enum Kind {
            reference,
            reference_rate,  // its time derivative
            angle,           // [rad] of a shaft
            speed,           // [rad/s] of a shaft
        } kind = reference;
        int shaft = 0;
    };
    std::string name;  // of its motor
    int motor = 0;     // whose command u is
    std::vector<Signal> signals;
    Signal compared;                  // what the reference is compared with: for the record of the error
    std::vector<std::string> states;  // their names
    std::vector<std::vector<double>> A, B;
    std::vector<double> C, D, back_calculation;
    double limit = std::numeric_limits<double>::infinity();  // of |u|

    bool curved = false;  // whether there is the curve; else it is a line of slope 1
    TorsionCurve curve;
    double droop = 0.0;  // [s/rad]

    bool limited() const { return limit < std::numeric_limits<double>::infinity(); }
    bool takes(Signal::Kind kind) const {
        return std::any_of(signals.begin(), signals.end(), [kind](const Signal& s) { return s.kind == kind; });
    }
    bool takes_angle(int shaft) const {
        return std::any_of(signals.begin(), signals.end(),
                           [shaft](const Signal& s) { return s.kind == Signal::angle && s.shaft == shaft; }) ||
               (compared.kind == Signal::angle && compared.shaft == shaft);
    }
};

}  // namespace lostmotion::model
