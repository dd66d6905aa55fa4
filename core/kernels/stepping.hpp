// A motion step by step: for control loops, co-simulation and learning.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "closed_loop.hpp"
#include "lostmotion/solver/exact_solver.hpp"

namespace lostmotion {

template <class System>
class SimulationOf {
 public:
    using D = typename System::Dims;
    using Regime = typename System::Regime;
    using Inputs = InputsOf<D>;

    // All that a run needs to go on bit for bit.
    struct Snapshot {
        double time = 0.0;
        StateOf<D> x{};
        typename D::Memory memory{};
        typename System::Key key;
        Inputs input{};  // the last values that the caller gave, from which variables are read
        bool started = false;
        bool steady = false;  // the inputs were constant in the last interval
        CourseOf<D> course;   // what is known of the motion in the present regime beside its state
        ControlCourse control;
    };

    // scale: natural sizes of the states. step: the usual interval [s]; others are allowed, this one is fastest.
    // inputs: how many the system has. sines: that are added all the time to what the inputs are given, by time since
    // 0.
    SimulationOf(const System& system, const StateOf<D>& scale, double step, int inputs = D::inputs,
                 const InputSines& sines = {});
    SimulationOf(const SimulationOf&) = delete;
    SimulationOf& operator=(const SimulationOf&) = delete;

    // Controllers turn some of the motors from the start on: make_loop(laws) gives these in the system.
    template <class MakeLoop>
    void close_loop(const Control& control, MakeLoop&& make_loop) {
        laws_ = control.laws();
        loop_ = make_loop(laws_);
        controllers_.emplace(solver_, loop_);
    }
    // How many numbers the controllers remember.
    int control_slots() const { return loop_.slots(); }
    // What the controllers show at the present instant, axis by axis, each with its winding's signals behind.
    std::vector<double> control_signals() const;

    double time() const { return now_.time; }
    typename D::Contact stopped_at() const { return solver_.stopped_at(); }
    const Snapshot& snapshot() const { return now_; }
    // At the present instant, sines included.
    Inputs inputs() const;
    void restore(const Snapshot& s) { now_ = s; }
    void set_interrupt(bool (*poll)(void*), void* context) { solver_.set_interruption({poll, context}); }

    // Advances by `interval` [s] with each input running in a straight line from its first to its second value; those
    // that a controller gives are not looked at. On any status but done the state is left as it was.
    Status advance(double interval, Inputs begin, Inputs end) {
        Observer<System> nobody;
        return advance(interval, begin, end, nobody);
    }
    Status advance(double interval, Inputs begin, Inputs end, Observer<System>& observer);
    // The regime at the present instant, with the inputs at their last values. A state that nothing has advanced yet
    // must have one.
    Status find_regime();
    const Regime& regime();
    RegimeCache<System>& regimes() { return solver_.cache(); }
    // Replaces the reference of the controller of an axis by value + rate (t - now).
    void set_reference(std::size_t axis, double value, double rate) {
        laws_[axis].reference = {{{now_.time, {value, rate}}}, {}};
    }

    // --- as a hybrid system, which an integrator of the caller's own solves: hybrid.hpp. Not with windings. ---

    // At a time, a state and inputs, in the regime that it is in.
    void place(double time, const StateOf<D>& x, const Inputs& input);
    StateOf<D> rates();
    // The guards, each over its natural magnitude; 1 beyond the last. One that falls below zero ends the regime.
    using GuardValues = typename RegimeCache<System>::GuardTable::Values;
    std::size_t guard_count() const { return static_cast<std::size_t>(system_.most_guards()); }
    GuardValues guards();
    // The ticks that are due, and the regime that follows where guards have fallen or inputs have changed.
    Status settle();
    double next_tick() const;  // [s], infinity without controllers
    // After a step of the integrator: whether the regime has to be settled, since inputs take a torque at rest along.
    bool accept();

