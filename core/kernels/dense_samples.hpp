// Samples of the adaptive solver: the instants that lie within its steps.
#pragma once

#include <cstddef>

#include "lostmotion/simulation/sample_times.hpp"
#include "lostmotion/solver/adaptive_solver.hpp"

namespace lostmotion {

class DenseSamples {
 public:
    explicit DenseSamples(const SampleTimes& times) : times_(times) {}

    // Calls use(k, state, inputs) for each within a step; the end of the last one belongs to it.
    template <class D, class Solver, class Use>
    void within(const DenseStepOf<D>& step, bool last, Solver& solver, Use&& use) {
        for (; next_ < times_.count; ++next_) {
            const double t = times_[next_];
            if (!(t < step.end || (last && t <= step.end * (1.0 + 1e-15)))) return;
            const StateOf<D> x = step(t);
            use(next_, x, t < step.end ? solver.input_at(t, x) : solver.input_before(t, x));
        }
    }

 private:
    SampleTimes times_;
    std::size_t next_ = 0;
};

}  // namespace lostmotion
