#include "camera.hpp"

namespace lostmotion::control {

void Camera::expose(std::int64_t sample, double offset, double line_of_sight, double* slot) const {
    if (sample % every != 0) return;
    const std::int64_t n = sample / every;
    double measured = offset;
    if (noise > 0.0) measured += noise * normal(seed, stream, static_cast<std::uint64_t>(n));
    if (const double p = pixel / pixel_parts; p > 0.0) measured = p * std::floor(measured / p + 0.5);
    double* frame = slot + first_ + 2 * (n % kept());
    frame[0] = line_of_sight + measured;
    frame[1] = std::fabs(offset) <= 0.5 * field ? 1.0 : 0.0;
}

auto Camera::arrived(std::int64_t sample, const double* slot) const -> Frame {
    const double* frame = slot + first_ + 2 * ((sample - late) / every % kept());
    return {frame[0], frame[1] != 0.0};
}

}  // namespace lostmotion::control
