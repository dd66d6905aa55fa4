// A holding brake: a dry contact of a shaft with the frame, whose capacity is commanded.
#pragma once

#include <algorithm>
#include <string>

namespace lostmotion::model {

// Capacity torque * u with the input u in [0, 1]; below 0 it is open, above 1 fully engaged. On its shaft it adds to
// whatever else is dry there: one speed, one sign.
struct Brake {
    std::string name;
    int shaft = 0;
    double torque = 0.0;  // [N m] at u = 1

    double capacity(double u) const { return torque * std::clamp(u, 0.0, 1.0); }
};

}  // namespace lostmotion::model
