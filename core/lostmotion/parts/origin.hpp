// What a law of the core made a curve of: scenario files and descriptions have these numbers in place of its points.
#pragma once

#include <vector>

namespace lostmotion {

struct Origin {
    int law = 0;  // its number; 0: the points are given
    std::vector<double> numbers;
};

}  // namespace lostmotion
