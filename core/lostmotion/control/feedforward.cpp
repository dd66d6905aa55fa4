#include "feedforward.hpp"

namespace lostmotion::control {

double Feedforward::offset(double reference_rate, double sample_time, double* slot) const {
    if (backlash == 0.0) return 0.0;
    double& moved = slot[first_];
    const double way = sign_of(reference_rate);
    if (way != 0.0) {
        const double step = backlash_rate * sample_time, target = way * 0.5 * backlash;
        moved += std::clamp(target - moved, -step, step);
    }
    return moved;
}

}  // namespace lostmotion::control
