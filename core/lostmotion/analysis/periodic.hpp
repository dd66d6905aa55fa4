// Periodic motion under periodic inputs, by shooting: Newton's method on the map of the state over one period (the
// Poincare map), with its exact Jacobian. Where Newton does not converge, the transient is followed for a while.
#pragma once

#include <vector>

#include "../simulation/run.hpp"
#include "rank_solve.hpp"
#include "sensitivity.hpp"

namespace lostmotion {

// All that it takes to continue a motion.
struct Station {
    State x{};
    Memory memory;
    RegimeKey key;
};

struct PeriodicMotion {
    Status status = Status::done;
    double time = 0.0;  // [s] reached, if the status is not done
    Contact contact = input_contact;
    bool converged = false;
    bool smooth = true;          // whether the Jacobian is exact: no grazing among the switchings
    int periods = 0;             // followed, all in all
    int newton_steps = 0;        // of the attempt that converged
    double residual = 0.0;       // largest change of a state over one period / its largest magnitude within it
    double angle_advance = 0.0;  // of the load angle over one period [rad]; the angle itself is neutral
    Station start;               // at t = 0
    Jacobian jacobian;           // of the map over one period, at the start
};

struct ShootingOptions {
    double period = 1.0;       // [s]
    int max_periods = 20000;   // to follow
    double tolerance = 1e-10;  // of the residual
    bool (*interrupted)(void*) = nullptr;
    void* interrupted_context = nullptr;
};

class Shooting {
 public:
    // The inputs must repeat with the period. unit: as of ExactSolver.
    Shooting(Workspace& workspace, const Signals& signals, double unit, const ShootingOptions& options)
        : workspace_(workspace),
          drive_(workspace.drive),
          options_(options),
          solver_(workspace.system, signals, unit, workspace.drive.balanced_scale(), &workspace.cache) {
        solver_.interrupted = options.interrupted;
        solver_.interrupted_context = options.interrupted_context;
    }

    PeriodicMotion solve(const Start& start) {
        PeriodicMotion motion;
        motion.status = solver_.begin(0.0, start.x, start.memory);
        if (motion.status != Status::done) return motion;
        Station here{solver_.state(), solver_.memory(), solver_.key()};
        for (int follow = first_follow; motion.periods < options_.max_periods; follow *= 2) {
            for (int k = 0; k < follow; ++k, ++motion.periods) {
                Image image(workspace_);
                if (!advance(here, image, motion)) return motion;
                motion.residual = residual(here, image);
                // A motion that repeats to the last bit needs no more.
                if (motion.residual == 0.0) return finish(motion, here, image, 0);
                here = image.end;
                here.x[load_angle] = 0.0;
            }
            if (newton(here, motion)) return motion;
            if (motion.status == Status::interrupted) return motion;
            motion.status = Status::done;  // a trial that strayed is no failure of the motion
        }
        return motion;
    }

    // Samples one period from a station: n_channels x samples.
    Status sample(const Station& start, std::size_t samples, double* out) {
        Sampler sampler(drive_, 0.0, options_.period / static_cast<double>(samples), samples, out);
        const Status status = enter(start);
        return status == Status::done ? solver_.advance(options_.period, sampler) : status;
    }

 private:
    static constexpr int first_follow = 2;
    static constexpr int max_newton = 15;

    // A station after one period, and how it depends on the one before.
    struct Image {
        explicit Image(Workspace& workspace) : sensitivity(workspace.drive, workspace.cache) {}
        Station end;
        Sensitivity sensitivity;
    };

    Status enter(const Station& s) {
        solver_.resume(0.0, s.x, s.memory, s.key);
        return solver_.inputs_changed();
    }

    bool advance(const Station& from, Image& image, PeriodicMotion& motion) {
        motion.status = enter(from);
        if (motion.status == Status::done) motion.status = solver_.advance(options_.period, image.sensitivity);
        motion.time = solver_.time();
        motion.contact = solver_.stopped_at();
        if (motion.status != Status::done) return false;
        image.end = {solver_.state(), solver_.memory(), solver_.key()};
        return true;
    }

