#include "tick_tangent.hpp"

namespace lostmotion {

bool difference_beside_limits(const std::array<double, 5>& f, double h, double noise, double& derivative) {
    const double left = f[2] - 2.0 * f[1] + f[0], middle = f[3] - 2.0 * f[2] + f[1], right = f[4] - 2.0 * f[3] + f[2];
    double size = 0.0, course = 0.0;
    for (const double v : f) {
        size = std::fmax(size, std::fabs(v));
        course = std::fmax(course, std::fabs(v - f[2]));
    }
    const double alike = 1e-4 * course + 2e-13 * size + 1e-2 * std::fabs(middle);
    if (std::fabs(middle - left) <= alike && std::fabs(right - middle) <= alike) {
        derivative = (8.0 * (f[3] - f[1]) - (f[4] - f[0])) / (12.0 * h);
        return true;
    }
    const bool to_left = std::fabs(left) < std::fabs(right);
    derivative = to_left ? (3.0 * f[2] - 4.0 * f[1] + f[0]) / (2.0 * h) : (-3.0 * f[2] + 4.0 * f[3] - f[4]) / (2.0 * h);
    return std::fmin(std::fabs(left), std::fabs(right)) <= 1e-2 * course + noise;
}

bool alike_beside(double left, double here, double right, double bend) {
    const double size = std::fmax(std::fabs(left), std::fmax(std::fabs(here), std::fabs(right)));
    return std::fabs(right - 2.0 * here + left) <= bend * std::fabs(right - left) + 2e-13 * size;
}

void TickTangent::measure(std::size_t a, const control::Axis& law, const FormTangent& form, const double* w,
                          const double* derivative, double time) {
    std::array<double, n_measured> y;
    std::fill(measured_derivative_.begin(), measured_derivative_.end(), 0.0);
    for (int k = 0; k < n_measured; ++k) {
        const model::Row& f = rows_[a].measured[static_cast<std::size_t>(k)];
        y[static_cast<std::size_t>(k)] = form.value(f, w);
        const control::Encoder& encoder =
            k == 0 && law.two_encoders ? law.position_sensor.encoder : law.speed_sensor.encoder;
        if (k < 2 && encoder.step() > 0.0) continue;
        double* to = &measured_derivative_[static_cast<std::size_t>(k * parameters_)];
        form.add_motion(f, derivative, 1.0, to);
        for (int p = 0; p < parameters_; ++p)
            for (const Beside& b : beside_[static_cast<std::size_t>(p)])
                if (!b.rows.empty())
                    to[p] += b.weight * (form.value(b.rows[a].measured[static_cast<std::size_t>(k)], w) -
                                         y[static_cast<std::size_t>(k)]);
    }
    measured_ = {y[0], y[1], y[2], y[3], y[4], y[5], y[6], time};
}

auto TickTangent::measured(int p, double offset) const -> control::Sampled {
    const auto d = [&](int k) { return offset * measured_derivative_[static_cast<std::size_t>(k * parameters_ + p)]; };
    const control::Sampled& y = measured_;
    return {y.position_angle + d(0), y.speed_angle + d(1), y.speed + d(2),       y.motor_torque + d(3),
            y.rotor_angle + d(4),    y.rotor_speed + d(5), y.shaft_angle + d(6), y.time};
}

bool TickTangent::moves(int p, int first, int count) const {
    for (int k = 0; k < count; ++k)
        if (slots_[static_cast<std::size_t>((first + k) * parameters_ + p)] != 0.0) return true;
    for (int k = 0; k < n_measured; ++k)
        if (measured_derivative_[static_cast<std::size_t>(k * parameters_ + p)] != 0.0) return true;
    return false;
}

double TickTangent::taken(int k, double h, double noise) {
    const double* f = &values_[static_cast<std::size_t>(5 * k)];
    double out = 0.0;
    if (!difference_beside_limits({f[0], f[1], now_[static_cast<std::size_t>(k)], f[3], f[4]}, h, noise, out))
        error_ = "a limit of a controller that it only touches";
    return out;
}

}  // namespace lostmotion
