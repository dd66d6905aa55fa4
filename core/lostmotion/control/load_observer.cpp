#include "load_observer.hpp"

namespace lostmotion::control {

void LoadObserver::start(double speed, const InverseModel& model, double* slot) const {
    if (!present) return;
    double* s = slot + first_;
    s[input] = model.motor_inertia / input_time * speed;
    s[output] = model.load_inertia / load_time * speed / model.losses.ratio;
}

void LoadObserver::observe(double M, double w, const InverseModel& model, double* slot) const {
    double* x = slot + first_;
    const double i = model.losses.ratio, s = std::fabs(w) > model.min_speed ? sign_of(w) : 0.0;
    const double J_1 = model.motor_inertia / input_time, J_2 = model.load_inertia / load_time;
    const double phi_rate = w / i;
    // What stands keeps both low passes in step with the speed, so that nothing jumps when it goes on.
    if (s == 0.0) {
        x[input] = x[input_torque] + J_1 * w;
        x[output] = x[torque] + J_2 * phi_rate;
        return;
    }
    const double given = M - model.motor_viscous_friction * w - model.friction_now(slot) * s;
    x[input] += input_share * (given + J_1 * w - x[input]);
    x[input_torque] = x[input] - J_1 * w;
    const double T_2 = model.losses.output_torque(x[input_torque], s, w, model.loss_factor_now(slot));
    const double left = T_2 - model.load_viscous_friction * phi_rate;
    x[output] += load_share * (left + J_2 * phi_rate - x[output]);
    x[torque] = x[output] - J_2 * phi_rate;
    x[slope] = model.losses.slope(T_2, s, w);
}

auto LoadObserver::schedule(SpeedLoop loop, const InverseModel& model, const double* slot) const -> SpeedLoop {
    if (!present || bandwidth == 0.0) return loop;
    const double i = model.losses.ratio, weight = loop.reference_gain / loop.gain;
    const double J = model.motor_inertia + (1.0 + slot[first_ + slope]) * model.load_inertia / (i * i);
    loop.gain = bandwidth * J;
    loop.reference_gain = weight * loop.gain;
    loop.integral_gain = 0.25 * bandwidth * loop.gain;
    return loop;
}

}  // namespace lostmotion::control
