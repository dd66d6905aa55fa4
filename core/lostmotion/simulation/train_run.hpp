// A whole run of a train, by the exact or the adaptive solver, in the narrowest kernel that holds it.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "../model/check.hpp"
#include "train_point.hpp"
#include "train_reader.hpp"
#include "train_report.hpp"

namespace lostmotion {

// What is wrong with states by the layout of the assembly, or empty.
std::string check_start(const model::Assembly& a, std::span<const double> start);

// Why a run cannot begin, or empty.
std::string check_run(const model::Assembly& a, std::span<const double> start, const Control& control);

template <class D>
class TrainWatcher;
// What runs of a train leave for the next ones: the regimes that they have met. Runs of another train take the memory.
struct AnyWorkspace {
    explicit AnyWorkspace(const void* kernel) : kernel(kernel) {}
    virtual ~AnyWorkspace() = default;
    // Forgets the regimes of a train that is gone.
    virtual void leave() = 0;

    const void* const kernel;
    const model::Assembly* of = nullptr;  // nullptr: of a train that is gone
};

// These are compiled once for each kernel, by core/kernels.

// By the exact solver. start: the states by the layout of the assembly, or nothing for rest. workspace: of this train
// or one that is gone, made where there is none of this kernel.
template <class D>
TrainReport run_train_exactly_in(const typename TrainReader<D>::Model& model, const std::vector<Signal>& inputs,
                                 std::span<const double> start, std::span<const double> memory,
                                 const TrainOptions& options, double* out, TrainWatcher<D>* watcher,
                                 std::unique_ptr<AnyWorkspace>& workspace);
// By the adaptive solver, to options.tolerance.
template <class D>
TrainReport run_train_adaptively_in(const typename TrainReader<D>::Model& model, const std::vector<Signal>& inputs,
                                    std::span<const double> start, std::span<const double> memory,
                                    const TrainOptions& options, double* out);
// By the exact solver to options.duration, without a record. point: what is there.
template <class D>
TrainReport reach_train_in(const typename TrainReader<D>::Model& model, const std::vector<Signal>& inputs,
                           std::span<const double> start, std::span<const double> memory, const TrainOptions& options,
                           TrainPoint& point);

// States and memory by the layout of the assembly.
inline std::pair<std::vector<double>, std::vector<double>> in_layout(const model::Assembly& a,
                                                                     const TrainStart& start) {
    std::vector<double> x, memory(static_cast<std::size_t>(a.layout().memory));
    for (const std::string& name : model::state_names(a)) x.push_back(value_of(start.states, name));
    const std::vector<model::Gear>& gears = a.train().gears;
    for (std::size_t g = 0; g < gears.size(); ++g) {
        const model::GearPlace& p = a.places().gears[g];
        if (p.hysteresis == model::nowhere) continue;
        memory[static_cast<std::size_t>(p.hysteresis)] = value_of(start.hysteresis_capacities, gears[g].name);
        if (const int locked = a.places().contacts[static_cast<std::size_t>(p.contact)].locked;
            locked != model::nowhere)
            memory[static_cast<std::size_t>(locked)] = a.stiffness_factor(static_cast<int>(g), a.meshes_at(x)) *
                                                       gears[g].law.curve.torque(x[static_cast<std::size_t>(p.twist)]);
    }
    return {x, memory};
}

// A train that has been checked and composed, in the narrowest kernel that holds it.
class TrainRun {
 public:
    // What is wrong with the train, or empty. Then nothing else may be asked for.
    explicit TrainRun(const model::Train& train);
    const model::Fault& fault() const { return fault_; }
    std::string error() const { return fault_.sentence(); }
    const model::Assembly& assembly() const { return *assembly_; }
    const std::vector<TrainChannel>& channels() const { return *channels_; }

    // The narrowest kernel that holds the train.
    const char* kernel() const;
    // What `use` gives in it.
    template <class Use>
    auto in_kernel(const Use& use) const {
        return in_kernel(*assembly_, use);
    }
    template <class Use>
    auto in_kernel(const model::Assembly& assembly, const Use& use) const {
        const model::Train& train = assembly.train();
        const model::Layout& n = assembly.layout();
        const auto in = [&]<class D>(D) {
            const typename TrainReader<D>::Model model{assembly, *channels_};
            return use.template operator()<D>(model);
        };
        if constexpr (holds(Kernel::drive))
            if (model::fits<model::Least>(train, n)) return in(model::Least{});
        if constexpr (holds(Kernel::narrow))
            if (model::fits<model::Narrow>(train, n)) return in(model::Narrow{});
        if constexpr (holds(Kernel::middle))
            if (model::fits<model::Middle>(train, n)) return in(model::Middle{});
        return in(model::Widest{});
    }

    // States and memory by the layout of the assembly.
    std::pair<std::vector<double>, std::vector<double>> in_layout(const TrainStart& start) const {
        return lostmotion::in_layout(*assembly_, start);
    }

