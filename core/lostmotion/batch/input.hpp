// Inputs of a step of a batch, and the failure that it may report.
#pragma once

#include <cstddef>
#include <string>

namespace lostmotion::batch {

// A value for all drives, or one for each.
struct Input {
    const double* values;
    bool each;
    double operator[](std::size_t k) const { return values[each ? k : 0]; }
};

// A drive that cannot go on.
struct Failure {
    std::size_t drive = 0;
    std::string text;  // empty: there is none

    // Keeps the failure of the drive with the smaller number.
    void add(Failure other) {
        if (!other.text.empty() && (text.empty() || other.drive < drive)) *this = std::move(other);
    }
};

}  // namespace lostmotion::batch
