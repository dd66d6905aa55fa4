#include "firmware.hpp"

namespace lostmotion::control {

double Firmware::followed(double goal, double h, double* slot) const {
    double *own = slot + first_, &limited = own[limited_goal], &rate = own[goal_rate];
    const double filtered = goal_filter_(goal, own[filtered_goal]);
    const double distance = filtered - limited, a = goal_acceleration_limit;
    if (std::isinf(a)) {
        if (std::fabs(distance) <= h * goal_rate_limit) return limited = filtered;
        rate = std::copysign(goal_rate_limit, distance);
    } else {
        const double braking = h * a * (std::sqrt(0.25 + 2.0 * std::fabs(distance) / (h * h * a)) - 0.5);
        const double wanted = std::copysign(std::min({braking, goal_rate_limit, std::fabs(distance) / h}), distance);
        rate = std::clamp(wanted, rate - h * a, rate + h * a);
    }
    return limited += h * rate;
}

double Firmware::duty(double error) const {
    const double e = std::fmax(std::fabs(error) - dead_band, 0.0);
    std::size_t k = 1;
    while (k < errors.size() && e > errors[k]) ++k;
    if (k == errors.size()) return std::copysign(duties.back(), error);
    const double share = (e - errors[k - 1]) / (errors[k] - errors[k - 1]);
    return std::copysign(1.0, error) * (duties[k - 1] + share * (duties[k] - duties[k - 1]));
}

}  // namespace lostmotion::control
