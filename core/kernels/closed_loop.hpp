// A run under sampled controllers: between two ticks an exact propagation, at each tick what the controllers make of
// it.
#pragma once

#include <limits>
#include <span>
#include <vector>

#include "lostmotion/simulation/train_control.hpp"
#include "lostmotion/solver/components.hpp"
#include "lostmotion/solver/exact_solver.hpp"
#include "pack.hpp"
#include "winding_coupling.hpp"

namespace lostmotion {

// The controllers of a run, all at the same base tick. Parameters only.
template <class D>
struct ClosedLoop {
    Ticks ticks;
    std::span<const control::Axis> axes;
    std::vector<AxisPlace> places;  // of each axis

    int slots() const {
        int n = 0;
        for (const control::Axis& a : axes) n += a.slots();
        return n;
    }
};

// Signals of which those that windings turn will be set to ramps. input(motor): its number among them.
template <class Signals, class Input>
Signals with_ramps(Signals signals, const Control& control, Input&& input) {
    for (const ControlledAxis& axis : control.axes)
        if (axis.law.field_orientation) signals[static_cast<std::size_t>(input(axis.motor))] = {{{0.0, 0.0, 1.0}}, {}};
    return signals;
}

template <class Solver>
class ClosedLoopRun {
 public:
    using D = typename Solver::D;
    using System = typename Solver::System;
    using Observer = typename Solver::Observer;

    ClosedLoopRun(Solver& solver, const ClosedLoop<D>& loop)
        : solver_(solver), loop_(loop), windings_(solver, loop.ticks.length, loop.axes, loop.places) {}

    const ControlCourse& course() const { return course_; }
    // Goes on from what the controllers were, at the time and state that the solver has.
    void resume(const ControlCourse& course) {
        course_ = course;
        if (course_.slots.empty()) return;  // not begun
        each_axis([&](const control::Axis& a, const AxisPlace& p, double* slot) {
            const Ramp command = command_of(a, slot);
            solver_.set_ramp(p.input, command.value, command.slope);
            return true;
        });
    }
    // The inputs that no controller gives have changed.
    void forget_plan() {
        if (windings_.present()) windings_.forget_plan(course_.slots);
    }
    // What acts on the motors, among the inputs.
    void write_commands(InputsOf<D>& inputs) {
        if (course_.slots.empty()) return;
        each_axis([&](const control::Axis& a, const AxisPlace& p, double* slot) {
            inputs[p.input] = command_of(a, slot).value;
            return true;
        });
    }

    // The controllers at the start, with the drive at a state, and their first tick.
    Status begin(const StateOf<D>& x, const typename D::Memory& memory, Observer& observer) {
        course_.next = 0;
        course_.slots.assign(static_cast<std::size_t>(loop_.slots()), 0.0);
        each_axis([&](const control::Axis& a, const AxisPlace& p, double* slot) {
            a.start(sample(p, x, memory, 0.0), loop_.ticks.length, slot);
            return true;
        });
        if (!run_tick(x, memory, observer)) return Status::controller;
        each_axis([&](const control::Axis& a, const AxisPlace& p, double*) {
            if (a.field_orientation) solver_.set_ramp(p.input, 0.0, 0.0);
            return true;
        });
        return solver_.begin(0.0, x, memory);
    }
    // The next tick, at the state that the solver has.
    bool tick() {
        Observer nobody;
        return run_tick(solver_.state(), solver_.memory(), nobody);
    }
    // To t_end, the ticks up to it included unless they fall on it. record: gets what the controllers show, or nullptr.
    Status advance(double t_end, Observer& observer, ControlRecord* record) {
        while (true) {
            const double tick = loop_.ticks.time(course_.next);
            const bool last = !loop_.ticks.before(tick, t_end);
            if (!windings_.present()) hold_until(last ? t_end : tick, record);
            if (last || tick > solver_.time()) {
                Passing passing(observer, last);
                const Status status = windings_.present() ? advance_windings(tick, t_end, last, observer, record)
                                                          : solver_.advance(last ? t_end : tick, passing);
                if (status != Status::done || last) return status;
            }
            if (!observer.flush()) return Status::interrupted;
            if (!run_tick(solver_.state(), solver_.memory(), observer)) return Status::controller;
            if (changed_)
                if (const Status found = solver_.inputs_changed(observer); found != Status::done) return found;
        }
    }
    // At the end of a run: the tick that falls on it, for what the controllers show there.
    Status show_end(Observer& observer) {
        if (loop_.ticks.before(solver_.time(), loop_.ticks.time(course_.next))) return Status::done;
        if (!observer.flush()) return Status::interrupted;
        return run_tick(solver_.state(), solver_.memory(), observer) ? Status::done : Status::controller;
    }

 private:
    // Hands on what a solver shows, and says of no stretch but the last of all that it is the last.
    class Passing final : public Observer {
     public:
        Passing(Observer& to, bool last) : to_(to), last_(last) {}
        bool segment(const Segment<System>& s) override {
            if (last_ || !s.last) return to_.segment(s);
            Segment<System> inner = s;
            inner.last = false;
            return to_.segment(inner);
        }
        void step(const typename System::Regime& r, const typename D::Memory& m, const DenseStepOf<D>& dense,
                  bool at_end) override {
            to_.step(r, m, dense, at_end && last_);
        }
        bool wants_switching() const override { return to_.wants_switching(); }
        void switching(const SwitchingOf<System>& s) override { to_.switching(s); }
        bool flush() override { return to_.flush(); }

     private:
        Observer& to_;
        bool last_;
    };

