// The numbers of the law that a curve was made by: scenario files and descriptions have these in place of its points.
#pragma once

#include <vector>

namespace lostmotion {

struct Origin {
    int law = 0;  // its number; 0: the points are given
    std::vector<double> numbers;
};

}  // namespace lostmotion
