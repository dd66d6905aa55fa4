// The instants of a record.
#pragma once

#include <cstddef>
#include <span>

namespace lostmotion {

// The multiples of an interval, or a list.
struct SampleTimes {
    double interval = 1e-3;  // [s]
    std::size_t count = 0;
    std::span<const double> listed;  // [s], ascending, `count` of them; none: k * interval from k = 0

    double operator[](std::size_t k) const { return listed.empty() ? static_cast<double>(k) * interval : listed[k]; }
};

}  // namespace lostmotion
