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
    double torque = 0.0;            // [N m] while it slips, at u = 1
    double breakaway_torque = 0.0;  // [N m] at rest, at u = 1; what lies below `torque` means that torque

    double holding() const { return std::max(torque, breakaway_torque); }
    // Torque [N m] that it holds at rest, or takes while it slips, at command u.
    double capacity(double u, bool at_rest) const { return (at_rest ? holding() : torque) * std::clamp(u, 0.0, 1.0); }
};

}  // namespace lostmotion::model
