// The core's tables of names.
#pragma once

#include "arrays.hpp"
#include "lostmotion/analysis/batch.hpp"
#include "lostmotion/simulation/result_names.hpp"

namespace lostmotion::binding {

// A column of a table, as a list of strings.
template <class Table>
std::vector<std::string> names_of(const Table& table) {
    std::vector<std::string> names;
    for (const auto& row : table) names.emplace_back(row.name);
    return names;
}

inline void bind_names(nb::module_& m) {
    m.def(
        "channels",
        [] {
            nb::list rows;
            for (const ChannelName& c : channel_names) rows.append(nb::make_tuple(c.name, c.symbol, c.unit, c.meaning));
            return rows;
        },
        nb::sig("def channels() -> list[tuple[str, str, str, str]]"), "Name, symbol, unit, meaning.");
    m.def("states", [] { return names_of(state_names); }, nb::sig("def states() -> list[str]"));
    m.def("contacts", [] { return names_of(contact_names); }, nb::sig("def contacts() -> list[str]"));
    m.def("energy_entries", [] { return names_of(energy_entries); }, nb::sig("def energy_entries() -> list[str]"));
    m.def(
        "causes",
        [] {
            std::vector<std::pair<int, std::string>> all{{input_changed, input_changed_name}};
            for (const Cause& c : causes) all.emplace_back(static_cast<int>(c.value), c.name);
            return all;
        },
        nb::sig("def causes() -> list[tuple[int, str]]"), "Of switchings: number and name.");
    m.def(
        "switching_columns", [] { return names_of(switching_columns()); },
        nb::sig("def switching_columns() -> list[str]"));
    m.def(
        "parameters",
        [] {
            std::vector<std::pair<std::string, std::string>> all;
            for (const Parameter& p : parameters) all.emplace_back(p.key, p.unit);
            return all;
        },
        nb::sig("def parameters() -> list[tuple[str, str]]"), "Of a drive: key and unit.");
    m.def(
        "batch_fields",
        [] {
            std::vector<std::string> keys;
            for (const BatchField& f : batch_fields()) keys.push_back(f.key);
            return keys;
        },
        nb::sig("def batch_fields() -> list[str]"));
    m.def("reductions", [] { return names_of(reduction_names); }, nb::sig("def reductions() -> list[str]"));
}

}  // namespace lostmotion::binding
