// Harmonic response over many points: the periodic motion of each, its Fourier coefficients and mean powers, on several
// threads. Points do not know of each other, so the result does not depend on the number of threads.
//
// Plant: what is asked.
//   System, Workspace         a system with the regimes that runs of it have visited
//   channels(), powers()      how many channels a record has, and which of them give powers
//   sampler(workspace, interval, count, out)    an observer of the solver that records
//   take(), give_back()       a workspace for a thread
//   spoiled(workspace)        nothing more can be done with it
//   components()              of its motions, by name
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "lostmotion/analysis/harmonics.hpp"
#include "lostmotion/analysis/power_channels.hpp"
#include "lostmotion/analysis/respond.hpp"
#include "lostmotion/analysis/workers.hpp"
#include "pack.hpp"
#include "periodic.hpp"

namespace lostmotion {

// A component of a motion, and its place in the kernel's dimensions.
struct NamedComponent {
    std::string name;
    int place;
    bool neutral;  // nothing depends on it
};

template <class System>
struct ResponsePointOf {
    using D = typename System::Dims;
    SignalsOf<D> signals;  // constant, or of this period
    double period = 1.0;   // [s] of the motion that is looked for
    StartOf<D> start;
};

template <class System>
struct ResponseResultOf {
    PeriodicMotionOf<System> motion;
    bool spoiled = false;          // its workspace, where it was looked for
    std::vector<double> harmonic;  // channels x (harmonics + 1) x (cos, sin), of exp(-i n w t) from t = 0
    std::vector<double> mean_square;
    double motor_power = 0.0;   // [W] mean of M_D w_M, of all motors
    double load_power = 0.0;    // [W] mean of T_2 w, of the last gears
    double gear_loss = 0.0;     // [W] mean of T_1 w_M - T_2 w - (T_1 - T_2) w_h, of all gears
    std::vector<double> table;  // channels x samples, if it is kept
};

template <class Result>
void add_mean_powers(const std::vector<double>& table, std::size_t samples, const PowerChannels& powers,
                     Result& result) {
    for (std::size_t k = 0; k < samples; ++k) {
        const auto power = [&](const PowerChannels::Pair& p) {
            return table[static_cast<std::size_t>(p.torque) * samples + k] *
                   table[static_cast<std::size_t>(p.speed) * samples + k];
        };
        for (const PowerChannels::Pair& m : powers.motors) result.motor_power += power(m);
        for (const PowerChannels::Gear& g : powers.gears) {
            const double in = power(g.in), out = power(g.out);
            if (g.last) result.load_power += out;
            result.gear_loss += in - out;
            if (g.housing_speed < 0) continue;
            const auto value = [&](int channel) { return table[static_cast<std::size_t>(channel) * samples + k]; };
            result.gear_loss -= (value(g.in.torque) - value(g.out.torque)) * value(g.housing_speed);
        }
    }
    for (double* p : {&result.motor_power, &result.load_power, &result.gear_loss}) *p /= static_cast<double>(samples);
}

template <class Plant, class System = typename Plant::System>
ResponseResultOf<System> respond(const Plant& plant, typename Plant::Workspace& workspace,
                                 const ResponsePointOf<System>& point, const ResponseSpec& spec,
                                 const UnitCircle& circle, std::vector<double>& table, bool (*interrupted)(void*),
                                 void* context) {
    ResponseResultOf<System> result;
    ShootingOptions options;
    options.period = point.period;
    options.max_periods = spec.max_periods;
    options.tolerance = spec.tolerance;
    options.limit_cycle = spec.limit_cycle;
    options.interrupted = interrupted;
    options.interrupted_context = context;
    const double samples = static_cast<double>(spec.samples);
    ShootingOf<System> search(workspace, point.signals, point.period / samples, options);
    result.motion = search.solve(point.start);
    if (result.motion.status != Status::done || !result.motion.converged) return result;
    options.period = result.motion.period;
    const double interval = options.period / samples;
    ShootingOf<System> shooting(workspace, point.signals, interval, options);
    table.resize(plant.channels() * spec.samples);
    auto sampler = plant.sampler(workspace, interval, spec.samples, table.data());
    result.motion.status = shooting.run(result.motion.start, sampler);
    if (result.motion.status != Status::done) return result;
    const std::size_t width = 2 * (static_cast<std::size_t>(spec.harmonics) + 1);
    result.harmonic.resize(plant.channels() * width);
    result.mean_square.resize(plant.channels());
    for (std::size_t c = 0; c < plant.channels(); ++c)
        result.mean_square[c] =
            harmonics_of(&table[c * spec.samples], circle, spec.harmonics, &result.harmonic[c * width]);
    add_mean_powers(table, spec.samples, plant.powers(), result);
    if (spec.keep_table) result.table = table;
    return result;
}

// What the caller's `waiting` has stopped stays `interrupted`.
template <class Plant, class System = typename Plant::System>
std::vector<ResponseResultOf<System>> respond_all(Plant& plant, const std::vector<ResponsePointOf<System>>& points,
                                                  const ResponseSpec& spec, unsigned threads,
                                                  const std::function<bool(std::size_t)>& waiting) {
    std::vector<ResponseResultOf<System>> results(points.size());
    for (auto& r : results) r.motion.status = Status::interrupted;
    const UnitCircle circle(spec.samples);
    distribute(points.size(), threads, waiting, [&](auto next, std::atomic<bool>& stop) {
        const auto stopped = [](void* flag) { return static_cast<std::atomic<bool>*>(flag)->load(); };
        auto workspace = plant.take();
        std::vector<double> table;
        for (std::size_t k = next(); k < points.size() && !stop; k = next()) {
            results[k] = respond(plant, *workspace, points[k], spec, circle, table, stopped, &stop);
            results[k].spoiled = plant.spoiled(*workspace);
            if (results[k].spoiled) workspace = plant.take();
        }
        plant.give_back(std::move(workspace));
    });
    return results;
}

// The results as a table. start(named): what it is in the kernel's dimensions.
template <class Plant, class MakeStart, class System = typename Plant::System>
ResponseTable respond_by_name(Plant& plant, const std::vector<ResponseRequest>& asked, const MakeStart& start,
                              const ResponseSpec& spec, unsigned threads, const Waiting& waiting) {
    using D = typename System::Dims;
    using Result = ResponseResultOf<System>;
    std::vector<ResponsePointOf<System>> points;
    for (const ResponseRequest& r : asked) {
        points.emplace_back();
        points.back().signals = model::packed_signals<D>(r.inputs);
        points.back().period = r.period;
        points.back().start = start(r.start);
    }
    const std::vector<NamedComponent> components = plant.components();
    ResponseTable out;
    out.channels = plant.channels();
    for (const NamedComponent& c : components) {
        out.components.push_back(c.name);
        out.neutral.push_back(c.neutral);
    }
    const std::size_t harmonics = out.channels * (static_cast<std::size_t>(spec.harmonics) + 1) * 2;
    for (const Result& r : respond_all(plant, points, spec, threads, waiting)) {
        const PeriodicMotionOf<System>& m = r.motion;
        out.error.push_back(plant.error(r));
        out.converged.push_back(m.converged);
        out.smooth.push_back(m.smooth);
        out.periods.push_back(m.periods);
        out.newton_steps.push_back(m.newton_steps);
        out.period.push_back(m.period);
        out.residual.push_back(m.residual);
        out.motor_power.push_back(r.motor_power);
        out.load_power.push_back(r.load_power);
        out.gear_loss.push_back(r.gear_loss);
        for (const NamedComponent& c : components) {
            const bool is_state = c.place < D::states;
            out.advance.push_back(is_state ? m.advance[c.place] : 0.0);
            out.start.push_back(is_state ? m.start.x[c.place]
                                         : m.start.memory[static_cast<std::size_t>(c.place - D::states)]);
            for (const NamedComponent& by : components) out.jacobian.push_back(m.jacobian.row[c.place][by.place]);
        }
        const auto add = [](std::vector<double>& to, const std::vector<double>& values, std::size_t count) {
            to.insert(to.end(), values.begin(), values.end());
            to.resize(to.size() + count - values.size(), 0.0);
        };
        add(out.harmonics, r.harmonic, harmonics);
        add(out.mean_square, r.mean_square, out.channels);
        if (spec.keep_table) add(out.table, r.table, out.channels * spec.samples);
    }
    return out;
}

}  // namespace lostmotion
