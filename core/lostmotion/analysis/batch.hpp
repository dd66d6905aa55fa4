// Many runs in one call, on several threads: parameters as arrays in, samples and totals as arrays out. A run does not
// know of the others, so a row is the single run to the last bit, for any number of threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <limits>
#include <span>

#include "reduction.hpp"
#include "response.hpp"

namespace lostmotion {

// What may differ from run to run.
struct BatchField {
    const char* key;  // as in a scenario file
    // Sets the value; drive: whether the drive itself changes.
    void (*set)(Drive&, Signals&, Start&, double);
    bool drive;
};

inline std::span<const BatchField> batch_fields() {
    static constexpr auto first_sine = [](Signal& s) -> Sine& {
        if (s.sines.empty()) s.sines.emplace_back();
        return s.sines.front();
    };
    static constexpr BatchField fields[] = {
        {"motor.rotor_inertia", [](Drive& d, Signals&, Start&, double v) { d.motor.rotor_inertia = v; }, true},
        {"motor.friction_torque", [](Drive& d, Signals&, Start&, double v) { d.motor.friction_torque = v; }, true},
        {"motor.rated_torque", [](Drive& d, Signals&, Start&, double v) { d.motor.rated_torque = v; }, true},
        {"motor.rated_speed", [](Drive& d, Signals&, Start&, double v) { d.motor.rated_speed = v; }, true},
        {"motor.electrical_time_constant",
         [](Drive& d, Signals&, Start&, double v) { d.motor.electrical_time_constant = v; }, true},
        {"motor.armature_voltage_constant",
         [](Drive& d, Signals&, Start&, double v) { d.motor.armature_voltage_constant = v; }, true},
        {"gearbox.ratio", [](Drive& d, Signals&, Start&, double v) { d.gearbox.ratio = v; }, true},
        {"gearbox.inertia", [](Drive& d, Signals&, Start&, double v) { d.gearbox.inertia = v; }, true},
        {"gearbox.viscous_friction", [](Drive& d, Signals&, Start&, double v) { d.gearbox.viscous_friction = v; },
         true},
        {"gearbox.rated_input_speed", [](Drive& d, Signals&, Start&, double v) { d.gearbox.rated_input_speed = v; },
         true},
        {"gearbox.rated_output_torque", [](Drive& d, Signals&, Start&, double v) { d.gearbox.rated_output_torque = v; },
         true},
        {"gearbox.hysteresis.efficiency",
         [](Drive& d, Signals&, Start&, double v) { d.gearbox.hysteresis_efficiency = v; }, true},
        // A factor on what the drive has, not the value itself.
        {"gearbox.stiffness.slopes",
         [](Drive& d, Signals&, Start&, double v) { d.gearbox.curve = d.gearbox.curve.scaled(v); }, true},
        {"load.inertia", [](Drive& d, Signals&, Start&, double v) { d.load.inertia = v; }, true},
        {"load.viscous_friction", [](Drive& d, Signals&, Start&, double v) { d.load.viscous_friction = v; }, true},
        {"load.friction_torque", [](Drive& d, Signals&, Start&, double v) { d.load.friction_torque = v; }, true},
        {"command.mean", [](Drive&, Signals& s, Start&, double v) { s[0].knots[0].value = v; }, false},
        {"command.amplitude", [](Drive&, Signals& s, Start&, double v) { first_sine(s[0]).amplitude = v; }, false},
        {"command.frequency", [](Drive&, Signals& s, Start&, double v) { first_sine(s[0]).frequency = v; }, false},
        {"command.phase", [](Drive&, Signals& s, Start&, double v) { first_sine(s[0]).phase = v; }, false},
        {"load.torque.mean", [](Drive&, Signals& s, Start&, double v) { s[1].knots[0].value = v; }, false},
        {"load.torque.amplitude", [](Drive&, Signals& s, Start&, double v) { first_sine(s[1]).amplitude = v; }, false},
        {"load.torque.frequency", [](Drive&, Signals& s, Start&, double v) { first_sine(s[1]).frequency = v; }, false},
        {"load.torque.phase", [](Drive&, Signals& s, Start&, double v) { first_sine(s[1]).phase = v; }, false},
        {"initial.motor_torque", [](Drive&, Signals&, Start& s, double v) { s.x[motor_torque] = v; }, false},
        {"initial.motor_speed", [](Drive&, Signals&, Start& s, double v) { s.x[motor_speed] = v; }, false},
        {"initial.load_speed", [](Drive&, Signals&, Start& s, double v) { s.x[load_speed] = v; }, false},
        {"initial.twist", [](Drive&, Signals&, Start& s, double v) { s.x[twist] = v; }, false},
        {"initial.load_angle", [](Drive&, Signals&, Start& s, double v) { s.x[load_angle] = v; }, false},
    };
    return fields;
}

// One number to keep of each run: a reduction of the samples of a channel, by its place among those of the run.
struct Kept {
    std::size_t channel = 0;
    Reduction how = Reduction::peak;
};

struct BatchInput {
    const Drive& drive;
    const Signals& signals;
    Start start;
    RunOptions options;
    std::span<const int> fields;     // numbers in batch_fields()
    std::span<const double> values;  // runs x fields
    std::size_t runs = 0;
    std::vector<Kept> kept;  // none: the samples themselves
};

struct BatchRow {
    Status status = Status::interrupted;
    Contact contact = input_contact;
    double time = 0.0;
    double switchings = 0.0;
    double left_data_at = 0.0;
    EnergyLedger energy;
};

// out: runs x channels x samples or, of what is to be kept, runs x kept; NaN all through a run that did not end well.
inline std::vector<BatchRow> run_batch(WorkspacePool& pool, const BatchInput& in, double* out, unsigned threads,
                                       const std::function<bool(std::size_t)>& waiting) {
    std::vector<BatchRow> rows(in.runs);
    const std::size_t width = in.options.channels.size() * in.options.samples;
    const std::size_t row_size = in.kept.empty() ? width : in.kept.size();
    bool drive_varies = false;
    for (const int f : in.fields) drive_varies = drive_varies || batch_fields()[static_cast<std::size_t>(f)].drive;
    work_through(in.runs, threads, waiting, [&](auto next, std::atomic<bool>& stop) {
        std::unique_ptr<Workspace> workspace = drive_varies ? std::make_unique<Workspace>(in.drive) : pool.take();
        RunOptions options = in.options;
        options.max_switchings = 0;
        options.interrupted = [](void* flag) { return static_cast<std::atomic<bool>*>(flag)->load(); };
        options.interrupted_context = &stop;
        std::vector<double> scratch(in.kept.empty() ? 0 : width);
        for (std::size_t k = next(); k < in.runs && !stop; k = next()) {
            Drive drive = in.drive;
            Signals signals = in.signals;
            Start start = in.start;
            for (std::size_t f = 0; f < in.fields.size(); ++f)
                batch_fields()[static_cast<std::size_t>(in.fields[f])].set(drive, signals, start,
                                                                           in.values[k * in.fields.size() + f]);
            if (drive_varies) workspace->set(drive);
            double* samples = in.kept.empty() ? out + k * width : scratch.data();
            const RunReport report = run_exact(*workspace, signals, start, options, samples);
            const std::span<double> row(out + k * row_size, row_size);
            if (report.status != Status::done) {
                std::ranges::fill(row, std::numeric_limits<double>::quiet_NaN());
            } else {
                for (std::size_t j = 0; j < in.kept.size(); ++j)
                    row[j] = reduce(in.kept[j].how, samples + in.kept[j].channel * options.samples, options.samples);
            }
            rows[k] = {report.status,       report.contact, report.time, static_cast<double>(report.switching_count),
                       report.left_data_at, report.energy};
        }
        if (!drive_varies) pool.give_back(std::move(workspace));
    });
    return rows;
}

}  // namespace lostmotion
