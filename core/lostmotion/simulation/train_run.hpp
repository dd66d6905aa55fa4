// A whole run of a train, by the exact or the adaptive solver.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "../model/check.hpp"
#include "../solver/adaptive_solver.hpp"
#include "stepping.hpp"
#include "train_point.hpp"
#include "train_recorder.hpp"

namespace lostmotion {

// A train with the regimes that its runs have met.
template <class D>
struct TrainWorkspace {
    explicit TrainWorkspace(const model::Assembly& assembly) : system(assembly), cache(system) {}

    const model::TrainSystem<D> system;
    RegimeCache<model::TrainSystem<D>> cache;
};

// What is wrong with states by the layout of the assembly, or empty.
inline std::string check_start(const model::Assembly& a, std::span<const double> start) {
    std::vector<double> speeds;
    for (const model::ShaftPlace& s : a.places().shafts)
        speeds.push_back(start.empty() ? 0.0 : start[static_cast<std::size_t>(s.speed)]);
    return model::check_start(a.train(), speeds);
}

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

// Why a run cannot begin, or empty.
inline std::string check_run(const model::Assembly& a, std::span<const double> start, const Control& control) {
    std::string wrong = check_start(a, start);
    return wrong.empty() ? check_control(a, control) : wrong;
}

// By the exact solver. start: the states by the layout of the assembly, or nothing for rest. workspace: of the train,
// for several runs with the same sample interval.
template <class D>
TrainReport run_train_exactly_in(const typename TrainReader<D>::Model& model, const std::vector<Signal>& inputs,
                                 std::span<const double> start, std::span<const double> memory,
                                 const TrainOptions& options, double* out, TrainWatcher<D>* watcher = nullptr,
                                 TrainWorkspace<D>* workspace = nullptr) {
    TrainReport report;
    report.message = check_run(model.assembly, start, options.control);
    if (!report.message.empty()) return report;
    const PackedRun<D> c(model.assembly, inputs, start, memory, options);
    TrainRecorder<D> recorder(model, options, out, report, watcher);
    std::optional<TrainWorkspace<D>> own;
    if (workspace == nullptr) workspace = &own.emplace(model.assembly);
    const model::TrainSystem<D>& system = workspace->system;
    ExactSolver<model::TrainSystem<D>> solver(system, c.signals, options.sample_interval, system.balanced_scale(),
                                              &workspace->cache);
    if (watcher != nullptr) watcher->begin(solver);
    report.status = run_recorded(solver, c.start, options, recorder, c.in_train());
    recorder.end();
    report.steps = solver.event_checks();
    c.end(report, system, solver);
    return report;
}

// By the adaptive solver, to options.tolerance.
template <class D>
TrainReport run_train_adaptively_in(const typename TrainReader<D>::Model& model, const std::vector<Signal>& inputs,
                                    std::span<const double> start, std::span<const double> memory,
                                    const TrainOptions& options, double* out) {
    using System = model::TrainSystem<D>;
    TrainReport report;
    report.message = check_run(model.assembly, start, options.control);
    if (!report.message.empty()) return report;
    const PackedRun<D> c(model.assembly, inputs, start, memory, options);
    TrainRecorder<D> recorder(model, options, out, report, nullptr);
    const System system(model.assembly);
    AdaptiveSolver<System> solver(system, c.signals, options.tolerance, system.rated_scale());
    struct {
        TrainRecorder<D>& recorder;
        AdaptiveSolver<System>& solver;
        void step(const typename System::Regime& r, const typename D::Memory& m, const DenseStepOf<D>& dense,
                  bool last) {
            recorder.sample(solver, r, m, dense, last);
        }
        void switching(const SwitchingOf<System>& s) { recorder.switching(s); }
        bool wants_switching() const { return recorder.wants_switching(); }
    } observer{recorder, solver};
    report.status = run_recorded(solver, c.start, options, observer, c.in_train());
    report.steps = solver.steps();
    c.end(report, system, solver);
    return report;
}

// By the exact solver to options.duration, without a record. point: what is there.
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
    NoObserver nothing;
    report.status = run_recorded(solver, c.start, options, nothing, c.in_train());
    report.ended(system, solver);
    if (report.status != Status::done) return report;
    point = point_of<D>(model, solver.regime(), solver.time(), solver.state(), solver.memory(),
                        inputs_at_end(solver, c.signals, options.control));
    return report;
}

