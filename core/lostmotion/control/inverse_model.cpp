#include "inverse_model.hpp"

namespace lostmotion::control {

void InverseModel::start(double* slot) const {
    if (!present) return;
    slot[first_] = loss_factor;
    slot[first_ + 1] = friction_torque;
}

auto InverseModel::twist(double speed, double acceleration, double observed_load, double sample_time,
                         double* slot) const -> Twist {
    if (!present || !through_gear) return {};
    double &angle = slot[first_ + 2], &rate = slot[first_ + 3];
    const double step = twist_rate * sample_time, target = inverse(output_torque(speed, acceleration, observed_load));
    const double next = angle + std::clamp(target - angle, -step, step);
    rate = (next - angle) / sample_time;
    angle = next;
    return {angle, rate};
}

auto InverseModel::torque(double speed, double acceleration, double observed_load, const double* slot) const -> Known {
    const double i = losses.ratio, s = sign_of(i * speed);
    const double rate = through_gear ? slot[first_ + 3] : 0.0;
    const double w = i * (speed + rate), T_2 = output_torque(speed, acceleration, observed_load);
    const double Y = s * losses(T_2, s, w), kappa = slot[first_], T_10 = slot[first_ + 1];
    const double torque =
        motor_inertia * i * acceleration + motor_viscous_friction * w + T_2 / i + s * T_10 + kappa * Y;
    if (std::fabs(w) > min_speed) return {torque, Y, s};
    return {torque};
}

void InverseModel::adapt(const Known& by, double error, double sample_time, double* slot) const {
    of_losses(slot[first_], error, by.losses, sample_time);
    of_friction(slot[first_ + 1], error, by.way, sample_time);
}

double InverseModel::inverse(double torque) const { return curve.twist(torque); }

}  // namespace lostmotion::control
