// The instants of a record.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

namespace lostmotion {

// How many instants a record has that begins at 0: the multiples of the interval and, where it is none of them but for
// rounding, the end.
inline std::size_t sample_count(double duration, double interval) {
    const double whole = std::floor(duration / interval * (1.0 + 1e-12));
    return static_cast<std::size_t>(whole) + (duration > whole * interval * (1.0 + 1e-12) ? 2 : 1);
}

// The multiples of an interval, the last of them no later than the end, or a list.
struct SampleTimes {
    double interval = 1e-3;  // [s]
    std::size_t count = 0;
    std::span<const double> listed;  // [s], ascending, `count` of them; none: k * interval from k = 0
    double end = std::numeric_limits<double>::infinity();  // [s], if the last of them is no multiple

    SampleTimes() = default;
    SampleTimes(double interval, std::size_t count) : interval(interval), count(count) {}
    // Those that a run of this duration has.
    SampleTimes(double interval, std::size_t count, double duration) : SampleTimes(interval, count) {
        if (count > 1 && static_cast<double>(count - 1) * interval > duration * (1.0 + 1e-12)) end = duration;
    }
    explicit SampleTimes(std::span<const double> listed) : count(listed.size()), listed(listed) {}

    double operator[](std::size_t k) const {
        return listed.empty() ? std::min(static_cast<double>(k) * interval, end) : listed[k];
    }
    // Whether it lies closer to the one before than the interval.
    bool is_early(std::size_t k) const { return k + 1 == count && std::isfinite(end); }
    // How much of the interval that is, for the last one.
    double last_share() const { return count > 1 && is_early(count - 1) ? (end - (*this)[count - 2]) / interval : 1.0; }
};

}  // namespace lostmotion
