// Many runs of trains with their derivatives, on several threads. A run does not know of the others.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sensitive_run.hpp"
#include "train_batch.hpp"

namespace lostmotion {

struct SensitiveCase {
    TrainCase run;
    TrainOptions options;
    std::vector<Variation> variations;
};

struct SensitiveRow {
    std::string problem, error;                             // of what is asked for, of the motion, or empty
    std::unique_ptr<double[]> values, derivatives;          // channels x samples; parameters x channels x samples
    std::unique_ptr<double[]> signals, signal_derivatives;  // of the controllers: (axes x signals) x samples, as above
    double ends_at = std::numeric_limits<double>::infinity();  // [s] from where the derivatives do not exist, and why
    std::string ends_by;
};

inline SensitiveRow run_sensitive(const SensitiveCase& one, const std::vector<std::string>& channels,
                                  TrainOptions options) {
    SensitiveRow row;
    const std::size_t samples = options.samples, parameters = one.variations.size();
    const std::size_t shown = options.control.axes.size() * control::n_axis_signals * samples;
    const auto room = [](std::size_t count) {
        auto data = std::make_unique_for_overwrite<double[]>(count);
        std::fill_n(data.get(), count, std::numeric_limits<double>::quiet_NaN());
        return data;
    };
    row.values = room(channels.size() * samples);
    row.derivatives = room(parameters * channels.size() * samples);
    row.signals = room(shown);
    row.signal_derivatives = room(parameters * shown);
    options.control_out = row.signals.get();
    const TrainRun run(one.run.train);
    row.problem = run.error();
    if (row.problem.empty()) row.problem = find_channels(run, channels, options.channels.emplace());
    if (!row.problem.empty()) return row;
    SensitivityOutput output;
    output.channels = *options.channels;
    output.out = row.derivatives.get();
    output.axes_out = row.signal_derivatives.get();
    const TrainReport report =
        run_with_derivatives(run, one.run.inputs, one.run.start, one.variations, options, row.values.get(), output);
    row.problem = report.message;
    if (row.problem.empty()) row.error = error_text(report, run.assembly());
    row.ends_at = output.ends_at;
    row.ends_by = output.ends_by;
    return row;
}

inline std::vector<SensitiveRow> run_sensitive(const std::vector<SensitiveCase>& cases,
                                               const std::vector<std::string>& channels, unsigned threads,
                                               const std::function<bool(std::size_t)>& waiting) {
    std::vector<SensitiveRow> rows(cases.size());
    distribute(rows.size(), threads, waiting, [&](auto next, std::atomic<bool>& stop) {
        for (std::size_t k = next(); k < rows.size() && !stop; k = next()) {
            TrainOptions options = cases[k].options;
            options.interrupted = [](void* flag) { return static_cast<std::atomic<bool>*>(flag)->load(); };
            options.interrupted_context = &stop;
            rows[k] = run_sensitive(cases[k], channels, options);
        }
    });
    return rows;
}

}  // namespace lostmotion
