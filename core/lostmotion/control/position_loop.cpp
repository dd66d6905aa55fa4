#include "position_loop.hpp"

namespace lostmotion::control {

double PositionLoop::operator()(double e, double reference_rate, double at_limit, double sample_time,
                                double* slot) const {
    double &integral = slot[first_], &held = slot[first_ + 1];
    const double wanted = gain * e + integral + feedforward * reference_rate;
    const double speed = std::clamp(wanted, -speed_limit, speed_limit);
    if (reference_rate != 0.0 || std::fabs(e) > dead_zone[1])
        held = 0.0;
    else if (std::fabs(e) < dead_zone[0])
        held = 1.0;
    const bool winds_up = (speed != wanted && e * wanted > 0.0) || e * at_limit > 0.0;
    if (held == 0.0 && !winds_up) integral += sample_time * integral_gain * e;
    return speed;
}

}  // namespace lostmotion::control
