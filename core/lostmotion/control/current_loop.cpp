#include "current_loop.hpp"

namespace lostmotion::control {

double CurrentLoop::operator()(double reference, double torque, double speed, double* slot) const {
    double &integral = slot[first_], &beyond = slot[first_ + 1];
    const double e = (reference - torque) / rated_torque;
    const double wanted = gain * e + integral + back_emf * speed;
    const double u = std::clamp(wanted, -limit, limit);
    integral += integral_gain * (u == wanted ? e : e + (u - wanted) / gain);
    beyond = sign_of(wanted - u);
    return u;
}

}  // namespace lostmotion::control
