// The core's tables of names: those of a drive, and what all runs share.
#pragma once

#include "train.hpp"

namespace lostmotion::binding {

inline void bind_names(nb::module_& m) {
    const auto drive = [] { return model::Assembly(model::drive_train()); };
    m.def(
        "aliases_of_drive",
        [] { return rows_of(model::aliases_of_drive(), &model::Alias::name, &model::Alias::shown); },
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
        "causes", [] { return rows_of(switching_causes(), &SwitchingCause::number, &SwitchingCause::name); },
        "Of switchings: number and name.");
    m.def(
        "parameters", [] { return rows_of(model::parameters(), &model::Parameter::key, &model::Parameter::unit); },
        "Of a drive: key and unit.");
    m.def("batch_fields", [] { return each_of(batch_fields(), &BatchField::key); });
    m.def("reductions", [] { return each_of(reduction_names, &ReductionName::name); });
}

}  // namespace lostmotion::binding
