// Runs of a train in one kernel by the exact solver. Only core/kernels takes it.
#pragma once

#include <optional>

#include "stepping.hpp"
#include "train_recorder.hpp"
#include "train_run.hpp"

namespace lostmotion {

// A train with the regimes that its runs have met.
template <class D>
struct TrainWorkspace {
    explicit TrainWorkspace(const model::Assembly& assembly) : system(assembly), cache(system) {}

    const model::TrainSystem<D> system;
    RegimeCache<model::TrainSystem<D>> cache;
};

// What a run begins with, by the layout of a kernel: signals, state, and the controllers in the train.
template <class D>
struct PackedRun {
    PackedRun(const model::Assembly& a, const std::vector<Signal>& inputs, std::span<const double> x,
              std::span<const double> m, const TrainOptions& options)
        : assembly(a),
          options(options),
          signals(with_ramps(model::packed_signals<D>(inputs), options.control,
                             [&](int motor) { return a.places().motors[static_cast<std::size_t>(motor)].command; })),
          start(model::packed_start<D>(a.layout(), x, m)) {}

    auto in_train() const {
        return [this](const auto& laws) { return closed_loop_of<D>(assembly, options.control, laws); };
    }
    // Into the report of a recorded run, what it has ended with.
    template <class System, class Solver>
    void end(TrainReport& report, const System& system, Solver& solver) const {
        report.ended(system, solver);
        report.stored_begin = model::stored_energy(assembly, start.x);
        report.stored_end = model::stored_energy(assembly, solver.state());
    }

    const model::Assembly& assembly;
    const TrainOptions& options;
    SignalsOf<D> signals;
    StartOf<D> start;
};

template <class D>
TrainReport run_train_exactly_in(const typename TrainReader<D>::Model& model, const std::vector<Signal>& inputs,
                                 std::span<const double> start, std::span<const double> memory,
                                 const TrainOptions& options, double* out, TrainWatcher<D>* watcher,
                                 TrainWorkspace<D>* workspace) {
    TrainReport report;
    report.message = check_run(model.assembly, start, options.control);
    if (!report.message.empty()) return report;
    const PackedRun<D> c(model.assembly, inputs, start, memory, options);
    TrainRecorder<D> recorder(model, options, out, report, watcher);
    std::optional<TrainWorkspace<D>> own;
    if (workspace == nullptr) workspace = &own.emplace(model.assembly);
    const model::TrainSystem<D>& system = workspace->system;
    system.searches() = {};
    ExactSolver<model::TrainSystem<D>> solver(system, c.signals, options.sample_interval, system.balanced_scale(),
                                              &workspace->cache);
    if (watcher != nullptr) watcher->begin(solver);
    report.status = run_recorded(solver, c.start, options, recorder, c.in_train());
    recorder.end();
    report.steps = solver.event_checks();
    c.end(report, system, solver);
    return report;
}

template <class D>
TrainReport reach_train_in(const typename TrainReader<D>::Model& model, const std::vector<Signal>& inputs,
                           std::span<const double> start, std::span<const double> memory, const TrainOptions& options,
                           TrainPoint& point) {
    TrainReport report;
    report.message = check_run(model.assembly, start, options.control);
    if (!report.message.empty()) return report;
    const PackedRun<D> c(model.assembly, inputs, start, memory, options);
    const model::TrainSystem<D> system(model.assembly);
    ExactSolver<model::TrainSystem<D>> solver(system, c.signals, options.sample_interval, system.balanced_scale());
    Observer<model::TrainSystem<D>> nothing;
    report.status = run_recorded(solver, c.start, options, nothing, c.in_train());
    report.ended(system, solver);
    if (report.status != Status::done) return report;
    point = point_of<D>(model, solver.regime(), solver.time(), solver.state(), solver.memory(),
                        inputs_at_end(solver, c.signals, options.control));
    return report;
}

}  // namespace lostmotion
