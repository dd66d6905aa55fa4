// Runs of trains in one kernel with their derivatives. Only core/kernels takes it.
#pragma once

#include "lostmotion/analysis/sensitive_run.hpp"
#include "lostmotion/analysis/train_batch.hpp"
#include "train_sensitivity.hpp"
#include "train_solving.hpp"

namespace lostmotion {

// Runs of one train, each with its derivatives, by the exact solver. What their regimes are is found once for all.
template <class D>
class SensitiveRuns {
 public:
    explicit SensitiveRuns(const TrainModel& model) : model_(model) {}

    // out: values, as TrainRun::run; output: derivatives of the same channels and instants.
    TrainReport operator()(const SensitiveCase& c, const TrainOptions& options, double* out,
                           SensitivityOutput& output) {
        const auto [x, memory] = c.run->in_layout(c.start);
        if (c.variations.empty())
            return run_train_exactly_in<D>(model_, {c.inputs, x, memory}, options, out, nullptr, workspace_);
        const auto trains = std::make_shared<const VariedTrain>(*c.run, c.variations);
        const auto tangents = std::make_shared<const InputTangents>(c.run->assembly().layout(), c.inputs, c.variations);
        for (const DerivativeFault& fault :
             {check_derivatives(options.control, c.variations), trains->fault(), tangents->fault()})
            if (!fault.empty()) output.fault = fault;
        if (!output.fault.empty()) return {};
        output.times = options.times();
        if (!regimes_ || !regimes_->serve(*trains, *tangents, output.channels))
            regimes_.emplace(trains, tangents, output.channels);
        TrainSensitivity<D> watcher(*trains, *tangents, *regimes_, c.variations, c.start, options.control, output);
        return run_train_exactly_in<D>(model_, {c.inputs, x, memory}, options, out, &watcher, workspace_);
    }

 private:
    const TrainModel& model_;
    std::unique_ptr<Workspace> workspace_;
    std::optional<RegimeTangents> regimes_;
};

template <class D>
SensitiveRow run_sensitive(SensitiveRuns<D>& runs, const SensitiveCase& one, const std::vector<std::string>& channels,
                           bool signals, TrainOptions options) {
    SensitiveRow row;
    const std::size_t samples = options.times().count, parameters = one.variations.size();
    const std::size_t shown = signals ? options.control.axes.size() * control::n_axis_signals * samples : 0;
    const auto room = [](std::size_t count) {
        auto data = std::make_unique_for_overwrite<double[]>(count);
        std::fill_n(data.get(), count, std::numeric_limits<double>::quiet_NaN());
        return data;
    };
    row.values = room(channels.size() * samples);
    row.derivatives = room(parameters * channels.size() * samples);
    row.signals = room(shown);
    row.signal_derivatives = room(parameters * shown);
    if (signals) options.control_out = row.signals.get();
    row.problem.reason = find_channels(*one.run, channels, options.channels.emplace());
    if (!row.problem.empty()) return row;
    SensitivityOutput output;
    output.channels = *options.channels;
    output.out = row.derivatives.get();
    if (signals) output.axes_out = row.signal_derivatives.get();
    const TrainReport report = runs(one, options, row.values.get(), output);
    row.problem = output.fault.empty() ? DerivativeFault{{}, report.message} : output.fault;
    if (row.problem.empty()) row.error = error_text(report, one.run->assembly());
    if (row.problem.empty() && row.error.empty()) row.end_state = named_end(report, one.run->assembly());
    row.ends_at = output.ends_at;
    row.ends_by = output.ends_by;
    return row;
}

template <class D>
void run_sensitive_cases(const TrainModel& model, std::span<const SensitiveCase> cases, std::span<SensitiveRow> rows,
                         const std::vector<std::string>& channels, bool signals, std::atomic<bool>& stop) {
    SensitiveRuns<D> runs(model);
    for (std::size_t k = 0; k < cases.size() && !stop; ++k) {
        TrainOptions options = cases[k].options;
        options.interrupted = [](void* flag) { return static_cast<std::atomic<bool>*>(flag)->load(); };
        options.interrupted_context = &stop;
        rows[k] = run_sensitive(runs, cases[k], channels, signals, std::move(options));
    }
}

}  // namespace lostmotion
