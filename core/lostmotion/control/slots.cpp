#include "slots.hpp"

#include <algorithm>

#include "../base/powers.hpp"

namespace lostmotion::control {

int Slots::take(int count) {
    const int first = count_;
    count_ += count;
    return first;
}

double SampleDelay::operator()(double in, double* slot) const {
    return samples == 0 ? in : shifted(in, slot + first, samples);
}

double share_of(double sample_time, double time) {
    return time > 0.0 ? -exponential_minus_one(-sample_time / time) : 1.0;
}

double shifted(double in, double* kept, int count) {
    const double out = kept[0];
    std::copy(kept + 1, kept + count, kept);
    kept[count - 1] = in;
    return out;
}

}  // namespace lostmotion::control