 private:
    const typename System::Guard* lowest_guard();
    Status follow(const typename System::Guard* fired);
    // The solver at the present state, with the inputs running over the interval.
    void resume(Inputs& begin, Inputs& end, double interval);
    Status begin_motion();
    void keep(Inputs input, bool steady);

    const System& system_;
    ExactSolver<System> solver_;
    int inputs_;
    InputSines sines_;
    Snapshot now_;
    std::vector<control::Axis> laws_;
    ClosedLoop<D> loop_;
    std::optional<ClosedLoopRun<ExactSolver<System>>> controllers_;
};

template <class System>
SimulationOf<System>::SimulationOf(const System& system, const StateOf<D>& scale, double step, int inputs,
                                   const InputSines& sines)
    : system_(system), solver_(system, ramped_inputs<D>(inputs, sines), step, scale), inputs_(inputs), sines_(sines) {}

template <class System>
std::vector<double> SimulationOf<System>::control_signals() const {
    std::vector<double> out;
    const double* slot = now_.control.slots.data();
    for (const control::Axis& a : laws_) {
        for (int s = 0; s < control::n_axis_signals; ++s) out.push_back(a.signal(s, slot));
        for (const double v : winding_signals_of(a, now_.time, slot)) out.push_back(v);
        slot += a.slots();
    }
    return out;
}

template <class System>
auto SimulationOf<System>::inputs() const -> Inputs {
    Inputs u = now_.input;
    for (const auto& [input, sine] : sines_) u[static_cast<std::size_t>(input)] += sine.at(now_.time);
    return u;
}

template <class System>
Status SimulationOf<System>::advance(double interval, Inputs begin, Inputs end, Observer<System>& observer) {
    resume(begin, end, interval);
    const bool steady = begin == end && sines_.empty(), unchanged = now_.steady && steady && begin == now_.input;
    Status status = Status::done;
    if (!now_.started)
        status = begin_motion();
    else if (!unchanged) {
        if (controllers_) controllers_->forget_plan();
        status = solver_.inputs_changed();
    }
    const double to = now_.time + interval;
    if (status == Status::done)
        status = controllers_ ? controllers_->advance(to, observer, nullptr) : solver_.advance(to, observer);
    if (status == Status::done) keep(end, steady);
    return status;
}

template <class System>
Status SimulationOf<System>::find_regime() {
    if (now_.started) return Status::done;
    Inputs input = now_.input;
    resume(input, input, 1.0);
    const Status status = begin_motion();
    if (status == Status::done) keep(input, false);
    return status;
}

template <class System>
void SimulationOf<System>::resume(Inputs& begin, Inputs& end, double interval) {
    solver_.resume(now_.time, now_.x, now_.memory, now_.key, now_.course);
    for (int i = 0; i < inputs_; ++i) solver_.set_ramp(i, begin[i], (end[i] - begin[i]) / interval);
    if (!controllers_) return;
    controllers_->resume(now_.control);
    controllers_->write_commands(begin);
    controllers_->write_commands(end);
}

template <class System>
Status SimulationOf<System>::begin_motion() {
    // Controllers that have begun go on.
    Observer<System> nobody;
    return controllers_ && now_.control.slots.empty() ? controllers_->begin(now_.x, now_.memory, nobody)
                                                      : solver_.begin(now_.time, now_.x, now_.memory);
}

template <class System>
void SimulationOf<System>::keep(Inputs input, bool steady) {
    if (controllers_) controllers_->write_commands(input);
    now_ = {solver_.time(),
            solver_.state(),
            solver_.memory(),
            solver_.key(),
            input,
            true,
            steady,
            solver_.course(),
            controllers_ ? controllers_->course() : ControlCourse{}};
}

template <class System>
auto SimulationOf<System>::regime() -> const Regime& {
    find_regime();
    return solver_.regime(now_.key);
}

}  // namespace lostmotion
