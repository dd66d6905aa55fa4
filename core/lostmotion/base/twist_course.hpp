#pragma once

namespace lostmotion {

// What is known of the speed of a twist in the present regime. The speed ends the regime by touching zero, too, and
// what rounding leaves of a zero is relative to the largest magnitude of its terms.
struct TwistCourse {
    bool off_zero = false;  // has it been off zero?
    // The largest magnitude of its terms, and of the change of speed by the terms of the first rate [rad/s].
    double grazing_magnitude = 0.0;
    double doubt = 0.0;       // rounding of the rate where the regime began, relative to the rate
    double most_doubt = 0.0;  // the same as a speed of the twist [rad/s]
};

}  // namespace lostmotion
