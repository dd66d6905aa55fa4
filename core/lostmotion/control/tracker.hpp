// Where a target is and goes, from measured directions: the filter that is called alpha-beta, or with an acceleration
// alpha-beta-gamma.
#pragma once

#include "reference.hpp"
#include "slots.hpp"

namespace lostmotion::control {

// At a frame of time t_n, with the prediction x, v, a from the last one that showed the target and r = z - x:
//   x += alpha r,  v += (beta/T) r,  a += (gamma/(2 T^2)) r   (Kalata 1984)
struct Tracker {
    double alpha = 1.0, beta = 0.0, gamma = 0.0;
    double frame_time = 1.0;  // T [s]
    bool predicts = true;     // else the angle stays that of the last frame until the next

    void place(Slots& slots) { first_ = slots.take(4); }
    void start(double angle, double rate, double* slot) const {
        double* s = slot + first_;
        s[0] = angle;
        s[1] = rate;
    }
    // A measured direction [rad] of an instant [s].
    void operator()(double direction, double time, double* slot) const {
        double* s = slot + first_;
        const ReferencePoint p = extrapolated(time, slot);
        const double r = direction - p.value;
        s[0] = p.value + alpha * r;
        s[1] = p.rate + beta / frame_time * r;
        s[2] = p.second + gamma / (2.0 * frame_time * frame_time) * r;
        s[3] = time;
    }
    ReferencePoint at(double time, const double* slot) const {
        ReferencePoint p = extrapolated(time, slot);
        if (!predicts) p.value = slot[first_];
        return p;
    }

 private:
    ReferencePoint extrapolated(double time, const double* slot) const {
        const double *s = slot + first_, h = time - s[3];
        return {s[0] + h * (s[1] + 0.5 * h * s[2]), s[1] + h * s[2], s[2]};
    }

    int first_ = 0;
};

}  // namespace lostmotion::control
