// Trains step by step.
#pragma once

#include <nanobind/stl/optional.h>

#include <optional>

#include "instants.hpp"
#include "lostmotion/simulation/given_motion.hpp"
#include "snapshots.hpp"

namespace lostmotion::binding {

// Amplitude and frequency [Hz] by the number of an input.
using Sines = std::map<int, std::pair<double, double>>;
inline InputSines input_sines(const Sines& sines) {
    InputSines out;
    for (const auto& [input, sine] : sines) out.push_back({input, {sine.first, sine.second, 0.0}});
    return out;
}

inline void check(Status status, TrainSimulation& s) {
    if (status == Status::done) return;
    TrainReport report;
    report.status = status;
    report.time = s.motion().time();
    report.contact = s.motion().stopped_at();
    report.too_many_guards = s.motion().too_many_guards();
    check_train_run(report, s.assembly());
}

// step(begin, end) without the lock of the interpreter.
template <class Step>
void advance(TrainSimulation& s, const Numbers& begin, const Numbers& end, Step&& step) {
    const auto n = static_cast<std::size_t>(s.assembly().layout().inputs);
    check_size(begin, n);
    check_size(end, n);
    s.motion().set_interrupt(poll_signals, nullptr);
    Status status;
    {
        nb::gil_scoped_release release;
        status = step();
    }
    check(status, s);
}

inline TrainPoint point_now(TrainSimulation& s) {
    check(s.motion().find_regime(), s);
    return s.motion().point();
}

inline Numbers read(TrainSimulation& s) {
    check(s.motion().find_regime(), s);
    return s.motion().values();
}

inline void bind_stepping(nb::module_& m) {
    using S = TrainSimulation;
    nb::class_<MotionState>(m, "SimulationSnapshot");
    nb::class_<S>(m, "Simulation")
        .def(
            "__init__",
            [](S* self, const TrainDescription& t, double step, const BoundControl& bound, const Sines& sines) {
                const Control control = control_of(bound);
                if (const std::string error = check_control(t.run()->assembly(), control); !error.empty())
                    throw nb::value_error(error.c_str());
                new (self) S(t.train, step, control, input_sines(sines));
            },
            "train"_a, nb::kw_only(), "step"_a, "control"_a, "sines"_a, nb::keep_alive<1, 4>())
        .def(
            "advance",
            [](S& s, double interval, const Numbers& begin, const Numbers& end) {
                advance(s, begin, end, [&] { return s.motion().advance(interval, begin, end); });
            },
            "interval"_a, "begin"_a, "end"_a)
        .def(
            "answer",
            [](S& s, double interval, const Numbers& begin, const Numbers& end, int shaft) {
                const std::optional<LoadShaft> load = s.load_shaft(shaft);
                if (!load) throw nb::type_error("a shaft without load torque");
                LoadAnswer out;
                advance(s, begin, end, [&] { return s.motion().answer(interval, begin, end, *load, out); });
                return std::make_tuple(load->inertia, out.acceleration, out.compliance);
            },
            "interval"_a, "begin"_a, "end"_a, nb::kw_only(), "shaft"_a,
            "Advances; returns inertia and mean acceleration of a shaft, and -da/dM of its load torque M.")
        .def(
            "answers", [](const S& s, int shaft) { return s.load_shaft(shaft).has_value(); }, "shaft"_a,
            "Whether a shaft is one of answer().")
        .def("snapshot",
             [](const S& s) {
                 MotionState to;
                 s.motion().save(to);
                 return to;
             })
        .def(
            "restore",
            [](S& s, const MotionState& from) {
                if (!s.restore(from)) throw nb::type_error("a snapshot of another simulation");
            },
            "snapshot"_a)
        .def("read", &read)
        .def("explain", [](S& s) { return explain_point(s.assembly(), point_now(s)); })
        .def("linearize", [](S& s) { return linearize_point(s.assembly(), s.channels(), point_now(s)); })
        .def(
            "reset",
            [](S& s, const Named& start, const Named& capacities) {
                const std::string error = s.reset({start, capacities});
                if (!error.empty()) throw nb::value_error(error.c_str());
            },
            "start"_a, "hysteresis_capacities"_a)
        .def("get_state", [](const S& s) { return get_state(s.motion()); })
        .def(
            "set_state", [](S& s, const Record& state) { set_state(s.motion(), state); }, "state"_a)
        .def(
            "control_signals",
            [](S& s) {
                s.motion().find_regime();
                return s.motion().control_signals();
            },
            "Of each controller what axis_signals() and winding_signals() name, one controller after the other.")
        .def("time", [](const S& s) { return s.motion().time(); });

    nb::class_<MotionCourse>(m, "MotionCourse")
        .def(
            "__init__",
            [](MotionCourse* self, std::optional<double> to_angle, double to_speed,
               std::optional<double> to_acceleration, double angle, double speed, double acceleration,
               double interval) {
                new (self) MotionCourse({to_speed, to_angle, to_acceleration}, angle, speed, acceleration, interval);
            },
            nb::kw_only(), "to_angle"_a.none(), "to_speed"_a, "to_acceleration"_a.none(), "angle"_a, "speed"_a,
            "acceleration"_a, "interval"_a)
        .def("times", [](const MotionCourse& c) { return Numbers(c.times().begin(), c.times().end()); })
        .def("speed", &MotionCourse::speed, "time"_a)
        .def("acceleration", &MotionCourse::acceleration, "time"_a);
}

}  // namespace lostmotion::binding
