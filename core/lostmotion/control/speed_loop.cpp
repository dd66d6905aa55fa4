#include "speed_loop.hpp"

namespace lostmotion::control {

double SpeedLoop::operator()(double reference, double speed, double feedforward, double limit, double sample_time,
                             double* slot) const {
    double& integral = slot[first_];
    const double v = integral - (gain - reference_gain) * speed + feedforward;
    const double torque = std::clamp(reference_gain * (reference - speed) + v, -limit, limit);
    if (integral_gain != 0.0) integral += sample_time * (integral_gain / reference_gain) * (torque - v);
    return torque;
}

}  // namespace lostmotion::control
