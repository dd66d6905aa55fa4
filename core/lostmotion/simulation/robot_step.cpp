#include "robot_step.hpp"

#include <algorithm>
#include <cmath>

namespace lostmotion {

RobotStep::RobotStep(JointTrains& trains, Engine engine) : trains_(trains), engine_(std::move(engine)) {
    const std::size_t all = engine_.speed.size(), n = engine_.trained.size(), m = engine_.others.size();
    for (std::vector<double>* v : {&ahead_, &motion_, &end_, &force_, &acceleration_, &speed_}) v->resize(all);
    position_.resize(engine_.position.size());
    course_.acceleration.resize(all);
    course_.before.resize(all);
    for (std::vector<double>* v : {&course_.inertia, &own_, &mass_rate_}) v->resize(n * n);
    for (std::vector<double>* v : {&course_.force, &acting_, &force_rate_}) v->resize(n);
    mass_.resize(all * all);
    factor_.resize(m * m);
    across_.resize(m * n);
    right_.resize(m);
}

int RobotStep::away() const {
    for (std::size_t k = 0; k < engine_.trained.size(); ++k) {
        const JointTrains::Joint& j = trains_.joints()[k];
        if (engine_.position[engine_.place[k]] != j.angle || engine_.speed[engine_.trained[k]] != j.speed)
            return static_cast<int>(k);
    }
    return -1;
}

void RobotStep::integrate_positions(double interval) {
    for (std::size_t k = 0; k < engine_.place_of_speed.size(); ++k)
        engine_.position[engine_.place_of_speed[k]] += interval * motion_[k];
}

void RobotStep::begin(double h) {
    std::ranges::copy(engine_.position, position_.begin());
    std::ranges::copy(engine_.speed, speed_.begin());
    for (std::size_t k = 0; k < speed_.size(); ++k) {
        ahead_[k] = course_.acceleration[k] + 0.75 * (course_.acceleration[k] - course_.before[k]);
        motion_[k] = speed_[k] + 0.25 * h * ahead_[k];
    }
    integrate_positions(0.5 * h);
}

void RobotStep::speed_at_middle(double h) {
    for (std::size_t k = 0; k < speed_.size(); ++k) engine_.speed[k] = speed_[k] + 0.5 * h * ahead_[k];
}

void RobotStep::take(double h, std::span<const double> acceleration) {
    const std::size_t all = speed_.size(), n = engine_.trained.size(), m = engine_.others.size();
    std::ranges::fill(mass_, 0.0);
    for (std::size_t r = 0; r < all; ++r)
        for (std::int32_t k = engine_.row_begin[r]; k < engine_.row_begin[r] + engine_.row_length[r]; ++k) {
            const auto at = static_cast<std::size_t>(k), c = static_cast<std::size_t>(engine_.column[at]);
            mass_[r * all + c] = mass_[c * all + r] = engine_.matrix[at];
        }
    std::ranges::copy(engine_.force, force_.begin());
    // Viscous friction of joints without a drive, at the mean of the speeds at both ends.
    for (std::size_t k = 0; k < all; ++k) {
        const double share = 0.5 * h * engine_.damping[k];
        force_[k] += share * acceleration[k];
        mass_[k * all + k] += share;
    }
    for (std::size_t r = 0; r < n; ++r)
        for (std::size_t c = 0; c < n; ++c) own_[r * n + c] = mass_[engine_.trained[r] * all + engine_.trained[c]];
    for (std::size_t r = 0; r < m; ++r) {
        const double* row = &mass_[engine_.others[r] * all];
        for (std::size_t c = 0; c <= r; ++c) {
            double sum = row[engine_.others[c]];
            for (std::size_t k = 0; k < c; ++k) sum -= factor_[r * m + k] * factor_[c * m + k];
            factor_[r * m + c] = c == r ? std::sqrt(sum) : sum / factor_[c * m + c];
        }
        for (std::size_t c = 0; c < n; ++c) {
            double sum = row[engine_.trained[c]];
            for (std::size_t k = 0; k < r; ++k) sum -= factor_[r * m + k] * across_[k * n + c];
            across_[r * n + c] = sum / factor_[r * m + r];
        }
    }
    for (std::size_t k = 0; k < m; ++k)
        for (std::size_t r = 0; r < n; ++r)
            for (std::size_t c = 0; c < n; ++c) own_[r * n + c] -= across_[k * n + r] * across_[k * n + c];
}

Status RobotStep::advance(double h, int substeps, std::span<const double> force, bool smooth) {
    const std::size_t n = engine_.trained.size(), m = engine_.others.size();
    for (std::size_t k = 0; k < n; ++k) acting_[k] = force[engine_.trained[k]];
    for (std::size_t r = 0; r < m; ++r) {
        double sum = force[engine_.others[r]];
        for (std::size_t k = 0; k < r; ++k) sum -= factor_[r * m + k] * right_[k];
        right_[r] = sum / factor_[r * m + r];
        for (std::size_t k = 0; k < n; ++k) acting_[k] -= across_[r * n + k] * right_[r];
    }
    const double per_time = smooth && course_.smooth ? 1.0 / h : 0.0;
    for (std::size_t k = 0; k < n * n; ++k) mass_rate_[k] = per_time * (own_[k] - course_.inertia[k]);
    for (std::size_t k = 0; k < n; ++k) force_rate_[k] = per_time * (acting_[k] - course_.force[k]);
    if (smooth) {
        course_.inertia = own_;
        course_.force = acting_;
    }
    course_.smooth = smooth;
    const Status status = trains_.step(h, substeps, {own_, acting_, mass_rate_, force_rate_});
    if (status != Status::done) return status;
    for (std::size_t k = 0; k < n; ++k) acceleration_[engine_.trained[k]] = trains_.joints()[k].acceleration;
    // L' a_O = L^-1 f_O - L^-1 M_OD a_D
    for (std::size_t r = m; r-- > 0;) {
        double sum = right_[r];
        for (std::size_t k = 0; k < n; ++k) sum -= across_[r * n + k] * trains_.joints()[k].acceleration;
        for (std::size_t k = r + 1; k < m; ++k) sum -= factor_[k * m + r] * acceleration_[engine_.others[k]];
        acceleration_[engine_.others[r]] = sum / factor_[r * m + r];
    }
    return status;
}

void RobotStep::restore() {
    std::ranges::copy(position_, engine_.position.begin());
    std::ranges::copy(speed_, engine_.speed.begin());
}

void RobotStep::integrate(double h, std::span<const double> acceleration) {
    restore();
    for (std::size_t k = 0; k < speed_.size(); ++k) end_[k] = speed_[k] + h * acceleration[k];
    for (std::size_t k = 0; k < engine_.trained.size(); ++k) end_[engine_.trained[k]] = trains_.joints()[k].speed;
    for (std::size_t k = 0; k < speed_.size(); ++k) motion_[k] = 0.5 * (speed_[k] + end_[k]);
    integrate_positions(h);
}

void RobotStep::finish(std::span<const double> acceleration) {
    for (std::size_t k = 0; k < engine_.trained.size(); ++k)
        engine_.position[engine_.place[k]] = trains_.joints()[k].angle;
    std::ranges::copy(end_, engine_.speed.begin());
    std::ranges::copy(acceleration, engine_.acceleration.begin());
    std::ranges::copy(acceleration, engine_.warmstart.begin());
    course_.before.swap(course_.acceleration);
    std::ranges::copy(acceleration, course_.acceleration.begin());
}

}  // namespace lostmotion
