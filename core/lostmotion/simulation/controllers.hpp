// Sampled controllers of the motors of a run: what they are, when they run, what they remember and show.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "../control/axis.hpp"
#include "sample_times.hpp"

namespace lostmotion {

// The controller of a motor, by the numbers of the motor, of the shafts that its encoders are on, and of that of its
// reference.
struct ControlledAxis {
    control::Axis law;
    int motor = 0;
    int position_shaft = 0, speed_shaft = 0, reference_shaft = 0;
};

struct Control {
    double tick = 1e-3;  // [s]
    std::vector<ControlledAxis> axes;

    bool present() const { return !axes.empty(); }
    // How many of them each axis shows: those of a winding too if there is one.
    int signals() const;
    // The controllers, ready to run.
    std::vector<control::Axis> laws() const;
};

// When the controllers run. An instant that only rounding parts from a tick is that of the tick.
struct Ticks {
    double length = 1e-3;          // [s]
    double sample_interval = 0.0;  // [s] of a run's record, whose instants are ticks where both fall together; 0: none

    double time(std::int64_t tick) const;
    // Of two times: whether the first lies before the second by more than rounding.
    bool before(double first, double second) const { return first < second - rounding(); }

 private:
    double rounding() const { return 1e-9 * length; }
};

// What the controllers remember, and when they run next.
struct ControlCourse {
    std::int64_t next = 0;      // tick
    std::vector<double> slots;  // of all axes, one after the other
};

// Of an axis, 0 without a winding.
inline std::array<double, control::n_winding_signals> winding_signals_of(const control::Axis& a, double time,
                                                                         const double* slot) {
    return a.field_orientation ? a.winding_signals(time, slot) : std::array<double, control::n_winding_signals>{};
}

// The signals of the axes at the instants of a record: out[(axis * signals + signal) * count + k] at k * interval.
class ControlRecord {
 public:
    ControlRecord(const SampleTimes& times, int signals, double* out) : times_(times), signals_(signals), out_(out) {}

    // What holds before time `end`.
    void hold_until(double end, std::span<const control::Axis> axes, const ControlCourse& course) {
        for (; next_ < times_.count && times_[next_] < end; ++next_) {
            const double* slot = course.slots.data();
            double* to = out_ + next_;
            for (const control::Axis& a : axes) {
                for (int s = 0; s < control::n_axis_signals; ++s, to += times_.count) *to = a.signal(s, slot);
                if (signals_ > control::n_axis_signals)
                    for (const double v : winding_signals_of(a, times_[next_], slot)) {
                        *to = v;
                        to += times_.count;
                    }
                slot += a.slots();
            }
        }
    }

 private:
    SampleTimes times_;
    int signals_;
    double* out_;
    std::size_t next_ = 0;
};

// What every run is asked for.
struct RunRequest {
    double duration = 1.0;          // [s]
    double sample_interval = 1e-3;  // [s]
    std::size_t samples = 0;        // instants to record: k * sample_interval, from k = 0, and no later than the end
    bool energy = true;
    std::size_t max_switchings = 100000;  // kept; all are counted
    bool (*interrupted)(void*) = nullptr;
    void* interrupted_context = nullptr;
    Control control;                // nothing: the inputs alone act
    double* control_out = nullptr;  // (axes x signals) x samples, as ControlRecord
    // The sample at which the observer may end a run under controllers; 0: none. Up to there the run is the one
    // that ends there, and it goes on as if there was no pause.
    std::size_t pause = 0;

    SampleTimes times() const { return {sample_interval, samples, duration}; }
};

}  // namespace lostmotion
