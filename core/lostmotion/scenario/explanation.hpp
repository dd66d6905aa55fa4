// Why a scenario stands still at an instant: what holds each contact, and the commands from which on the motors turn.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "../analysis/train_explain.hpp"
#include "scenario.hpp"

namespace lostmotion {

struct Explanation {
    std::string error;  // why the motion does not reach the instant, or empty
    std::vector<ContactReport> contacts;
    std::vector<MotorReport> motors;
};

// The scenario has passed its check; time is not negative.
Explanation explain(const Scenario& s, double time);

}  // namespace lostmotion
