// A drive train: shafts, and what joins, turns, loads and holds them. Parameters only.
#pragma once

#include <vector>

#include "../parts/angle_torque.hpp"
#include "../parts/brake.hpp"
#include "../parts/coupling.hpp"
#include "../parts/gear.hpp"
#include "../parts/linear_controller.hpp"
#include "../parts/shaft.hpp"
#include "../parts/shaft_motor.hpp"

namespace lostmotion::model {

struct Train {
    std::vector<Shaft> shafts;
    std::vector<ShaftMotor> motors;
    std::vector<Gear> gears;
    std::vector<Brake> brakes;
    std::vector<Coupling> couplings;
    std::vector<AngleTorque> angle_torques;
    std::vector<LinearController> controllers;
};

}  // namespace lostmotion::model
