// What a motion is made of between two instants: the states, then what the system remembers beside them.
#pragma once

#include <array>

#include "switching.hpp"

namespace lostmotion {

template <class D>
inline constexpr int component_count = D::states + D::memory;
template <class D>
using ComponentsOf = std::array<double, static_cast<std::size_t>(component_count<D>)>;

// Where a motion begins.
template <class D>
struct StartOf {
    StateOf<D> x{};
    typename D::Memory memory{};
};

// Gradient of a form over the components.
template <class D>
ComponentsOf<D> gradient(const LinearFormOf<D>& f) {
    ComponentsOf<D> g{};
    for (int k = 0; k < D::states; ++k) g[k] = f.c[k];
    for (int k = 0; k < D::memory; ++k) g[D::states + k] = f.c[D::first_memory + k];
    return g;
}

// Of the components after a while, by those before.
template <class D>
struct JacobianOf {
    static constexpr int n = component_count<D>;
    std::array<ComponentsOf<D>, static_cast<std::size_t>(n)> row{};

    static JacobianOf identity() {
        JacobianOf j;
        for (int k = 0; k < n; ++k) j.row[k][k] = 1.0;
        return j;
    }
    friend JacobianOf operator*(const JacobianOf& a, const JacobianOf& b) {
        JacobianOf out;
        for (int r = 0; r < n; ++r)
            for (int k = 0; k < n; ++k)
                if (a.row[r][k] != 0.0)
                    for (int c = 0; c < n; ++c) out.row[r][c] += a.row[r][k] * b.row[k][c];
        return out;
    }
};

// A switching with all that it goes by.
template <class System>
struct ResetOf {
    using D = typename System::Dims;
    const SwitchingOf<System>& switching;
    const typename System::Regime &before, &after;
    const StateOf<D>& x;  // before it
    const typename D::Memory& memory;
    const std::array<InputsOf<D>, 2>&input, &input_after;  // values and rates, left and right limits
};

// What a reset depends on.
template <class D>
struct ResetRatesOf {
    ComponentsOf<D> by_time{};
    bool exact = true;  // false: where a torque at rest comes to lie is not known to the first order
};

// What only the system can say of its components. A specialisation for each has
//   ComponentLaws(const System&)
//   bool neutral(k): nothing depends on this component, or it follows from the others; a period need not bring it back
//   bool matters(key, k): in this regime it is used
//   double magnitude(k): of a torque that is remembered [N m]
//   double change(k, from, to): over a period; of an angle modulo the period of the torques that depend on it
//   void add(x, memory, k, change): changes a component by as much as it may
//   void rewind(x, memory): takes whole periods off the angles
//   void direct(x, key): lets the contacts that slip do so in the direction of their speeds
//   constraints(key): gradients of what no motion changes, such as the assembly of shafts whose angles matter
//   ResetRatesOf<D> reset(const ResetOf<System>&, JacobianOf<D>& jump): derivatives of what a switching sets anew
template <class System>
class ComponentLaws;

}  // namespace lostmotion
