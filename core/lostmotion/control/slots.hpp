// Where the blocks of a controller keep what they remember: one row of numbers, so that all of it can be copied,
// compared and restored.
#pragma once

namespace lostmotion::control {

// Gives each block its place in the row.
class Slots {
 public:
    int take(int count);
    int count() const { return count_; }

 private:
    int count_ = 0;
};

// The first of some numbers, whose place the others move up to and a new one joins.
double shifted(double in, double* kept, int count);

// What a signal was some ticks ago; the oldest value comes first.
struct TickDelay {
    int ticks = 0;
    int first = 0;  // slot

    void place(Slots& slots) { first = slots.take(ticks); }
    double operator()(double in, double* slot) const;
    void fill(double value, double* slot) const {
        for (int k = 0; k < ticks; ++k) slot[first + k] = value;
    }
};

}  // namespace lostmotion::control
