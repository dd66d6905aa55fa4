// The state of a motion, by the layout of its train, so that every kernel can go on from it.
#pragma once

#include <vector>

#include "../base/twist_course.hpp"
#include "../elements/regime.hpp"
#include "controllers.hpp"

namespace lostmotion {

// All that a motion needs to go on bit for bit.
struct MotionState {
    double time = 0.0;  // [s]
    std::vector<double> x, memory;
    std::vector<double> input;  // the last values that the caller gave, from which variables are read
    model::Key key;
    bool started = false;
    bool steady = false;  // the inputs were constant in the last interval
    // Rates and their rounding, which the solver carries along with the state in the present regime.
    std::vector<double> rate;  // x', if it is known better than from x
    bool rate_known = false;
    std::vector<double> rate_input;  // inputs up to here, which the rate belongs to
    std::vector<TwistCourse> twists;
    ControlCourse control;

    // To t = 0, where only a state is missing; memory is used again.
    void clear() {
        time = 0.0;
        key = {};
        started = steady = rate_known = false;
        for (auto* numbers : {&x, &memory, &input, &rate, &rate_input, &control.slots}) numbers->clear();
        twists.clear();
        control.next = 0;
    }
};

// use(number) for each number that a state consists of, to read or to write them.
template <class State, class Use>
void each_number(State& s, Use&& use) {
    use(s.time);
    for (auto* numbers : {&s.x, &s.memory, &s.input, &s.rate, &s.rate_input})
        for (auto& number : *numbers) use(number);
    for (auto& mode : s.key.modes) use(mode);
    for (auto& branch : s.key.branch) use(branch);
    for (auto* flag : {&s.started, &s.steady, &s.rate_known}) use(*flag);
    for (auto& t : s.twists) {
        use(t.off_zero);
        use(t.grazing_magnitude);
        use(t.doubt);
        use(t.most_doubt);
    }
    use(s.control.next);
    for (auto& slot : s.control.slots) use(slot);
}

}  // namespace lostmotion
