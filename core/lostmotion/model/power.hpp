// Power flows of a regime, as products of two linear forms, and the stored energies.
#pragma once

#include <string>
#include <vector>

#include "../parts/power.hpp"
#include "assembly.hpp"

namespace lostmotion::model {

struct PowerFlow {
    enum Kind {
        source,  // into the train: motors, torques that depend on an angle
        loss,    // turned into heat
        output,  // to the load
    } kind;
    std::string name;  // of the element, and what it is: "drum: viscous friction"
    Power<Row> power;
};

// What kinetic and elastic energy grow by from one state to another [J].
template <class X>
double stored_change(const Assembly& a, const X& from, const X& to) {
    double sum = 0.0;
    for (const ShaftPlace& s : a.places().shafts) sum += kinetic_energy(s.inertia, from[s.speed], to[s.speed]);
    for (std::size_t g = 0; g < a.train().gears.size(); ++g)
        if (const int d = a.places().gears[g].twist; !a.train().gears[g].rigid())
            sum += a.train().gears[g].law.curve.energy(from[d], to[d]);
    return sum;
}

std::vector<PowerFlow> power_flows(const Assembly& a, const Regime& r);

// Of all flows that there can be: those of a regime in which every contact slips.
std::vector<std::string> flow_names(const Assembly& a);

}  // namespace lostmotion::model
