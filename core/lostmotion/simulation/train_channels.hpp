// What can be read of a train at an instant: the channels of a record.
#pragma once

#include <string>
#include <vector>

#include "../model/names.hpp"

namespace lostmotion {

// At a jump a channel has its right limit.
struct TrainChannel {
    enum Kind {
        input,
        state,
        motor_torque,
        output_torque,
        input_torque,
        contact_torque,
        drive_torque,
        massless_speed,
        loss_coefficient,
        contact_mode,
        shaft_sign,  // of the speed: what shows how a contact slips that the train does not have
        twist_sign,
        output,
        error,
        pressing_torque,
        field_lead
    } kind;
    // The number of the input, state, motor, gear, contact, given motion, shaft, controller or element; of a shaft
    // without inertia, that among these.
    int index;
    std::string name, unit, meaning, symbol = {};
};

// The inputs from this one on are those of the controllers.
std::size_t first_reference(const model::Assembly& a);

void add_controller_channels(const model::Assembly& a, int controller, std::vector<TrainChannel>& out);

std::vector<TrainChannel> train_channels(const model::Assembly& a);

// A train that has been composed, with all that can be read of it. What it refers to must stay.
struct TrainModel {
    const model::Assembly& assembly;
    const std::vector<TrainChannel>& channels;
};

}  // namespace lostmotion
