// The speed that a controller makes of the angles that it has read.
#pragma once

#include "slots.hpp"

namespace lostmotion::control {

struct SpeedEstimate {
    enum Kind { exact, difference, observer } kind = difference;

    int span = 1;            // sample times that the difference is taken over
    double smoothing = 1.0;  // of the difference, 1 - exp(-T_s/tau): y += smoothing (x - y)
    double bandwidth = 0.0;  // w_o [rad/s] of the observer
    double damping = 1.0;    // zeta
    double inertia = 0.0;    // J [kg m2] that the observer takes the torque to accelerate; 0: it does not

    void place(Slots& slots) { first_ = slots.take(kind == observer ? 2 : 1 + span); }
    // At rest at an angle.
    void start(double angle, double speed, double sample_time, double* slot) const {
        double* s = slot + first_;
        if (kind == observer) {
            s[0] = angle;
            s[1] = speed;
            return;
        }
        s[0] = speed;
        for (int k = 0; k < span; ++k) s[1 + k] = angle - speed * sample_time * (span - k);
    }
    // angle [rad], speed [rad/s] as it is, torque [N m] that the controller takes to act, of sample n.
    double operator()(double angle, double speed, double torque, std::int64_t n, double sample_time,
                      double* slot) const {
        double* s = slot + first_;
        if (kind == exact) return speed;
        if (kind == difference) {
            double& before = s[1 + n % span];
            s[0] += smoothing * ((angle - before) / (sample_time * span) - s[0]);
            before = angle;
            return s[0];
        }
        // Of this sample what the last ones predict, corrected for the next.
        const double T = sample_time, e = angle - s[0], estimate = s[1];
        const double acceleration = inertia > 0.0 ? torque / inertia : 0.0;
        s[0] += T * (s[1] + 2.0 * damping * bandwidth * e) + 0.5 * T * T * acceleration;
        s[1] += T * (bandwidth * bandwidth * e + acceleration);
        return estimate;
    }

 private:
    int first_ = 0;
};

}  // namespace lostmotion::control