    double residual(const Station& a, const Image& image) const {
        const Station& b = image.end;
        double worst = std::fabs(b.memory.hysteresis_capacity - a.memory.hysteresis_capacity) / torque_magnitude();
        if (b.key.modes[0] == 0 && b.key.modes[1] == 0 && b.key.modes[2] == 0)
            worst = std::fmax(worst, std::fabs(b.memory.locked_torque - a.memory.locked_torque) / torque_magnitude());
        for (int k = 0; k < n_states; ++k)
            if (k != load_angle && image.sensitivity.magnitude[k] > 0.0)
                worst = std::fmax(worst, std::fabs(b.x[k] - a.x[k]) / image.sensitivity.magnitude[k]);
        return worst;
    }
    double torque_magnitude() const { return drive_.gearbox.rated_output_torque; }

    PeriodicMotion& finish(PeriodicMotion& motion, const Station& start, const Image& image, int steps) const {
        motion.converged = true;
        motion.smooth = image.sensitivity.smooth;
        motion.newton_steps = steps;
        motion.start = start;
        motion.jacobian = image.sensitivity.jacobian;
        motion.angle_advance = image.end.x[load_angle] - start.x[load_angle];
        return motion;
    }

    // Newton's method from a station, as long as each step gains; true if it ends within the tolerance.
    bool newton(Station y, PeriodicMotion& motion) {
        double best = std::numeric_limits<double>::infinity();
        for (int step = 0; step <= max_newton; ++step) {
            Image image(workspace_);
            if (!advance(y, image, motion)) return false;
            const double now = residual(y, image), before = best;
            if (now < best) {
                best = motion.residual = now;
                finish(motion, y, image, step);
                motion.converged = now <= options_.tolerance;
            }
            // Rounding ends the descent; above the tolerance, a step that gains nothing is no convergence.
            if (now == 0.0 || now >= (motion.converged ? 0.5 : 1.0) * before || !step_from(y, image)) break;
        }
        return motion.converged;
    }

    // y + (1 - J)^-1 (image - y), leaving out the directions in which the motion is neutral.
    bool step_from(Station& y, const Image& image) {
        constexpr std::array<int, n_components - 1> active{motor_torque, motor_speed,          load_speed,
                                                           twist,        hysteresis_component, locked_component};
        constexpr int n = active.size();
        std::array<std::array<double, n>, n> M{};
        std::array<double, n> rhs{}, scale{};
        const auto value = [](const Station& s, int k) {
            return k < n_states                ? s.x[k]
                   : k == hysteresis_component ? s.memory.hysteresis_capacity
                                               : s.memory.locked_torque;
        };
        for (int r = 0; r < n; ++r) {
            scale[r] = active[r] < n_states ? image.sensitivity.magnitude[active[r]] : torque_magnitude();
            if (!(scale[r] > 0.0)) scale[r] = 1.0;
        }
        for (int r = 0; r < n; ++r) {
            rhs[r] = (value(image.end, active[r]) - value(y, active[r])) / scale[r];
            for (int c = 0; c < n; ++c)
                M[r][c] =
                    (r == c ? 1.0 : 0.0) - image.sensitivity.jacobian.row[active[r]][active[c]] * scale[c] / scale[r];
        }
        const std::array<double, n> delta = solve_leaving_neutral<n>(M, rhs, neutral);
        for (int k = 0; k < n; ++k) {
            const double change = delta[k] * scale[k];
            if (!std::isfinite(change)) return false;
            if (active[k] < n_states)
                y.x[active[k]] += change;
            else if (active[k] == hysteresis_component)
                y.memory.hysteresis_capacity = std::fmax(0.0, y.memory.hysteresis_capacity + change);
            else
                y.memory.locked_torque += change;
        }
        // What is at rest at the end of the period is at rest at its beginning, to the last bit.
        y.key = image.end.key;
        std::array<bool, n_contacts> at_rest = workspace_.cache.regime(y.key).at_rest;
        workspace_.system.stop(y.x, at_rest);
        workspace_.system.direct(y.x, y.key);
        return true;
    }

    static constexpr double neutral = 1e-9;  // of a pivot, in units of the scales

    Workspace& workspace_;
    const Drive& drive_;
    ShootingOptions options_;
    ExactSolver<SwitchedDrive> solver_;
};

}  // namespace lostmotion
