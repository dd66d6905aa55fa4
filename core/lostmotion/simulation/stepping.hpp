// The drive step by step: for control loops, co-simulation and learning.
#pragma once

#include <memory>

#include "sampler.hpp"

namespace lostmotion {

class Simulation {
 public:
    // All that a run needs to go on bit for bit.
    struct Snapshot {
        double time = 0.0;
        State x{};
        Memory memory;
        RegimeKey key;
        std::array<double, n_inputs> input{};  // last values, for reading variables
        bool started = false;
        bool steady = false;         // the inputs were constant in the last interval
        CourseOf<DriveDims> course;  // what is known of the motion in the present regime beside its state
    };

    // step: the usual interval [s]; others are allowed, this one is fastest.
    Simulation(const Drive& drive, double step)
        : drive_(drive), system_(drive_), solver_(system_, ramped_inputs<DriveDims>(), step, drive_.balanced_scale()) {}
    Simulation(const Simulation&) = delete;
    Simulation& operator=(const Simulation&) = delete;

    const Drive& drive() const { return drive_; }
    double time() const { return now_.time; }
    Contact stopped_at() const { return solver_.stopped_at(); }
    const Snapshot& snapshot() const { return now_; }
    void restore(const Snapshot& s) { now_ = s; }
    void set_interrupt(bool (*poll)(void*), void* context) {
        solver_.interrupted = poll;
        solver_.interrupted_context = context;
    }

    // Advances by `interval` [s] with each input running in a straight line from its first to its second value.
    // On any status but done the state is left as it was.
    Status advance(double interval, double command_begin, double command_end, double load_begin, double load_end) {
        const std::array<double, n_inputs> begin{command_begin, load_begin}, end{command_end, load_end};
        solver_.resume(now_.time, now_.x, now_.memory, now_.key, now_.course);
        for (int i = 0; i < n_inputs; ++i) solver_.set_ramp(i, begin[i], (end[i] - begin[i]) / interval);
        const bool steady = begin == end, unchanged = now_.steady && steady && begin == now_.input;
        Status status = Status::done;
        if (!now_.started)
            status = solver_.begin(now_.time, now_.x, now_.memory);
        else if (!unchanged)
            status = solver_.inputs_changed();
        Nothing nothing;
        if (status == Status::done) status = solver_.advance(now_.time + interval, nothing);
        if (status != Status::done) return status;
        now_ = {solver_.time(), solver_.state(), solver_.memory(), solver_.key(), end, true, steady, solver_.course()};
        return status;
    }

    // Variables at the present instant, with the inputs at their last values.
    Reading reading() {
        if (!now_.started) advance_nowhere();
        const Regime& regime = solver_.regime(now_.key);
        return Reader(drive_, regime, now_.memory)(now_.x, now_.input);
    }
    Regime regime() const { return system_.build(now_.key); }

 private:
    struct Nothing {
        bool segment(const Segment<SwitchedDrive>&) { return true; }
    };
    void advance_nowhere() {
        solver_.resume(now_.time, now_.x, now_.memory, now_.key);
        for (int i = 0; i < n_inputs; ++i) solver_.set_ramp(i, now_.input[i], 0.0);
        if (solver_.begin(now_.time, now_.x, now_.memory) == Status::done)
            now_ = {now_.time, solver_.state(), solver_.memory(), solver_.key(), now_.input,
                    true,      false,           solver_.course()};
    }

    Drive drive_;
    SwitchedDrive system_;
    ExactSolver<SwitchedDrive> solver_;
    Snapshot now_;
};

}  // namespace lostmotion
