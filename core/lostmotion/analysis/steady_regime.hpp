// The linear regime of a train in steady motion: every dry contact slips the way its shaft turns, clutches are closed,
// brakes open, rigid gears hold. Its eigenvalues say whether such a motion lasts.
//
// Torques over angle, springs and transmission errors are left out: they change within a turn.
#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "../model/names.hpp"

namespace lostmotion {

struct SteadyMotion {
    std::vector<double> speed;   // of each shaft [rad/s]
    std::vector<double> torque;  // T_2 of each gear [N m]
};

struct SteadyRegime {
    std::vector<std::string> states;  // coupled ones, as they are named in results
    std::vector<double> rate;         // d(rate of state k)/d(state j), row by row
    bool determined = true;           // false: no motion or several (rigid gears jam)
};

model::Key key_of(const model::Assembly& a, const SteadyMotion& motion);

// The train must have passed the check.
SteadyRegime steady_regime(model::Train train, const SteadyMotion& motion);

}  // namespace lostmotion
