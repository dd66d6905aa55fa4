#include "controllers.hpp"

#include <cmath>

namespace lostmotion {

int Control::signals() const {
    int n = control::n_axis_signals;
    for (const ControlledAxis& axis : axes)
        if (axis.law.field_orientation) n = int{control::n_axis_signals} + int{control::n_winding_signals};
    return n;
}

auto Control::laws() const -> std::vector<control::Axis> {
    std::vector<control::Axis> out;
    for (const ControlledAxis& axis : axes) {
        out.push_back(axis.law);
        out.back().place(tick);
    }
    return out;
}

double Ticks::time(std::int64_t tick) const {
    const double t = static_cast<double>(tick) * length;
    if (sample_interval == 0.0) return t;
    const double sample = std::round(t / sample_interval) * sample_interval;
    return std::fabs(sample - t) < rounding() ? sample : t;
}

}  // namespace lostmotion
