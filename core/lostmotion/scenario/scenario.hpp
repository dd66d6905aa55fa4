// All that a run takes: a drive or a train, what acts on it, its controllers, its state at t = 0, and how long.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "../simulation/train_run.hpp"
#include "control_fields.hpp"

namespace lostmotion {

struct Scenario {
    std::string title;
    enum Form { of_drive, of_train } form = of_drive;
    Drive drive;
    model::Train train;
    std::vector<Signal> inputs;                 // of each input, in their order; those of controllers are not looked at
    std::vector<double> start;                  // states, in their order
    std::vector<double> hysteresis_capacities;  // of each gear [N m]
    Control control;
    // Step by step, and not in descriptions: whether the references of the controllers are inputs, and which inputs,
    // free ones before references, follow the signals of the scenario in the place of what is given.
    bool references_given = false;
    std::vector<bool> played;
    double duration = 1.0, sample_interval = 1e-3;  // [s]

    // Known beforehand in a build for one form alone, once it has passed `check_build`.
    bool is_of_drive() const { return holds(Kernel::drive) && (!holds_trains || form == of_drive); }
    std::size_t samples() const { return static_cast<std::size_t>(duration / sample_interval * (1.0 + 1e-12)) + 1; }
};

inline constexpr double max_samples = 1e8;

// What is wrong where a build holds no kernel for a scenario, or empty.
std::string check_build(Scenario::Form form);

template <class F>
void describe(F& f, Scenario& s) {
    f.text("title", s.title);
    f.choice("form", s.form, 2);
    if (s.form == Scenario::of_drive)
        f.part("drive", [&] { describe(f, s.drive); });
    else
        f.part("train", [&] { model::describe(f, s.train); });
    f.each("inputs", s.inputs, [&](Signal& signal) { describe(f, signal); });
    f.list("start", s.start);
    f.list("hysteresis_capacities", s.hysteresis_capacities, Range::not_negative);
    f.part("control", [&] { describe(f, s.control); });
    f.number("duration", s.duration, Range::positive);
    f.number("sample_interval", s.sample_interval, Range::positive);
}

// States and capacities in their order as a start by name.
TrainStart train_start(const model::Assembly& a, std::span<const double> states, std::span<const double> capacities);

double value_at_start(const Signal& s);

// The inputs that no sampled controller gives, by their numbers among all.
struct FreeInput {
    std::string name;
    std::size_t number;
};
std::vector<FreeInput> free_inputs(const Scenario& s);

// Why references cannot be given step by step, or empty.
std::string check_given_references(const Scenario& s);

// What is wrong with a scenario whose numbers are all in range, or empty.
std::string check(const Scenario& s);

}  // namespace lostmotion
