// Copies between arrays in the order of a layout and the vectors of a kernel.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "lostmotion/kernel/inputs.hpp"
#include "lostmotion/model/assembly.hpp"
#include "lostmotion/solver/components.hpp"

namespace lostmotion::model {
// Index, in a state of the kernel, of state k of the layout: coupled states stand first, in D::coupled places.
template <class D>
int state_place(const Layout& n, int k) {
    return k < n.coupled ? k : D::coupled + k - n.coupled;
}

inline Counts counts_of(const Layout& n) { return {n.coupled, n.angles, n.inputs, n.memory}; }

// Writes a state of the kernel to `to`, in the order of the layout.
template <class D, class State, class To>
void unpack_state(const State& x, const Layout& n, To to) {
    for (int k = 0; k < n.states; ++k) *to++ = x[state_place<D>(n, k)];
}

// Signals of the inputs, at least one.
template <class D>
SignalsOf<D> packed_signals(const std::vector<Signal>& inputs) {
    SignalsOf<D> signals;
    make_room(signals, std::max(1, static_cast<int>(inputs.size())));
    std::copy(inputs.begin(), inputs.end(), signals.begin());
    return signals;
}
// Start of a run. x: states in the order of the layout; empty: rest.
template <class D>
StartOf<D> packed_start(const Layout& n, std::span<const double> x, std::span<const double> memory) {
    StartOf<D> start;
    make_room<D>(start.x, CountsOf<D>(counts_of(n)));
    for (std::size_t k = 0; k < x.size(); ++k) start.x[state_place<D>(n, static_cast<int>(k))] = x[k];
    for (std::size_t k = 0; k < memory.size(); ++k) start.memory[k] = memory[k];
    return start;
}

}  // namespace lostmotion::model
