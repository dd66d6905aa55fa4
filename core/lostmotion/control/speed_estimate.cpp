#include "speed_estimate.hpp"

#include <numbers>

namespace lostmotion::control {

void SpeedEstimate::place(Slots& slots, double sample_time) {
    first_ = slots.take(kind == observer ? 2 : 1 + span);
    filter_.place(sample_time, time_constant);
    w_o_ = 2.0 * std::numbers::pi * bandwidth;
}

void SpeedEstimate::start(double angle, double speed, double sample_time, double* slot) const {
    double* s = slot + first_;
    if (kind == observer) {
        s[0] = angle;
        s[1] = speed;
        return;
    }
    s[0] = speed;
    for (int k = 0; k < span; ++k) s[1 + k] = angle - speed * sample_time * (span - k);
}

double SpeedEstimate::operator()(double angle, double speed, double torque, double sample_time, double* slot) const {
    double* s = slot + first_;
    if (kind == exact) return speed;
    if (kind == difference) return filter_((angle - shifted(angle, s + 1, span)) / (sample_time * span), s[0]);
    // Of this sample what the last ones predict, corrected for the next.
    const double T = sample_time, e = angle - s[0], estimate = s[1];
    const double acceleration = torque / inertia;
    s[0] += T * (s[1] + 2.0 * damping * w_o_ * e) + 0.5 * T * T * acceleration;
    s[1] += T * (w_o_ * w_o_ * e + acceleration);
    return estimate;
}

}  // namespace lostmotion::control
