// Harmonic response over many points: the periodic motion of each, its Fourier coefficients and mean powers, on several
// threads. Points do not know of each other, so the result does not depend on the number of threads.
#pragma once

#include <functional>

#include "harmonics.hpp"
#include "periodic.hpp"
#include "workers.hpp"

namespace lostmotion {

struct ResponsePoint {
    Signals signals;      // constant, or of this period
    double period = 1.0;  // [s] of the motion that is looked for
    Start start;
};

struct ResponseSpec {
    std::size_t samples = 2048;  // a period
    int harmonics = 8;           // coefficients 0 (mean) to this
    int max_periods = 20000;
    double tolerance = 1e-10;
    bool keep_table = false;  // of the samples, with each result
};

struct ResponseResult {
    PeriodicMotion motion;
    std::vector<double> harmonic;  // n_channels x (harmonics + 1) x (cos, sin), of exp(-i n w t) from t = 0
    std::array<double, n_channels> mean_square{};
    double motor_power = 0.0;   // [W] mean of M_D w_M
    double load_power = 0.0;    // [W] mean of T_2 w
    double gear_loss = 0.0;     // [W] mean of T_1 w_M - T_2 w
    std::vector<double> table;  // n_channels x samples, if it is kept
};

inline void add_mean_powers(const std::vector<double>& table, std::size_t samples, ResponseResult& result) {
    const auto channel = [&](Channel c) { return table.data() + static_cast<std::size_t>(c) * samples; };
    for (std::size_t k = 0; k < samples; ++k) {
        const double in = channel(ch_input_torque)[k] * channel(ch_motor_speed)[k];
        const double out = channel(ch_output_torque)[k] * channel(ch_load_speed)[k];
        result.motor_power += channel(ch_motor_torque)[k] * channel(ch_motor_speed)[k];
        result.load_power += out;
        result.gear_loss += in - out;
    }
    for (double* p : {&result.motor_power, &result.load_power, &result.gear_loss}) *p /= static_cast<double>(samples);
}

inline ResponseResult respond(Workspace& workspace, const ResponsePoint& point, const ResponseSpec& spec,
                              const UnitCircle& circle, std::vector<double>& table, bool (*interrupted)(void*),
                              void* context) {
    ResponseResult result;
    ShootingOptions options;
    options.period = point.period;
    options.max_periods = spec.max_periods;
    options.tolerance = spec.tolerance;
    options.interrupted = interrupted;
    options.interrupted_context = context;
    Shooting shooting(workspace, point.signals, point.period / static_cast<double>(spec.samples), options);
    result.motion = shooting.solve(point.start);
    if (result.motion.status != Status::done || !result.motion.converged) return result;
    table.resize(n_channels * spec.samples);
    result.motion.status = shooting.sample(result.motion.start, spec.samples, table.data());
    if (result.motion.status != Status::done) return result;
    const std::size_t width = 2 * (static_cast<std::size_t>(spec.harmonics) + 1);
    result.harmonic.resize(n_channels * width);
    for (std::size_t c = 0; c < n_channels; ++c)
        result.mean_square[c] =
            harmonics_of(&table[c * spec.samples], circle, spec.harmonics, &result.harmonic[c * width]);
    add_mean_powers(table, spec.samples, result);
    if (spec.keep_table) result.table = table;
    return result;
}

// What the caller's `waiting` has stopped stays `interrupted`.
inline std::vector<ResponseResult> respond_all(WorkspacePool& pool, const std::vector<ResponsePoint>& points,
                                               const ResponseSpec& spec, unsigned threads,
                                               const std::function<bool(std::size_t)>& waiting) {
    std::vector<ResponseResult> results(points.size());
    for (ResponseResult& r : results) r.motion.status = Status::interrupted;
    const UnitCircle circle(spec.samples);
    distribute(points.size(), threads, waiting, [&](auto next, std::atomic<bool>& stop) {
        const auto stopped = [](void* flag) { return static_cast<std::atomic<bool>*>(flag)->load(); };
        std::unique_ptr<Workspace> workspace = pool.take();
        std::vector<double> table;
        for (std::size_t k = next(); k < points.size() && !stop; k = next())
            results[k] = respond(*workspace, points[k], spec, circle, table, stopped, &stop);
        pool.give_back(std::move(workspace));
    });
    return results;
}

}  // namespace lostmotion
