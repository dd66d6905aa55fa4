// The record of a run of a train: samples, switchings and energies.
#pragma once

#include <numeric>
#include <string>
#include <vector>

#include "dense_samples.hpp"
#include "power_integral.hpp"
#include "sampler.hpp"
#include "train_reader.hpp"
#include "train_report.hpp"

namespace lostmotion {

// The energies of a train, flow by flow.
template <class D>
class TrainMeter {
 public:
    explicit TrainMeter(const model::Assembly& a) : assembly_(a) {}

    Interruption& interruption() { return integral_.interruption; }

    // False ends the run.
    bool segment(const Segment<model::TrainSystem<D>>& s) {
        if (!(s.end > s.begin)) return true;
        typename Integral::Factors factors;
        const model::Layout& n = assembly_.layout();
        for (std::size_t k = 0; k < names_.size(); ++k)
            factors.set(static_cast<int>(k), {}, {});  // none in this regime
        for (const model::PowerFlow& f : model::power_flows(assembly_, s.entry.regime.rows))
            factors.set(place(f), model::pack<D>(f.power.torque, n), model::pack<D>(f.power.speed, n));
        factors.hold(s.memory);
        return integral_.add(s, factors);
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
        const std::string& name = f.name;
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

template <class D>
class TrainRecorder final : public Observer<model::TrainSystem<D>> {
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
        sampler_.interruption = meter_.interruption() = {options.interrupted, options.interrupted_context};
    }

    bool segment(const Segment<System>& s) override {
        if (watcher_ != nullptr) watcher_->segment(s);
        return (!options_.energy || meter_.segment(s)) && sampler_.segment(s);
    }
    bool flush() override { return sampler_.write(); }
    bool wants_switching() const override { return watcher_ != nullptr || keeps_switching(); }
    void tick(const ClosedLoop<D>& loop, const ControlCourse& course, const StateOf<D>& x,
              const typename D::Memory& memory) override {
        if (watcher_ != nullptr) watcher_->tick(loop, course, x, memory);
    }
    void finish(const ClosedLoop<D>& loop) override {
        if (watcher_ != nullptr) watcher_->finish(loop);
    }
    void switching(const SwitchingOf<System>& s) override {
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
        InstantsOf<D, vec_width> at;
        dense_samples_.within(dense, last, solver, [&](std::size_t k, const StateOf<D>& x, const InputsOf<D>& input) {
            at.set(0, load(x), input);
            const TrainReader<D> reader(model_, r, m);
            for (std::size_t c = 0; c < channels_.size(); ++c)
                out_[c * options_.samples + k] = reader.first(channels_[c], at);
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

}  // namespace lostmotion
