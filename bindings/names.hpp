// The core's tables of names: those of a drive, and what all runs share.
#pragma once

#include "train.hpp"

namespace lostmotion::binding {

inline void bind_names(nb::module_& m) {
    const auto drive = [] { return model::Assembly(model::drive_train()); };
    m.def(
        "aliases_of_drive",
        [] {
            std::vector<std::pair<std::string, std::string>> all;
            for (const model::Alias& a : model::aliases_of_drive()) all.emplace_back(a.name, a.shown);
            return all;
        },
        "What the results of a motor, a gearbox and a load are called: name in the long form and name that is shown.");
    m.def("result_name", &model::result_name, "element"_a, "what"_a, "slide"_a,
          "Name of a result variable: NAME_WHAT, of a slide with position, deflection and force.");
    m.def(
        "variables", [drive] { return variable_rows(Variables(drive())); },
        "Of a drive: name, symbol, unit, meaning, whether it is derived.");
    m.def("states", [drive] { return model::state_names(drive()); });
    m.def("energy_entries", [drive] { return ledger_names(drive()); });
    m.def("switching_columns", [drive] {
        const model::Assembly a = drive();
        return SwitchingTable(a).columns();
    });
    m.def(
        "causes",
        [] {
            std::vector<std::pair<int, std::string>> all;
            for (const SwitchingCause& c : switching_causes()) all.emplace_back(c.number, c.name);
            return all;
        },
        "Of switchings: number and name.");
    m.def(
        "parameters",
        [] {
            std::vector<std::pair<std::string, std::string>> all;
            for (const model::Parameter& p : model::parameters()) all.emplace_back(p.key, p.unit);
            return all;
        },
        "Of a drive: key and unit.");
    m.def("batch_fields", [] {
        std::vector<std::string> keys;
        for (const BatchField& f : batch_fields()) keys.push_back(f.key);
        return keys;
    });
    m.def("reductions", [] {
        std::vector<std::string> names;
        for (const auto& row : reduction_names) names.emplace_back(row.name);
        return names;
    });
}

}  // namespace lostmotion::binding
