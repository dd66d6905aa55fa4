// Contacts of two shafts at equal speed: a commanded friction clutch, a safety clutch, a freewheel.
#pragma once

#include <algorithm>
#include <limits>
#include <string>

namespace lostmotion::model {

struct Coupling {
    enum Kind {
        clutch,         // capacity torque * u, u in [0, 1], the same for rest and slip
        safety_clutch,  // capacity torque
        freewheel,      // carries any torque that drives the output forward, none backward
    };
    std::string name;
    Kind kind = clutch;
    int input = 0, output = 0;  // shafts
    double torque = 0.0;        // [N m]

    bool commanded() const { return kind == clutch; }
    // Torque [N m] that it passes on at most before it slips in direction s. u: the command, if it has one.
    double capacity(int s, double u) const {
        if (kind == freewheel) return s > 0 ? std::numeric_limits<double>::infinity() : 0.0;
        return kind == clutch ? torque * std::clamp(u, 0.0, 1.0) : torque;
    }
};

}  // namespace lostmotion::model