    void hold_until(double end, ControlRecord* record) const {
        if (record != nullptr) record->hold_until(end, loop_.axes, course_);
    }
    // With windings, by the parts of a tick.
    Status advance_windings(double tick, double t_end, bool last_tick, Observer& observer, ControlRecord* record) {
        const double to = last_tick ? t_end : tick;
        while (true) {
            if (const double now = solver_.time();
                !loop_.ticks.before(now, windings_.end(course_.slots)) && loop_.ticks.before(now, to)) {
                if (!observer.flush()) return Status::interrupted;
                if (const Status s = windings_.plan(tick, course_.slots, observer); s != Status::done) return s;
            }
            double end = windings_.end(course_.slots);
            if (!loop_.ticks.before(end, to)) end = to;
            const bool last = last_tick && !(end < t_end);
            hold_until(end, record);
            Passing passing(observer, last);
            if (const Status s = solver_.advance(end, passing); s != Status::done) return s;
            if (!(end < to)) return Status::done;
        }
    }

    control::Sampled sample(const AxisPlace& p, const StateOf<D>& x, const typename D::Memory& memory,
                            double command) const {
        InputsOf<D> u{};
        u[p.input] = command;
        const auto value = [&](const LinearForm& f) { return evaluate<D>(f, x, memory, u); };
        return {value(p.position_angle), value(p.speed_angle), value(p.speed),       value(p.motor_torque),
                value(p.rotor_angle),    value(p.rotor_speed), value(p.shaft_angle), solver_.time()};
    }
    // What acts now.
    Ramp command_of(const control::Axis& a, const double* slot) const {
        return a.field_orientation ? a.torque_command(solver_.time(), slot) : Ramp{a.command(slot), 0.0};
    }
    template <class Use>
    bool each_axis(Use&& use) {
        double* slot = course_.slots.data();
        for (std::size_t k = 0; k < loop_.axes.size(); ++k) {
            if (!use(loop_.axes[k], loop_.places[k], slot)) return false;
            slot += loop_.axes[k].slots();
        }
        return true;
    }
    // All axes sample the same instant before any of them acts.
    bool run_tick(const StateOf<D>& x, const typename D::Memory& memory, Observer& observer) {
        observer.tick(loop_, course_, x, memory);
        changed_ = course_.next == 0;
        const bool well = each_axis([&](const control::Axis& a, const AxisPlace& p, double* slot) {
            const double before =
                a.field_orientation ? a.winding_torque(solver_.time(), slot) / a.rated_torque : a.command(slot);
            if (!a.step(course_.next, loop_.ticks.length, sample(p, x, memory, before), slot)) return false;
            if (a.field_orientation || (a.command(slot) == before && course_.next > 0)) return true;
            solver_.set_ramp(p.input, a.command(slot), 0.0);
            changed_ = true;
            return true;
        });
        ++course_.next;
        return well;
    }

    Solver& solver_;
    const ClosedLoop<D>& loop_;
    ControlCourse course_;
    WindingCoupling<Solver> windings_;
    bool changed_ = false;
};

// From a start to the end of the run, open loop or under the controllers of the request. make_loop(laws): these in the
// system.
template <class Solver, class MakeLoop>
Status run_recorded(Solver& solver, const StartOf<typename Solver::D>& start, const RunRequest& request,
                    typename Solver::Observer& observer, MakeLoop&& make_loop) {
    solver.set_interruption({request.interrupted, request.interrupted_context});
    if (!request.control.present()) {
        const Status begun = solver.begin(0.0, start.x, start.memory);
        return begun == Status::done && request.duration > 0.0 ? solver.advance(request.duration, observer) : begun;
    }
    const std::vector<control::Axis> laws = request.control.laws();
    auto loop = make_loop(laws);
    loop.ticks.sample_interval = request.sample_interval;
    ClosedLoopRun<Solver> run(solver, loop);
    ControlRecord record(request.control_out == nullptr ? SampleTimes() : request.times(), request.control.signals(),
                         request.control_out);
    const Status begun = run.begin(start.x, start.memory, observer);
    if (begun != Status::done) return begun;
    if (request.pause > 0) {
        const double time = static_cast<double>(request.pause) * request.sample_interval;
        const Status s = run.advance(time, observer, &record);
        if (s != Status::done || observer.enough()) return s;
    }
    if (const Status s = run.advance(request.duration, observer, &record); s != Status::done) return s;
    const Status ended = run.show_end(observer);
    observer.finish(loop);
    if (ended == Status::done) record.hold_until(std::numeric_limits<double>::infinity(), loop.axes, run.course());
    return ended;
}

// What acts at the end of such a run: after a jump of the inputs there, and before a tick.
template <class Solver, class Signals>
auto inputs_at_end(Solver& solver, const Signals& signals, const Control& control) {
    if (control.present()) return solver.input_before(solver.time(), solver.state());
    InputState<typename Solver::D> input(signals, solver.basis());
    input.anchor(solver.time());
    return input.values();
}

// The controllers in a train. The laws are those of `laws`, which must stay.
template <class D>
ClosedLoop<D> closed_loop_of(const model::Assembly& a, const Control& control, const std::vector<control::Axis>& laws) {
    ClosedLoop<D> loop{{control.tick}, laws, {}};
    for (const AxisRows& rows : axis_rows(a, control)) {
        const auto form = [&](std::size_t k) { return model::OwnForm(rows.measured[k], a.layout()); };
        loop.places.push_back({rows.command, form(0), form(1), form(2), form(3), form(4), form(5), form(6)});
    }
    return loop;
}

}  // namespace lostmotion
