// A linear discrete-time system with one input and one output: filters of references and torques.
#pragma once

#include <array>
#include <vector>

#include "slots.hpp"

namespace lostmotion::control {

// z[k+1] = A z[k] + B u[k], y[k] = C z[k] + D u[k]
struct DiscreteSystem {
    std::vector<double> A, B, C;  // row by row
    double D = 1.0;

    static constexpr int max_order = 16;
    int order() const { return static_cast<int>(B.size()); }
    void place(Slots& slots) { first_ = slots.take(order()); }
    double operator()(double u, double* slot) const;

 private:
    int first_ = 0;
};

}  // namespace lostmotion::control
