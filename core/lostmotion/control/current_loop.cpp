#include "current_loop.hpp"

namespace lostmotion::control {

double CurrentLoop::operator()(double reference, double torque, double speed, double* slot) const {
    double& integral = slot[first_];
    const double e = (reference - torque) / rated_torque;
    const double wanted = gain * e + integral + back_emf * speed;
    const double u = std::clamp(wanted, -limit, limit);
    if (u == wanted) integral += integral_gain * e;
    return u;
}

}  // namespace lostmotion::control
