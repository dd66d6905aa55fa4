// Runs of a train in one kernel by the exact solver. Only core/kernels takes it.
#pragma once

#include <memory>

#include "lostmotion/simulation/train_run.hpp"
#include "train_motion.hpp"
#include "train_recorder.hpp"

namespace lostmotion {

template <class D>
inline constexpr char kernel_of = 0;  // its address tells kernels apart

// A train with the regimes that its runs have met.
template <class D>
struct TrainWorkspace final : Workspace {
    explicit TrainWorkspace(const model::Assembly& assembly)
        : Workspace(&kernel_of<D>), system(assembly), cache(system) {
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

// What a run has ended with.
template <class System, class Solver>
void end_report(TrainReport& report, const System& system, Solver& solver) {
    const model::Assembly& a = system.assembly();
    const model::Layout& n = a.layout();
    report.time = solver.time();
    report.contact = solver.stopped_at();
    report.switching_count = solver.switchings();
    report.searches = system.search().searches;
    report.too_many_guards = system.overflowed();
    report.x.resize(static_cast<std::size_t>(n.states));
    const auto& r = solver.regime();
    const auto state = solver.state();
    model::unpack_state<typename System::Dims>(state, n, report.x.begin());
    report.memory.clear();
    for (int k = 0; k < n.memory; ++k) report.memory.push_back(solver.memory()[k]);
    const auto input = solver.input_before(report.time, state);
    // What rest leaves open may have gone along with the limit of a contact since its regime began.
    for (std::size_t c = 0; c < a.places().contacts.size(); ++c) {
        const model::ContactPlace& place = a.places().contacts[c];
        if (place.locked == model::nowhere) continue;
        const auto& torque =
            place.kind == model::ContactPlace::gear ? r.output_torque[place.element] : r.contact_torque[c];
        report.memory[static_cast<std::size_t>(place.locked)] =
            evaluate<typename System::Dims>(torque, state, solver.memory(), input);
    }
}

// What a run begins with, by the layout of a kernel: signals, state, and the controllers in the train.
template <class D>
struct PackedRun {
    PackedRun(const model::Assembly& a, const RunStart& s, const TrainOptions& options)
        : assembly(a),
          options(options),
          signals(with_ramps(model::packed_signals<D>(s.inputs), options.control,
                             [&](int motor) { return a.places().motors[static_cast<std::size_t>(motor)].command; })),
          start(model::packed_start<D>(a.layout(), s.start, s.memory)) {}

    auto in_train() const {
        return [this](const auto& laws) { return closed_loop_of<D>(assembly, options.control, laws); };
    }
    // Into the report of a recorded run, what it has ended with.
    template <class System, class Solver>
    void end(TrainReport& report, const System& system, Solver& solver) const {
        end_report(report, system, solver);
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
        assembly.places().each_striking([&](const model::ContactPlace& c, int) {
            const auto& name = c.kind == model::ContactPlace::gear
                                   ? assembly.train().gears[static_cast<std::size_t>(c.element)].name
                                   : assembly.places().name_of(c);
            report.add(name + ": impacts", model::PowerFlow::loss, remembered(c.gap.impact_loss));
        });
    }

    const model::Assembly& assembly;
    const TrainOptions& options;
    SignalsOf<D> signals;
    StartOf<D> start;
};

// As Kernel::run. watcher: sees the run, or nullptr.
template <class D>
TrainReport run_train_exactly_in(const TrainModel& model, const RunStart& start, const TrainOptions& options,
                                 double* out, TrainWatcher<D>* watcher, std::unique_ptr<Workspace>& workspace) {
    TrainReport report;
    report.message = check_run(model.assembly, start.start, options.control);
    if (!report.message.empty()) return report;
    const PackedRun<D> c(model.assembly, start, options);
    TrainRecorder<D> recorder(model, options, out, report, watcher);
    if (!workspace || workspace->kernel != &kernel_of<D>)
        workspace = std::make_unique<TrainWorkspace<D>>(model.assembly);
    auto& own = static_cast<TrainWorkspace<D>&>(*workspace);
    own.serve(model.assembly);
    const model::TrainSystem<D>& system = own.system;
    system.search().searches = {};
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
class KernelIn final : public Kernel {
 public:
    explicit KernelIn(const char* name) : Kernel(name, sizes_of<D>) {}
    std::unique_ptr<Motion> motion(const TrainModel& model, double step, const Control& control,
                                   const InputSines& sines) const override {
        return std::make_unique<TrainMotion<D>>(model, step, control, sines);
    }
    TrainReport run(const TrainModel& model, const RunStart& start, const TrainOptions& options, double* out,
                    std::unique_ptr<Workspace>& workspace) const override {
        return run_train_exactly_in<D>(model, start, options, out, nullptr, workspace);
    }
    TrainReport reach(const TrainModel& model, const RunStart& start, const TrainOptions& options,
                      TrainPoint& point) const override;
};

template <class D>
TrainReport KernelIn<D>::reach(const TrainModel& model, const RunStart& start, const TrainOptions& options,
                               TrainPoint& point) const {
    TrainReport report;
    report.message = check_run(model.assembly, start.start, options.control);
    if (!report.message.empty()) return report;
    const PackedRun<D> c(model.assembly, start, options);
    const model::TrainSystem<D> system(model.assembly);
    ExactSolver<model::TrainSystem<D>> solver(system, c.signals, options.sample_interval, system.balanced_scale());
    Observer<model::TrainSystem<D>> nothing;
    report.status = run_recorded(solver, c.start, options, nothing, c.in_train());
    end_report(report, system, solver);
    if (report.status != Status::done) return report;
    point = point_of<D>(model, solver.regime(), solver.time(), solver.state(), solver.memory(),
                        inputs_at_end(solver, c.signals, options.control));
    return report;
}

}  // namespace lostmotion
