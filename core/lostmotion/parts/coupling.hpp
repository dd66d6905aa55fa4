// Contacts of two shafts at equal speed: a commanded friction clutch, a safety clutch, a freewheel.
#pragma once

#include <algorithm>
#include <limits>
#include <string>

namespace lostmotion::model {

struct Coupling {
    enum Kind {
        clutch,         // capacity torque * u, u in [0, 1]
        safety_clutch,  // capacity torque
        freewheel,      // carries any torque that drives the output forward, none backward
    };
    std::string name;
    Kind kind = clutch;
    int input = 0, output = 0;      // shafts
    double torque = 0.0;            // [N m] while it slips
    double breakaway_torque = 0.0;  // [N m] at rest; what lies below `torque` means that torque

    bool commanded() const { return kind == clutch; }
    double holding() const { return std::max(torque, breakaway_torque); }
    // Torque [N m] that it passes on before it slips in direction s, or while it does. u: the command, if it has one.
    double capacity(int s, double u, bool at_rest) const {
        if (kind == freewheel) return s > 0 ? std::numeric_limits<double>::infinity() : 0.0;
        return (at_rest ? holding() : torque) * (kind == clutch ? std::clamp(u, 0.0, 1.0) : 1.0);
    }
};

}  // namespace lostmotion::model
