#include "batch.hpp"

namespace lostmotion {

void add_signal_fields(std::vector<BatchField>& fields, const std::string& prefix, std::size_t input) {
    const auto first_sine = [input](Case& c) -> Sine& {
        std::vector<Sine>& sines = c.signals[input].sines;
        return sines.empty() ? sines.emplace_back() : sines.front();
    };
    fields.push_back({prefix + ".mean", [=](Case& c, double v) { c.signals[input].breakpoints[0].value = v; }, false});
    fields.push_back({prefix + ".amplitude", [=](Case& c, double v) { first_sine(c).amplitude = v; }, false});
    fields.push_back({prefix + ".frequency", [=](Case& c, double v) { first_sine(c).frequency = v; }, false});
    fields.push_back({prefix + ".phase", [=](Case& c, double v) { first_sine(c).phase = v; }, false});
}

const std::vector<BatchField>& batch_fields() {
    static const std::vector<BatchField> all = [] {
        std::vector<BatchField> fields;
        for (const Parameter& p : parameters)
            fields.push_back({p.key, [in = p.in](Case& c, double v) { in(c.drive) = v; }, true});
        // A factor on what the drive has, not the value itself.
        fields.push_back({"gearbox.stiffness.slopes",
                          [](Case& c, double v) { c.drive.gearbox.curve = c.drive.gearbox.curve.scaled(v); }, true});
        add_signal_fields(fields, "command", command - first_input);
        add_signal_fields(fields, "load.torque", load_torque - first_input);
        for (const StateName& s : state_names)
            fields.push_back({"initial." + std::string(s.name),
                              [k = s.value](Case& c, double v) { c.start.x[static_cast<std::size_t>(k)] = v; }, false});
        return fields;
    }();
    return all;
}

std::vector<BatchRow> run_batch(WorkspacePool& pool, const BatchInput& in, double* out, unsigned threads,
                                const std::function<bool(std::size_t)>& waiting) {
    std::vector<BatchRow> rows(in.runs);
    const std::size_t width = in.options.channels.size() * in.options.samples;
    const std::size_t row_size = in.kept.empty() ? width : in.kept.size();
    bool drive_varies = false;
    for (const int f : in.fields) drive_varies = drive_varies || batch_fields()[static_cast<std::size_t>(f)].of_drive;
    distribute(in.runs, threads, waiting, [&](auto next, std::atomic<bool>& stop) {
        std::unique_ptr<Workspace> workspace = pool.take();
        RunOptions options = in.options;
        options.max_switchings = 0;
        options.interrupted = [](void* flag) { return static_cast<std::atomic<bool>*>(flag)->load(); };
        options.interrupted_context = &stop;
        std::vector<double> scratch(in.kept.empty() ? 0 : width);
        for (std::size_t k = next(); k < in.runs && !stop; k = next()) {
            Case one = in.base;
            for (std::size_t f = 0; f < in.fields.size(); ++f)
                batch_fields()[static_cast<std::size_t>(in.fields[f])].set(one, in.values[k * in.fields.size() + f]);
            if (drive_varies) workspace->set(one.drive);
            double* samples = in.kept.empty() ? out + k * width : scratch.data();
            const RunReport report = run_exact(*workspace, one.signals, one.start, options, samples);
            const std::span<double> row(out + k * row_size, row_size);
            if (report.status != Status::done) {
                std::ranges::fill(row, std::numeric_limits<double>::quiet_NaN());
            } else {
                reduce_all(in.kept, samples, options.samples, row.data());
            }
            rows[k] = {report.status,       report.contact, report.time, static_cast<double>(report.switching_count),
                       report.left_data_at, report.energy};
        }
        if (drive_varies) workspace->set(in.base.drive);
        pool.give_back(std::move(workspace));
    });
    return rows;
}

}  // namespace lostmotion
