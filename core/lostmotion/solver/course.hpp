// What a solver knows of a motion beside its state.
#pragma once

#include <algorithm>
#include <array>

#include "../base/twist_course.hpp"
#include "../kernel/form.hpp"

namespace lostmotion {

// What is known of the motion in the present regime beside its state, and goes on with the regime.
template <class D>
struct CourseOf {
    StateOf<D> rate{};  // x', if it is known better than from x: under constant inputs
    bool rate_known = false;
    InputsOf<D> input{};  // up to here; those that the rate belongs to
    ListOf<D, TwistCourse, D::twists> twist{};

    // Has the regime begun?
    bool has_magnitudes() const {
        return std::any_of(twist.begin(), twist.end(), [](const TwistCourse& t) { return t.grazing_magnitude > 0.0; });
    }

    // In another regime: what is kept of the numbers means nothing.
    void forget() {
        rate_known = false;
        twist = {};
    }
};

}  // namespace lostmotion
