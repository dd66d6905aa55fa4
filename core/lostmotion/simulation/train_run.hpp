// A whole run of a train, recorded: samples, switchings and energy ledger.
#pragma once

#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "../model/check.hpp"
#include "../model/power.hpp"
#include "../solver/adaptive_solver.hpp"
#include "dense_samples.hpp"
#include "power_integral.hpp"
#include "result_names.hpp"
#include "sampler.hpp"
#include "stepping.hpp"
#include "train_control.hpp"
#include "train_point.hpp"
#include "train_status.hpp"

namespace lostmotion {

// By name; what is left out is 0.
using Named = std::map<std::string, double>;

inline double value_of(const Named& values, const std::string& name) {
    const auto found = values.find(name);
    return found == values.end() ? 0.0 : found->second;
}

struct TrainStart {
    Named states;
    Named hysteresis_capacities;  // of gears [N m]
};

struct TrainOptions {
    double duration = 1.0;                     // [s]
    double sample_interval = 1e-3;             // [s]
    std::size_t samples = 0;                   // instants k * sample_interval to record, from k = 0
    std::vector<double> instants;              // these instead [s], ascending; exact solver, without control_out
    std::optional<std::vector<int>> channels;  // to record, by their place among TrainRun::channels(); left out, all
    bool energy = true;
    std::size_t max_switchings = 100000;  // kept; all are counted
    double tolerance = 0.0;               // relative, of the adaptive solver; 0: the exact one
    bool (*interrupted)(void*) = nullptr;
    void* interrupted_context = nullptr;
    Control control;                // nothing: the inputs alone act
    double* control_out = nullptr;  // (axes x signals) x samples, as ControlRecord

    SampleTimes times() const { return {sample_interval, instants.empty() ? samples : instants.size(), instants}; }
};

struct TrainSwitching {
    double time = 0.0;  // [s]
    bool input_jump = false;
    model::Guard::Kind kind = model::Guard::speed;
    int contact = -1, branch = -1;  // that it was about, if any
    model::Key before, after;
};

// Time, cause, the modes of all contacts before and after.
inline double* write_switching(const TrainSwitching& s, int contacts, double* to) {
    *to++ = s.time;
    *to++ = s.input_jump ? input_changed : static_cast<int>(s.kind);
    to = std::copy_n(s.before.modes.begin(), contacts, to);
    return std::copy_n(s.after.modes.begin(), contacts, to);
}

struct TrainEnergy {
    std::string name;
    model::PowerFlow::Kind kind;
    double energy = 0.0;  // [J] since the start
};

struct TrainReport {
    Status status = Status::done;
    std::string message;  // what is wrong with the start; then nothing has run
    double time = 0.0;    // [s] reached
    int contact = -1;     // at the last switching
    std::vector<double> x, memory;
    std::vector<TrainSwitching> switchings;
    std::size_t switching_count = 0;
    std::vector<TrainEnergy> energy;
    double stored_begin = 0.0, stored_end = 0.0, turned_over = 0.0;  // [J]
    double left_data_at = std::numeric_limits<double>::infinity();   // [s]
    long steps = 0;
    bool too_many_guards = false;  // a regime has more conditions than the kernel has room for

    template <class System, class Solver>
    void ended(const System& system, Solver& solver) {
        const model::Assembly& a = system.assembly();
        const model::Layout& n = a.layout();
        time = solver.time();
        contact = solver.stopped_at();
        switching_count = solver.switchings();
        too_many_guards = system.overflowed();
        x.resize(static_cast<std::size_t>(n.states));
        // Speeds that are tied may have drifted apart by rounding.
        const auto& r = solver.regime();
        auto state = solver.state();
        auto at_rest = r.at_rest;
        system.stop(state, at_rest);
        model::unpack_state<typename System::Dims>(state, n, x.begin());
        memory.assign(solver.memory().begin(), solver.memory().begin() + n.memory);
        const auto input = solver.input_before(time, state);
        // What rest leaves open may have gone along with the limit of a contact since its regime began.
        for (std::size_t c = 0; c < a.places().contacts.size(); ++c) {
            const model::ContactPlace& place = a.places().contacts[c];
            if (place.locked == model::nowhere) continue;
            const auto& torque =
                place.kind == model::ContactPlace::gear ? r.output_torque[place.element] : r.contact_torque[c];
            memory[static_cast<std::size_t>(place.locked)] =
                evaluate<typename System::Dims>(torque, state, solver.memory(), input);
        }
    }
    // What the balance fails by [J].
    double residual() const {
        double sum = stored_begin - stored_end;
        for (const TrainEnergy& e : energy) sum += e.kind == model::PowerFlow::source ? e.energy : -e.energy;
        return sum;
    }
};

// The energies of a train, flow by flow.
template <class D>
class TrainMeter {
 public:
    explicit TrainMeter(const model::Assembly& a) : assembly_(a) {}

