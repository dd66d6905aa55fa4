// Samples of the adaptive solver: the instants k * interval that lie within its steps.
#pragma once

#include <cstddef>

#include "../solver/adaptive_solver.hpp"

namespace lostmotion {

class DenseSamples {
 public:
    DenseSamples(double interval, std::size_t samples) : interval_(interval), samples_(samples) {}

    // Calls use(k, state, inputs) for each within a step; the end of the last one belongs to it.
    template <class D, class Solver, class Use>
    void within(const DenseStepOf<D>& step, bool last, Solver& solver, Use&& use) {
        for (; next_ < samples_; ++next_) {
            const double t = static_cast<double>(next_) * interval_;
            if (!(t < step.end || (last && t <= step.end * (1.0 + 1e-15)))) return;
            const StateOf<D> x = step(t);
            use(next_, x, t < step.end ? solver.input_at(t, x) : solver.input_before(t, x));
        }
    }

 private:
    double interval_;  // [s]
    std::size_t samples_, next_ = 0;
};

}  // namespace lostmotion
