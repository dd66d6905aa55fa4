#include "tracker.hpp"

#include <cmath>

namespace lostmotion::control {

void Tracker::place(Slots& slots) {
    first_ = slots.take(4);
    if (std::isinf(tracking_index)) return;
    // beta^2 = index^2 (1 - alpha) and beta = 2 (2 - alpha) - 4 sqrt(1 - alpha), by r = sqrt(1 - alpha).
    const double index = tracking_index, r = (4.0 + index - std::sqrt(8.0 * index + index * index)) / 4.0;
    alpha = 1.0 - r * r;
    beta = index * r;
}

void Tracker::start(double angle, double rate, double* slot) const {
    double* s = slot + first_;
    s[0] = angle;
    s[1] = rate;
}

void Tracker::operator()(double direction, double time, double* slot) const {
    double* s = slot + first_;
    const ReferencePoint p = extrapolated(time, slot);
    const double r = direction - p.value;
    s[0] = p.value + alpha * r;
    s[1] = p.rate + beta / frame_time * r;
    s[2] = p.acceleration + gamma / (2.0 * frame_time * frame_time) * r;
    s[3] = time;
}

auto Tracker::at(double time, const double* slot) const -> ReferencePoint {
    ReferencePoint p = extrapolated(time, slot);
    if (!prediction) p.value = slot[first_];
    return p;
}

auto Tracker::extrapolated(double time, const double* slot) const -> ReferencePoint {
    const double *s = slot + first_, h = time - s[3];
    return {s[0] + h * (s[1] + 0.5 * h * s[2]), s[1] + h * s[2], s[2]};
}

}  // namespace lostmotion::control
