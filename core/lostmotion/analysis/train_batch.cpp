#include "train_batch.hpp"

namespace lostmotion {

std::string find_channels(const TrainRun& run, const std::vector<std::string>& names, std::vector<int>& found) {
    const std::vector<TrainChannel>& all = run.channels();
    for (const std::string& name : names) {
        const auto at = std::ranges::find(all, name, &TrainChannel::name);
        if (at == all.end()) return "this train has no result variable " + name;
        found.push_back(static_cast<int>(at - all.begin()));
    }
    return "";
}

TrainRow run_case(const TrainCase& one, const TrainBatch& batch, TrainOptions options, double* samples, double* out) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    TrainRow row;
    row.energies.assign(batch.energies.size(), nan);
    const std::span<double> numbers(out, batch.width());
    std::ranges::fill(numbers, nan);
    const TrainRun run(one.train);
    row.error = run.error();
    if (row.error.empty()) row.error = find_channels(run, batch.channels, options.channels.emplace());
    if (!row.error.empty()) return row;
    const TrainReport report = run.run(one.inputs, one.start, options, batch.kept.empty() ? out : samples);
    row.error = error_text(report, run.assembly());
    if (!row.error.empty()) {
        std::ranges::fill(numbers, nan);
        return row;
    }
    reduce_all(batch.kept, samples, options.samples, out);
    row.switchings = static_cast<double>(report.switching_count);
    if (batch.energies.empty()) return row;
    const Named ledger = named_ledger(report, run.assembly());
    for (std::size_t k = 0; k < batch.energies.size(); ++k) row.energies[k] = value_of(ledger, batch.energies[k]);
    return row;
}

std::vector<TrainRow> run_trains(const TrainBatch& batch, double* out, unsigned threads,
                                 const std::function<bool(std::size_t)>& waiting) {
    std::vector<TrainRow> rows(batch.cases.size());
    distribute(rows.size(), threads, waiting, [&](auto next, std::atomic<bool>& stop) {
        TrainOptions options = batch.options;
        options.interrupted = [](void* flag) { return static_cast<std::atomic<bool>*>(flag)->load(); };
        options.interrupted_context = &stop;
        std::vector<double> samples(batch.kept.empty() ? 0 : batch.channels.size() * options.samples);
        for (std::size_t k = next(); k < rows.size() && !stop; k = next())
            rows[k] = run_case(batch.cases[k], batch, options, samples.data(), out + k * batch.width());
    });
    return rows;
}

}  // namespace lostmotion
