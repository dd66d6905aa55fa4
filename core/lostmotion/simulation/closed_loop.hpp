// A run under sampled controllers: between two ticks an exact propagation, at each tick what the controllers make of
// it.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "../control/axis.hpp"
#include "../solver/components.hpp"
#include "../solver/exact_solver.hpp"

namespace lostmotion {

// The controller of a motor, by the numbers of the motor and of the shafts that its encoders are on.
struct ControlledAxis {
    control::Axis law;
    int motor = 0;
    int position_shaft = 0, speed_shaft = 0;
};

struct Control {
    double tick = 1e-3;  // [s]
    std::vector<ControlledAxis> axes;

    bool present() const { return !axes.empty(); }
    // The controllers, ready to run.
    std::vector<control::Axis> laws() const {
        std::vector<control::Axis> out;
        for (const ControlledAxis& axis : axes) {
            out.push_back(axis.law);
            out.back().place();
        }
        return out;
    }
};

// An axis in a system: the input of its motor, and the forms that give what is sampled.
template <class D>
struct AxisPlace {
    int input = 0;
    LinearFormOf<D> position_angle{}, speed_angle{}, speed{}, motor_torque{};
};

// The controllers of a run, all at the same base tick. Parameters only.
template <class D>
struct ClosedLoop {
    double tick = 1e-3;  // [s]
    std::span<const control::Axis> axes;
    std::vector<AxisPlace<D>> places;  // of each axis

    int slots() const {
        int n = 0;
        for (const control::Axis& a : axes) n += a.slots();
        return n;
    }
};

// What the controllers remember, and when they run next.
struct ControlCourse {
    std::int64_t next = 0;      // tick
    std::vector<double> slots;  // of all axes, one after the other
};

// The signals of the axes at the instants of a record: out[(axis * n_axis_signals + signal) * count + k] at k *
// interval.
class ControlRecord {
 public:
    ControlRecord(double interval, std::size_t count, double* out) : interval_(interval), count_(count), out_(out) {}

    // What holds before time `end`.
    template <class D>
    void hold_until(double end, const ClosedLoop<D>& loop, const ControlCourse& course) {
        for (; next_ < count_ && static_cast<double>(next_) * interval_ < end; ++next_) {
            const double* slot = course.slots.data();
            double* to = out_ + next_;
            for (const control::Axis& a : loop.axes) {
                for (int s = 0; s < control::n_axis_signals; ++s, to += count_) *to = a.signal(s, slot);
                slot += a.slots();
            }
        }
    }

 private:
    double interval_;
    std::size_t count_;
    double* out_;
    std::size_t next_ = 0;
};

template <class Solver>
class ClosedLoopRun {
 public:
    using D = typename Solver::D;

    ClosedLoopRun(Solver& solver, const ClosedLoop<D>& loop) : solver_(solver), loop_(loop) {}

    const ControlCourse& course() const { return course_; }
    // Goes on from what the controllers were, at the time and state that the solver has.
    void resume(const ControlCourse& course) {
        course_ = course;
        if (course_.slots.empty()) return;  // not begun
        each_axis([&](const control::Axis& a, const AxisPlace<D>& p, double* slot) {
            solver_.set_ramp(p.input, a.command(slot), 0.0);
            return true;
        });
    }
    // What acts on the motors, among the inputs.
    void write_commands(InputsOf<D>& inputs) {
        if (course_.slots.empty()) return;
        each_axis([&](const control::Axis& a, const AxisPlace<D>& p, double* slot) {
            inputs[p.input] = a.command(slot);
            return true;
        });
    }

