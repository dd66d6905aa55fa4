// The library's runs held against the referee.
#pragma once

#include <algorithm>
#include <cmath>

#include "drive_runs.hpp"
#include "referee.hpp"

namespace lostmotion::test::referee {

inline Case case_of(const Drive& drive, const Signals& signals, double duration, double interval,
                    const Start& start = {}) {
    Case c;
    c.drive = drive;
    c.signals = signals;
    c.start = start.x;
    c.duration = duration;
    c.sample_interval = interval;
    return c;
}

// Largest difference at the samples of M_D, w_M, w, d, phi, each in units of its largest magnitude in the referee's
// run. Speeds of input and load are one quantity seen from two sides and share a unit, as do twist and load angle.
// value(c, k): component c of the other run at sample k.
template <class Value>
State differences(const Drive& drive, const Value& value, std::size_t count, const Result& truth) {
    State gap{}, size{};
    count = std::min(count, truth.samples.size());
    for (std::size_t c = 0; c < n_states; ++c)
        for (std::size_t k = 0; k < count; ++k) {
            size[c] = std::fmax(size[c], std::fabs(truth.samples[k][c]));
            gap[c] = std::fmax(gap[c], std::fabs(truth.samples[k][c] - value(c, k)));
        }
    const double i = drive.gearbox.ratio;
    size[load_speed] = std::fmax(size[load_speed], size[motor_speed] / i);
    size[motor_speed] = i * size[load_speed];
    size[twist] = size[load_angle] = std::fmax(size[twist], size[load_angle]);
    // What should not move at all may move by rounding of what does.
    const State rated = drive.rated_scale();
    for (std::size_t c = 0; c < n_states; ++c) gap[c] /= std::fmax(size[c], 1e-9 * rated[c]);
    return gap;
}
inline State differences(const Drive& drive, const Samples& run, const Result& truth) {
    const auto value = [&](std::size_t c, std::size_t k) { return run(static_cast<Quantity>(c), k); };
    return differences(drive, value, run.samples, truth);
}
// Between two runs of the referee.
inline double spread(const Drive& drive, const Result& other, const Result& truth) {
    const auto gap = differences(
        drive, [&](std::size_t c, std::size_t k) { return other.samples[k][c]; }, other.samples.size(), truth);
    return *std::max_element(gap.begin(), gap.end());
}

struct Agreement {
    State gap{};  // M_D, w_M, w, d, phi, relative
    double worst = 0.0;
    Result truth;
};

// Whether a run of `drive` is right to within `tolerance`; not so if the referee finds no single motion.
inline bool referee_agrees(const Drive& drive, const Signals& signals, double duration, double interval,
                           const Samples& run, double tolerance, Agreement* out = nullptr, const Start& start = {}) {
    Agreement a;
    a.truth = referee_run(case_of(drive, signals, duration, interval, start));
    a.gap = differences(drive, run, a.truth);
    a.worst = *std::max_element(a.gap.begin(), a.gap.end());
    const bool agrees = a.truth.outcome == Outcome::done && run.report.status == Status::done &&
                        a.truth.samples.size() == run.samples && a.worst <= tolerance;
    if (out) *out = a;
    return agrees;
}

}  // namespace lostmotion::test::referee
