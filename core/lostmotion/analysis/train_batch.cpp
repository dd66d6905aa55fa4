#include "train_batch.hpp"

namespace lostmotion {

namespace {

void add_signal_fields(std::vector<BatchField>& fields, const std::string& prefix, std::size_t input) {
    const auto first_sine = [input](TrainCase& c) -> Sine& {
        std::vector<Sine>& sines = c.inputs[input].sines;
        return sines.empty() ? sines.emplace_back() : sines.front();
    };
    fields.push_back({prefix + ".mean", [=](TrainCase& c, double v) { c.inputs[input].breakpoints[0].value = v; }});
    fields.push_back({prefix + ".amplitude", [=](TrainCase& c, double v) { first_sine(c).amplitude = v; }});
    fields.push_back({prefix + ".frequency", [=](TrainCase& c, double v) { first_sine(c).frequency = v; }});
    fields.push_back({prefix + ".phase", [=](TrainCase& c, double v) { first_sine(c).phase = v; }});
}

}  // namespace

const std::vector<BatchField>& batch_fields() {
    static const std::vector<BatchField> all = [] {
        std::vector<BatchField> fields;
        for (std::size_t k = 0; k < model::parameters().size(); ++k)
            fields.push_back({model::parameters()[k].key,
                              [k](TrainCase& c, double v) { *model::parameters_of(c.train)[k].value = v; }});
        // A factor on what the drive has, not the value itself.
        fields.push_back({"gearbox.stiffness.slopes", [](TrainCase& c, double v) {
                              Gearbox& law = c.train.gears[0].law;
                              law.curve = law.curve.scaled(v);
                          }});
        add_signal_fields(fields, "command", 0);
        add_signal_fields(fields, "load.torque", 1);
        for (const std::string& s : model::state_names(model::Assembly(model::drive_train())))
            fields.push_back({"initial." + s, [s](TrainCase& c, double v) { c.start.states[s] = v; }});
        return fields;
    }();
    return all;
}

const TrainCase& TrainBatch::row(std::size_t k, TrainCase& room) const {
    if (fields.empty()) return cases[k];
    room = cases[0];
    for (std::size_t f = 0; f < fields.size(); ++f)
        batch_fields()[static_cast<std::size_t>(fields[f])].set(room, values[k * fields.size() + f]);
    return room;
}

std::string find_channels(const TrainRun& run, const std::vector<std::string>& names, std::vector<int>& found) {
    const std::vector<TrainChannel>& all = run.channels();
    for (const std::string& name : names) {
        const auto at = std::ranges::find(all, name, &TrainChannel::name);
        if (at == all.end()) return "this train has no result variable " + name;
        found.push_back(static_cast<int>(at - all.begin()));
    }
    return "";
}

TrainRow run_case(const TrainCase& one, const TrainBatch& batch, TrainOptions options, double* samples, double* out,
                  std::unique_ptr<Workspace>& workspace) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    TrainRow row;
    row.energies.assign(batch.energies.size(), nan);
    const std::span<double> numbers(out, batch.width());
    std::ranges::fill(numbers, nan);
    const TrainRun run(one.train);
    row.error = run.error();
    if (row.error.empty()) row.error = find_channels(run, batch.channels, options.channels.emplace());
    if (!row.error.empty()) return row;
    const TrainReport report = run.run(one.inputs, one.start, options, batch.kept.empty() ? out : samples, workspace);
    if (workspace) workspace->leave();
    row.error = error_text(report, run.assembly());
    if (!row.error.empty()) {
        std::ranges::fill(numbers, nan);
        return row;
    }
    reduce_all(batch.kept, samples, options.samples, options.times().last_share(), out);
    row.switchings = static_cast<double>(report.switching_count);
    if (batch.energies.empty()) return row;
    const NamedInOrder ledger = named_ledger(report, run.assembly());
    for (std::size_t k = 0; k < batch.energies.size(); ++k) row.energies[k] = value_of(ledger, batch.energies[k]);
    return row;
}

std::vector<TrainRow> run_trains(const TrainBatch& batch, double* out, unsigned threads,
                                 const std::function<bool(std::size_t)>& waiting) {
    std::vector<TrainRow> rows(batch.runs());
    distribute(rows.size(), threads, waiting, [&](auto next, std::atomic<bool>& stop) {
        TrainOptions options = batch.options;
        options.interrupted = [](void* flag) { return static_cast<std::atomic<bool>*>(flag)->load(); };
        options.interrupted_context = &stop;
        std::vector<double> samples(batch.kept.empty() ? 0 : batch.channels.size() * options.samples);
        TrainCase room;
        std::unique_ptr<Workspace> workspace;
        for (std::size_t k = next(); k < rows.size() && !stop; k = next())
            rows[k] = run_case(batch.row(k, room), batch, options, samples.data(), out + k * batch.width(), workspace);
    });
    return rows;
}

}  // namespace lostmotion
