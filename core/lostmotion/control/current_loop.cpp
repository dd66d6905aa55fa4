#include "current_loop.hpp"

namespace lostmotion::control {

void CurrentLoop::place(Slots& slots, double sample_time) {
    first_ = slots.take(2);
    const double k_N = armature_voltage_constant;
    K_ = gain / (k_N * share_of(sample_time, electrical_time_constant));
    K_i_ = gain / k_N;
    K_e_ = back_emf * (k_N - 1.0) / (k_N * rated_speed);
}

double CurrentLoop::operator()(double reference, double torque, double speed, double* slot) const {
    double &integral = slot[first_], &beyond = slot[first_ + 1];
    const double e = (reference - torque) / rated_torque;
    const double wanted = K_ * e + integral + K_e_ * speed;
    const double u = std::clamp(wanted, -command_limit, command_limit);
    integral += K_i_ * (u == wanted ? e : e + (u - wanted) / K_);
    beyond = sign_of(wanted - u);
    return u;
}

}  // namespace lostmotion::control
