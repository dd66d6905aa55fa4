// Snapshots of simulations as numbers, so that they can be kept and pickled.
#pragma once

#include "arrays.hpp"
#include "lostmotion/simulation/train_stepping.hpp"

namespace lostmotion::binding {

using Numbers = std::vector<double>;

// Of what was given, `count` numbers.
template <class T>
void check_size(const std::vector<T>& given, std::size_t count) {
    if (given.size() != count) throw nb::type_error("a state of another simulation");
}

template <std::size_t n>
Numbers from_memory(const std::array<double, n>& m) {
    return {m.begin(), m.end()};
}
template <std::size_t n>
void to_memory(const Numbers& v, std::array<double, n>& m) {
    check_size(v, n);
    std::copy(v.begin(), v.end(), m.begin());
}

// The modes of the contacts, and which pieces of the laws hold.
inline std::vector<int> from_key(const model::Key& k) {
    std::vector<int> v(k.modes.begin(), k.modes.end());
    v.insert(v.end(), k.branch.begin(), k.branch.end());
    return v;
}
inline void to_key(const std::vector<int>& v, model::Key& key) {
    check_size(v, key.modes.size() + key.branch.size());
    for (std::size_t c = 0; c < key.modes.size(); ++c) key.modes[c] = static_cast<std::int8_t>(v[c]);
    for (std::size_t b = 0; b < key.branch.size(); ++b)
        key.branch[b] = static_cast<std::int16_t>(v[key.modes.size() + b]);
}

// The course of a motion and whether the inputs are constant.
template <class D>
Numbers from_course(const CourseOf<D>& c, bool steady) {
    Numbers v;
    each_number(c, [&](const auto& number) { v.push_back(static_cast<double>(number)); });
    v.push_back(steady);
    return v;
}
template <class D>
void to_course(const Numbers& v, CourseOf<D>& c, bool& steady) {
    std::size_t count = 1;
    each_number(c, [&](const auto&) { ++count; });
    check_size(v, count);
    const double* next = v.data();
    each_number(c, [&](auto& number) { number = static_cast<std::remove_reference_t<decltype(number)>>(*next++); });
    steady = *next != 0.0;
}

// The next tick of the controllers, and what they remember.
inline Numbers from_control(const ControlCourse& c) {
    Numbers v{static_cast<double>(c.next)};
    v.insert(v.end(), c.slots.begin(), c.slots.end());
    return v;
}
inline ControlCourse to_control(const Numbers& v) {
    if (v.empty()) throw nb::type_error("a state of another simulation");
    return {static_cast<std::int64_t>(v[0]), {v.begin() + 1, v.end()}};
}

// State of a simulation by keys.
template <class System>
Record get_state(const SimulationOf<System>& s) {
    const auto& n = s.snapshot();
    Record out;
    out["time"] = n.time;
    out["state"] = Numbers(n.x.begin(), n.x.end());
    out["memory"] = from_memory(n.memory);
    out["regime"] = from_key(n.key);
    out["inputs"] = Numbers(n.input.begin(), n.input.end());
    out["started"] = n.started;
    out["course"] = from_course(n.course, n.steady);
    out["control"] = from_control(n.control);
    return out;
}

template <class System>
void set_state(SimulationOf<System>& s, const Record& from) {
    typename SimulationOf<System>::Snapshot to;
    const auto numbers = [&](const char* key) { return nb::cast<Numbers>(from[key]); };
    to.time = nb::cast<double>(from["time"]);
    const Numbers x = numbers("state"), input = numbers("inputs");
    check_size(x, to.x.size());
    std::copy(x.begin(), x.end(), to.x.begin());
    to_memory(numbers("memory"), to.memory);
    to_key(nb::cast<std::vector<int>>(from["regime"]), to.key);
    check_size(input, to.input.size());
    std::copy(input.begin(), input.end(), to.input.begin());
    to.started = nb::cast<bool>(from["started"]);
    to_course(numbers("course"), to.course, to.steady);
    to.control = to_control(numbers("control"));
    if (to.started) check_size(to.control.slots, static_cast<std::size_t>(s.control_slots()));
    s.restore(to);
}

}  // namespace lostmotion::binding
