#include "tracker.hpp"

namespace lostmotion::control {

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
    s[2] = p.second + gamma / (2.0 * frame_time * frame_time) * r;
    s[3] = time;
}

auto Tracker::at(double time, const double* slot) const -> ReferencePoint {
    ReferencePoint p = extrapolated(time, slot);
    if (!predicts) p.value = slot[first_];
    return p;
}

auto Tracker::extrapolated(double time, const double* slot) const -> ReferencePoint {
    const double *s = slot + first_, h = time - s[3];
    return {s[0] + h * (s[1] + 0.5 * h * s[2]), s[1] + h * s[2], s[2]};
}

}  // namespace lostmotion::control
