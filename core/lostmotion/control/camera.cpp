#include "camera.hpp"

namespace lostmotion::control {

void Camera::expose(std::int64_t tick, double offset, double line_of_sight, double* slot) const {
    if (tick % every != 0) return;
    const std::int64_t n = tick / every;
    double measured = offset;
    if (noise > 0.0) measured += noise * normal(seed, stream, static_cast<std::uint64_t>(n));
    if (step > 0.0) measured = step * std::floor(measured / step + 0.5);
    double* frame = slot + first_ + 2 * (n % kept());
    frame[0] = line_of_sight + measured;
    frame[1] = std::fabs(offset) <= half_field ? 1.0 : 0.0;
}

auto Camera::arrived(std::int64_t tick, const double* slot) const -> Frame {
    const double* frame = slot + first_ + 2 * ((tick - latency) / every % kept());
    return {frame[0], frame[1] != 0.0};
}

}  // namespace lostmotion::control
