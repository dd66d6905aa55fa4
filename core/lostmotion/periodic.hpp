// Periodic motion under a periodic command, found by following the transient.
#pragma once

#include <vector>

#include "run.hpp"

namespace lostmotion {

struct PeriodicMotion {
    Status status = Status::done;
    double time = 0.0;
    Contact contact = input_contact;
    bool converged = false;
    int periods = 0;        // followed until then
    double residual = 0.0;  // largest change of a state over one period / its largest magnitude within it
    double drift = 0.0;     // of the load angle over one period [rad]; the angle itself is neutral
    Start start;            // state at the beginning of the period that is sampled
};

// Follows the motion period by period until it repeats. out: n_channels x samples over the last period, which begins
// at a multiple of the period.
inline PeriodicMotion follow_to_periodic(const Drive& drive, const Signals& signals, const Start& start, double period,
                                         std::size_t samples, int max_periods, double tolerance, double* out,
                                         bool (*interrupted)(void*)) {
    PeriodicMotion motion;
    const SwitchedDrive system(drive);
    ExactSolver<SwitchedDrive> solver(system, signals, period / static_cast<double>(samples), drive.balanced_scale());
    solver.interrupted = interrupted;
    RunOptions options;
    options.energy = false;
    options.max_switchings = 0;
    motion.status = solver.begin(0.0, start.x, start.memory);
    while (motion.status == Status::done && motion.periods < max_periods) {
        const State before = solver.state();
        const double capacity = solver.memory().hysteresis_capacity;
        motion.start = {before, solver.memory()};
        Sampler sampler(drive, motion.periods * period, period / static_cast<double>(samples), samples, out);
        sampler.interrupted = interrupted;
        motion.status = solver.advance((motion.periods + 1) * period, sampler);
        ++motion.periods;
        const State& after = solver.state();
        motion.drift = after[load_angle] - before[load_angle];
        motion.residual = std::fabs(solver.memory().hysteresis_capacity - capacity) /
                          std::fmax(1e-300, drive.gearbox.rated_output_torque);
        constexpr std::array<Channel, 4> channel{ch_motor_torque, ch_motor_speed, ch_load_speed, ch_twist};
        for (int k = 0; k < 4; ++k) {
            double largest = 0.0;
            for (std::size_t j = 0; j < samples; ++j)
                largest = std::fmax(largest, std::fabs(out[channel[k] * samples + j]));
            if (largest > 0.0) motion.residual = std::fmax(motion.residual, std::fabs(after[k] - before[k]) / largest);
        }
        motion.converged = motion.residual <= tolerance;
        if (motion.converged) break;
    }
    motion.time = solver.time();
    motion.contact = solver.stopped_at();
    return motion;
}

}  // namespace lostmotion
