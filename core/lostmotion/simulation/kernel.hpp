// The door to the solver. A kernel solves trains up to its dimensions, which are known when it is compiled; a program
// has the kernels that it is linked with (core/kernels), and takes the smallest that holds a train.
#pragma once

#include <algorithm>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "motion.hpp"
#include "train_report.hpp"

namespace lostmotion {

// Regimes that runs of a train have met, for the next ones.
struct Workspace {
    explicit Workspace(const void* kernel) : kernel(kernel) {}
    virtual ~Workspace() = default;
    // Forgets the regimes of a train that is gone.
    virtual void leave() = 0;

    const void* const kernel;
    const model::Assembly* of = nullptr;  // nullptr: of a train that is gone
};

// What a run begins with. start, memory: by the layout of the train; no start is rest.
struct RunStart {
    const std::vector<Signal>& inputs;
    std::span<const double> start, memory;
};

// What a kernel has room for. Guards are counted regime by regime.
struct KernelSizes {
    int coupled, angles, inputs, memory, contacts, guards;

    bool hold(const model::Train& train, const model::Layout& n) const;
    // What of a train is too much, or nothing.
    std::string excess(const model::Train& train, const model::Layout& n) const;
    friend bool operator<(const KernelSizes& a, const KernelSizes& b) {
        return a.coupled != b.coupled ? a.coupled < b.coupled : a.guards < b.guards;
    }
};

template <class D>
inline constexpr KernelSizes sizes_of{D::coupled, D::angles, D::inputs, D::memory, D::contacts, D::guards};

// What programs are linked with, each for the trains that it has room for. Own: the class that derives from it.
template <class Own>
class Linked {
 public:
    Linked(const char* name, const KernelSizes& sizes) : name_(name), sizes_(sizes) {
        const auto wider = [&](const Own* o) { return sizes < o->sizes(); };
        list().insert(std::ranges::find_if(list(), wider), static_cast<Own*>(this));
    }
    Linked(const Linked&) = delete;
    Linked& operator=(const Linked&) = delete;
    virtual ~Linked() = default;
    const char* name() const { return name_; }
    const KernelSizes& sizes() const { return sizes_; }

    // The smallest first.
    static const std::vector<const Own*>& all() { return list(); }
    // The smallest that holds a train, or the largest. There must be one.
    static const Own& of(const model::Assembly& assembly) {
        for (const Own* o : list())
            if (o->sizes().hold(assembly.train(), assembly.layout())) return *o;
        return *list().back();
    }

 private:
    // Changes while a program starts, never later.
    static std::vector<const Own*>& list() {
        static std::vector<const Own*> linked;
        return linked;
    }

    const char* const name_;
    const KernelSizes sizes_;
};

// Stepping and runs by the exact solver.
class Kernel : public Linked<Kernel> {
 public:
    using Linked::Linked;

    // The train must have passed the check, and its controllers theirs. step: the usual interval [s].
    virtual std::unique_ptr<Motion> motion(const TrainModel& model, double step, const Control& control,
                                           const InputSines& sines) const = 0;
    // out: channels x samples. workspace: of this train or one that is gone, made where there is none of this kernel.
    virtual TrainReport run(const TrainModel& model, const RunStart& start, const TrainOptions& options, double* out,
                            std::unique_ptr<Workspace>& workspace) const = 0;
    // To options.duration, without a record. point: what is there.
    virtual TrainReport reach(const TrainModel& model, const RunStart& start, const TrainOptions& options,
                              TrainPoint& point) const = 0;
};

// Runs by the adaptive solver.
class AdaptiveKernel : public Linked<AdaptiveKernel> {
 public:
    using Linked::Linked;
    // To options.tolerance. out: channels x samples.
    virtual TrainReport run(const TrainModel& model, const RunStart& start, const TrainOptions& options,
                            double* out) const = 0;
};

}  // namespace lostmotion
