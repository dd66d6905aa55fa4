// Harmonic response over many points: the periodic motion of each, its Fourier coefficients and mean powers, on several
// threads. Points do not know of each other, so the result does not depend on the number of threads.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <numbers>
#include <span>
#include <thread>

#include "periodic.hpp"

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

// Samples of one turn, made once for all points.
struct Circle {
    std::vector<double> cosine, sine;

    explicit Circle(std::size_t samples) : cosine(samples), sine(samples) {
        for (std::size_t k = 0; k < samples; ++k) {
            const double angle = 2.0 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(samples);
            const SineCosine at = sine_cosine(angle);
            cosine[k] = at.cos;
            sine[k] = at.sin;
        }
    }
};

// Coefficients c_n = 2/N sum x_k exp(-2 pi i n k / N) (n = 0: the mean) of one period of samples.
inline void add_harmonics(std::span<const double> table, const Circle& circle, int harmonics, ResponseResult& result) {
    const std::size_t samples = circle.cosine.size();
    result.harmonic.assign(static_cast<std::size_t>(n_channels * (harmonics + 1) * 2), 0.0);
    for (int c = 0; c < n_channels; ++c) {
        const double* x = table.data() + static_cast<std::size_t>(c) * samples;
        double square = 0.0;
        for (std::size_t k = 0; k < samples; ++k) square += x[k] * x[k];
        result.mean_square[c] = square / static_cast<double>(samples);
        for (int n = 0; n <= harmonics; ++n) {
            double re = 0.0, im = 0.0;
            std::size_t at = 0;
            for (std::size_t k = 0; k < samples; ++k) {
                re += x[k] * circle.cosine[at];
                im -= x[k] * circle.sine[at];
                at += static_cast<std::size_t>(n);
                if (at >= samples) at -= samples;
            }
            const double scale = (n == 0 ? 1.0 : 2.0) / static_cast<double>(samples);
            double* out = &result.harmonic[static_cast<std::size_t>((c * (harmonics + 1) + n) * 2)];
            out[0] = scale * re;
            out[1] = scale * im;
        }
    }
}

inline ResponseResult respond(Workspace& workspace, const ResponsePoint& point, const ResponseSpec& spec,
                              const Circle& circle, std::vector<double>& table, bool (*interrupted)(void*),
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
    add_harmonics(table, circle, spec.harmonics, result);
    const auto channel = [&](Channel c) { return table.data() + static_cast<std::size_t>(c) * spec.samples; };
    for (std::size_t k = 0; k < spec.samples; ++k) {
        const double in = channel(ch_input_torque)[k] * channel(ch_motor_speed)[k];
        const double out = channel(ch_output_torque)[k] * channel(ch_load_speed)[k];
        result.motor_power += channel(ch_motor_torque)[k] * channel(ch_motor_speed)[k];
        result.load_power += out;
        result.gear_loss += in - out;
    }
    for (double* p : {&result.motor_power, &result.load_power, &result.gear_loss})
        *p /= static_cast<double>(spec.samples);
    if (spec.keep_table) result.table = table;
    return result;
}

// A place where idle workspaces wait; each thread takes one.
struct WorkspacePool {
    virtual ~WorkspacePool() = default;
    virtual std::unique_ptr<Workspace> take() = 0;
    virtual void give_back(std::unique_ptr<Workspace>) = 0;
};

// Shares `count` pieces of work among threads. worker(next, stop) runs once on each thread: it takes pieces from next()
// until that is `count` or beyond. waiting(done) is called by the calling thread now and then; false stops the work.
template <class Worker>
void work_through(std::size_t count, unsigned threads, const std::function<bool(std::size_t)>& waiting,
                  const Worker& worker) {
    std::atomic<std::size_t> taken{0}, returned{0};
    std::atomic<bool> stop{false};
    unsigned at_work =
        static_cast<unsigned>(std::min<std::size_t>(std::max(1u, threads), std::max<std::size_t>(1, count)));
    std::mutex door;
    std::condition_variable somebody_left;
    std::vector<std::jthread> crew;
    for (unsigned k = at_work; k > 0; --k)
        crew.emplace_back([&] {
            bool busy = false;
            worker(
                [&] {
                    if (busy) ++returned;
                    busy = true;
                    return taken++;
                },
                stop);
            const std::lock_guard lock(door);
            --at_work;
            somebody_left.notify_one();
        });
    using namespace std::chrono_literals;
    std::unique_lock lock(door);
    while (!somebody_left.wait_for(lock, 20ms, [&] { return at_work == 0; })) {
        lock.unlock();
        if (!stop && !waiting(std::min<std::size_t>(returned, count))) stop = true;
        lock.lock();
    }
    lock.unlock();
    crew.clear();
    if (!stop) waiting(count);
}

// What the caller's `waiting` has stopped stays `interrupted`.
inline std::vector<ResponseResult> respond_all(WorkspacePool& pool, const std::vector<ResponsePoint>& points,
                                               const ResponseSpec& spec, unsigned threads,
                                               const std::function<bool(std::size_t)>& waiting) {
    std::vector<ResponseResult> results(points.size());
    for (ResponseResult& r : results) r.motion.status = Status::interrupted;
    const Circle circle(spec.samples);
    work_through(points.size(), threads, waiting, [&](auto next, std::atomic<bool>& stop) {
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
