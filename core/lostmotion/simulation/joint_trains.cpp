#include "joint_trains.hpp"

#include <algorithm>
#include <cmath>

#include "../model/shaft_angle.hpp"

namespace lostmotion {

std::optional<JointTrains::Joint> JointTrains::joint(TrainSimulation& train, int shaft) {
    const std::optional<LoadShaft> load = train.load_shaft(shaft);
    std::optional<model::Row> position = model::shaft_angle(train.assembly(), shaft);
    if (!load || !position) return {};
    return Joint{&train, *load, std::move(*position)};
}

JointTrains::JointTrains(std::vector<Joint> joints) : joints_(std::move(joints)) {
    const std::size_t n = joints_.size();
    for (Joint& j : joints_) j.inputs.assign(static_cast<std::size_t>(j.train->assembly().layout().inputs), 0.0);
    answer_.resize(n);
    residual_.resize(n);
    best_torque_.resize(n);
    change_.resize(n);
    begin_speed_.resize(n);
    matrix_.resize(n * n);
    mass_.resize(n * n);
    force_.resize(n);
    slope_.resize(n);
    read();
}

void JointTrains::set_commands(std::span<const double> values) {
    for (std::size_t k = 0; k < joints_.size(); ++k) {
        Joint& j = joints_[k];
        if (j.command < 0)
            j.train->motion().set_reference(0, values[k], 0.0);
        else
            j.inputs[static_cast<std::size_t>(j.command)] = values[k] * j.command_scale;
    }
}

auto JointTrains::guess(std::size_t joint) const -> Guess {
    const Joint& j = joints_[joint];
    return {j.inputs[static_cast<std::size_t>(j.shaft.load)], answer_[joint].acceleration};
}

void JointTrains::set_guess(std::size_t joint, const Guess& g) {
    Joint& j = joints_[joint];
    j.inputs[static_cast<std::size_t>(j.shaft.load)] = g.torque;
    answer_[joint].acceleration = g.acceleration;
}

void JointTrains::read() {
    for (Joint& j : joints_) {
        j.speed = j.train->motion().state(j.shaft.speed_state);
        j.angle = 0.0;
        for (int k = 0; k < j.train->assembly().layout().states; ++k)
            if (const double factor = j.position.c[k]; factor != 0.0) j.angle += factor * j.train->motion().state(k);
    }
}

Status JointTrains::respond(std::size_t joint, double interval, double slope) {
    const Joint& j = joints_[joint];
    ++evaluations_;
    begin_inputs_ = end_inputs_ = j.inputs;
    begin_inputs_[static_cast<std::size_t>(j.shaft.load)] -= 0.5 * interval * slope;
    end_inputs_[static_cast<std::size_t>(j.shaft.load)] += 0.5 * interval * slope;
    const Status status = j.train->motion().answer(interval, begin_inputs_, end_inputs_, j.shaft, answer_[joint]);
    if (status != Status::done) failed_ = joint;
    return status;
}

// The linear equations of Newton's method, by elimination with row pivoting; the residuals become the changes.
bool JointTrains::solve() {
    const std::size_t n = joints_.size();
    for (std::size_t r = 0; r < n; ++r)
        for (std::size_t c = 0; c < n; ++c)
            matrix_[r * n + c] = (r == c ? 1.0 : 0.0) +
                                 (mass_[r * n + c] - (r == c ? joints_[r].shaft.inertia : 0.0)) * answer_[c].compliance;
    change_ = residual_;
    for (std::size_t k = 0; k < n; ++k) {
        std::size_t pivot = k;
        for (std::size_t r = k + 1; r < n; ++r)
            if (std::fabs(matrix_[r * n + k]) > std::fabs(matrix_[pivot * n + k])) pivot = r;
        if (matrix_[pivot * n + k] == 0.0) return false;
        if (pivot != k) {
            std::swap_ranges(&matrix_[k * n], &matrix_[k * n] + n, &matrix_[pivot * n]);
            std::swap(change_[k], change_[pivot]);
        }
        for (std::size_t r = k + 1; r < n; ++r) {
            const double factor = matrix_[r * n + k] / matrix_[k * n + k];
            if (factor == 0.0) continue;
            for (std::size_t c = k; c < n; ++c) matrix_[r * n + c] -= factor * matrix_[k * n + c];
            change_[r] -= factor * change_[k];
        }
    }
    for (std::size_t k = n; k-- > 0;) {
        for (std::size_t c = k + 1; c < n; ++c) change_[k] -= matrix_[k * n + c] * change_[c];
        change_[k] /= matrix_[k * n + k];
    }
    return true;
}

Status JointTrains::substep(double interval) {
    const std::size_t n = joints_.size();
    for (Joint& j : joints_) j.train->motion().save(j.substep_begin);
    double best = 0.0;
    double share = 1.0;  // of the last change that is taken
    for (int iteration = 0;; ++iteration) {
        for (std::size_t k = 0; k < n; ++k) {
            if (iteration > 0) joints_[k].train->motion().restore(joints_[k].substep_begin);
            if (const Status status = respond(k, interval, slope_[k]); status != Status::done) return status;
        }
        double worst = 0.0;  // over what rounding leaves
        bool settled = true;
        for (std::size_t r = 0; r < n; ++r) {
            const double load = joints_[r].inputs[static_cast<std::size_t>(joints_[r].shaft.load)];
            double sum = -force_[r] - load, size = std::fabs(force_[r]) + std::fabs(load), rounded = 0.0;
            for (std::size_t c = 0; c < n; ++c) {
                const double coupled = mass_[r * n + c] - (r == c ? joints_[r].shaft.inertia : 0.0);
                sum += coupled * answer_[c].acceleration;
                size += std::fabs(coupled * answer_[c].acceleration);
                rounded += std::fabs(coupled) * answer_[c].rounding;
            }
            residual_[r] = sum;
            settled = settled && std::fabs(sum) <= 1e-11 * size + 16.0 * rounded;
            worst = std::fmax(worst, std::fabs(sum));
        }
        if (settled) break;
        if (iteration == most_iterations) {
            ++unsettled_;
            break;
        }
        if (iteration > 0 && worst >= best && share > 0x1p-6) {
            share *= 0.5;  // a switching lies between: less of the last change
        } else {
            for (std::size_t k = 0; k < n; ++k)
                best_torque_[k] = joints_[k].inputs[static_cast<std::size_t>(joints_[k].shaft.load)];
            best = worst;
            share = 1.0;
            if (!solve()) {
                ++unsettled_;
                break;
            }
        }
        for (std::size_t k = 0; k < n; ++k)
            joints_[k].inputs[static_cast<std::size_t>(joints_[k].shaft.load)] = best_torque_[k] + share * change_[k];
    }
    for (std::size_t k = 0; k < n; ++k) {
        Joint& j = joints_[k];
        j.compliance = answer_[k].compliance;
        j.torque +=
            joints_[k].shaft.inertia * answer_[k].acceleration + j.inputs[static_cast<std::size_t>(j.shaft.load)];
    }
    return Status::done;
}

Status JointTrains::step(double interval, int substeps, const Mechanics& m) {
    const std::size_t n = joints_.size();
    for (std::size_t k = 0; k < joints_.size(); ++k) {
        joints_[k].train->motion().save(joints_[k].step_begin);
        begin_speed_[k] = joints_[k].speed;
        joints_[k].torque = 0.0;
    }
    for (int s = 0; s < substeps; ++s) {
        const double away = interval * ((s + 0.5) / substeps - 0.5);  // from the middle of the step
        for (std::size_t k = 0; k < n * n; ++k) mass_[k] = m.mass[k] + away * m.mass_rate[k];
        for (std::size_t k = 0; k < n; ++k) {
            force_[k] = m.force[k] + away * m.force_rate[k];
            slope_[k] = -m.force_rate[k];
            for (std::size_t j = 0; j < n; ++j) slope_[k] += m.mass_rate[k * n + j] * answer_[j].acceleration;
        }
        if (const Status status = substep(interval / substeps); status != Status::done) {
            go_back();
            return status;
        }
    }
    read();
    for (std::size_t k = 0; k < joints_.size(); ++k) {
        joints_[k].acceleration = (joints_[k].speed - begin_speed_[k]) / interval;
        joints_[k].torque /= substeps;
    }
    return Status::done;
}

void JointTrains::go_back() {
    for (Joint& j : joints_) j.train->motion().restore(j.step_begin);
    read();
}

}  // namespace lostmotion
