#include "speed_estimate.hpp"

namespace lostmotion::control {

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
    if (kind == difference) {
        s[0] += smoothing * ((angle - shifted(angle, s + 1, span)) / (sample_time * span) - s[0]);
        return s[0];
    }
    // Of this sample what the last ones predict, corrected for the next.
    const double T = sample_time, e = angle - s[0], estimate = s[1];
    const double acceleration = inertia > 0.0 ? torque / inertia : 0.0;
    s[0] += T * (s[1] + 2.0 * damping * bandwidth * e) + 0.5 * T * T * acceleration;
    s[1] += T * (bandwidth * bandwidth * e + acceleration);
    return estimate;
}

}  // namespace lostmotion::control
