#include "speed_loop.hpp"

namespace lostmotion::control {

double SpeedLoop::operator()(double reference, double speed, double feedforward, TorqueRange range, double at_limit,
                             double sample_time, double* slot) const {
    double& integral = slot[first_];
    const double k_t = reference_weight * gain, v = integral - (gain - k_t) * speed + feedforward;
    const double torque = range(k_t * (reference - speed) + v);
    if (k_i() != 0.0 && !((torque - v) * at_limit > 0.0)) integral += sample_time * (k_i() / k_t) * (torque - v);
    return torque;
}

}  // namespace lostmotion::control
