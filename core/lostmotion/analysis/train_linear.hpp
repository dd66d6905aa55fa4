// The regime of a train at a point as matrices: its rates and outputs over states and inputs.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "../model/names.hpp"
#include "../simulation/train_point.hpp"
#include "shared_torque.hpp"

namespace lostmotion {

struct LinearRegime {
    std::vector<std::string> states;  // those that the train moves
    std::vector<double> state;        // their values
    std::vector<std::string> outputs;
    // A row each: over the states, over the inputs, constant.
    std::vector<std::vector<double>> rate, output;
};

LinearRegime linearize(const model::Assembly& a, const std::vector<TrainChannel>& channels, const TrainPoint& p);

}  // namespace lostmotion
