// What a motion is made of between two instants: the states, then what the system remembers beside them.
#pragma once

#include <array>
#include <utility>
#include <vector>

#include "switching.hpp"

namespace lostmotion {

// Things by the place of a component: those of the states, then D::states and what is remembered.
template <class D, class T>
struct ByComponent : std::array<T, static_cast<std::size_t>(D::states + D::memory)> {};
template <class T>
struct ByComponent<Any, T> {
    std::vector<T> coupled, angle, memory;

    T& operator[](int k) {
        return k < Any::coupled  ? at(coupled, k)
               : k < Any::states ? at(angle, k - Any::coupled)
                                 : at(memory, k - Any::states);
    }
    const T& operator[](int k) const {
        static const T nothing{};
        const auto& part = k < Any::coupled ? coupled : k < Any::states ? angle : memory;
        const auto at = static_cast<std::size_t>(k < Any::coupled  ? k
                                                 : k < Any::states ? k - Any::coupled
                                                                   : k - Any::states);
        return at < part.size() ? part[at] : nothing;
    }

 private:
    static T& at(std::vector<T>& part, int k) {
        if (static_cast<std::size_t>(k) >= part.size()) part.resize(static_cast<std::size_t>(k) + 1);
        return part[static_cast<std::size_t>(k)];
    }
};
template <class D>
using ComponentsOf = ByComponent<D, double>;

// Calls use(k) for the place of each component.
template <class D, class Use>
void each_component(const CountsOf<D>& n, Use&& use) {
    each_state<D>(n, use);
    for (int k = 0; k < n.memory; ++k) use(D::states + k);
}

// Where a motion begins.
template <class D>
struct StartOf {
    StateOf<D> x{};
    typename D::Memory memory{};
};

// Gradient of a form over the components.
template <class D>
ComponentsOf<D> gradient(const LinearForm& f) {
    ComponentsOf<D> g{};
    each_state_of<D>(f, [&](int k, double c) { g[k] = c; });
    for (const auto& [k, c] : f.of_memory()) g[D::states + k] = c;
    return g;
}

// Calls use(k, form) for the rate of each state of a regime, by its place in the kernel.
template <class D, class Regime, class Use>
void each_rate(const Regime& r, Use&& use) {
    for (std::size_t k = 0; k < r.rate.size() && k < D::coupled; ++k) use(static_cast<int>(k), r.rate[k]);
    for (std::size_t j = 0; j < r.angle_rate.size(); ++j) use(D::coupled + static_cast<int>(j), r.angle_rate[j]);
}

// Of the components after a while, by those before.
template <class D>
struct JacobianOf {
    [[no_unique_address]] CountsOf<D> n;
    ByComponent<D, ComponentsOf<D>> row{};

    static JacobianOf identity(const CountsOf<D>& n) {
        JacobianOf j{n};
        each_component<D>(n, [&](int k) { j.row[k][k] = 1.0; });
        return j;
    }
    friend JacobianOf operator*(const JacobianOf& a, const JacobianOf& b) {
        JacobianOf out{a.n};
        each_component<D>(a.n, [&](int r) {
            each_component<D>(a.n, [&](int k) {
                if (std::as_const(a.row)[r][k] == 0.0) return;
                each_component<D>(a.n, [&](int c) { out.row[r][c] += a.row[r][k] * b.row[k][c]; });
            });
        });
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
