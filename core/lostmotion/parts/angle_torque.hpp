// A torque that depends on the angle of its shaft: gravity or unbalance (m g r sin phi), cogging, ripple.
#pragma once

#include <string>

#include "periodic_curve.hpp"

namespace lostmotion::model {

struct AngleTorque {
    std::string name;
    int shaft = 0;
    PeriodicCurve torque;  // [N m] on the shaft, in the direction of its angle
};

}  // namespace lostmotion::model
