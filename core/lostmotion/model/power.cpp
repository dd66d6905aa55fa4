#include "power.hpp"

namespace lostmotion::model {

std::vector<PowerFlow> power_flows(const Assembly& a, const Regime& r) {
    const Train& train = a.train();
    const Places& places = a.places();
    const Terms terms(a.layout());
    const auto speed = [&](int s) { return terms.state(places.shafts[s].speed); };
    const auto index = [](std::size_t k) { return static_cast<int>(k); };
    std::vector<PowerFlow> flows;
    const auto add = [&](PowerFlow::Kind kind, const std::string& element, const char* what, const Power<Row>& power) {
        flows.push_back({kind, element + ": " + what, power});
    };
    for (std::size_t m = 0; m < train.motors.size(); ++m)
        add(PowerFlow::source, train.motors[m].name, "motor", {r.motor_torque[m], speed(train.motors[m].shaft)});
    for (const auto& e : places.acting)
        if (e->source() != nullptr)
            add(PowerFlow::source, e->name, e->source(), {e->torque(a.site(e->shaft), r.key), speed(e->shaft)});
    for (std::size_t s = 0; s < train.shafts.size(); ++s) {
        const ShaftPlace& p = places.shafts[s];
        const std::string& name = train.shafts[s].name;
        const Row w = speed(index(s));
        const auto lossy = [s](const auto& e) { return e->loss() != nullptr && e->shaft == static_cast<int>(s); };
        add(PowerFlow::loss, name, "viscous friction", viscous_power(p.viscous_friction, w));
        for (const auto& e : places.acting)
            if (lossy(e) && !e->is_dry())
                add(PowerFlow::loss, e->name, e->loss(), {-e->torque(a.site(index(s)), r.key), w});
        if (p.load != nowhere) add(PowerFlow::output, name, "load", {terms.input(p.load), w});
        if (p.contact == nowhere || r.key.modes[p.contact] == 0) continue;
        add(PowerFlow::loss, name, "dry friction", {a.sliding_friction(index(s), r.key), w});
        for (const auto& e : places.acting)
            if (lossy(e) && e->is_dry()) add(PowerFlow::loss, e->name, e->loss(), {a.dry_torque(*e, r.key), w});
    }
    for (std::size_t g = 0; g < train.gears.size(); ++g) {
        const Gear& gear = train.gears[g];
        Row relative = speed(gear.input);  // to the housing
        if (gear.housing != nowhere) relative -= speed(gear.housing);
        add(PowerFlow::loss, gear.name, "mesh",
            mesh_power(r.input_torque[g], r.output_torque[g], a.per_input(index(g), r.key), relative));
        if (gear.housing != nowhere && gear.law.viscous_friction > 0.0)
            add(PowerFlow::loss, gear.name, "viscous friction on the housing",
                {a.housing_friction(index(g), r), relative});
        if (gear.rigid() || a.twist_rests(index(g), r)) continue;
        // All of the output torque that is not the spring's.
        add(PowerFlow::loss, gear.name, "hysteresis and damping",
            {r.output_torque[g] - a.spring_torque(index(g), r.key), a.twist_rate(index(g), r.key)});
    }
    for (const auto& c : places.couplings)
        add(PowerFlow::loss, c->name, c->loss(), {a.coupling_torque(*c, r), speed(c->input) - speed(c->output)});
    return flows;
}

std::vector<std::string> flow_names(const Assembly& a) {
    Key key;
    key.modes.fill(1);
    std::vector<std::string> names;
    for (const PowerFlow& f : power_flows(a, a.build(key))) names.push_back(f.name);
    return names;
}

}  // namespace lostmotion::model
