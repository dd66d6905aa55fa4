// Why a train is stuck: what each contact holds and could hold, and the command of each motor that would turn it.
#pragma once

#include <string>
#include <vector>

#include "../model/names.hpp"
#include "../simulation/train_point.hpp"
#include "breakaway.hpp"

namespace lostmotion {

struct ContactReport {
    std::string name;
    int mode = 0;                              // -1, 0, +1
    double speed = 0.0;                        // [rad/s]
    double torque = 0.0;                       // what the contact holds or takes [N m]
    double capacity_forward = 0.0;             // largest torque it holds before it slips forward [N m]
    double capacity_backward = 0.0;            // ... and backward, as a magnitude [N m]
    std::vector<model::CapacityShare> shares;  // of its capacities, by element
    bool determined = true;                    // false: rest leaves open what it and others that are rigid hold each
};

std::vector<ContactReport> explain_contacts(const model::Assembly& a, const TrainPoint& p);

struct MotorReport {
    std::string name;
    double command_forward, command_backward;  // from which on its shaft goes on turning; see Breakaway
};

std::vector<MotorReport> explain_motors(const model::Assembly& a, const TrainPoint& p);

}  // namespace lostmotion
