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

// What is known of a motion beside its state: use(number) for each of its numbers.
template <class State, class Use>
void each_number_of_course(State& s, Use&& use) {
    for (auto* numbers : {&s.rate, &s.rate_input})
        for (auto& number : *numbers) use(number);
    use(s.rate_known);
    for (auto& t : s.twists) {
        use(t.off_zero);
        use(t.grazing_magnitude);
        use(t.doubt);
        use(t.most_doubt);
    }
    use(s.steady);
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
inline Record get_state(const Motion& m) {
    MotionState s;
    m.save(s);
    Numbers course;
    each_number_of_course(s, [&](const auto& number) { course.push_back(static_cast<double>(number)); });
    Record out;
    out["time"] = s.time;
    out["state"] = s.x;
    out["memory"] = s.memory;
    out["regime"] = from_key(s.key);
    out["inputs"] = s.input;
    out["started"] = s.started;
    out["course"] = course;
    out["control"] = from_control(s.control);
    return out;
}

inline void set_state(Motion& m, const Record& from) {
    MotionState to;
    m.save(to);  // which has as many numbers
    const auto numbers = [&](const char* key) { return nb::cast<Numbers>(from[key]); };
    const auto take = [&](const char* key, Numbers& into) {
        Numbers given = numbers(key);
        check_size(given, into.size());
        into = std::move(given);
    };
    to.time = nb::cast<double>(from["time"]);
    take("state", to.x);
    take("memory", to.memory);
    take("inputs", to.input);
    to_key(nb::cast<std::vector<int>>(from["regime"]), to.key);
    to.started = nb::cast<bool>(from["started"]);
    const Numbers course = numbers("course");
    std::size_t count = 0;
    each_number_of_course(to, [&](const auto&) { ++count; });
    check_size(course, count);
    const double* next = course.data();
    each_number_of_course(
        to, [&](auto& number) { number = static_cast<std::remove_reference_t<decltype(number)>>(*next++); });
    to.control = to_control(numbers("control"));
    if (to.started) check_size(to.control.slots, m.control_slots());
    m.restore(to);
}

}  // namespace lostmotion::binding
