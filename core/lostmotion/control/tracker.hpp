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
    void start(double angle, double rate, double* slot) const;
    // A measured direction [rad] of an instant [s].
    void operator()(double direction, double time, double* slot) const;
    ReferencePoint at(double time, const double* slot) const;

 private:
    ReferencePoint extrapolated(double time, const double* slot) const;

    int first_ = 0;
};

}  // namespace lostmotion::control
