// The record of a run of a train: samples, switchings and energies.
#pragma once

#include <algorithm>
#include <array>
#include <numeric>
#include <string>
#include <vector>

#include "dense_samples.hpp"
#include "lostmotion/simulation/train_report.hpp"
#include "power_integral.hpp"
#include "sampler.hpp"
#include "train_reader.hpp"

namespace lostmotion {

// The energies of a train, flow by flow.
template <class D>
class TrainMeter {
 public:
    explicit TrainMeter(const model::Assembly& a) : assembly_(a) {
        const std::vector<model::PowerFlow> all = model::all_flows(a);
        place_.assign(all.size(), -1);
        for (const model::Alias& alias : a.train().aliases)  // in their order
            if (const auto flow = std::ranges::find(all, alias.name, &model::PowerFlow::name); flow != all.end())
                place(static_cast<int>(flow - all.begin()));
    }

    Interruption& interruption() { return integral_.interruption; }

    // False ends the run.
    bool segment(const Segment<model::TrainSystem<D>>& s) {
        const model::SparseRegime& r = *s.entry.regime;
        if (!(s.end > s.begin)) return true;
        const auto& flows = s.system.flows(r);
        for (const auto& f : flows) place(f.number);
        if (std::ranges::all_of(assembly_.places().shafts,
                                [&](const model::ShaftPlace& p) { return r.resting[p.speed]; }))
            return true;
        typename Integral::Factors factors;
        const int rows = max_flows <= 8 ? max_flows : static_cast<int>(order_.size());
        for (int k = 0; k < rows; ++k) factors.set(k, {}, {});  // none in this regime
        for (const auto& f : flows) factors.set(place(f.number), f.torque, f.speed);
        factors.hold(s.memory);
        return integral_.add(s, factors);
    }
    void write(TrainReport& report) const {
        const std::vector<model::PowerFlow> all = model::all_flows(assembly_);
        for (std::size_t k = 0; k < order_.size(); ++k) {
            const auto& flow = all[static_cast<std::size_t>(order_[k])];
            report.energy.push_back({flow.name, flow.kind, integral_.flow[k]});
        }
        report.turned_over = integral_.turned_over;
    }

 private:
    static constexpr int max_flows = std::same_as<D, Any> ? Any::coupled : D::guards <= 16 ? 8 : 96;
    using Integral = PowerIntegral<D, max_flows>;

    // The row of a flow, which it keeps from regime to regime.
    int place(int number) {
        int& place = place_[static_cast<std::size_t>(number)];
        if (place < 0) {
            place = static_cast<int>(order_.size());
            order_.push_back(number);
        }
        return place;
    }

    const model::Assembly& assembly_;
    Integral integral_;
    std::vector<int> place_;
    std::vector<int> order_;
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

    TrainRecorder(const TrainModel& m, const TrainOptions& options, double* out, TrainReport& report,
                  TrainWatcher<D>* watcher)
        : watcher_(watcher),
          model_(m),
          options_(options),
          out_(out),
          report_(report),
          channels_(options.channels ? *options.channels : all(m)),
          sampler_(m, options.times(), out, channels_),
          meter_(m.assembly),
          dense_samples_(options.RunRequest::times()) {
        sampler_.interruption = meter_.interruption() = {options.interrupted, options.interrupted_context};
    }

    bool segment(const Segment<System>& s) override {
        if (watcher_ != nullptr) watcher_->segment(s);
        return (!options_.energy || meter_.segment(s)) && sampler_.segment(s);
    }
    bool flush() override { return sampler_.write(); }
    bool enough() override {
        sampler_.go_back_to(options_.pause);  // of a run that goes on, it is that behind the tick
        return options_.enough && options_.enough();
    }
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
        report_.switchings.push_back({s.time, s.input_jump, s.kind, s.contact, s.branch, s.before.modes, s.after.modes,
                                      s.torque_before, s.torque_after});
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
    static std::vector<int> all(const TrainModel& m) {
        std::vector<int> numbers(m.channels.size());
        std::iota(numbers.begin(), numbers.end(), 0);
        return numbers;
    }

    bool keeps_switching() const { return report_.switchings.size() < options_.max_switchings; }

    TrainWatcher<D>* watcher_;
    const TrainModel& model_;
    const TrainOptions& options_;
    double* out_;
    TrainReport& report_;
    std::vector<int> channels_;
    SamplerOf<System, TrainReader<D>> sampler_;
    TrainMeter<D> meter_;
    DenseSamples dense_samples_;
};

}  // namespace lostmotion
