// Where the blocks of a controller keep what they remember: one row of numbers, so that all of it can be copied,
// compared and restored.
#pragma once

#include <cstdint>

namespace lostmotion::control {

// Gives each block its place in the row.
class Slots {
 public:
    int take(int count);
    int count() const { return count_; }

 private:
    int count_ = 0;
};

// What a signal was some ticks ago.
struct TickDelay {
    int ticks = 0;
    int first = 0;  // slot

    void place(Slots& slots) { first = slots.take(ticks); }
    double operator()(double in, std::int64_t tick, double* slot) const;
    void fill(double value, double* slot) const {
        for (int k = 0; k < ticks; ++k) slot[first + k] = value;
    }
};

}  // namespace lostmotion::control
