// What records runs of a drive by either solver. Only core/kernels/drive.cpp takes it.
#pragma once

#include "../solver/adaptive_solver.hpp"
#include "dense_samples.hpp"
#include "run.hpp"
#include "sampler.hpp"

namespace lostmotion {

// Observer of the exact solver that samples, keeps switchings and meters energy.
class Recorder final : public Observer<SwitchedDrive> {
 public:
    Recorder(const Drive& drive, const RunOptions& options, double* out, RunReport& report)
        : sampler_(drive, 0.0, options.sample_interval, options.samples, out, options.channels),
          meter_(drive),
          options_(options),
          report_(report) {
        sampler_.interruption = meter_.interruption() = {options.interrupted, options.interrupted_context};
    }
    void begin(const State& x) { meter_.begin(x); }
    bool segment(const Segment<SwitchedDrive>& s) override {
        return sampler_.segment(s) && (!options_.energy || meter_.segment(s));
    }
    bool flush() override { return sampler_.write(); }
    bool wants_switching() const override { return report_.switchings.size() < options_.max_switchings; }
    void switching(const Switching& s) override { report_.switchings.push_back(s); }
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

// Observer of the adaptive solver.
class AdaptiveRecorder final : public Observer<SwitchedDrive> {
 public:
    AdaptiveRecorder(const Drive& drive, AdaptiveSolver<SwitchedDrive>& solver, const RunOptions& options, double* out,
                     RunReport& report)
        : drive_(drive),
          solver_(solver),
          options_(options),
          out_(out),
          report_(report),
          samples_(options.sample_interval, options.samples) {}

    void step(const Regime& r, const Memory& m, const DenseStepOf<DriveDims>& dense, bool last) override {
        if (!r.in_data) report_.left_data_at = std::fmin(report_.left_data_at, dense.begin);
        samples_.within(dense, last, solver_, [&](std::size_t k, const State& x, const InputsOf<DriveDims>& input) {
            const Reading reading = Reader(drive_, r, m)(x, input);
            for (int c = 0; c < n_channels; ++c) out_[c * options_.samples + k] = reading.value[c];
        });
    }
    bool wants_switching() const override { return report_.switchings.size() < options_.max_switchings; }
    void switching(const Switching& s) override { report_.switchings.push_back(s); }

 private:
    const Drive& drive_;
    AdaptiveSolver<SwitchedDrive>& solver_;
    const RunOptions& options_;
    double* out_;
    RunReport& report_;
    DenseSamples samples_;
};

}  // namespace lostmotion
