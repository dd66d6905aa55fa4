#include "steady_regime.hpp"

namespace lostmotion {

model::Key key_of(const model::Assembly& a, const SteadyMotion& motion) {
    using namespace model;
    const Train& t = a.train();
    const Places& p = a.places();
    const auto sign = [](double v) { return v > 0.0 ? 1 : v < 0.0 ? -1 : 0; };
    Key key;
    for (std::size_t c = 0; c < p.contacts.size(); ++c) {
        const ContactPlace& place = p.contacts[c];
        const auto k = static_cast<std::size_t>(place.element);
        if (place.kind == ContactPlace::shaft) key.modes[c] = static_cast<std::int8_t>(sign(motion.speed[k]));
        if (place.kind == ContactPlace::gear && !t.gears[k].rigid())
            key.modes[c] = 1;  // hysteresis: its way is the same
    }
    const auto set = [&key](int branch, int at) {
        if (branch != nowhere) key.branch[static_cast<std::size_t>(branch)] = static_cast<std::int16_t>(at);
    };
    for (std::size_t s = 0; s < t.shafts.size(); ++s)
        set(p.shafts[s].friction_piece, t.shafts[s].friction.piece(motion.speed[s]));
    for (std::size_t g = 0; g < t.gears.size(); ++g) {
        const Gear& gear = t.gears[g];
        if (!gear.rigid()) set(p.gears[g].piece, gear.law.curve.piece_at(motion.torque[g]));
        if (!gear.has_dry_losses()) continue;
        const double w = motion.speed[static_cast<std::size_t>(gear.input)];
        const double mu = sign(w) * gear.sense() * motion.torque[g] / gear.rated_torque();
        set(p.gears[g].cell, gear.loss_cell(mu, std::fabs(w) / gear.law.rated_input_speed));
    }
    for (const auto& e : p.acting) set(e->branch, e->locate_steady(motion.speed[static_cast<std::size_t>(e->shaft)]));
    for (const auto& c : p.couplings)
        set(c->branch, c->locate_steady(motion.speed[static_cast<std::size_t>(c->input)] -
                                        motion.speed[static_cast<std::size_t>(c->output)]));
    return key;
}

SteadyRegime steady_regime(model::Train train, const SteadyMotion& motion) {
    model::Train::each_kind(train, [](const char*, const char*, auto& elements) {
        std::erase_if(elements, [](const auto& e) { return model::on_shaft(e)->over_angle(); });
    });
    for (model::Gear& g : train.gears) g.transmission_error = g.mesh_stiffness = {};
    const model::Assembly a(std::move(train));
    const model::Regime r = a.build(key_of(a, motion));
    const int n = a.layout().coupled;
    SteadyRegime out;
    out.determined = r.solvable;
    out.states = model::state_names(a);
    out.states.resize(static_cast<std::size_t>(n));
    for (int k = 0; k < n; ++k)
        for (int j = 0; j < n; ++j)
            out.rate.push_back(r.rate[static_cast<std::size_t>(k)].c[static_cast<std::size_t>(j)]);
    return out;
}

}  // namespace lostmotion
