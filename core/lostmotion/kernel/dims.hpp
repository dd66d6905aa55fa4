// The dimensions of a drive train, known when the kernel is compiled for it.
#pragma once

#include <array>
#include <cstddef>

namespace lostmotion {

// Which coupled speed each angle follows.
template <class D>
struct AngleSpeeds {
    std::array<int, static_cast<std::size_t>(D::angles)> state{};
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

}  // namespace lostmotion
