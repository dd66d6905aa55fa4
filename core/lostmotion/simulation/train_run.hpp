// A whole run of a train, recorded: samples, switchings and energy ledger.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "../model/check.hpp"
#include "../model/power.hpp"
#include "../solver/adaptive_solver.hpp"
#include "power_integral.hpp"
#include "sampler.hpp"
#include "train_reader.hpp"
#include "train_status.hpp"

namespace lostmotion {

struct TrainOptions {
    double duration = 1.0;          // [s]
    double sample_interval = 1e-3;  // [s]
    std::size_t samples = 0;        // instants k * sample_interval to record, from k = 0
    bool energy = true;
    std::size_t max_switchings = 100000;  // kept; all are counted
    double tolerance = 0.0;               // relative, of the adaptive solver; 0: the exact one
    bool (*interrupted)(void*) = nullptr;
    void* interrupted_context = nullptr;
};

struct TrainSwitching {
    double time = 0.0;  // [s]
    bool input_jump = false;
    model::Guard::Kind kind = model::Guard::speed;
    int contact = -1, branch = -1;  // that it was about, if any
    model::Key before, after;
};

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
            factors.set(place(f), model::pack<D>(f.torque, n), model::pack<D>(f.speed, n));
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

template <class D>
class TrainRecorder {
 public:
    using System = model::TrainSystem<D>;
    using Model = typename TrainReader<D>::Model;

    TrainRecorder(const Model& m, const TrainOptions& options, double* out, TrainReport& report)
        : model_(m),
          options_(options),
          out_(out),
          report_(report),
          channels_(m.channels.size()),
          sampler_(m, 0.0, options.sample_interval, options.samples, out, numbers()),
          meter_(m.assembly) {
        sampler_.interrupted = options.interrupted;
        sampler_.interrupted_context = options.interrupted_context;
    }

    bool segment(const Segment<System>& s) {
        if (options_.energy) meter_.segment(s);
        return sampler_.segment(s);
    }
    bool wants_switching() const { return report_.switchings.size() < options_.max_switchings; }
    void switching(const SwitchingOf<System>& s) {
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
        for (; next_ < options_.samples; ++next_) {
            const double t = static_cast<double>(next_) * options_.sample_interval;
            if (!(t < dense.end || (last && t <= dense.end * (1.0 + 1e-15)))) return;
            at.set(0, load(dense(t)), t < dense.end ? solver.input_at(t) : solver.input_before(t));
            const TrainReader<D> reader(model_, r, m);
            for (std::size_t c = 0; c < channels_.size(); ++c)
                out_[c * options_.samples + next_] = reader.read(static_cast<int>(c), at, 0)[0];
        }
    }
    void end() {
        sampler_.write();
        meter_.write(report_);
        report_.left_data_at = std::fmin(report_.left_data_at, sampler_.left_data_at);
    }

 private:
    std::span<const int> numbers() {
        for (std::size_t c = 0; c < channels_.size(); ++c) channels_[c] = static_cast<int>(c);
        return channels_;
    }

