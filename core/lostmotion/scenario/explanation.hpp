// Why a scenario stands still at an instant: what holds each contact, and the commands from which on the motors turn.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "../analysis/train_explain.hpp"
#include "../simulation/run.hpp"
#include "scenario.hpp"

namespace lostmotion {

struct NamedContact : ContactReport {
    std::string name;
};
struct Explanation {
    std::string error;  // why the motion does not reach the instant, or empty
    std::vector<NamedContact> contacts;
    std::vector<MotorReport> motors;  // of a drive: what moves its load
};

namespace explanation {

Explanation of_drive(const Scenario& s, double time);

Explanation of_train(const Scenario& s, double time);

}  // namespace explanation

// The scenario has passed its check; time is not negative.
Explanation explain(const Scenario& s, double time);

}  // namespace lostmotion