    // The controllers at the start, with the drive at a state, and their first tick.
    Status begin(const StateOf<D>& x, const typename D::Memory& memory) {
        course_.next = 0;
        course_.slots.assign(static_cast<std::size_t>(loop_.slots()), 0.0);
        each_axis([&](const control::Axis& a, const AxisPlace<D>& p, double* slot) {
            a.start(sample(p, x, memory, 0.0), loop_.tick, slot);
            return true;
        });
        if (!run_tick(x, memory)) return Status::controller;
        return solver_.begin(0.0, x, memory);
    }
    // To t_end, the ticks up to it included unless they fall on it. record(t): what the controllers show holds until t.
    template <class Observer, class Record>
    Status advance(double t_end, Observer& observer, Record&& record) {
        while (true) {
            const double tick = static_cast<double>(course_.next) * loop_.tick;
            const bool last = !(tick < t_end);
            record(last ? std::numeric_limits<double>::infinity() : tick);
            if (last || tick > solver_.time()) {
                Passing<Observer> passing{observer, last};
                const Status status = solver_.advance(last ? t_end : tick, passing);
                if (status != Status::done || last) return status;
            }
            if constexpr (requires { observer.flush(); })
                if (!observer.flush()) return Status::interrupted;
            if (!run_tick(solver_.state(), solver_.memory())) return Status::controller;
            if (changed_)
                if (const Status found = solver_.inputs_changed(observer); found != Status::done) return found;
        }
    }

 private:
    // Hands on what a solver shows, and says of no stretch but the last of all that it is the last.
    template <class Observer>
    struct Passing {
        Observer& observer;
        bool last;

        template <class Segment>
        bool segment(const Segment& s) {
            if (last || !s.last) return observer.segment(s);
            Segment inner = s;
            inner.last = false;
            return observer.segment(inner);
        }
        template <class Regime, class Memory, class Dense>
            requires requires(Observer o, Regime r, Memory m, Dense d) { o.step(r, m, d, true); }
        void step(const Regime& r, const Memory& m, const Dense& dense, bool at_end) {
            observer.step(r, m, dense, at_end && last);
        }
        template <class Switching>
            requires requires(Observer o, Switching s) { o.switching(s); }
        void switching(const Switching& s) {
            observer.switching(s);
        }
        bool wants_switching() const
            requires requires(const Observer o) { o.wants_switching(); }
        {
            return observer.wants_switching();
        }
    };

    control::Sampled sample(const AxisPlace<D>& p, const StateOf<D>& x, const typename D::Memory& memory,
                            double command) const {
        InputsOf<D> u{};
        u[p.input] = command;
        const auto value = [&](const LinearFormOf<D>& f) { return evaluate<D>(f, x, memory, u); };
        return {value(p.position_angle), value(p.speed_angle), value(p.speed), value(p.motor_torque)};
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
    bool run_tick(const StateOf<D>& x, const typename D::Memory& memory) {
        changed_ = course_.next == 0;
        const bool well = each_axis([&](const control::Axis& a, const AxisPlace<D>& p, double* slot) {
            const double before = a.command(slot);
            if (!a.step(course_.next, loop_.tick, sample(p, x, memory, before), slot)) return false;
            if (a.command(slot) == before && course_.next > 0) return true;
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
    bool changed_ = false;
};

// From a start to options.duration, open loop or under the controllers of options. make_loop(laws): these in the
// system.
template <class Solver, class Options, class Observer, class MakeLoop>
Status run_recorded(Solver& solver, const StartOf<typename Solver::D>& start, const Options& options,
                    Observer& observer, MakeLoop&& make_loop) {
    solver.interrupted = options.interrupted;
    solver.interrupted_context = options.interrupted_context;
    if (!options.control.present()) {
        const Status begun = solver.begin(0.0, start.x, start.memory);
        return begun == Status::done ? solver.advance(options.duration, observer) : begun;
    }
    const std::vector<control::Axis> laws = options.control.laws();
    const auto loop = make_loop(laws);
    ClosedLoopRun<Solver> run(solver, loop);
    ControlRecord record(options.sample_interval, options.control_out == nullptr ? 0 : options.samples,
                         options.control_out);
    const Status begun = run.begin(start.x, start.memory);
    if (begun != Status::done) return begun;
    return run.advance(options.duration, observer, [&](double end) { record.hold_until(end, loop, run.course()); });
}

}  // namespace lostmotion
