#include "ties.hpp"

namespace lostmotion::model {

unsigned tied_speed(const ContactPlace& c, const Ties& t, std::array<double, max_shafts>& speed) {
    unsigned all = 0;
    c.each_shaft([&](int s, double) { all |= t.free[s]; });
    unsigned moves = 0;
    for (unsigned left = all; left != 0; left &= left - 1) {
        const int k = std::countr_zero(left);
        double sum = 0.0, size = 0.0;
        c.each_shaft([&](int s, double per) {
            const double part = t.free[s] >> k & 1 ? per * t.share[s][k] : 0.0;
            sum += part;
            size += std::fabs(part);
        });
        speed[k] = sum;
        if (std::fabs(sum) > loop_rounding * size) moves |= 1u << k;
    }
    return moves;
}

// The free shaft whose inertia, with that of all that follow it, is least as the contact feels it.
static int lightest(unsigned moves, const std::array<double, max_shafts>& speed, int shafts, const Ties& t,
                    const double* inertia) {
    int found = nowhere;
    double least = 0.0;
    for (unsigned left = moves; left != 0; left &= left - 1) {
        const int k = std::countr_zero(left);
        double J = 0.0;
        for (int s = 0; s < shafts; ++s)
            if (t.free[s] >> k & 1) J += inertia[s] * t.share[s][k] * t.share[s][k];
        J /= speed[k] * speed[k];
        if (found != nowhere && !(J < least)) continue;
        found = k;
        least = J;
    }
    return found;
}

bool stop_contact(const ContactPlace& c, int shafts, Ties& t, const double* inertia, GivenShafts given) {
    std::array<double, max_shafts> speed;
    const unsigned moves = tied_speed(c, t, speed);
    unsigned may_follow = moves & ~given.shafts;
    if (may_follow == 0 && given.follow) may_follow = moves;
    if (may_follow == 0) return false;
    if ((may_follow & given.massless) != 0) may_follow &= given.massless;
    const int last =
        inertia != nullptr ? lightest(may_follow, speed, shafts, t, inertia) : std::bit_width(may_follow) - 1;
    for (int s = 0; s < shafts; ++s) {
        if ((t.free[s] >> last & 1) == 0) continue;
        t.free[s] ^= static_cast<std::uint16_t>(1u << last);
        for (unsigned left = moves ^ 1u << last; left != 0; left &= left - 1) {
            const int k = std::countr_zero(left);
            const auto bit = static_cast<std::uint16_t>(1u << k);
            const double change = t.share[s][last] * (-speed[k] / speed[last]),
                         sum = (t.free[s] & bit) != 0 ? t.share[s][k] + change : change;
            t.share[s][k] = sum;
            t.free[s] |= bit;
            if (!(std::fabs(sum) > loop_rounding * std::fabs(change))) t.free[s] ^= bit;
        }
    }
    return true;
}

Ties tie(const std::vector<ContactPlace>& contacts, int shafts, const std::int8_t* modes, const double* inertia,
         GivenShafts given) {
    Ties t;
    for (int s = 0; s < shafts; ++s) {
        t.free[s] = static_cast<std::uint16_t>(1u << s);
        t.share[s][s] = 1.0;
    }
    enum { rigid, frame, other };
    const auto turn = [&](const ContactPlace& c) {
        return c.bilateral && given.shafts != 0 ? rigid : c.b == nowhere ? frame : other;
    };
    for (const auto now : {rigid, frame, other})
        for (std::size_t k = 0; k < contacts.size(); ++k)
            if (modes[k] == 0 && turn(contacts[k]) == now)
                t.redundant[k] = !stop_contact(contacts[k], shafts, t, inertia, given);
    for (int s = 0; s < shafts; ++s) t.at_rest[s] = t.free[s] == 0;
    return t;
}

bool kept_at_rest(const ContactPlace& c, const Ties& t) {
    std::array<double, max_shafts> speed;
    return tied_speed(c, t, speed) == 0;
}

}  // namespace lostmotion::model
