#include "encoder.hpp"

namespace lostmotion::control {

double Encoder::step() const {
    if (ideal || resolution > 0.0) return ideal ? 0.0 : resolution;
    if (grating_period > 0.0) return std::ldexp(grating_period, bits == 0 ? -2 : -bits);
    constexpr double turn = 2.0 * std::numbers::pi;
    if (lines > 0) return turn / (lines * std::ldexp(1.0, bits == 0 ? 2 : bits));
    return bits > 0 ? std::ldexp(turn, -bits) : 0.0;
}

double Encoder::reading(double angle) const {
    const double q = step(), read = q > 0.0 ? q * std::floor(angle / q + 0.5) : angle;
    const double periods = error_periods != 0     ? error_periods
                           : grating_period > 0.0 ? 2.0 * std::numbers::pi / grating_period
                                                  : lines;
    return error > 0.0 ? read + error * sine_cosine(periods * angle + error_phase).sin : read;
}

}  // namespace lostmotion::control
