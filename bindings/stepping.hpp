// Drives and trains step by step.
#pragma once

#include "instants.hpp"
#include "snapshots.hpp"

namespace lostmotion::binding {

// Input, amplitude, frequency [Hz], phase [rad].
using Sines = std::vector<std::tuple<int, double, double, double>>;
inline InputSines input_sines(const Sines& sines) {
    InputSines out;
    for (const auto& [input, amplitude, frequency, phase] : sines)
        out.push_back({input, {amplitude, frequency, phase}});
    return out;
}

inline void advance(Simulation& s, double interval, double c0, double c1, double m0, double m1) {
    s.set_interrupt(poll_signals, nullptr);
    Status status;
    {
        nb::gil_scoped_release release;
        status = s.advance(interval, c0, c1, m0, m1);
    }
    if (status != Status::done) check(status, s.time(), s.stopped_at());
}

// use(drive, regime, state, memory, inputs) at the present instant.
template <class Use>
nb::tuple now(Simulation& s, Use&& use) {
    check(s.find_regime(), s.time(), s.stopped_at());
    const auto& n = s.snapshot();
    return use(s.drive(), s.regime(), n.x, n.memory, s.inputs());
}

// To t = 0, with the contacts still to be found.
inline void reset(Simulation& s, const StateNumbers& x, double capacity) {
    Simulation::Snapshot start;
    start.x = to_state(x);
    start.memory = {capacity, 0.0};
    s.restore(start);
}

inline void check_train(Status status, TrainSimulation& s) {
    if (status == Status::done) return;
    TrainReport report;
    report.status = status;
    report.time = s.time();
    s.with([&](auto& in) {
        report.contact = in.stopped_at();
        report.too_many_guards = in.too_many_guards();
    });
    check_train_run(report, s.assembly());
}

inline void advance_train(TrainSimulation& s, double interval, const Numbers& begin, const Numbers& end) {
    const auto n = static_cast<std::size_t>(s.assembly().layout().inputs);
    check_size(begin, n);
    check_size(end, n);
    s.with([](auto& in) { in.set_interrupt(poll_signals, nullptr); });
    Status status;
    {
        nb::gil_scoped_release release;
        status = s.advance(interval, begin, end);
    }
    check_train(status, s);
}

inline TrainPoint point_now(TrainSimulation& s) {
    return s.with([&](auto& in) {
        check_train(in.find_regime(), s);
        return in.point();
    });
}

inline Numbers read_train(TrainSimulation& s) {
    return s.with([&](auto& in) {
        check_train(in.find_regime(), s);
        return in.values();
    });
}

// use(simulation) with the one of its kernel.
template <class Use>
auto with_kernel(const Simulation& s, Use&& use) {
    return use(s);
}
template <class Use>
auto with_kernel(Simulation& s, Use&& use) {
    return use(s);
}
template <class Use>
auto with_kernel(const TrainSimulation& s, Use&& use) {
    return s.with(use);
}
template <class Use>
auto with_kernel(TrainSimulation& s, Use&& use) {
    return s.with(use);
}

// What both have.
template <class S, class Class>
void bind_state(Class& c) {
    c.def(
         "get_state", [](const S& s) { return with_kernel(s, [](const auto& in) { return get_state(in); }); },
         nb::sig("def get_state(self) -> tuple[float, list[float], list[float], list[int], list[float], bool, "
                 "list[float], list[float]]"))
        .def(
            "set_state",
            [](S& s, double time, const Numbers& x, const Numbers& memory, const std::vector<int>& regime,
               const Numbers& input, bool started, const Numbers& course, const Numbers& control) {
                with_kernel(s,
                            [&](auto& in) { set_state(in, time, x, memory, regime, input, started, course, control); });
            },
            "time"_a, "state"_a, "memory"_a, "regime"_a, "input"_a, "started"_a, "course"_a, "control"_a)
        .def(
            "control_signals",
            [](S& s) {
                return with_kernel(s, [&](auto& in) {
                    in.find_regime();
                    return in.control_signals();
                });
            },
            "Of each controller what axis_signals() and winding_signals() name, one controller after the other.")
        .def("time", [](const S& s) { return s.time(); });
}

inline void bind_stepping(nb::module_& m) {
    nb::class_<Simulation> of_drive(m, "Simulation");
    of_drive
        .def(
            "__init__",
            [](Simulation* self, const SharedDrive& d, double step, const BoundControl& control, const Sines& sines) {
                new (self) Simulation(d.drive, step, control_of(control), input_sines(sines));
            },
            "drive"_a, "step"_a, "control"_a, "sines"_a, nb::keep_alive<1, 4>())
        .def("advance", &advance, "interval"_a, "command_begin"_a, "command_end"_a, "load_begin"_a, "load_end"_a)
        .def("read",
             [](Simulation& s) {
                 check(s.find_regime(), s.time(), s.stopped_at());
                 return values_of(s.reading());
             })
        .def(
            "explain", [](Simulation& s) { return now(s, explain_state); },
            nb::sig("def explain(self) -> "
                    "tuple[list[float], list[tuple[str, int, float, float, float, float]]]"))
        .def(
            "linearize", [](Simulation& s) { return now(s, linearize_state); },
            nb::sig("def linearize(self) -> tuple[list[float], float, list[float], "
                    "numpy.typing.NDArray[numpy.float64], dict[str, numpy.typing.NDArray[numpy.float64]], list[int]]"))
        .def("reset", &reset, "state"_a, "hysteresis_capacity"_a);
    bind_state<Simulation>(of_drive);

    nb::class_<TrainSimulation> of_train(m, "TrainSimulation");
    of_train
        .def(
            "__init__",
            [](TrainSimulation* self, const TrainDescription& t, double step, const BoundControl& bound,
               const Sines& sines) {
                const Control control = control_of(bound);
                if (const std::string error = check_control(model::Assembly(t.train), control); !error.empty())
                    throw nb::value_error(error.c_str());
                new (self) TrainSimulation(t.train, step, control, input_sines(sines));
            },
            "train"_a, "step"_a, "control"_a, "sines"_a, nb::keep_alive<1, 4>())
        .def("advance", &advance_train, "interval"_a, "begin"_a, "end"_a)
        .def("read", &read_train)
        .def(
            "explain", [](TrainSimulation& s) { return explain_point(s.assembly(), point_now(s)); },
            nb::sig("def explain(self) -> "
                    "tuple[list[float], list[tuple[typing.Any, ...]], list[tuple[str, float, float]]]"))
        .def(
            "linearize", [](TrainSimulation& s) { return linearize_point(s.assembly(), s.channels(), point_now(s)); },
            nb::sig("def linearize(self) -> tuple[typing.Any, ...]"))
        .def(
            "reset",
            [](TrainSimulation& s, const Named& start, const Named& capacities) {
                const std::string error = s.reset({start, capacities});
                if (!error.empty()) throw nb::value_error(error.c_str());
            },
            "start"_a, "hysteresis_capacities"_a);
    bind_state<TrainSimulation>(of_train);
}

}  // namespace lostmotion::binding
