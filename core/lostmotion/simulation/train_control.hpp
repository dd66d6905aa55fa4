// Controllers in a train.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "../model/assembly.hpp"
#include "controllers.hpp"

namespace lostmotion {

// What is wrong with the controllers of a train, or empty.
std::string check_control(const model::Assembly& a, const Control& control);

// A controller in a train.
struct AxisRows {
    int command;  // of its motor, among the inputs
    // The measured signals, in the order of control::Sampled.
    std::array<model::Row, 7> measured;
};
std::vector<AxisRows> axis_rows(const model::Assembly& a, const Control& control);

}  // namespace lostmotion
