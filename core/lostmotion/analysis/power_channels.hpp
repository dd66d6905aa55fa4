// Channels of a train whose products are powers.
#pragma once

#include <vector>

#include "../simulation/train_channels.hpp"

namespace lostmotion {

struct PowerChannels {
    struct Pair {
        int torque, speed;
    };
    struct Gear {
        Pair in, out;
        bool last;               // its output shaft turns no other gear
        int housing_speed = -1;  // -1: it stands
    };
    std::vector<Pair> motors;
    std::vector<Gear> gears;
};

PowerChannels power_channels(const model::Assembly& a, const std::vector<TrainChannel>& channels);

}  // namespace lostmotion
