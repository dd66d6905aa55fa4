#include "speed_loop.hpp"

namespace lostmotion::control {

double SpeedLoop::operator()(double reference, double speed, double feedforward, TorqueRange range, double at_limit,
                             double sample_time, double* slot) const {
    double& integral = slot[first_];
    const double v = integral - (gain - reference_gain) * speed + feedforward;
    const double torque = range(reference_gain * (reference - speed) + v);
    if (integral_gain != 0.0 && !((torque - v) * at_limit > 0.0))
        integral += sample_time * (integral_gain / reference_gain) * (torque - v);
    return torque;
}

}  // namespace lostmotion::control
