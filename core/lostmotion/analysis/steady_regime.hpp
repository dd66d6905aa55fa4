// The linear regime of a train in steady motion: every dry contact slips the way its shaft turns, clutches are closed,
// brakes open, rigid gears hold. Its eigenvalues say whether such a motion lasts.
//
// Torques over angle, springs and transmission errors are left out: they change within a turn.
#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "../model/names.hpp"

namespace lostmotion {

struct SteadyMotion {
    std::vector<double> speed;   // of each shaft [rad/s]
    std::vector<double> torque;  // T_2 of each gear [N m]
};

struct SteadyRegime {
    std::vector<std::string> states;  // coupled ones, as they are named in results
    std::vector<double> rate;         // d(rate of state k)/d(state j), row by row
    bool determined = true;           // false: no motion or several (rigid gears jam)
};

// Piece of a torsion curve in which it has this torque; of two, the inner one.
inline int piece_at(const TorsionCurve& curve, double torque) {
    int k = 0;
    while (k < curve.outermost_piece() && curve.torque(curve.upper(k)) < std::fabs(torque)) ++k;
    return torque < 0.0 ? -k : k;
}

inline model::Key key_of(const model::Assembly& a, const SteadyMotion& motion) {
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
        if (!gear.rigid()) set(p.gears[g].piece, piece_at(gear.law.curve, motion.torque[g]));
        if (!gear.has_dry_losses()) continue;
        const double w = motion.speed[static_cast<std::size_t>(gear.input)];
        const double mu = sign(w) * motion.torque[g] / gear.rated_torque();
        set(p.gears[g].cell, gear.loss_cell(mu, std::fabs(w) / gear.law.rated_input_speed));
    }
    for (const auto& e : p.acting) set(e->branch, e->locate_steady(motion.speed[static_cast<std::size_t>(e->shaft)]));
    for (const auto& c : p.couplings)
        set(c->branch, c->locate_steady(motion.speed[static_cast<std::size_t>(c->input)] -
                                        motion.speed[static_cast<std::size_t>(c->output)]));
    return key;
}

// The train must have passed the check.
inline SteadyRegime steady_regime(model::Train train, const SteadyMotion& motion) {
    model::Train::each_kind(train, [](const char*, const char*, auto& elements) {
        std::erase_if(elements, [](const auto& e) { return model::on_shaft(e)->over_angle(); });
    });
    for (model::Gear& g : train.gears) g.transmission_error = {};
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
