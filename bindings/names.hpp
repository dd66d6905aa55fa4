// The core's tables of names: those of a drive, and what all runs share.
#pragma once

#include "train.hpp"

namespace lostmotion::binding {

inline void bind_names(nb::module_& m) {
    const auto drive = [] { return model::Assembly(model::drive_train()); };
    m.def("channels", [drive] { return channel_rows(train_channels(drive())); }, "Name, symbol, unit, meaning.");
    m.def("states", [drive] { return model::state_names(drive()); });
    m.def("energy_entries", [drive] { return ledger_names(drive()); });
    m.def("switching_columns", [drive] { return switching_columns(drive()); });
    m.def(
        "causes",
        [](bool short_form) {
            std::vector<std::pair<int, std::string>> all;
            for (const SwitchingCause& c : switching_causes(short_form)) all.emplace_back(c.number, c.name);
            return all;
        },
        "short_form"_a, "Of switchings: number and name.");
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
