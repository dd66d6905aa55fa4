// A train step by step, in the narrowest kernel that holds it.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "stepping.hpp"
#include "torque_response.hpp"
#include "train_run.hpp"

namespace lostmotion {

template <class D>
struct OwnTrain {
    explicit OwnTrain(const TrainRun& run) : model{run.assembly(), run.channels()}, own_system(model.assembly) {}
    const typename TrainReader<D>::Model model;
    const model::TrainSystem<D> own_system;
};

// In one kernel.
template <class D>
class TrainSimulationIn : private OwnTrain<D>, public SimulationOf<model::TrainSystem<D>> {
    using Own = OwnTrain<D>;
    using Base = SimulationOf<model::TrainSystem<D>>;

 public:
    TrainSimulationIn(const TrainRun& run, double step, const Control& control, const InputSines& sines);

    bool too_many_guards() const { return Own::own_system.overflowed(); }
    TrainPoint point();
    std::vector<double> values();

    // advance(), and how the state at the end depends on one of the inputs, which is shifted all over the interval:
    // response().
    Status respond(double interval, const typename Base::Inputs& begin, const typename Base::Inputs& end, int shifted);
    const ComponentsOf<D>& response() const { return response_.derivative(); }
    // Copies of the state: that of a substep, and that of the step which it is part of.
    void keep_here() { kept_ = Base::snapshot(); }
    void go_back() { Base::restore(kept_); }
    void keep_begin() { begin_ = Base::snapshot(); }
    void go_back_to_begin() { Base::restore(begin_); }

 private:
    TorqueResponse<model::TrainSystem<D>> response_;
    typename Base::Snapshot kept_, begin_;
};

template <class D>
TrainSimulationIn<D>::TrainSimulationIn(const TrainRun& run, double step, const Control& control,
                                        const InputSines& sines)
    : Own(run),
      Base(Own::own_system, Own::own_system.balanced_scale(), step, run.assembly().layout().inputs, sines),
      response_(Own::own_system) {
    if (control.present())
        Base::close_loop(control,
                         [&](const auto& laws) { return closed_loop_of<D>(Own::model.assembly, control, laws); });
}

template <class D>
Status TrainSimulationIn<D>::respond(double interval, const typename Base::Inputs& begin,
                                     const typename Base::Inputs& end, int shifted) {
    response_.begin(Base::regimes(), shifted);
    return Base::advance(interval, begin, end, response_);
}

template <class D>
TrainPoint TrainSimulationIn<D>::point() {
    const auto& now = Base::snapshot();
    const auto& r = Base::regime();
    return point_of<D>(Own::model, r, now.time, now.x, now.memory, Base::inputs());
}

template <class D>
std::vector<double> TrainSimulationIn<D>::values() {
    const auto& r = Base::regime();
    return TrainReader<D>(Own::model, r, Base::snapshot().memory)(Base::snapshot().x, Base::inputs());
}

// A shaft with a load torque whose angle is a state.
struct LoadShaft {
    int speed_state, angle_state;  // in the kernel
    int load;                      // its load torque, among the inputs
    double inertia;                // [kg m^2]
};

// How a train answers a load torque M over an interval.
struct LoadAnswer {
    double acceleration = 0.0;  // mean a of the shaft [rad/s^2]
    double rounding = 0.0;      // of it, which is a difference of speeds
    double compliance = 0.0;    // -da/dM >= 0 [1/(kg m^2)], M shifted all over the interval; 0: the shaft is held
};

class TrainSimulation {
 public:
    // The train must have passed the check, and its controllers theirs.
    TrainSimulation(const model::Train& train, double step, const Control& control = {}, const InputSines& sines = {});
    const model::Assembly& assembly() const { return run_.assembly(); }
    const std::vector<TrainChannel>& channels() const { return run_.channels(); }

    // use(simulation) with the one of its kernel.
    template <class Use>
    decltype(auto) with(Use&& use) {
        return std::visit([&](auto& s) -> decltype(auto) { return use(*s); }, in_);
    }
    template <class Use>
    decltype(auto) with(Use&& use) const {
        return std::visit([&](const auto& s) -> decltype(auto) { return use(std::as_const(*s)); }, in_);
    }

    double time() const {
        return with([](const auto& s) { return s.time(); });
    }
    // Each input runs in a straight line from its first to its second value.
    Status advance(double interval, std::span<const double> begin, std::span<const double> end);
    // Nothing: the shaft has no load torque, its angle is no state, or a mass matrix joins it to others.
    std::optional<LoadShaft> load_shaft(int shaft) const;
    // advance(), with the answer of a shaft to its load torque.
    Status answer(double interval, std::span<const double> begin, std::span<const double> end, const LoadShaft& shaft,
                  LoadAnswer& out);
    // To t = 0, with the contacts still to be found. Returns what is wrong with the start, or nothing.
    std::string reset(const TrainStart& start);

 private:
    template <class... D>
    struct Kernels {
        using Simulations = std::variant<std::unique_ptr<TrainSimulationIn<D>>...>;
        using Snapshots = std::variant<typename TrainSimulationIn<D>::Snapshot...>;
    };
    using Built =
        std::conditional_t<built == Kernel::all, Kernels<model::Least, model::Narrow, model::Middle, model::Wide>,
                           std::conditional_t<built == Kernel::drive_and_wide, Kernels<model::Least, model::Wide>,
                                              Kernels<model::Widest>>>;

 public:
    // A copy of the state, for this simulation or one of the same train and controllers.
    using Snapshot = typename Built::Snapshots;
    void save(Snapshot& to) const {
        with([&](const auto& s) { to = s.snapshot(); });
    }
    // False: the snapshot is that of another kernel.
    bool restore(const Snapshot& from);

 private:
    TrainRun run_;
    typename Built::Simulations in_;
};

// Compiled once for each kernel, by core/kernels.
#define LOSTMOTION_TRAIN_STEPPING(TEMPLATE, D)          \
    TEMPLATE class Propagator<D>;                       \
    TEMPLATE class Taylor<D>;                           \
    TEMPLATE class Cursor<D>;                           \
    TEMPLATE class LongStep<D>;                         \
    TEMPLATE class Stride<D>;                           \
    TEMPLATE class ExactSolver<model::TrainSystem<D>>;  \
    TEMPLATE class SimulationOf<model::TrainSystem<D>>; \
    TEMPLATE class TrainSimulationIn<D>;
LOSTMOTION_EACH_KERNEL(LOSTMOTION_TRAIN_STEPPING, extern template)

}  // namespace lostmotion
