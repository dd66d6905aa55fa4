#include "slots.hpp"

namespace lostmotion::control {

int Slots::take(int count) {
    const int first = count_;
    count_ += count;
    return first;
}

double TickDelay::operator()(double in, std::int64_t tick, double* slot) const {
    if (ticks == 0) return in;
    double& kept = slot[first + tick % ticks];
    const double out = kept;
    kept = in;
    return out;
}

}  // namespace lostmotion::control
