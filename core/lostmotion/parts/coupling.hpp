// Contacts of two shafts at equal speed: a commanded friction clutch, a safety clutch, a freewheel.
#pragma once

#include <algorithm>
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
};

}  // namespace lostmotion::model