    void segment(const Segment<model::TrainSystem<D>>& s) {
        if (!(s.end > s.begin)) return;
        typename Integral::Factors factors;
        const model::Layout& n = assembly_.layout();
        for (std::size_t k = 0; k < names_.size(); ++k)
            factors.set(static_cast<int>(k), {}, {});  // none in this regime
        for (const model::PowerFlow& f : model::power_flows(assembly_, s.entry.regime.rows))
            factors.set(place(f), model::pack<D>(f.power.torque, n), model::pack<D>(f.power.speed, n));
        factors.hold(s.memory);
        integral_.add(s, factors);
    }
    void write(TrainReport& report) const {
        for (std::size_t k = 0; k < names_.size(); ++k)
            report.energy.push_back({names_[k], kinds_[k], integral_.flow[k]});
        report.turned_over = integral_.turned_over;
    }

 private:
    static constexpr int max_flows = 96;
    using Integral = PowerIntegral<D, max_flows>;

    // Its row, which it keeps from regime to regime.
    int place(const model::PowerFlow& f) {
        const std::string name = model::flow_name(assembly_, f);
        for (std::size_t k = 0; k < names_.size(); ++k)
            if (names_[k] == name) return static_cast<int>(k);
        names_.push_back(name);
        kinds_.push_back(f.kind);
        return static_cast<int>(names_.size()) - 1;
    }

    const model::Assembly& assembly_;
    Integral integral_;
    std::vector<std::string> names_;
    std::vector<model::PowerFlow::Kind> kinds_;
};

// What follows a run of the exact solver beside the record: each stretch of time, each switching, each tick of the
// controllers before they compute.
template <class D>
class TrainWatcher {
 public:
    using System = model::TrainSystem<D>;

    virtual ~TrainWatcher() = default;
    virtual void begin(ExactSolver<System>& solver) = 0;
    virtual void segment(const Segment<System>& s) = 0;
    virtual void switching(const SwitchingOf<System>& s) = 0;
    virtual void tick(const ClosedLoop<D>& loop, const ControlCourse& course, const StateOf<D>& x,
                      const typename D::Memory& memory) = 0;
    virtual void finish(const ClosedLoop<D>& loop) = 0;  // of controllers, at the end of the run
};

// A train with the regimes that its runs have met.
template <class D>
struct TrainWorkspace {
    explicit TrainWorkspace(const model::Assembly& assembly) : system(assembly), cache(system) {}

    const model::TrainSystem<D> system;
    RegimeCache<model::TrainSystem<D>> cache;
};

template <class D>
class TrainRecorder {
 public:
    using System = model::TrainSystem<D>;
    using Model = typename TrainReader<D>::Model;

    TrainRecorder(const Model& m, const TrainOptions& options, double* out, TrainReport& report,
                  TrainWatcher<D>* watcher)
        : watcher_(watcher),
          model_(m),
          options_(options),
          out_(out),
          report_(report),
          channels_(options.channels ? *options.channels : all(m)),
          sampler_(m, options.times(), out, channels_),
          meter_(m.assembly),
          dense_samples_(options.sample_interval, options.samples) {
        sampler_.interrupted = options.interrupted;
        sampler_.interrupted_context = options.interrupted_context;
    }

    bool segment(const Segment<System>& s) {
        if (watcher_ != nullptr) watcher_->segment(s);
        if (options_.energy) meter_.segment(s);
        return sampler_.segment(s);
    }
    bool flush() { return sampler_.write(); }
    bool wants_switching() const { return watcher_ != nullptr || keeps_switching(); }
    void tick(const ClosedLoop<D>& loop, const ControlCourse& course, const StateOf<D>& x,
              const typename D::Memory& memory) {
        if (watcher_ != nullptr) watcher_->tick(loop, course, x, memory);
    }
    void finish(const ClosedLoop<D>& loop) {
        if (watcher_ != nullptr) watcher_->finish(loop);
    }
    void switching(const SwitchingOf<System>& s) {
        if (watcher_ != nullptr) watcher_->switching(s);
        if (!keeps_switching()) return;
        int branch = -1;
        if (s.guard >= 0) {
            for (int b = 0; b < model_.assembly.layout().branches; ++b)
                if (s.before.branch[b] != s.after.branch[b]) branch = b;
        }
        report_.switchings.push_back({s.time, s.input_jump, s.kind, s.contact, branch, s.before, s.after});
    }
    // Of the adaptive solver.
    template <class Solver>
    void sample(Solver& solver, const typename System::Regime& r, const typename D::Memory& m,
                const DenseStepOf<D>& dense, bool last) {
        if (!r.in_data) report_.left_data_at = std::fmin(report_.left_data_at, dense.begin);
        InstantsOf<D> at;
        dense_samples_.within(dense, last, solver, [&](std::size_t k, const StateOf<D>& x, const InputsOf<D>& input) {
            at.set(0, load(x), input);
            const TrainReader<D> reader(model_, r, m);
            for (std::size_t c = 0; c < channels_.size(); ++c)
                out_[c * options_.samples + k] = reader.read(channels_[c], at, 0)[0];
        });
    }
    void end() {
        sampler_.write();
        meter_.write(report_);
        report_.left_data_at = std::fmin(report_.left_data_at, sampler_.left_data_at);
    }

