// The drive step by step.
#pragma once

#include "analysis.hpp"
#include "lostmotion/simulation/stepping.hpp"

namespace lostmotion::binding {

// The course of a motion and whether the inputs are constant, as numbers.
using CourseNumbers = std::array<double, n_states + n_inputs + 6>;
inline CourseNumbers from_course(const CourseOf<DriveDims>& c, bool steady) {
    CourseNumbers v{};
    auto next = std::copy(c.input.begin(), c.input.end(), std::copy(c.rate.begin(), c.rate.end(), v.begin()));
    const auto& twist = c.twist[0];
    for (const double x : {double(c.rate_known), double(twist.off_zero), twist.grazing_magnitude, twist.doubt,
                           twist.most_doubt, double(steady)})
        *next++ = x;
    return v;
}
inline CourseOf<DriveDims> to_course(const CourseNumbers& v) {
    CourseOf<DriveDims> c;
    std::copy_n(v.begin(), n_states, c.rate.begin());
    std::copy_n(v.begin() + n_states, n_inputs, c.input.begin());
    const double* rest = &v[n_states + n_inputs];
    c.rate_known = rest[0] != 0.0;
    c.twist[0] = {rest[1] != 0.0, rest[2], rest[3], rest[4]};
    return c;
}

// The modes of the contacts, and which pieces of the laws hold.
using KeyNumbers = std::array<int, n_contacts + 4>;
inline KeyNumbers from_key(const RegimeKey& k) {
    return {k.modes[0], k.modes[1], k.modes[2], k.amplifier, k.piece, k.cell, k.cell_back};
}
inline RegimeKey to_key(const KeyNumbers& k) {
    RegimeKey key;
    for (int c = 0; c < n_contacts; ++c) key.modes[c] = static_cast<std::int8_t>(k[c]);
    key.amplifier = static_cast<std::int8_t>(k[3]);
    key.piece = static_cast<std::int16_t>(k[4]);
    key.cell = k[5];
    key.cell_back = k[6];
    return key;
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

inline nb::tuple explain_now(Simulation& s) {
    const Reading r = s.reading();
    const auto& now = s.snapshot();
    return nb::make_tuple(values_of(r), explain_state(s.drive(), s.regime(), now.x, now.memory, now.input));
}

inline nb::tuple get_state(const Simulation& s) {
    const auto& n = s.snapshot();
    return nb::make_tuple(n.time, from_state(n.x), n.memory.hysteresis_capacity, n.memory.locked_torque,
                          from_key(n.key), n.input, n.started, from_course(n.course, n.steady));
}

inline void set_state(Simulation& s, double time, const StateNumbers& x, double capacity, double locked_torque,
                      const KeyNumbers& key, const InputNumbers& input, bool started, const CourseNumbers& course) {
    s.restore({time,
               to_state(x),
               {capacity, locked_torque},
               to_key(key),
               input,
               started,
               course.back() != 0.0,
               to_course(course)});
}

// To t = 0, with the contacts still to be found.
inline void reset(Simulation& s, const StateNumbers& x, double capacity) {
    Simulation::Snapshot start;
    start.x = to_state(x);
    start.memory = {capacity, 0.0};
    s.restore(start);
}

inline void bind_stepping(nb::module_& m) {
    nb::class_<Simulation>(m, "Simulation")
        .def(
            "__init__",
            [](Simulation* self, const SharedDrive& d, double step) { new (self) Simulation(d.drive, step); },
            "drive"_a, "step"_a)
        .def("advance", &advance, "interval"_a, "command_begin"_a, "command_end"_a, "load_begin"_a, "load_end"_a)
        .def("time", &Simulation::time)
        .def("read", [](Simulation& s) { return values_of(s.reading()); })
        .def("explain", &explain_now,
             nb::sig("def explain(self) -> "
                     "tuple[list[float], list[tuple[str, int, float, float, float, float]]]"))
        .def("reset", &reset, "state"_a, "hysteresis_capacity"_a)
        .def("get_state", &get_state,
             nb::sig("def get_state(self) -> tuple[float, list[float], float, float, list[int], list[float], bool, "
                     "list[float]]"))
        .def("set_state", &set_state, "time"_a, "state"_a, "hysteresis_capacity"_a, "locked_torque"_a, "regime"_a,
             "input"_a, "started"_a, "course"_a);
}

}  // namespace lostmotion::binding
