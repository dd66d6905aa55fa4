// Which speeds the contacts at rest tie together, and which of those contacts are redundant.
//
// Each stuck contact is a linear equation between one or two speeds. A set of such equations has the rank of a gain
// graph: in each part that hangs together, the number of shafts if it is at rest (a shaft is held, or a loop
// contradicts itself), else one less. A contact that does not raise the rank is redundant: its reaction is not
// determined by the motion.
#pragma once

#include <cmath>
#include <vector>

#include "contact_place.hpp"
#include "regime.hpp"

namespace lostmotion::model {

// Ratios in a loop agree within this share.
inline constexpr double loop_rounding = 1e-12;

// What a contact's speed is times that of its leader; both shafts must have the same one.
inline bool moves_in_tie(const ContactPlace& c, const Ties& t, double& speed) {
    const double a = c.per_a * t.factor[c.a], b = c.b == nowhere ? 0.0 : c.per_b * t.factor[c.b];
    speed = a + b;
    return std::fabs(speed) > loop_rounding * (std::fabs(a) + std::fabs(b));
}

// stuck: a contact is at rest where this is 0. Frame contacts come first, so that it is a gear or coupling whose
// torque is redundant where a shaft is held twice.
inline Ties tie(const std::vector<ContactPlace>& contacts, int shafts, const std::int8_t* modes) {
    Ties t;
    std::array<bool, max_shafts> held{};  // by leader
    for (int s = 0; s < shafts; ++s) {
        t.leader[s] = s;
        t.factor[s] = 1.0;
    }
    const auto all_of = [&](int from, int to, double times) {
        for (int s = 0; s < shafts; ++s)
            if (t.leader[s] == from) {
                t.leader[s] = to;
                t.factor[s] = t.factor[s] * times;
            }
    };
    for (const ContactPlace& c : contacts)
        if (c.kind == ContactPlace::shaft && modes[&c - contacts.data()] == 0) held[c.a] = true;
    for (const ContactPlace& c : contacts) {
        const std::size_t k = static_cast<std::size_t>(&c - contacts.data());
        if (c.b == nowhere || modes[k] != 0) continue;
        const int a = t.leader[c.a], b = t.leader[c.b];
        double speed;
        if (a == b) {
            t.redundant[k] = held[a] || !moves_in_tie(c, t, speed);
            held[a] = held[a] || !t.redundant[k];
            continue;
        }
        t.redundant[k] = held[a] && held[b];
        const bool either = held[a] || held[b];
        if (a < b)
            all_of(b, a, -c.per_a * t.factor[c.a] / (c.per_b * t.factor[c.b]));
        else
            all_of(a, b, -c.per_b * t.factor[c.b] / (c.per_a * t.factor[c.a]));
        held[std::min(a, b)] = either;
    }
    for (int s = 0; s < shafts; ++s) t.at_rest[s] = held[t.leader[s]];
    return t;
}

// Is the speed of a contact kept at zero by these ties?
inline bool kept_at_rest(const ContactPlace& c, const Ties& t) {
    if (c.b == nowhere) return t.at_rest[c.a];
    if (t.at_rest[c.a] && t.at_rest[c.b]) return true;
    double speed;
    return t.leader[c.a] == t.leader[c.b] && !moves_in_tie(c, t, speed);
}

}  // namespace lostmotion::model
