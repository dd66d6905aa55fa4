#include "feedforward.hpp"

namespace lostmotion::control {

double BacklashCompensation::operator()(double reference_rate, double sample_time, double* slot) const {
    if (backlash == 0.0) return 0.0;
    double& offset = slot[first_];
    const double way = sign_of(reference_rate);
    if (way != 0.0) {
        const double step = rate * sample_time, target = way * 0.5 * backlash;
        offset += std::clamp(target - offset, -step, step);
    }
    return offset;
}

}  // namespace lostmotion::control