 private:
    static std::vector<int> all(const Model& m) {
        std::vector<int> numbers(m.channels.size());
        std::iota(numbers.begin(), numbers.end(), 0);
        return numbers;
    }

    bool keeps_switching() const { return report_.switchings.size() < options_.max_switchings; }

    TrainWatcher<D>* watcher_;
    const Model& model_;
    const TrainOptions& options_;
    double* out_;
    TrainReport& report_;
    std::vector<int> channels_;
    SamplerOf<System, TrainReader<D>, Model> sampler_;
    TrainMeter<D> meter_;
    DenseSamples dense_samples_;
};

// Why a run has not ended well, or empty.
inline std::string error_text(const TrainReport& report, const model::Assembly& a) {
    if (!report.message.empty()) return report.message;
    return train_status_text(a, report.status, report.time, report.contact, report.too_many_guards);
}

// The energy ledger by name [J], also of flows that there have not been.
inline std::vector<std::string> ledger_names(const model::Assembly& a) {
    std::vector<std::string> names = model::flow_names(a);
    for (const char* name : {"stored_change", "residual", "turned_over"}) names.emplace_back(name);
    return names;
}
inline Named named_ledger(const TrainReport& report, const model::Assembly& a) {
    Named ledger;
    for (const std::string& name : ledger_names(a)) ledger[name] = 0.0;
    for (const TrainEnergy& e : report.energy) ledger.at(e.name) = e.energy;
    ledger["stored_change"] = report.stored_end - report.stored_begin;
    ledger["residual"] = report.residual();
    ledger["turned_over"] = report.turned_over;
    return ledger;
}

// What is wrong with states by the layout of the assembly, or empty.
inline std::string check_start(const model::Assembly& a, std::span<const double> start) {
    std::vector<double> speeds;
    for (const model::ShaftPlace& s : a.places().shafts)
        speeds.push_back(start.empty() ? 0.0 : start[static_cast<std::size_t>(s.speed)]);
    return model::check_start(a.train(), speeds);
}

// States, and capacities of the hysteresis of gears [N m].
inline Named named_end(const TrainReport& report, const model::Assembly& a) {
    Named end;
    const std::vector<std::string> states = model::state_names(a);
    for (std::size_t k = 0; k < states.size(); ++k) end[states[k]] = report.x[k];
    for (std::size_t g = 0; g < a.train().gears.size(); ++g)
        if (const int h = a.places().gears[g].hysteresis; h != model::nowhere)
            end[a.train().gears[g].name + "_hysteresis_capacity"] = report.memory[static_cast<std::size_t>(h)];
    return end;
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
    report.ended(system, solver);
    report.stored_begin = model::stored_energy(model.assembly, c.start.x);
    report.stored_end = model::stored_energy(model.assembly, solver.state());
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
    report.ended(system, solver);
    report.stored_begin = model::stored_energy(model.assembly, c.start.x);
    report.stored_end = model::stored_energy(model.assembly, solver.state());
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
        const model::Layout n = model::Places(train, true).layout;
        using model::Widest;
        if (!model::fits<Widest>(train, n))
            error_ = "the train has " + std::to_string(n.coupled) + " coupled states, " + std::to_string(n.inputs) +
                     " inputs and " + std::to_string(n.contacts) + " dry contacts; at most " +
                     std::to_string(Widest::coupled) + ", " + std::to_string(Widest::inputs) + " and " +
                     std::to_string(Widest::contacts) + " are possible";
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
    std::string error_;
    std::unique_ptr<model::Assembly> assembly_;
    std::vector<TrainChannel> channels_;
};

}  // namespace lostmotion
