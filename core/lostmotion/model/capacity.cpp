#include "capacity.hpp"

namespace lostmotion::model {

std::vector<CapacityShare> shaft_capacity(const Assembly& a, int shaft, double w, const Instant& now,
                                          const double* T_2) {
    const Train& train = a.train();
    std::vector<CapacityShare> shares;
    if (const double T_f = train.shafts[shaft].friction.capacity(w); T_f > 0.0)
        shares.push_back({train.shafts[shaft].name, T_f, T_f});
    for (const ShaftMotor& m : train.motors)
        if (m.shaft == shaft && m.law.friction_torque > 0.0)
            shares.push_back({m.name, m.law.friction_torque, m.law.friction_torque});
    for (const auto& e : a.places().acting)
        if (e->is_dry() && e->shaft == shaft) {
            const double T = e->friction(a.places().instant_of(*e, now), w == 0.0);
            shares.push_back({e->name, T, T});
        }
    for (std::size_t g = 0; g < train.gears.size() && T_2 != nullptr; ++g)
        if (const Gear& gear = train.gears[g]; gear.input == shaft && gear.has_dry_losses())
            shares.push_back({gear.name, gear.loss(gear.sense() * T_2[g], w).torque / gear.reduction(),
                              gear.loss(-gear.sense() * T_2[g], w).torque / gear.reduction()});
    return shares;
}

std::vector<CapacityShare> contact_capacity(const Assembly& a, int contact, const Regime& r, const Instant& now,
                                            const double* T_2) {
    const ContactPlace& c = a.places().contacts[contact];
    const auto k = static_cast<std::size_t>(c.element);
    if (c.kind == ContactPlace::shaft) {
        std::vector<CapacityShare> shares =
            shaft_capacity(a, c.a, r.at_rest[contact] ? 0.0 : now.x[a.places().shafts[k].speed], now, T_2);
        for (std::size_t g = 0; g < a.train().gears.size(); ++g) {
            const Gear& gear = a.train().gears[g];
            if (gear.input != c.a || !gear.over_angle() || r.key.modes[contact] != 0) continue;
            const auto more = [&](int way) {
                return evaluate(a.layout(), a.beyond_corner(static_cast<int>(g), way, r.key, r.output_torque[g]), now);
            };
            if (more(+1) != 0.0 || more(-1) != 0.0) shares.push_back({gear.name, more(+1), more(-1)});
        }
        return shares;
    }
    if (c.kind == ContactPlace::gear || c.kind == ContactPlace::stop) {
        const double h = c.bilateral || c.gap.present() ? std::numeric_limits<double>::infinity()
                                                        : now.memory[a.places().gears[k].hysteresis];
        return {{c.kind == ContactPlace::gear ? a.train().gears[k].name : a.places().name_of(c), h, h}};
    }
    const CouplingElement& law = *a.places().couplings[k];
    CouplingInstant here = a.places().instant_of(law, now);
    if (law.branch != nowhere) here.mode = r.key.branch[law.branch];
    return {{law.name, law.capacity(+1, here, r.at_rest[contact]), law.capacity(-1, here, r.at_rest[contact])}};
}

}  // namespace lostmotion::model
