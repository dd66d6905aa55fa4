#include "ties.hpp"

#include <algorithm>
#include <iterator>

namespace lostmotion::model {

Shares tied_speed(const ContactPlace& c, const Ties& t) {
    Shares all;
    c.each_shaft([&](int s, double) { t.each_share(s, [&](int k, double) { all.set(k, 0.0); }); });
    Shares speed;
    for (const Share& free : all) {
        double sum = 0.0, size = 0.0;
        c.each_shaft([&](int s, double per) {
            const double part = per * t.of[static_cast<std::size_t>(s)].of(free.shaft);
            sum += part;
            size += std::fabs(part);
        });
        if (std::fabs(sum) > loop_rounding * size) speed.set(free.shaft, sum);
    }
    return speed;
}

// The share whose shaft has the least inertia, with that of all that follow it, as the contact feels it.
static const Share& lightest(const std::vector<Share>& speed, const Ties& t, const double* inertia) {
    const Share* found = nullptr;
    double least = 0.0;
    for (const Share& k : speed) {
        double J = 0.0;
        for (std::size_t s = 0; s < t.of.size(); ++s) {
            const double share = t.of[s].of(k.shaft);
            J += inertia[s] * share * share;
        }
        J /= k.share * k.share;
        if (found != nullptr && !(J < least)) continue;
        found = &k;
        least = J;
    }
    return *found;
}

bool stop_contact(const ContactPlace& c, Ties& t, const double* inertia, const GivenShafts& given) {
    const Shares speed = tied_speed(c, t);
    const auto some = [&](auto&& fits) {
        std::vector<Share> out;
        std::copy_if(speed.begin(), speed.end(), std::back_inserter(out), fits);
        return out;
    };
    const auto is_one_of = [](std::span<const int> shafts, const Share& s) {
        return std::binary_search(shafts.begin(), shafts.end(), s.shaft);
    };
    std::vector<Share> may_follow = some([&](const Share& s) { return !is_one_of(given.shafts, s); });
    if (may_follow.empty() && given.follow) may_follow.assign(speed.begin(), speed.end());
    if (may_follow.empty()) return false;
    const auto massless = some([&](const Share& s) {
        return is_one_of(given.massless, s) &&
               std::any_of(may_follow.begin(), may_follow.end(), [&](const Share& o) { return o.shaft == s.shaft; });
    });
    if (!massless.empty()) may_follow = massless;
    const Share last = inertia != nullptr ? lightest(may_follow, t, inertia) : may_follow.back();
    for (Shares& of : t.of) {
        const double share = of.of(last.shaft);
        if (share == 0.0) continue;
        of.erase(last.shaft);
        for (const Share& k : speed) {
            if (k.shaft == last.shaft) continue;
            const double change = share * (-k.share / last.share), sum = of.of(k.shaft) + change;
            of.set(k.shaft, sum);
            if (!(std::fabs(sum) > loop_rounding * std::fabs(change))) of.erase(k.shaft);
        }
    }
    return true;
}

Ties tie(const std::vector<ContactPlace>& contacts, int shafts, std::span<const std::int8_t> modes,
         const double* inertia, GivenShafts given) {
    Ties t;
    t.of.resize(static_cast<std::size_t>(shafts));
    for (int s = 0; s < shafts; ++s) t.of[static_cast<std::size_t>(s)].set(s, 1.0);
    Flags led;  // shafts that rigid gears tie to a given motion
    for (const int s : given.shafts) led[s] = true;
    for (bool more = !given.shafts.empty(); std::exchange(more, false);)
        for (const ContactPlace& c : contacts) {
            bool some = false, all = true;
            c.each_shaft([&](int s, double) { some = some || led[s], all = all && led[s]; });
            if (!c.bilateral || some == all) continue;
            c.each_shaft([&](int s, double) { led[s] = true; });
            more = true;
        }
    enum { rigid, frame, other };
    const auto turn = [&](const ContactPlace& c) {
        return c.bilateral && led[c.a] ? rigid : c.b == nowhere ? frame : other;
    };
    for (const auto now : {rigid, frame, other})
        for (std::size_t k = 0; k < contacts.size(); ++k)
            if ((k >= modes.size() || modes[k] == 0) && turn(contacts[k]) == now)
                t.redundant[k] = !stop_contact(contacts[k], t, inertia, given);
    for (std::size_t s = 0; s < t.of.size(); ++s)
        if (t.of[s].empty()) t.at_rest[s] = true;
    return t;
}

bool kept_at_rest(const ContactPlace& c, const Ties& t) { return tied_speed(c, t).empty(); }

}  // namespace lostmotion::model
