// Scenarios as numbers that a program without Python reads.
#pragma once

#include <string>
#include <tuple>
#include <vector>

#include "lostmotion/scenario/description.hpp"
#include "train.hpp"

namespace lostmotion::binding {

inline std::vector<double> scenario_numbers(Scenario s) {
    FieldWriter f;
    describe(f, s);
    return std::move(f.numbers);
}

// start: states by name; capacities: of the hysteresis of gears by name. What is left out is 0.
inline std::vector<double> describe(const std::string& title, const TrainDescription& description,
                                    const std::vector<Signal>& inputs, const Named& start, const Named& capacities,
                                    double duration, double interval, const BoundControl& bound) {
    Scenario s;
    s.title = title;
    s.inputs = inputs;
    s.duration = duration;
    s.sample_interval = interval;
    s.control = control_of(bound);
    s.train = description.train;
    for (const std::string& name : model::state_names(model::Assembly(s.train)))
        s.start.push_back(value_of(start, name));
    for (const model::Gear& g : s.train.gears) s.hysteresis_capacities.push_back(value_of(capacities, g.name));
    return scenario_numbers(std::move(s));
}

// Of each parameter its key, unit and value, above which, from which on and up to which it may be, and of each number
// that follows from it the place, whether it follows from the reciprocal value, offset and slope.
using ParameterOfDescription = std::tuple<std::string, std::string, double, std::tuple<double, double, double>,
                                          std::vector<std::tuple<int, bool, double, double>>>;
inline std::vector<double> write_description(const std::vector<double>& scenario,
                                             const std::vector<ParameterOfDescription>& parameters) {
    std::vector<ScenarioParameter> all;
    for (const auto& [key, unit, value, range, effects] : parameters) {
        const auto& [above, at_least, at_most] = range;
        all.push_back({key, unit, value, {}, {above, at_least, at_most}});
        for (const auto& [place, reciprocal, offset, slope] : effects)
            all.back().effects.push_back(
                {place, reciprocal ? Effect::reciprocal : Effect::proportional, offset, slope});
    }
    return ScenarioDescription::write(scenario, std::move(all));
}

inline void bind_descriptions(nb::module_& m) {
    m.def("describe", &describe, "title"_a, "train"_a, "inputs"_a, "start"_a, "hysteresis_capacities"_a, "duration"_a,
          "interval"_a, "control"_a,
          nb::sig("def describe(title: str, train: Train, inputs: collections.abc.Sequence[Signal], start: "
                  "collections.abc.Mapping[str, float], hysteresis_capacities: collections.abc.Mapping[str, float], "
                  "duration: float, interval: float, control: tuple[float, "
                  "collections.abc.Sequence[tuple[Axis, int, int, int, int]]]) -> list[float]"));
    m.def("write_description", &write_description, "scenario"_a, "parameters"_a);
}

}  // namespace lostmotion::binding
