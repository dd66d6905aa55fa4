// A whole run of a train, by the exact or the adaptive solver, in the smallest kernel that holds it.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "../model/check.hpp"
#include "kernel.hpp"

namespace lostmotion {

// What is wrong with states by the layout of the assembly, or empty.
std::string check_start(const model::Assembly& a, std::span<const double> start);

// Why a run cannot begin, or empty.
std::string check_run(const model::Assembly& a, std::span<const double> start, const Control& control);

// States and memory by the layout of the assembly.
std::pair<std::vector<double>, std::vector<double>> in_layout(const model::Assembly& a, const TrainStart& start);

// A train that has been checked and composed.
class TrainRun {
 public:
    // What is wrong with the train, or empty. Then nothing else may be asked for.
    explicit TrainRun(const model::Train& train);
    const model::Fault& fault() const { return fault_; }
    std::string error() const { return fault_.sentence(); }
    const model::Assembly& assembly() const { return *assembly_; }
    const std::vector<TrainChannel>& channels() const { return *channels_; }
    TrainModel model() const { return {*assembly_, *channels_}; }
    const Kernel& kernel() const { return *kernel_; }

    std::pair<std::vector<double>, std::vector<double>> in_layout(const TrainStart& start) const {
        return lostmotion::in_layout(*assembly_, start);
    }

    // inputs: one signal each, as model::input_names. out: channels x samples, channel by channel. workspace: as of
    // Kernel::run, of the exact solver.
    TrainReport run(const std::vector<Signal>& inputs, const TrainStart& start, const TrainOptions& options,
                    double* out, std::unique_ptr<Workspace>& workspace) const;
    TrainReport run(const std::vector<Signal>& inputs, const TrainStart& start, const TrainOptions& options,
                    double* out) const;
    TrainReport run(const std::vector<Signal>& inputs, std::span<const double> start, std::span<const double> memory,
                    const TrainOptions& options, double* out) const;
    // By the exact solver, whatever the tolerance.
    TrainReport run_exactly(const std::vector<Signal>& inputs, std::span<const double> start,
                            std::span<const double> memory, const TrainOptions& options, double* out,
                            std::unique_ptr<Workspace>& workspace) const {
        return kernel_->run(model(), {inputs, start, memory}, options, out, workspace);
    }
    TrainReport run_exactly(const std::vector<Signal>& inputs, std::span<const double> start,
                            std::span<const double> memory, const TrainOptions& options, double* out) const {
        std::unique_ptr<Workspace> own;
        return run_exactly(inputs, start, memory, options, out, own);
    }
    TrainReport reach(const std::vector<Signal>& inputs, const TrainStart& start, const TrainOptions& options,
                      TrainPoint& point) const {
        const auto [x, memory] = in_layout(start);
        return kernel_->reach(model(), {inputs, x, memory}, options, point);
    }

 private:
    model::Fault fault_;
    std::unique_ptr<model::Assembly> assembly_;
    std::unique_ptr<const std::vector<TrainChannel>> channels_;  // models refer to it, wherever this is moved
    const Kernel* kernel_ = nullptr;
};

}  // namespace lostmotion
