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
    enum Element { motor, shaft, gear, brake, coupling, angle_torque } element;
    int index;         // of the element
    const char* what;  // "motor", "viscous friction", ...
    Power<Row> power;
};

// Kinetic and elastic energy [J].
template <class X>
double stored_energy(const Assembly& a, const X& x) {
    double sum = 0.0;
    for (const ShaftPlace& s : a.places().shafts) sum += kinetic_energy(s.inertia, x[s.speed]);
    for (std::size_t g = 0; g < a.train().gears.size(); ++g)
        if (!a.train().gears[g].rigid()) sum += a.train().gears[g].law.curve.energy(x[a.places().gears[g].twist]);
    return sum;
}

inline std::vector<PowerFlow> power_flows(const Assembly& a, const Regime& r) {
    const Train& train = a.train();
    const Places& places = a.places();
    const Terms terms(a.layout());
    const auto speed = [&](int s) { return terms.state(places.shafts[s].speed); };
    const auto index = [](std::size_t k) { return static_cast<int>(k); };
    std::vector<PowerFlow> flows;
    for (std::size_t m = 0; m < train.motors.size(); ++m)
        flows.push_back({PowerFlow::source,
                         PowerFlow::motor,
                         index(m),
                         "motor",
                         {r.motor_torque[m], speed(train.motors[m].shaft)}});
    for (std::size_t k = 0; k < train.angle_torques.size(); ++k)
        flows.push_back({PowerFlow::source,
                         PowerFlow::angle_torque,
                         index(k),
                         "torque over angle",
                         {a.angle_torque(index(k), r.key), speed(train.angle_torques[k].shaft)}});
    for (std::size_t s = 0; s < train.shafts.size(); ++s) {
        const ShaftPlace& p = places.shafts[s];
        const Row w = speed(index(s));
        flows.push_back(
            {PowerFlow::loss, PowerFlow::shaft, index(s), "viscous friction", viscous_power(p.viscous_friction, w)});
        if (train.shafts[s].has_drag())
            flows.push_back({PowerFlow::loss, PowerFlow::shaft, index(s), "drag", {a.drag_torque(index(s), r.key), w}});
        if (p.load != nowhere)
            flows.push_back({PowerFlow::output, PowerFlow::shaft, index(s), "load", {terms.input(p.load), w}});
        if (p.contact == nowhere || r.key.modes[p.contact] == 0) continue;
        flows.push_back(
            {PowerFlow::loss, PowerFlow::shaft, index(s), "dry friction", {a.sliding_friction(index(s), r.key), w}});
        for (std::size_t b = 0; b < train.brakes.size(); ++b)
            if (train.brakes[b].shaft == index(s))
                flows.push_back(
                    {PowerFlow::loss, PowerFlow::brake, index(b), "brake", {a.brake_torque(index(b), r.key), w}});
    }
    for (std::size_t g = 0; g < train.gears.size(); ++g) {
        const Gear& gear = train.gears[g];
        Row relative = speed(gear.input);  // to the housing
        if (gear.housing != nowhere) relative -= speed(gear.housing);
        flows.push_back({PowerFlow::loss, PowerFlow::gear, index(g), "mesh",
                         mesh_power(r.input_torque[g], r.output_torque[g], a.per_input(index(g), r.key), relative)});
        if (gear.housing != nowhere && gear.law.viscous_friction > 0.0)
            flows.push_back({PowerFlow::loss,
                             PowerFlow::gear,
                             index(g),
                             "viscous friction",
                             {a.housing_friction(index(g), r), relative}});
        if (gear.rigid() || a.twist_rests(index(g), r)) continue;
        // All of the output torque that is not the spring's.
        const Row rate = a.twist_rate(index(g), r.key);
        flows.push_back({PowerFlow::loss,
                         PowerFlow::gear,
                         index(g),
                         "hysteresis and damping",
                         {r.output_torque[g] - a.spring_torque(index(g), r.key), rate}});
    }
    for (std::size_t k = 0; k < train.couplings.size(); ++k)
        flows.push_back({PowerFlow::loss,
                         PowerFlow::coupling,
                         index(k),
                         "coupling",
                         {r.contact_torque[places.couplings[k].contact],
                          speed(train.couplings[k].input) - speed(train.couplings[k].output)}});
    return flows;
}

// A name that no other flow of the train has: of the element, and of what it is.
inline std::string flow_name(const Assembly& a, const PowerFlow& f) {
    const Train& t = a.train();
    const auto k = static_cast<std::size_t>(f.index);
    const std::string& element = f.element == PowerFlow::motor      ? t.motors[k].name
                                 : f.element == PowerFlow::shaft    ? t.shafts[k].name
                                 : f.element == PowerFlow::gear     ? t.gears[k].name
                                 : f.element == PowerFlow::brake    ? t.brakes[k].name
                                 : f.element == PowerFlow::coupling ? t.couplings[k].name
                                                                    : t.angle_torques[k].name;
    return element + ": " + f.what;
}

// Of all flows that there can be: those of a regime in which every contact slips.
inline std::vector<std::string> flow_names(const Assembly& a) {
    Key key;
    key.modes.fill(1);
    std::vector<std::string> names;
    for (const PowerFlow& f : power_flows(a, a.build(key))) names.push_back(flow_name(a, f));
    return names;
}

}  // namespace lostmotion::model
