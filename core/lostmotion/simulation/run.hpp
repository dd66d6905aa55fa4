// A whole run, recorded: samples, switchings and energy ledger.
#pragma once

#include <vector>

#include "../solver/adaptive_solver.hpp"
#include "../solver/components.hpp"
#include "dense_samples.hpp"
#include "drive_control.hpp"
#include "energy.hpp"
#include "sampler.hpp"
#include "workspace.hpp"

namespace lostmotion {

using Start = StartOf<DriveDims>;

struct RunOptions {
    double duration = 1.0;          // [s]
    double sample_interval = 1e-3;  // [s]
    std::size_t samples = 0;        // instants k * sample_interval to record, from k = 0
    std::span<const int> channels = all_channels;
    bool energy = true;
    std::size_t max_switchings = 100000;  // kept; all are counted
    bool (*interrupted)(void*) = nullptr;
    void* interrupted_context = nullptr;
    Control control;                // nothing: the inputs alone act
    double* control_out = nullptr;  // (axes x signals) x samples, as ControlRecord
};

struct RunReport {
    Status status = Status::done;
    double time = 0.0;                // [s] reached
    Contact contact = input_contact;  // at the last switching
    State x{};
    Memory memory;
    std::vector<Switching> switchings;
    std::size_t switching_count = 0;
    EnergyLedger energy;
    double left_data_at = 0.0;  // [s], infinity if never
    long steps = 0;             // event checks of the exact solver, steps of the adaptive one
};

// Observer of the exact solver that samples, keeps switchings and meters energy.
class Recorder {
 public:
    Recorder(const Drive& drive, const RunOptions& options, double* out, RunReport& report)
        : sampler_(drive, 0.0, options.sample_interval, options.samples, out, options.channels),
          meter_(drive),
          options_(options),
          report_(report) {
        sampler_.interrupted = options.interrupted;
        sampler_.interrupted_context = options.interrupted_context;
    }
    void begin(const State& x) { meter_.begin(x); }
    bool segment(const Segment<SwitchedDrive>& s) {
        return sampler_.segment(s) && (!options_.energy || meter_.segment(s));
    }
    bool flush() { return sampler_.write(); }
    bool wants_switching() const { return report_.switchings.size() < options_.max_switchings; }
    void switching(const Switching& s) { report_.switchings.push_back(s); }
    void end(const State& x) {
        sampler_.write();
        meter_.end(x);
        report_.energy = meter_.ledger;
        report_.left_data_at = sampler_.left_data_at;
    }

 private:
    Sampler sampler_;
    EnergyMeter meter_;
    const RunOptions& options_;
    RunReport& report_;
};

// out: channels x samples, channel by channel.
inline RunReport run_exact(Workspace& workspace, const Signals& signals, const Start& start, const RunOptions& options,
                           double* out) {
    RunReport report;
    const Drive& drive = workspace.drive;
    ExactSolver<SwitchedDrive> solver(workspace.system, with_ramps(signals, options.control, only_motor),
                                      options.sample_interval, drive.balanced_scale(), &workspace.cache);
    Recorder recorder(drive, options, out, report);
    recorder.begin(start.x);
    report.status = run_recorded(solver, start, options, recorder,
                                 [&](const auto& laws) { return closed_loop_of(drive, options.control, laws); });
    recorder.end(solver.state());
    report.time = solver.time();
    report.contact = solver.stopped_at();
    report.x = solver.state();
    report.memory = solver.memory();
    report.steps = solver.event_checks();
    report.switching_count = solver.switchings();
    return report;
}

inline RunReport run_exact(const Drive& drive, const Signals& signals, const Start& start, const RunOptions& options,
                           double* out) {
    Workspace workspace(drive);
    return run_exact(workspace, signals, start, options, out);
}

// Observer of the adaptive solver.
template <class Solver>
class AdaptiveRecorder {
 public:
    AdaptiveRecorder(const Drive& drive, Solver& solver, const RunOptions& options, double* out, RunReport& report)
        : drive_(drive),
          solver_(solver),
          options_(options),
          out_(out),
          report_(report),
          samples_(options.sample_interval, options.samples) {}

    void step(const Regime& r, const Memory& m, const DenseStepOf<DriveDims>& dense, bool last) {
        if (!r.in_data) report_.left_data_at = std::fmin(report_.left_data_at, dense.begin);
        samples_.within(dense, last, solver_, [&](std::size_t k, const State& x, const InputsOf<DriveDims>& input) {
            const Reading reading = Reader(drive_, r, m)(x, input);
            for (int c = 0; c < n_channels; ++c) out_[c * options_.samples + k] = reading.value[c];
        });
    }
    bool wants_switching() const { return report_.switchings.size() < options_.max_switchings; }
    void switching(const Switching& s) { report_.switchings.push_back(s); }

 private:
    const Drive& drive_;
    Solver& solver_;
    const RunOptions& options_;
    double* out_;
    RunReport& report_;
    DenseSamples samples_;
};

inline RunReport run_adaptive(const Drive& drive, const Signals& signals, const Start& start, const RunOptions& options,
                              double relative_tolerance, double* out) {
    RunReport report;
    report.left_data_at = std::numeric_limits<double>::infinity();
    const SwitchedDrive system(drive);
    using Solver = AdaptiveSolver<SwitchedDrive>;
    Solver solver(system, with_ramps(signals, options.control, only_motor), relative_tolerance, drive.rated_scale());
    AdaptiveRecorder<Solver> recorder(drive, solver, options, out, report);
    report.status = run_recorded(solver, start, options, recorder,
                                 [&](const auto& laws) { return closed_loop_of(drive, options.control, laws); });
    report.time = solver.time();
    report.contact = solver.stopped_at();
    report.x = solver.state();
    report.memory = solver.memory();
    report.steps = solver.steps();
    report.switching_count = solver.switchings();
    return report;
}

}  // namespace lostmotion
