#include "gear_losses.hpp"

namespace lostmotion::control {

double GearLosses::output_torque(double T_1, double s, double w, double factor) const {
    double T_2 = ratio * T_1;
    for (int k = 0; k < 20; ++k) {
        const Loss loss = at(T_2, s, w);
        const double left = T_2 + s * factor * ratio * loss.torque - ratio * T_1;
        const double next = T_2 - left / (1.0 + factor * loss.per_load);
        if (next == T_2) break;
        T_2 = next;
    }
    return T_2;
}

auto GearLosses::at(double T_2, double s, double w) const -> Loss {
    const double i = std::fabs(ratio), load = s * std::copysign(1.0, ratio) * T_2;
    if (kind == constant_efficiency) {
        const double slope = load > 0.0 ? 1.0 / efficiency - 1.0 : efficiency - 1.0;
        return {load * slope / i, slope};
    }
    if (kind == none) return {};
    const double mu = load / rated_torque, v = std::fabs(w) / rated_speed;
    const Plane p = map.plane(map.triangle(mu, v));
    return {(p.at_zero + p.per_speed * v + p.per_load * mu) * rated_torque / i, p.per_load};
}

}  // namespace lostmotion::control
