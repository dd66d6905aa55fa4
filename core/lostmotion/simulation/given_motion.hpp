// The motion of a shaft over a step: from where it is to what is given for the end, without a jump of its speed.
//
// The acceleration runs in one, two or three straight lines, so that speed, angle and acceleration are met at the end:
// of lines between a_0, a_1, a_2, a_3 at thirds of a step h the integral is (a_0/2 + a_1 + a_2 + a_3/2) h/3, the double
// one (4/3 a_0 + 2 a_1 + a_2 + a_3/6) h^2/9.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <span>

namespace lostmotion {

// What is given for the end of a step; of a slide in m.
struct MotionEnd {
    double speed = 0.0;                  // [rad/s]
    std::optional<double> angle;         // [rad]
    std::optional<double> acceleration;  // [rad/s^2]
};

class MotionCourse {
 public:
    // From an angle, a speed and an acceleration, over a time h > 0. With a speed alone the acceleration is constant;
    // with an angle beside it, one straight line that begins where it has to.
    MotionCourse(const MotionEnd& to, double angle, double speed, double acceleration, double h) : speed_(speed) {
        const double rise = to.speed - speed;
        const double beyond = to.angle ? *to.angle - angle - speed * h : 0.0;  // of where the speed alone would lead
        if (!to.acceleration) {
            const double begin = to.angle ? 6.0 * beyond / (h * h) - 2.0 * rise / h : rise / h;
            set({0.0, h}, {begin, 2.0 * rise / h - begin});
            return;
        }
        const double end = *to.acceleration;
        if (!to.angle) {
            set({0.0, 0.5 * h, h}, {acceleration, 2.0 * rise / h - 0.5 * (acceleration + end), end});
            return;
        }
        const double third = h / 3.0, once = rise / third - 0.5 * (acceleration + end),
                     twice = beyond / (third * third) - 4.0 / 3.0 * acceleration - end / 6.0;
        set({0.0, third, 2.0 * third, h}, {acceleration, twice - once, 2.0 * once - twice, end});
    }

    // The instants [s] between which the acceleration is a straight line, from 0 to h.
    std::span<const double> times() const { return {times_.data(), n_}; }
    double acceleration(double t) const {
        std::size_t k = 1;
        while (k + 1 < n_ && times_[k] <= t) ++k;
        const double t0 = times_[k - 1], t1 = times_[k], a0 = accelerations_[k - 1], a1 = accelerations_[k];
        return t == t1 ? a1 : a0 + (a1 - a0) * (t - t0) / (t1 - t0);
    }
    double speed(double t) const {
        double sum = speed_, before = 0.0;
        const auto to = [&](double at) {
            sum += 0.5 * (acceleration(before) + acceleration(at)) * (at - before);
            before = at;
        };
        for (std::size_t k = 1; k < n_ && times_[k] < t; ++k) to(times_[k]);
        to(t);
        return sum;
    }

 private:
    template <std::size_t n>
    void set(const double (&times)[n], const double (&accelerations)[n]) {
        n_ = n;
        std::copy_n(times, n, times_.begin());
        std::copy_n(accelerations, n, accelerations_.begin());
    }

    std::array<double, 4> times_{}, accelerations_{};
    std::size_t n_ = 0;
    double speed_;
};

}  // namespace lostmotion
