// Why a train is stuck: what each contact holds and could hold, and the command of each motor that would turn it.
#pragma once

#include <string>
#include <vector>

#include "../model/names.hpp"
#include "../simulation/train_point.hpp"
#include "breakaway.hpp"
#include "explain.hpp"

namespace lostmotion {

struct TrainContactReport : ContactReport {
    std::string name;
    std::vector<model::CapacityShare> shares;  // of its capacities, by element
};

std::vector<TrainContactReport> explain_contacts(const model::Assembly& a, const TrainPoint& p);

struct MotorReport {
    std::string name;
    double command_forward, command_backward;  // from which on its shaft goes on turning; see Breakaway
};

std::vector<MotorReport> explain_motors(const model::Assembly& a, const TrainPoint& p);

}  // namespace lostmotion
