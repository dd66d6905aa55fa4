// Which speeds the contacts at rest tie together, and which of those contacts are redundant.
//
// Each stuck contact is a linear equation between the speeds of one or two shafts, or of three where the housing of a
// gear turns. Each that does not follow from those before it makes one speed follow the others, or stop. One that does
// follow is redundant: its reaction is not determined by the motion.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "contact_place.hpp"
#include "regime.hpp"

namespace lostmotion::model {

// Ratios in a loop agree within this share.
inline constexpr double loop_rounding = 1e-12;

// The speed of a contact in terms of those that are free; what cancels to within rounding is none. False if all does.
inline bool tied_speed(const ContactPlace& c, const Ties& t, std::array<double, max_shafts>& speed) {
    bool moves = false;
    for (int k = 0; k < t.shafts; ++k) {
        double sum = 0.0, size = 0.0;
        c.each_shaft([&](int s, double per) {
            sum += per * t.share[s][k];
            size += std::fabs(per * t.share[s][k]);
        });
        speed[k] = std::fabs(sum) > loop_rounding * size ? sum : 0.0;
        moves = moves || speed[k] != 0.0;
    }
    return moves;
}

// Makes the last of the free shafts that the speed of a contact depends on follow the others.
inline void stop_contact(const ContactPlace& c, std::size_t k, Ties& t) {
    std::array<double, max_shafts> speed;
    t.redundant[k] = !tied_speed(c, t, speed);
    int part = t.part[c.a];
    c.each_shaft([&](int s, double) { part = std::min(part, t.part[s]); });
    c.each_shaft([&](int s, double) { std::replace(t.part.begin(), t.part.begin() + t.shafts, int{t.part[s]}, part); });
    if (t.redundant[k]) return;
    int last = t.shafts - 1;
    while (speed[last] == 0.0) --last;
    for (int s = 0; s < t.shafts; ++s) {
        const double share = std::exchange(t.share[s][last], 0.0);
        for (int free = 0; share != 0.0 && free < last; ++free) {
            if (speed[free] == 0.0) continue;
            const double before = t.share[s][free], change = share * (-speed[free] / speed[last]);
            const double sum = before + change;
            t.share[s][free] = std::fabs(sum) > loop_rounding * std::fabs(change) ? sum : 0.0;
        }
    }
}

// stuck: a contact is at rest where this is 0. Frame contacts come first, so that it is a gear or coupling whose
// torque is redundant where a shaft is held twice.
inline Ties tie(const std::vector<ContactPlace>& contacts, int shafts, const std::int8_t* modes) {
    Ties t;
    t.shafts = shafts;
    for (int s = 0; s < shafts; ++s) {
        t.part[s] = s;
        std::fill_n(t.share[s].begin(), shafts, 0.0);
        t.share[s][s] = 1.0;
    }
    for (const bool frame : {true, false})
        for (std::size_t k = 0; k < contacts.size(); ++k)
            if (modes[k] == 0 && (contacts[k].b == nowhere) == frame) stop_contact(contacts[k], k, t);
    for (int s = 0; s < shafts; ++s)
        t.at_rest[s] = std::all_of(t.share[s].begin(), t.share[s].begin() + shafts, [](double v) { return v == 0.0; });
    return t;
}

// Is the speed of a contact kept at zero by these ties?
inline bool kept_at_rest(const ContactPlace& c, const Ties& t) {
    std::array<double, max_shafts> speed;
    return !tied_speed(c, t, speed);
}

}  // namespace lostmotion::model
