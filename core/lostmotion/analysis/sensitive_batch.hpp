// Many runs of trains with their derivatives, on several threads. A run does not know of the others.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sensitive_run.hpp"
#include "train_batch.hpp"

namespace lostmotion {

struct SensitiveRow {
    std::string problem, error;                             // of what is asked for, of the motion, or empty
    std::unique_ptr<double[]> values, derivatives;          // channels x samples; parameters x channels x samples
    std::unique_ptr<double[]> signals, signal_derivatives;  // of the controllers: (axes x signals) x samples, as above
    Named end_state;                                        // of a run that has ended well
    double ends_at = std::numeric_limits<double>::infinity();  // [s] from where the derivatives do not exist, and why
    std::string ends_by;
};

// Up to this many runs of the same train come one after the other on a thread.
inline constexpr std::size_t together = 8;

// Where each of the pieces of work begins, and the end: runs of the same train that stand together. What they share
// does not depend on the number of threads.
inline std::vector<std::size_t> pieces_of_work(const std::vector<SensitiveCase>& cases) {
    std::vector<std::size_t> first{0};
    for (std::size_t k = 1; k < cases.size(); ++k)
        if (cases[k].run != cases[k - 1].run ||
            cases[k].options.sample_interval != cases[k - 1].options.sample_interval || k - first.back() == together)
            first.push_back(k);
    first.push_back(cases.size());
    return first;
}

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
    row.problem = find_channels(*one.run, channels, options.channels.emplace());
    if (!row.problem.empty()) return row;
    SensitivityOutput output;
    output.channels = *options.channels;
    output.out = row.derivatives.get();
    if (signals) output.axes_out = row.signal_derivatives.get();
    const TrainReport report = runs(one, options, row.values.get(), output);
    row.problem = report.message;
    if (row.problem.empty()) row.error = error_text(report, one.run->assembly());
    if (row.problem.empty() && row.error.empty()) row.end_state = named_end(report, one.run->assembly());
    row.ends_at = output.ends_at;
    row.ends_by = output.ends_by;
    return row;
}

// signals: also what the controllers show; then the instants must be multiples of an interval.
inline std::vector<SensitiveRow> run_sensitive(const std::vector<SensitiveCase>& cases,
                                               const std::vector<std::string>& channels, bool signals, unsigned threads,
                                               const std::function<bool(std::size_t)>& waiting) {
    std::vector<SensitiveRow> rows(cases.size());
    const std::vector<std::size_t> first = pieces_of_work(cases);
    distribute(first.size() - 1, threads, waiting, [&](auto next, std::atomic<bool>& stop) {
        for (std::size_t n = next(); n + 1 < first.size() && !stop; n = next()) {
            const TrainRun& run = *cases[first[n]].run;
            if (!run.error().empty()) {
                for (std::size_t k = first[n]; k < first[n + 1]; ++k) rows[k].problem = run.error();
                continue;
            }
            run.in_kernel([&]<class D>(const typename TrainReader<D>::Model& model) {
                SensitiveRuns<D> runs(model);
                for (std::size_t k = first[n]; k < first[n + 1] && !stop; ++k) {
                    TrainOptions options = cases[k].options;
                    options.interrupted = [](void* flag) { return static_cast<std::atomic<bool>*>(flag)->load(); };
                    options.interrupted_context = &stop;
                    rows[k] = run_sensitive(runs, cases[k], channels, signals, std::move(options));
                }
            });
        }
    });
    return rows;
}

}  // namespace lostmotion
