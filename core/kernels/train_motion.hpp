// A train step by step in one kernel. Only core/kernels takes it.
#pragma once

#include <algorithm>
#include <cmath>

#include "hybrid.hpp"
#include "lostmotion/simulation/kernel.hpp"
#include "stepping.hpp"
#include "torque_response.hpp"
#include "train_reader.hpp"

namespace lostmotion {

template <class D>
class TrainMotion final : public Motion {
 public:
    using System = model::TrainSystem<D>;
    using Simulation = SimulationOf<System>;

    TrainMotion(const TrainModel& model, double step, const Control& control, const InputSines& sines)
        : model_(model),
          system_(model_.assembly),
          simulation_(system_, system_.balanced_scale(), step, layout().inputs, sines),
          response_(system_) {
        if (control.present())
            simulation_.close_loop(control,
                                   [&](const auto& laws) { return closed_loop_of<D>(model_.assembly, control, laws); });
    }

    double time() const override { return simulation_.time(); }
    double state(int k) const override { return now().x[model::state_place<D>(layout(), k)]; }
    void save(MotionState& to) const override;
    void restore(const MotionState& from) override;

    Status advance(double interval, std::span<const double> begin, std::span<const double> end) override {
        return simulation_.advance(interval, inputs(begin), inputs(end));
    }
    Status answer(double interval, std::span<const double> begin, std::span<const double> end, const LoadShaft& shaft,
                  LoadAnswer& out) override;
    void set_reference(std::size_t axis, double value, double rate) override {
        simulation_.set_reference(axis, value, rate);
    }
    void set_interrupt(bool (*poll)(void*), void* context) override { simulation_.set_interrupt(poll, context); }

    Status find_regime() override { return simulation_.find_regime(); }
    TrainPoint point() override {
        const auto& r = simulation_.regime();
        return point_of<D>(model_, r, now().time, now().x, now().memory, simulation_.inputs());
    }
    std::vector<double> values() override {
        const auto& r = simulation_.regime();
        return TrainReader<D>(model_, r, now().memory)(now().x, simulation_.inputs());
    }
    const ControlCourse& control() const override { return now().control; }
    std::size_t control_slots() const override { return static_cast<std::size_t>(simulation_.control_slots()); }
    std::vector<double> control_signals() const override { return simulation_.control_signals(); }
    int stopped_at() const override { return simulation_.stopped_at(); }
    bool too_many_guards() const override { return system_.overflowed(); }
    std::size_t memory() const override { return sizeof(*this); }

    void place(double time, std::span<const double> x, std::span<const double> input) override {
        simulation_.place(time, model::packed_start<D>(layout(), x, {}).x, inputs(input));
    }
    void rates(double* out) override { model::unpack_state<D>(simulation_.rates(), layout(), out); }
    std::size_t guard_count() const override { return simulation_.guard_count(); }
    void guards(double* out) override {
        const auto values = simulation_.guards();
        std::copy_n(values.begin(), guard_count(), out);
    }
    Status settle() override { return simulation_.settle(); }
    double next_tick() const override { return simulation_.next_tick(); }
    bool accept() override { return simulation_.accept(); }

 private:
    const model::Layout& layout() const { return model_.assembly.layout(); }
    const typename Simulation::Snapshot& now() const { return simulation_.snapshot(); }
    static InputsOf<D> inputs(std::span<const double> given) {
        InputsOf<D> out{};
        for (std::size_t i = 0; i < given.size(); ++i) out[i] = given[i];
        return out;
    }

    const TrainModel model_;
    const System system_;
    Simulation simulation_;
    TorqueResponse<System> response_;
};

template <class D>
void TrainMotion<D>::save(MotionState& to) const {
    const typename Simulation::Snapshot& s = now();
    const model::Layout& n = layout();
    const auto first = [](const auto& from, int count, std::vector<double>& numbers) {
        numbers.clear();
        for (int k = 0; k < count; ++k) numbers.push_back(from[k]);
    };
    const auto state = [&](const StateOf<D>& from, std::vector<double>& numbers) {
        numbers.resize(static_cast<std::size_t>(n.states));
        model::unpack_state<D>(from, n, numbers.begin());
    };
    to.time = s.time;
    state(s.x, to.x);
    first(s.memory, n.memory, to.memory);
    first(s.input, n.inputs, to.input);
    to.key = s.key;
    to.key.modes.reach(static_cast<std::size_t>(n.contacts));
    to.key.branch.reach(static_cast<std::size_t>(n.branches));
    to.started = s.started;
    to.steady = s.steady;
    state(s.course.rate, to.rate);
    to.rate_known = s.course.rate_known;
    first(s.course.input, n.inputs, to.rate_input);
    to.twists.clear();
    for (int t = 0; t < system_.n_twists(); ++t) to.twists.push_back(s.course.twist[t]);
    to.control = s.control;
}

template <class D>
void TrainMotion<D>::restore(const MotionState& from) {
    typename Simulation::Snapshot s;
    s.time = from.time;
    const auto start = model::packed_start<D>(layout(), from.x, from.memory);
    s.x = start.x;
    s.memory = start.memory;
    s.key = from.key;
    s.input = inputs(from.input);
    s.started = from.started;
    s.steady = from.steady;
    s.course.rate = model::packed_start<D>(layout(), from.rate, {}).x;
    s.course.rate_known = from.rate_known;
    s.course.input = inputs(from.rate_input);
    for (std::size_t t = 0; t < from.twists.size(); ++t) s.course.twist[t] = from.twists[t];
    s.control = from.control;
    simulation_.restore(s);
}

template <class D>
Status TrainMotion<D>::answer(double interval, std::span<const double> begin, std::span<const double> end,
                              const LoadShaft& shaft, LoadAnswer& out) {
    const double before = state(shaft.speed_state);
    response_.begin(simulation_.regimes(), shaft.load);
    const Status status = simulation_.advance(interval, inputs(begin), inputs(end), response_);
    if (status != Status::done) return status;
    const double after = state(shaft.speed_state);
    out.acceleration = (after - before) / interval;
    out.rounding = 0x1p-52 * std::fmax(std::fabs(before), std::fabs(after)) / interval;
    out.compliance = std::fmax(0.0, -response_.derivative()[shaft.speed_state] / interval);
    return status;
}

}  // namespace lostmotion
