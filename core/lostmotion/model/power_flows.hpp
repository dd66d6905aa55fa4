// Power flows of a regime, as products of two linear forms, and the stored energies.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "../parts/element_powers.hpp"
#include "assembly.hpp"

namespace lostmotion::model {

struct PowerFlow {
    enum Kind {
        source,  // into the train: motors, torques that depend on an angle
        loss,    // turned into heat
        output,  // to the load
    } kind;
    std::string name;  // of the element, and what it is: "drum: viscous friction"
};

// What kinetic and elastic energy grow by from one state to another [J]; before, after: the regimes there, by whose
// angles the stiffness of a mesh may differ.
struct StoredChange {
    double kinetic = 0.0, elastic = 0.0, all = 0.0;

    void add(double StoredChange::* part, double energy) {
        this->*part += energy;
        all += energy;
    }
};
template <class X>
StoredChange stored_change(const Assembly& a, const X& from, const X& to, const Key& before = {},
                           const Key& after = {}) {
    StoredChange sum;
    for (const ShaftPlace& s : a.places().shafts)
        sum.add(&StoredChange::kinetic, kinetic_energy(s.inertia, from[s.speed], to[s.speed]));
    for (const CoupledInertia& c : a.places().coupled_inertias) {
        const int p = a.places().shafts[c.a].speed, q = a.places().shafts[c.b].speed;
        sum.add(&StoredChange::kinetic, coupled_kinetic_energy(c.value, from[p], to[p], from[q], to[q]));
    }
    for (std::size_t g = 0; g < a.train().gears.size(); ++g)
        if (const int d = a.places().gears[g].twist; !a.train().gears[g].rigid() && !a.train().gears[g].strikes()) {
            const TorsionCurve& curve = a.train().gears[g].law.curve;
            const double factor = a.stiffness_factor(static_cast<int>(g), after),
                         step = factor - a.stiffness_factor(static_cast<int>(g), before);
            sum.add(&StoredChange::elastic,
                    factor * curve.energy(from[d], to[d]) + (step == 0.0 ? 0.0 : step * curve.energy(from[d])));
        }
    return sum;
}

// Of the flows of a regime: its number among all that there can be, and the power.
struct NumberedPower {
    int flow;
    Power<Row> power;
};
std::vector<NumberedPower> power_flows(const Assembly& a, const Regime& r);

// All flows that there can be: kind and name.
std::vector<PowerFlow> all_flows(const Assembly& a);

}  // namespace lostmotion::model
