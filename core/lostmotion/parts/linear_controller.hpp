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
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

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

    // Points of the curve from (0, 0) on, beyond the last of which it is constant; none: a line of slope 1.
    std::vector<double> curve_in, curve_out;
    double droop = 0.0;  // [s/rad]

    bool curved() const { return !curve_in.empty(); }
    // Number of a piece, with the sign of its side; that about 0 belongs to both.
    int piece(double in) const {
        int k = 0;
        while (k + 1 < static_cast<int>(curve_in.size()) && std::fabs(in) > curve_in[at(k + 1)]) ++k;
        return in < 0.0 ? -k : k;
    }
    double slope(int piece) const {
        const std::size_t k = at(std::abs(piece));
        if (k + 1 >= curve_in.size()) return 0.0;
        return (curve_out[k + 1] - curve_out[k]) / (curve_in[k + 1] - curve_in[k]);
    }
    // What a piece adds to its slope times the input.
    double offset(int piece) const {
        const std::size_t k = at(std::abs(piece));
        const double beyond = curve_out[k] - slope(piece) * curve_in[k];
        return piece < 0 ? -beyond : beyond;
    }
    double steepest() const {
        double most = curved() ? 0.0 : 1.0;
        for (int k = 0; k < static_cast<int>(curve_in.size()); ++k) most = std::max(most, std::fabs(slope(k)));
        return most;
    }

    bool limited() const { return limit < std::numeric_limits<double>::infinity(); }
    bool takes(Signal::Kind kind) const {
        return std::any_of(signals.begin(), signals.end(), [kind](const Signal& s) { return s.kind == kind; });
    }
    bool takes_angle(int shaft) const {
        return std::any_of(signals.begin(), signals.end(),
                           [shaft](const Signal& s) { return s.kind == Signal::angle && s.shaft == shaft; }) ||
               (compared.kind == Signal::angle && compared.shaft == shaft);
    }

 private:
    static std::size_t at(int k) { return static_cast<std::size_t>(k); }
};

}  // namespace lostmotion::model
