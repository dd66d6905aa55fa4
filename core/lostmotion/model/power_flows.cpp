#include "power_flows.hpp"

#include "names.hpp"

namespace lostmotion::model {

namespace {

// Calls use(kind, element, what, power) for each flow that there can be. power(regime): the flow in it, or nothing.
template <class Use>
void each_flow(const Assembly& a, Use&& use) {
    using Flow = std::optional<Power<Row>>;
    const Train& train = a.train();
    const Places& places = a.places();
    const Terms terms(a.layout());
    const auto speed = [&](int s) { return terms.state(places.shafts[s].speed); };
    for (std::size_t m = 0; m < train.motors.size(); ++m)
        use(PowerFlow::source, train.motors[m].name, "motor",
            [&](const Regime& r) -> Flow { return {{r.motor_torque[m], speed(train.motors[m].shaft)}}; });
    for (std::size_t k = 0; k < places.driven.size(); ++k)
        use(PowerFlow::source, train.shafts[places.driven[k]].name, "given motion",
            [&](const Regime& r) -> Flow { return {{r.drive_torque[k], speed(places.driven[k])}}; });
    for (const auto& e : places.acting)
        if (e->source() != nullptr)
            use(PowerFlow::source, e->name, law_text(train, e->shaft, e->source()),
                [&](const Regime& r) -> Flow { return {{e->torque(a.site(e->shaft), r.key), speed(e->shaft)}}; });
    for (std::size_t s = 0; s < train.shafts.size(); ++s) {
        const ShaftPlace& p = places.shafts[s];
        const std::string& name = train.shafts[s].name;
        const int shaft = static_cast<int>(s);
        const auto slips = [&p](const Regime& r) { return p.contact != nowhere && r.key.modes[p.contact] != 0; };
        const auto lossy = [shaft](const auto& e) { return e->loss() != nullptr && e->shaft == shaft; };
        use(PowerFlow::loss, name, "viscous friction",
            [&](const Regime&) -> Flow { return viscous_power(p.viscous_friction, speed(shaft)); });
        for (const auto& e : places.acting)
            if (lossy(e) && !e->is_dry())
                use(PowerFlow::loss, e->name, e->loss(),
                    [&](const Regime& r) -> Flow { return {{-e->torque(a.site(shaft), r.key), speed(shaft)}}; });
        for (const auto& e : places.acting)
            if (e->contact != nowhere && e->shaft == shaft)
                use(PowerFlow::loss, e->name, "impacts", [](const Regime&) -> Flow { return {}; });
        if (p.load != nowhere)
            use(PowerFlow::output, name, "load",
                [&](const Regime&) -> Flow { return {{terms.input(p.load), speed(shaft)}}; });
        if (p.contact == nowhere && !has_alias(train, name + ": dry friction")) continue;
        use(PowerFlow::loss, name, "dry friction", [&](const Regime& r) -> Flow {
            if (!slips(r)) return {};
            return {{a.sliding_friction(shaft, r.key), speed(shaft)}};
        });
        for (const auto& e : places.acting)
            if (lossy(e) && e->is_dry())
                use(PowerFlow::loss, e->name, e->loss(), [&](const Regime& r) -> Flow {
                    if (!slips(r)) return {};
                    return {{a.dry_torque(*e, r.key), speed(shaft)}};
                });
    }
    for (std::size_t k = 0; k < train.gears.size(); ++k) {
        const Gear& gear = train.gears[k];
        const int g = static_cast<int>(k);
        const auto relative = [&] {  // to the housing
            Row w = speed(gear.input);
            if (gear.housing != nowhere) w -= speed(gear.housing);
            return w;
        };
        use(PowerFlow::loss, gear.name, "mesh", [&](const Regime& r) -> Flow {
            return mesh_power(r.input_torque[k], r.output_torque[k], a.per_input(g, r.key), relative());
        });
        if (gear.housing != nowhere && gear.law.viscous_friction > 0.0)
            use(PowerFlow::loss, gear.name, "viscous friction on the housing",
                [&](const Regime& r) -> Flow { return {{a.housing_friction(g, r), relative()}}; });
        if (gear.mesh_stiffness.present())
            use(PowerFlow::source, gear.name, "parametric work", [](const Regime&) -> Flow { return {}; });
        if (gear.strikes() || gear.may_lock())
            use(PowerFlow::loss, gear.name, "impacts", [](const Regime&) -> Flow { return {}; });
        if ((gear.rigid() || gear.strikes()) && !has_alias(train, gear.name + ": hysteresis and damping")) continue;
        use(PowerFlow::loss, gear.name, "hysteresis and damping", [&](const Regime& r) -> Flow {
            if (r.twist_rests[g]) return {};
            // All of the output torque that is not the spring's.
            return {{gear.mesh_damping > 0.0 ? r.output_torque[k] - a.spring_torque(g, r.key) : r.gear_hysteresis[k],
                     a.twist_rate(g, r.key)}};
        });
    }
    for (const auto& c : places.couplings) {
        if (c->strikes() != nullptr) use(PowerFlow::loss, c->name, "impacts", [](const Regime&) -> Flow { return {}; });
        use(PowerFlow::loss, c->name, c->loss(),
            [&](const Regime& r) -> Flow { return {{a.coupling_torque(*c, r), speed(c->input) - speed(c->output)}}; });
    }
}

}  // namespace

std::vector<NumberedPower> power_flows(const Assembly& a, const Regime& r) {
    std::vector<NumberedPower> flows;
    int k = 0;
    each_flow(a, [&](PowerFlow::Kind, const std::string&, const auto&, auto&& power) {
        if (auto p = power(r)) {
            r.put_massless_speeds(p->torque);
            r.put_massless_speeds(p->speed);
            flows.push_back({k, *std::move(p)});
        }
        ++k;
    });
    return flows;
}

std::vector<PowerFlow> all_flows(const Assembly& a) {
    std::vector<PowerFlow> flows;
    each_flow(a, [&](PowerFlow::Kind kind, const std::string& element, const auto& what, auto&&) {
        flows.push_back({kind, element + ": " + what});
    });
    return flows;
}

}  // namespace lostmotion::model
