// Scenarios as numbers that a program without Python reads.
#pragma once

#include <string>
#include <vector>

#include "lostmotion/scenario/description.hpp"
#include "train.hpp"

namespace lostmotion::binding {

inline std::vector<double> scenario_numbers(Scenario s) {
    FieldWriter f;
    describe(f, s);
    return std::move(f.numbers);
}

inline std::vector<double> describe(const Case& one, const std::string& title, double duration, double sample_interval,
                                    const BoundControl& bound) {
    Scenario s;
    s.title = title;
    s.inputs = one.inputs;
    s.duration = duration;
    s.sample_interval = sample_interval;
    s.control = control_of(bound);
    s.train = one.assembly().train();
    for (const std::string& name : model::state_names(one.assembly()))
        s.start.push_back(value_of(one.start.states, name));
    for (const model::Gear& g : s.train.gears)
        s.hysteresis_capacities.push_back(value_of(one.start.hysteresis_capacities, g.name));
    return scenario_numbers(std::move(s));
}

inline std::vector<double> write_description(const std::vector<double>& scenario, const std::vector<Record>& parameters,
                                             const Record& derivation) {
    std::vector<ScenarioParameter> all;
    for (const Record& fields : parameters) all.push_back(described<ScenarioParameter>(fields));
    Derivation of;
    NamedFields f(derivation);
    of.describe(f, 0, 0);
    f.refuse_unknown();
    return ScenarioDescription::write(scenario, std::move(all), std::move(of));
}

inline void bind_descriptions(nb::module_& m) {
    m.def("describe", &describe, "case"_a, nb::kw_only(), "title"_a, "duration"_a, "sample_interval"_a, "control"_a);
    m.def("write_description", &write_description, "scenario"_a, "parameters"_a, "derivation"_a);
}

}  // namespace lostmotion::binding
