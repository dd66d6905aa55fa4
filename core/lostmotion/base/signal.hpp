// Commands and disturbances: a piecewise-linear part plus a sum of sines.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "sine.hpp"

namespace lostmotion {

// How far beyond a whole number of periods, in periods.
inline double fraction_of_turn(double frequency, double time) {
    const double turns = frequency * time, part = turns - std::floor(turns);
    // After a thousand periods the rounding of their number would be seen.
    return turns < 0x1p10 ? part : part + std::fma(frequency, time, -turns);
}

// amplitude * sin(2 pi frequency t + phase)
struct Sine {
    double amplitude = 0.0;  // unit of the signal
    double frequency = 0.0;  // [Hz]
    double phase = 0.0;      // [rad]

    double angle(double time) const { return 2.0 * std::numbers::pi * fraction_of_turn(frequency, time) + phase; }
    double at(double time) const { return amplitude * sine_cosine(angle(time)).sin; }
};

// From `time` on the piecewise-linear part is value + slope * (t - time), until the next breakpoint.
struct Breakpoint {
    double time = 0.0;   // [s]
    double value = 0.0;  // unit of the signal
    double slope = 0.0;  // unit of the signal per second
};

struct Signal {
    std::vector<Breakpoint> breakpoints{Breakpoint{}};  // sorted by time; the first holds from the start of the run
    std::vector<Sine> sines;

    // Index of the breakpoint that holds at t (on a breakpoint: the one that begins there).
    std::size_t segment(double t) const {
        std::size_t low = 0, high = breakpoints.size();
        while (high - low > 1) {
            const std::size_t middle = (low + high) / 2;
            (breakpoints[middle].time <= t ? low : high) = middle;
        }
        return low;
    }
    // The next breakpoint after t at which the signal changes its value or its slope.
    double next_breakpoint(double t) const {
        for (std::size_t k = segment(t) + 1; k < breakpoints.size(); ++k) {
            const Breakpoint &before = breakpoints[k - 1], &at = breakpoints[k];
            if (at.slope != 0.0 || before.slope != 0.0 || at.value != before.value) return at.time;
        }
        return std::numeric_limits<double>::infinity();
    }
};

// A share in a speed that is given: of the input that tells it, and of the input that is its rate.
struct GivenSpeed {
    int speed, acceleration;
    double share;
};
// A state that is a given speed, or follows given speeds alone.
struct GivenState {
    int state;
    std::vector<GivenSpeed> shares;
};

// Sines by the number of their input.
using InputSines = std::vector<std::pair<int, Sine>>;

}  // namespace lostmotion