// States and memory by the layout of the assembly.
inline std::pair<std::vector<double>, std::vector<double>> in_layout(const model::Assembly& a,
                                                                     const TrainStart& start) {
    std::vector<double> x, memory(static_cast<std::size_t>(a.layout().memory));
    for (const std::string& name : model::state_names(a)) x.push_back(value_of(start.states, name));
    const std::vector<model::Gear>& gears = a.train().gears;
    for (std::size_t g = 0; g < gears.size(); ++g) {
        const model::GearPlace& p = a.places().gears[g];
        if (p.hysteresis == model::nowhere) continue;
        memory[static_cast<std::size_t>(p.hysteresis)] = value_of(start.hysteresis_capacities, gears[g].name);
        if (const int locked = a.places().contacts[static_cast<std::size_t>(p.contact)].locked;
            locked != model::nowhere)
            memory[static_cast<std::size_t>(locked)] = gears[g].law.curve.torque(x[static_cast<std::size_t>(p.twist)]);
    }
    return {x, memory};
}

// A train that has been checked and composed, in the narrowest kernel that holds it.
class TrainRun {
 public:
    // error(): what is wrong with the train, or empty. Then nothing else may be asked for.
    explicit TrainRun(const model::Train& train) : error_(model::check(train)) {
        if (!error_.empty()) return;
        assembly_ = std::make_unique<model::Assembly>(train);
        channels_ = train_channels(*assembly_);
        error_ = too_large(train, model::Places(train, true).layout);
    }
    const std::string& error() const { return error_; }
    const model::Assembly& assembly() const { return *assembly_; }
    const std::vector<TrainChannel>& channels() const { return channels_; }

    // The narrowest kernel that holds the train.
    const char* kernel() const {
        const model::Train& train = assembly_->train();
        const model::Layout& n = assembly_->layout();
        return model::fits<model::Narrow>(train, n)   ? "narrow"
               : model::fits<model::Middle>(train, n) ? "middle"
                                                      : "wide";
    }
    // What `use` gives in it.
    template <class Use>
    auto in_kernel(const Use& use) const {
        return in_kernel(*assembly_, use);
    }
    template <class Use>
    auto in_kernel(const model::Assembly& assembly, const Use& use) const {
        const model::Train& train = assembly.train();
        const model::Layout& n = assembly.layout();
        const auto in = [&]<class D>(D) {
            const typename TrainReader<D>::Model model{assembly, channels_};
            return use.template operator()<D>(model);
        };
        if constexpr (holds(Kernel::narrow))
            if (model::fits<model::Narrow>(train, n)) return in(model::Narrow{});
        if constexpr (holds(Kernel::middle))
            if (model::fits<model::Middle>(train, n)) return in(model::Middle{});
        return in(model::Widest{});
    }

    // States and memory by the layout of the assembly.
    std::pair<std::vector<double>, std::vector<double>> in_layout(const TrainStart& start) const {
        return lostmotion::in_layout(*assembly_, start);
    }

    // inputs: one signal each, as model::input_names. out: channels x samples, channel by channel.
    TrainReport run(const std::vector<Signal>& inputs, const TrainStart& start, const TrainOptions& options,
                    double* out) const {
        const auto [x, memory] = in_layout(start);
        return run(inputs, x, memory, options, out);
    }
    TrainReport run(const std::vector<Signal>& inputs, std::span<const double> start, std::span<const double> memory,
                    const TrainOptions& options, double* out) const {
        if (!(options.tolerance > 0.0)) return run_exactly(inputs, start, memory, options, out);
        // The adaptive solver takes smooth laws as they are.
        return in_kernel(model::Assembly(assembly_->train(), true),
                         [&]<class D>(const typename TrainReader<D>::Model& model) {
                             return run_train_adaptively_in<D>(model, inputs, start, memory, options, out);
                         });
    }
    // By the exact solver, whatever the tolerance.
    TrainReport run_exactly(const std::vector<Signal>& inputs, std::span<const double> start,
                            std::span<const double> memory, const TrainOptions& options, double* out) const {
        return in_kernel([&]<class D>(const typename TrainReader<D>::Model& model) {
            return run_train_exactly_in<D>(model, inputs, start, memory, options, out);
        });
    }

    TrainReport reach(const std::vector<Signal>& inputs, const TrainStart& start, const TrainOptions& options,
                      TrainPoint& point) const {
        const auto [x, memory] = in_layout(start);
        return in_kernel([&, &x = x, &memory = memory]<class D>(const typename TrainReader<D>::Model& model) {
            return reach_train_in<D>(model, inputs, x, memory, options, point);
        });
    }

 private:
    // What of it is too much for any kernel, or nothing.
    static std::string too_large(const model::Train& train, const model::Layout& n) {
        std::string error;
        model::each_size<model::Widest>(train, n, [&](int count, int most, const char* what) {
            if (count > most)
                error += (error.empty() ? "the train has " : ", ") + std::to_string(count) + " " + what + " (at most " +
                         std::to_string(most) + ")";
        });
        return error.empty() ? error : error + "; leave some out";
    }

    std::string error_;
    std::unique_ptr<model::Assembly> assembly_;
    std::vector<TrainChannel> channels_;
};

}  // namespace lostmotion
