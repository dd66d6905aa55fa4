// What a solver knows of a motion beside its state.
#pragma once

#include <algorithm>
#include <array>

#include "../kernel/form.hpp"

namespace lostmotion {

// What is known of the motion in the present regime beside its state, and goes on with the regime.
template <class D>
struct CourseOf {
    StateOf<D> rate{};  // x', if it is known better than from x: under constant inputs
    bool rate_known = false;
    InputsOf<D> input{};  // up to here; those that the rate belongs to
    // Of the speed of a twist, which ends the regime by touching zero, too. What rounding leaves of a zero is relative
    // to the largest magnitude of its terms.
    struct Twist {
        bool off_zero = false;  // has it been off zero?
        // The largest magnitude of its terms, and of the change of speed by the terms of the first rate [rad/s].
        double grazing_magnitude = 0.0;
        double doubt = 0.0;       // rounding of the rate where the regime began, relative to the rate
        double most_doubt = 0.0;  // the same as a speed of the twist [rad/s]
    };
    std::array<Twist, D::twists> twist{};

    // Has the regime begun?
    bool has_magnitudes() const {
        return std::any_of(twist.begin(), twist.end(), [](const Twist& t) { return t.grazing_magnitude > 0.0; });
    }

    // In another regime: what is kept of the numbers means nothing.
    void forget() {
        rate_known = false;
        twist = {};
    }
};

// use(number) for each of the numbers that a course consists of, to read or to write them.
template <class Course, class Use>
void each_number(Course& course, Use&& use) {
    for (auto& r : course.rate) use(r);
    for (auto& u : course.input) use(u);
    use(course.rate_known);
    for (auto& t : course.twist) {
        use(t.off_zero);
        use(t.grazing_magnitude);
        use(t.doubt);
        use(t.most_doubt);
    }
}

}  // namespace lostmotion