    // inputs: one signal each, as model::input_names. out: channels x samples, channel by channel. workspace: as of
    // run_train_exactly_in, of the exact solver.
    TrainReport run(const std::vector<Signal>& inputs, const TrainStart& start, const TrainOptions& options,
                    double* out, std::unique_ptr<AnyWorkspace>& workspace) const {
        const auto [x, memory] = in_layout(start);
        if (options.tolerance > 0.0) return run(inputs, x, memory, options, out);
        return run_exactly(inputs, x, memory, options, out, workspace);
    }
    TrainReport run(const std::vector<Signal>& inputs, const TrainStart& start, const TrainOptions& options,
                    double* out) const {
        const auto [x, memory] = in_layout(start);
        return run(inputs, x, memory, options, out);
    }
    TrainReport run(const std::vector<Signal>& inputs, std::span<const double> start, std::span<const double> memory,
                    const TrainOptions& options, double* out) const {
        if (!(options.tolerance > 0.0)) return run_exactly(inputs, start, memory, options, out);
        // The adaptive solver takes smooth laws as they are.
        return in_kernel(model::Assembly(assembly_->train(), true),
                         [&]<class D>(const typename TrainReader<D>::Model& model) {
                             return run_train_adaptively_in<D>(model, inputs, start, memory, options, out);
                         });
    }
    // By the exact solver, whatever the tolerance.
    TrainReport run_exactly(const std::vector<Signal>& inputs, std::span<const double> start,
                            std::span<const double> memory, const TrainOptions& options, double* out,
                            std::unique_ptr<AnyWorkspace>& workspace) const {
        return in_kernel([&]<class D>(const typename TrainReader<D>::Model& model) {
            return run_train_exactly_in<D>(model, inputs, start, memory, options, out, nullptr, workspace);
        });
    }
    TrainReport run_exactly(const std::vector<Signal>& inputs, std::span<const double> start,
                            std::span<const double> memory, const TrainOptions& options, double* out) const {
        std::unique_ptr<AnyWorkspace> own;
        return run_exactly(inputs, start, memory, options, out, own);
    }

    TrainReport reach(const std::vector<Signal>& inputs, const TrainStart& start, const TrainOptions& options,
                      TrainPoint& point) const {
        const auto [x, memory] = in_layout(start);
        return in_kernel([&, &states = x, &kept = memory]<class D>(const typename TrainReader<D>::Model& model) {
            return reach_train_in<D>(model, inputs, states, kept, options, point);
        });
    }

 private:
    // What of it is too much for any kernel, or nothing.
    static std::string too_large(const model::Train& train, const model::Layout& n) {
        std::string error;
        model::each_size<model::Widest>(train, n, [&](int count, int most, const char* what) {
            if (count > most)
                error += (error.empty() ? "the train has " : ", ") + std::to_string(count) + " " + what + " (at most " +
                         std::to_string(most) + ")";
        });
        return error.empty() ? error : error + "; leave some out";
    }

    model::Fault fault_;
    std::unique_ptr<model::Assembly> assembly_;
    std::unique_ptr<const std::vector<TrainChannel>> channels_;  // readers refer to it, wherever this is moved
};

// Compiled once for each kernel, by core/kernels. TEMPLATE: `extern template` to declare, `template` to compile.
#define LOSTMOTION_TRAIN_RUNS(TEMPLATE, D)                                                                          \
    TEMPLATE TrainReport run_train_exactly_in<D>(                                                                   \
        const TrainReader<D>::Model&, const std::vector<Signal>&, std::span<const double>, std::span<const double>, \
        const TrainOptions&, double*, TrainWatcher<D>*, std::unique_ptr<AnyWorkspace>&);                            \
    TEMPLATE TrainReport reach_train_in<D>(const TrainReader<D>::Model&, const std::vector<Signal>&,                \
                                           std::span<const double>, std::span<const double>, const TrainOptions&,   \
                                           TrainPoint&);
#define LOSTMOTION_ADAPTIVE_RUNS(TEMPLATE, D)                                                                 \
    TEMPLATE TrainReport run_train_adaptively_in<D>(const TrainReader<D>::Model&, const std::vector<Signal>&, \
                                                    std::span<const double>, std::span<const double>,         \
                                                    const TrainOptions&, double*);
#define LOSTMOTION_EACH_KERNEL(DECLARE, TEMPLATE) \
    DECLARE(TEMPLATE, model::Least)               \
    DECLARE(TEMPLATE, model::Narrow)              \
    DECLARE(TEMPLATE, model::Middle)              \
    DECLARE(TEMPLATE, model::Wide)
LOSTMOTION_EACH_KERNEL(LOSTMOTION_TRAIN_RUNS, extern template)
LOSTMOTION_EACH_KERNEL(LOSTMOTION_ADAPTIVE_RUNS, extern template)

}  // namespace lostmotion
