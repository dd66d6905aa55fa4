#include "load_observer.hpp"

#include <numbers>

namespace lostmotion::control {

void LoadObserver::place(Slots& slots, double sample_time) {
    first_ = slots.take(present ? n_slots : 0);
    input_filter_.place(sample_time, input_time);
    load_filter_.place(sample_time, load_time);
    w_c_ = 2.0 * std::numbers::pi * speed_bandwidth;
}

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
    x[input_torque] = input_filter_(given + J_1 * w, x[input]) - J_1 * w;
    const double T_2 = model.losses.output_torque(x[input_torque], s, w, model.loss_factor_now(slot));
    const double left = T_2 - model.load_viscous_friction * phi_rate;
    x[torque] = load_filter_(left + J_2 * phi_rate, x[output]) - J_2 * phi_rate;
    x[slope] = model.losses.slope(T_2, s, w);
}

auto LoadObserver::schedule(SpeedLoop loop, const InverseModel& model, const double* slot) const -> SpeedLoop {
    if (!present || std::isinf(speed_bandwidth)) return loop;
    const double i = model.losses.ratio;
    const double J = model.motor_inertia + (1.0 + slot[first_ + slope]) * model.load_inertia / (i * i);
    loop.gain = w_c_ * J;
    loop.integral_gain = 0.25 * w_c_ * loop.gain;
    loop.integral_time = std::numeric_limits<double>::infinity();
    return loop;
}

}  // namespace lostmotion::control
