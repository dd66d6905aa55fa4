#include "slots.hpp"

#include <algorithm>

namespace lostmotion::control {

int Slots::take(int count) {
    const int first = count_;
    count_ += count;
    return first;
}

double TickDelay::operator()(double in, double* slot) const {
    return ticks == 0 ? in : shifted(in, slot + first, ticks);
}

double shifted(double in, double* kept, int count) {
    const double out = kept[0];
    std::copy(kept + 1, kept + count, kept);
    kept[count - 1] = in;
    return out;
}

}  // namespace lostmotion::control