    const Model& model_;
    const TrainOptions& options_;
    double* out_;
    TrainReport& report_;
    std::vector<int> channels_;
    SamplerOf<System, TrainReader<D>, Model> sampler_;
    TrainMeter<D> meter_;
    std::size_t next_ = 0;
};

// start: the states by the layout of the assembly, or nothing for rest.
template <class D>
TrainReport run_train_in(const typename TrainReader<D>::Model& model, const std::vector<Signal>& inputs,
                         std::span<const double> start, std::span<const double> memory, const TrainOptions& options,
                         double* out) {
    using System = model::TrainSystem<D>;
    const model::Assembly& a = model.assembly;
    const model::Layout& n = a.layout();
    TrainReport report;
    std::vector<double> speeds;
    for (const model::ShaftPlace& s : a.places().shafts)
        speeds.push_back(start.empty() ? 0.0 : start[static_cast<std::size_t>(s.speed)]);
    report.message = model::check_start(a.train(), speeds);
    if (!report.message.empty()) return report;
    const System system(a);
    const SignalsOf<D> signals = model::packed_signals<D>(inputs);
    const auto [x, m] = model::packed_start<D>(n, start, memory);
    TrainRecorder<D> recorder(model, options, out, report);
    const auto finish = [&](auto& solver) {
        report.time = solver.time();
        report.contact = solver.stopped_at();
        report.switching_count = solver.switchings();
        const StateOf<D>& end = solver.state();
        report.x.assign(end.begin(), end.begin() + n.coupled);
        report.x.insert(report.x.end(), end.begin() + D::coupled, end.begin() + D::coupled + n.angles);
        report.memory.assign(solver.memory().begin(), solver.memory().begin() + n.memory);
        report.stored_begin = model::stored_energy(a, x);
        report.stored_end = model::stored_energy(a, end);
        report.too_many_guards = system.overflowed();
    };
    if (options.tolerance > 0.0) {
        AdaptiveSolver<System> solver(system, signals, options.tolerance, system.rated_scale());
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
        solver.interrupted = options.interrupted;
        solver.interrupted_context = options.interrupted_context;
        report.status = solver.begin(0.0, x, m);
        if (report.status == Status::done) report.status = solver.advance(options.duration, observer);
        report.steps = solver.steps();
        finish(solver);
        return report;
    }
    ExactSolver<System> solver(system, signals, options.sample_interval, system.balanced_scale());
    solver.interrupted = options.interrupted;
    solver.interrupted_context = options.interrupted_context;
    report.status = solver.begin(0.0, x, m);
    if (report.status == Status::done) report.status = solver.advance(options.duration, recorder);
    recorder.end();
    report.steps = solver.event_checks();
    finish(solver);
    return report;
}

// A train that has been checked and composed, in the narrowest kernel that holds it.
class TrainRun {
 public:
    // error(): what is wrong with the train, or empty. Then nothing else may be asked for.
    explicit TrainRun(const model::Train& train) : error_(model::check(train)) {
        if (!error_.empty()) return;
        assembly_ = std::make_unique<model::Assembly>(train);
        channels_ = train_channels(*assembly_);
        const model::Layout& n = assembly_->layout();
        if (!model::fits<model::Narrow>(train, n) && !model::fits<model::Middle>(train, n) &&
            !model::fits<model::Wide>(train, n))
            error_ = "the train has " + std::to_string(n.coupled) + " coupled states, " + std::to_string(n.inputs) +
                     " inputs and " + std::to_string(n.contacts) + " dry contacts; at most " +
                     std::to_string(model::Wide::coupled) + ", " + std::to_string(model::Wide::inputs) + " and " +
                     std::to_string(model::Wide::contacts) + " are possible";
    }
    const std::string& error() const { return error_; }
    const model::Assembly& assembly() const { return *assembly_; }
    const std::vector<TrainChannel>& channels() const { return channels_; }

    // What `use` gives in the narrowest kernel that holds the train.
    template <class Use>
    auto in_kernel(const Use& use) const {
        const model::Train& train = assembly_->train();
        const model::Layout& n = assembly_->layout();
        const auto in = [&]<class D>(D) {
            const typename TrainReader<D>::Model model{*assembly_, channels_};
            return use.template operator()<D>(model);
        };
        if (model::fits<model::Narrow>(train, n)) return in(model::Narrow{});
        if (model::fits<model::Middle>(train, n)) return in(model::Middle{});
        return in(model::Wide{});
    }

    // inputs: one signal each, as model::input_names. out: channels x samples, channel by channel.
    TrainReport run(const std::vector<Signal>& inputs, std::span<const double> start, std::span<const double> memory,
                    const TrainOptions& options, double* out) const {
        return in_kernel([&]<class D>(const typename TrainReader<D>::Model& model) {
            return run_train_in<D>(model, inputs, start, memory, options, out);
        });
    }

 private:
    std::string error_;
    std::unique_ptr<model::Assembly> assembly_;
    std::vector<TrainChannel> channels_;
};

}  // namespace lostmotion
