// Where a target is and goes, from measured directions: the filter that is called alpha-beta, or with an acceleration
// alpha-beta-gamma.
#pragma once

#include <limits>

#include "../parts/field.hpp"
#include "reference.hpp"
#include "slots.hpp"

namespace lostmotion::control {

// At a frame of time t_n, with the prediction x, v, a from the last one that showed the target and r = z - x:
//   x += alpha r,  v += (beta/T) r,  a += (gamma/(2 T^2)) r   (Kalata 1984)
struct Tracker {
    double alpha = 1.0, beta = 0.0, gamma = 0.0;
    double tracking_index = std::numeric_limits<double>::infinity();
    bool prediction = true;
    double frame_time = 1.0;  // T [s]

    template <class Fields>
    void describe(Fields& f) {
        f.number({"alpha", "alpha", "", Range::positive, Given::may_be_left_out}, alpha);
        f.number({"beta", "beta", "", Range::not_negative, Given::may_be_left_out}, beta);
        f.number({"gamma", "gamma", "", Range::not_negative, Given::has_default,
                  "0: the target is taken to move at constant speed"},
                 gamma);
        f.number(
            {"tracking_index", "Lambda", "", Range::limit, Given::may_be_left_out,
             "in the place of alpha and beta: T^2 times the deviation of the target's acceleration over that of the "
             "noise, for which\nalpha and beta are best (Kalata 1984)"},
            tracking_index);
        f.flag({.key = "prediction",
                .meaning =
                    "whether the angle goes on at the expected rate from the exposure of the last frame; without, it "
                    "stays"},
               prediction);
    }

    // Takes alpha and beta from the tracking index if that is given.
    void place(Slots& slots);
    void start(double angle, double rate, double* slot) const;
    // A measured direction [rad] of an instant [s].
    void operator()(double direction, double time, double* slot) const;
    ReferencePoint at(double time, const double* slot) const;

 private:
    ReferencePoint extrapolated(double time, const double* slot) const;

    int first_ = 0;
};

}  // namespace lostmotion::control
