// How many numbers a drive train has of each kind.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <vector>

#include "../base/few.hpp"
#include "numbers.hpp"

namespace lostmotion {

// Room that is known when the kernel is compiled. Those that a train does not use are zero.
template <int coupled_, int angles_, int inputs_, int memory_, int contacts_, int guards_>
struct Dims {
    static constexpr int coupled = coupled_;    // states that act on one another
    static constexpr int angles = angles_;      // each follows one coupled speed; nothing depends on them
    static constexpr int inputs = inputs_;      // commands and disturbances
    static constexpr int memory = memory_;      // torques that are constant within a regime
    static constexpr int contacts = contacts_;  // dry contacts
    static constexpr int guards = guards_;      // conditions that end a regime, at most

    static constexpr int states = coupled + angles;
    static constexpr int twists = coupled;  // coupled states that are twists of gears, at most

    // A linear form has a coefficient for each state, for 1, for the memory and for each input.
    static constexpr int one = states, first_memory = one + 1, first_input = first_memory + memory,
                         terms = first_input + inputs;

    using Memory = std::array<double, static_cast<std::size_t>(memory)>;
    using Contact = int;
};

// Trains of any size: arrays are as long as they need to be. A number keeps its place: what is a state, the memory or
// an input is told from it as in any other kernel. The places are so many that no train for which there is memory has
// more; arrays over them all do not exist.
struct Any : Dims<1 << 12, 1 << 8, 1 << 12, 1 << 13, 1 << 13, 1 << 12> {
    using Memory = NumbersIn<16>;
};

// How many a train has: of coupled states as many as whole vectors hold.
struct Counts {
    int coupled = 0, angles = 0, inputs = 1, memory = 1;
};
template <class D>
struct CountsIn : D {
    CountsIn() = default;
    explicit CountsIn(const Counts&) {}
};
template <>
struct CountsIn<Any> : Counts {
    CountsIn() = default;
    explicit CountsIn(const Counts& n) : Counts{(n.coupled + 3) / 4 * 4, n.angles, n.inputs, n.memory} {
        if (inputs < 1) inputs = 1;
        if (memory < 1) memory = 1;
    }
};
template <class D>
using CountsOf = CountsIn<D>;

// Calls use(k) for the place of each state.
template <class D, class Use>
void each_state(const CountsOf<D>& n, Use&& use) {
    for (int k = 0; k < n.coupled; ++k) use(k);
    for (int j = 0; j < n.angles; ++j) use(D::coupled + j);
}

// Flags, counts and the like in an array of n: for trains of any size as many as are set.
template <class D, class T, int n>
using ListOf = std::conditional_t<std::same_as<D, Any>, Few<T, 8>, std::array<T, static_cast<std::size_t>(n)>>;
// Larger things in an array of n: for trains of any size, as many as there is asked for.
template <class D, class T, int n>
using ArrayOf = std::conditional_t<std::same_as<D, Any>, std::vector<T>, std::array<T, static_cast<std::size_t>(n)>>;
template <class T, std::size_t n>
void make_room(std::array<T, n>&, int) {}
template <class T, std::size_t few>
void make_room(Few<T, few>& array, int count) {
    array.reach(static_cast<std::size_t>(count));
}
template <int few>
void make_room(NumbersIn<few>& array, int count) {
    array.reach(count);
}
template <class T>
void make_room(std::vector<T>& array, int count) {
    array.resize(static_cast<std::size_t>(count));
}

// As many zeros.
template <std::size_t n>
void clear(std::array<double, n>& numbers, int) {
    numbers = {};
}
template <int few>
void clear(NumbersIn<few>& numbers, int count) {
    double* to = numbers.resized((count + 3) / 4 * 4);
    std::fill_n(to, numbers.size(), 0.0);
}

// Things by the place of a state.
template <class D, class T>
struct ByState : std::array<T, static_cast<std::size_t>(D::states)> {
    void make_room(const CountsOf<D>&) {}
};
template <class T>
struct ByState<Any, T> {
    std::vector<T> coupled, angle;
    void make_room(const CountsOf<Any>& n) {
        coupled.resize(static_cast<std::size_t>(n.coupled));
        angle.resize(static_cast<std::size_t>(n.angles));
    }
    T& operator[](int k) {
        return k < Any::coupled ? coupled[static_cast<std::size_t>(k)]
                                : angle[static_cast<std::size_t>(k - Any::coupled)];
    }
    const T& operator[](int k) const { return const_cast<ByState&>(*this)[k]; }
};

// Which coupled speed each angle follows.
template <class D>
struct AngleSpeeds {
    ListOf<D, int, D::angles> state{};
    int operator[](int angle) const { return state[static_cast<std::size_t>(angle)]; }
    void set(int angle, int speed) { state[static_cast<std::size_t>(angle)] = speed; }
};

// How many of the inputs and of the memory, from the first on, the equations of a regime depend on: where there is room
// for many, few trains have as many.
template <class D>
struct DependsOn {
    int inputs = 1, memory = 1;
    void see_input(int i, double coefficient) { inputs = coefficient != 0.0 && i >= inputs ? i + 1 : inputs; }
    void see_memory(int k, double coefficient) { memory = coefficient != 0.0 && k >= memory ? k + 1 : memory; }
};
template <class D>
    requires(D::inputs <= 2 && D::memory <= 2)
struct DependsOn<D> {
    static constexpr int inputs = D::inputs, memory = D::memory;
    void see_input(int, double) {}
    void see_memory(int, double) {}
};

}  // namespace lostmotion
