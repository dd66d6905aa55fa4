// Runs of trains by the exact solver in the kernel of any size, paused where a test reads them.
#pragma once

#include <optional>

#include "../kernels/solving.hpp"
#include "train_support.hpp"

namespace lostmotion {
LOSTMOTION_SOLVING(extern template, Any)
}  // namespace lostmotion

namespace lostmotion::model {

class TrainRun : Observer<TrainSystem<Any>> {
 public:
    using Switching = SwitchingOf<TrainSystem<Any>>;

    explicit TrainRun(Train train) : assembly(std::move(train)), system_(assembly) {
        now.reach(layout());
        inputs.resize(static_cast<std::size_t>(layout().inputs));
    }

    const Assembly assembly;
    std::vector<Signal> inputs;
    std::vector<Switching> events;  // without jumps of inputs
    Instant now;                    // before the run: its start
    Key key;
    Status status = Status::done;

    const Layout& layout() const { return assembly.layout(); }
    double& speed(int shaft) { return now.x[assembly.places().shafts[shaft].speed]; }
    double& angle(int part) { return now.x[layout().coupled + part]; }
    double& shaft_angle(int shaft) { return now.x[assembly.places().shafts[shaft].angle]; }
    double& twist(int gear) { return now.x[assembly.places().gears[gear].twist]; }
    int command(int motor) const { return assembly.places().motors[motor].command; }
    int load(int shaft) const { return assembly.places().shafts[shaft].load; }
    // The regime of the present key. The reference holds until the key changes.
    const Regime& regime() {
        if (!regime_ || !(regime_->key == key)) regime_.emplace(assembly.build(key));
        return *regime_;
    }
    double value(const Row& f) { return evaluate(layout(), f, now); }
    double acceleration(int shaft) { return value(regime().rate[assembly.places().shafts[shaft].speed]); }
    int mode(int contact) const { return key.modes[contact]; }

    // State and memory of `now`, by the layout.
    std::span<const double> start() const { return {now.x.begin(), static_cast<std::size_t>(layout().states)}; }
    std::span<const double> start_memory() const {
        return {now.memory.begin(), static_cast<std::size_t>(layout().memory)};
    }
    bool begin() {
        solver_.emplace(system_, packed_signals<Any>(inputs), 1e-3, system_.balanced_scale());
        const auto packed = packed_start<Any>(layout(), start(), start_memory());
        return see(solver_->begin(0.0, packed.x, packed.memory));
    }
    // Runs to t_end, from its start if it has not begun; false if no regime follows.
    bool run(double t_end) { return (solver_ || begin()) && see(solver_->advance(t_end, *this)); }

 private:
    bool see(Status s) {
        status = s;
        key = solver_->key();
        now.time = solver_->time();
        unpack_state<Any>(solver_->state(), layout(), now.x.data());
        for (int k = 0; k < layout().memory; ++k) now.memory[k] = solver_->memory()[k];
        const auto input = solver_->input_before(now.time, solver_->state());
        for (int i = 0; i < layout().inputs; ++i) now.input[0][i] = input[i];
        return status == Status::done;
    }
    bool wants_switching() const override { return true; }
    void switching(const Switching& s) override {
        if (!s.input_jump) events.push_back(s);
    }

    const TrainSystem<Any> system_;
    std::optional<ExactSolver<TrainSystem<Any>>> solver_;
    std::optional<Regime> regime_;
};

}  // namespace lostmotion::model
