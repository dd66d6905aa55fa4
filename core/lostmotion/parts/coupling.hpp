// Contacts of two shafts at equal speed: a commanded friction clutch, a safety clutch, a freewheel.
#pragma once

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
};

}  // namespace lostmotion::model
