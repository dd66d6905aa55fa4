// All that a run takes: a train, what acts on it, its controllers, its state at t = 0, and how long.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "../simulation/train_run.hpp"
#include "control_fields.hpp"

namespace lostmotion {

struct Scenario {
    std::string title;
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

    // Before the names of what a controller shows.
    std::string prefix(const ControlledAxis& axis) const {
        return model::shown_name(train, train.motors[static_cast<std::size_t>(axis.motor)].name + "_");
    }
    std::size_t samples() const { return sample_count(duration, sample_interval); }
};

inline constexpr double max_samples = 1e8;

template <class F>
void describe(F& f, Scenario& s) {
    f.text("title", s.title);
    f.part("train", [&] { model::describe(f, s.train); });
    f.each("inputs", s.inputs, [&](Signal& signal) { describe(f, signal); });
    f.list("start", s.start);
    f.list("hysteresis_capacities", s.hysteresis_capacities, Range::not_negative);
    f.part("control", [&] { describe(f, s.control); });
    f.number("duration", s.duration, Range::positive);
    f.number("sample_interval", s.sample_interval, Range::positive);
}

// A train from rest that is stepped, whose controllers are given their references; nothing acts on it.
Scenario stepped_scenario(const model::Train& train, const Control& control = {});

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
