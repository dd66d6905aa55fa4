// A train at one instant of a motion, by the layout of its assembly, so that it can be explained and linearised
// whatever the kernel that has led to it.
#pragma once

#include <vector>

#include "../model/instant.hpp"
#include "train_channels.hpp"

namespace lostmotion {

struct TrainPoint {
    model::Instant now;  // time, states, memory, inputs
    model::Key key;
    std::vector<double> values;  // of all channels
};

}  // namespace lostmotion
