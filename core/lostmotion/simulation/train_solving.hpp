// Runs of a train in one kernel by the exact solver. Only core/kernels takes it.
#pragma once

#include <memory>

#include "stepping.hpp"
#include "train_recorder.hpp"
#include "train_run.hpp"

namespace lostmotion {

template <class D>
inline constexpr char kernel_of = 0;  // its address tells kernels apart

// A train with the regimes that its runs have met.
template <class D>
struct TrainWorkspace final : AnyWorkspace {
    explicit TrainWorkspace(const model::Assembly& assembly)
        : AnyWorkspace(&kernel_of<D>), system(assembly), cache(system) {
        of = &assembly;
    }
    StateOf<D> balanced_scale() const { return system.balanced_scale(); }
    void leave() override {
        cache.forget(most_kept);
        of = nullptr;
    }
    void serve(const model::Assembly& assembly) {
        if (of == &assembly) return;
        std::destroy_at(&system);
        std::construct_at(&system, assembly);
        of = &assembly;
    }

    static constexpr std::size_t most_kept = 1000;  // regimes: of the memory, a few megabytes
    model::TrainSystem<D> system;
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
        report.stored_change =
            model::stored_change(assembly, start.x, solver.state(), assembly.meshes_at(start.x), solver.regime().key);
        const auto remembered = [&](int place) {
            return solver.memory()[static_cast<std::size_t>(place)] - start.memory[static_cast<std::size_t>(place)];
        };
        for (std::size_t g = 0; g < assembly.train().gears.size(); ++g) {
            const model::GearPlace& p = assembly.places().gears[g];
            const std::string& name = assembly.train().gears[g].name;
            if (p.impact_loss != model::nowhere)
                report.add(name + ": impacts", model::PowerFlow::loss, remembered(p.impact_loss));
            if (p.parametric_work != model::nowhere)
                report.add(name + ": parametric work", model::PowerFlow::source, remembered(p.parametric_work));
        }
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
                                 std::unique_ptr<AnyWorkspace>& workspace) {
    TrainReport report;
    report.message = check_run(model.assembly, start, options.control);
    if (!report.message.empty()) return report;
    const PackedRun<D> c(model.assembly, inputs, start, memory, options);
    TrainRecorder<D> recorder(model, options, out, report, watcher);
    if (!workspace || workspace->kernel != &kernel_of<D>)
        workspace = std::make_unique<TrainWorkspace<D>>(model.assembly);
    auto& own = static_cast<TrainWorkspace<D>&>(*workspace);
    own.serve(model.assembly);
    const model::TrainSystem<D>& system = own.system;
    system.searches() = {};
    ExactSolver<model::TrainSystem<D>> solver(system, c.signals, options.sample_interval, system.balanced_scale(),
                                              &own.cache);
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
