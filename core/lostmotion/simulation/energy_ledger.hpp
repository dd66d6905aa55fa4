// The energy ledger of a run: what flowed where, and by what the balance fails.
#pragma once

#include <array>

namespace lostmotion {

enum EnergyFlow : int {
    from_source,        // M_D w_M
    in_input_damper,    // b_MR w_M^2
    in_motor_friction,  // T_10 |w_M|
    in_gear,           // (T_1 - T_2/i) w_M: the losses of the mesh; negative where a constant efficiency creates energy
    in_hysteresis,     // H dd/dt
    in_load_damper,    // b_ZR w^2
    in_load_friction,  // dry friction of the load's bearing
    to_load,           // M_Z w
    n_flows
};

struct EnergyLedger {
    std::array<double, n_flows> flow{};                                                     // [J] since the start
    double kinetic_begin = 0.0, kinetic_end = 0.0, elastic_begin = 0.0, elastic_end = 0.0;  // [J]
    double turned_over = 0.0;  // [J] sum of the magnitudes of all flows, panel by panel (or of apparent energies)

    // What the balance fails by [J].
    double residual() const {
        double sum = flow[from_source] - (kinetic_end - kinetic_begin) - (elastic_end - elastic_begin);
        for (int k = from_source + 1; k < n_flows; ++k) sum -= flow[k];
        return sum;
    }
};

// What the ledger says, for everything outside the core; all in J.
struct EnergyEntry {
    const char* name;
    double (*of)(const EnergyLedger&);
};
template <EnergyFlow flow>
double flow_of(const EnergyLedger& e) {
    return e.flow[flow];
}
inline constexpr std::array energy_entries{
    EnergyEntry{"source", flow_of<from_source>},
    EnergyEntry{"input_damper", flow_of<in_input_damper>},
    EnergyEntry{"motor_friction", flow_of<in_motor_friction>},
    EnergyEntry{"gear_losses", flow_of<in_gear>},
    EnergyEntry{"hysteresis", flow_of<in_hysteresis>},
    EnergyEntry{"load_damper", flow_of<in_load_damper>},
    EnergyEntry{"load_friction", flow_of<in_load_friction>},
    EnergyEntry{"load_work", flow_of<to_load>},
    EnergyEntry{"kinetic_change", [](const EnergyLedger& e) { return e.kinetic_end - e.kinetic_begin; }},
    EnergyEntry{"elastic_change", [](const EnergyLedger& e) { return e.elastic_end - e.elastic_begin; }},
    EnergyEntry{"residual", [](const EnergyLedger& e) { return e.residual(); }},
    EnergyEntry{"turned_over", [](const EnergyLedger& e) { return e.turned_over; }},
};
static_assert(energy_entries.size() == n_flows + 4);

}  // namespace lostmotion
