// Impacts of rigid flanks: Newton's law at the ends of the gap, and the end of impacts that accumulate.
//
// Let u be the approach speed of the flanks of a gear, the rate at which its gap closes. An impulse P >= 0 between them
// leaves u+ <= -e max(u-, 0), with equality where P > 0. All flanks that touch take part, so the impulses solve a
// linear complementarity problem with the matrix G M^-1 G^T: M is the mass matrix of the speeds that rigid gears leave
// free, G the approach speeds by these. Torques of friction, springs and motors are finite and have no impulse. The
// impulses change the kinetic energy by -sum (u- + u+) P/2, which is never above 0.
//
// With an approach acceleration a > 0, flanks that part at the speed v meet again after 2 v/a, at the speed v, and the
// sum of all further flights is 2 v/(a (1 - e)). Flights that are less high than a millionth of the backlash are
// replaced by contact with the same mean torque: a clock runs for the sum of their durations, and then they touch.
#pragma once

#include <numeric>

#include "../kernel/elimination.hpp"
#include "switched_train.hpp"

namespace lostmotion::model {

// A row of linear equations: coefficients of the unknowns, then right sides.
struct ImpactRow {
    std::vector<double> c;
    friend ImpactRow operator/(ImpactRow row, double a) {
        for (double& v : row.c) v /= a;
        return row;
    }
};
// Solves for as many unknowns as there are rows; their values take the place of the right sides. False: there is no
// unique solution.
inline bool solve_impacts(std::vector<ImpactRow>& rows) {
    std::vector<std::size_t> unknowns(rows.size());
    std::iota(unknowns.begin(), unknowns.end(), std::size_t{0});
    return eliminate(rows, unknowns, rows.size(), [](ImpactRow& f, double factor, const ImpactRow& row) {
        for (std::size_t k = 0; k < f.c.size(); ++k) f.c[k] -= factor * row.c[k];
    });
}

template <class Sizes>
template <class Now>
auto SwitchedTrain<Sizes>::strike(Now& now, const Key& key, int contact, double restitution) const -> MovedShafts {
    constexpr double few_roundings = 8.0 * std::numeric_limits<double>::epsilon();
    std::array<std::int8_t, max_contacts> modes{};
    for (int c = 0; c < contacts(); ++c) modes[c] = places().contacts[c].bilateral ? 0 : 1;
    const Ties ties = places().ties(modes.data());
    const int shafts = static_cast<int>(train().shafts.size());
    std::vector<int> free;
    for (int s = 0; s < shafts; ++s)
        if ((ties.free[s] >> s & 1) != 0 && !places().moves_no_inertia(s, ties)) free.push_back(s);
    const std::size_t n = free.size();
    const auto share = [&](int s, int k) { return (ties.free[s] >> k & 1) != 0 ? ties.share[s][k] : 0.0; };

    struct Flank {
        int contact;
        double before, target;  // approach speed
        std::vector<double> per;
    };
    std::vector<Flank> flanks;
    for (int c = 0; c < contacts(); ++c) {
        const ContactPlace& p = places().contacts[c];
        if (p.flanks == nowhere || !p.may_rest(now.x)) continue;
        const double side = now.x[p.flanks] > 0.0 ? 1.0 : -1.0;
        Flank f{c, 0.0, 0.0, std::vector<double>(n)};
        double size = 0.0;
        p.each_shaft([&](int s, double per) {
            const double speed = side * per * now.x[places().shafts[s].speed];
            f.before += speed;
            size += std::fabs(speed);
            for (std::size_t k = 0; k < n; ++k) f.per[k] += side * per * share(s, free[k]);
        });
        if (key.modes[c] == 0 || std::fabs(f.before) <= few_roundings * size) f.before = 0.0;
        const double e = c == contact ? restitution : train().gears[static_cast<std::size_t>(p.element)].restitution;
        f.target = -e * std::fmax(f.before, 0.0);
        flanks.push_back(std::move(f));
    }
    // M, and M^-1 G^T as columns behind it, one for each of the flanks.
    std::vector<ImpactRow> moves(n);
    for (std::size_t k = 0; k < n; ++k) {
        std::vector<double>& row = moves[k].c;
        row.assign(n, 0.0);
        for (int s = 0; s < shafts; ++s) {
            const double to = share(s, free[k]);
            if (to == 0.0) continue;
            for (std::size_t l = 0; l < n; ++l) {
                row[l] += to * places().shafts[s].inertia * share(s, free[l]);
                places().each_coupled_inertia(s, [&](int t, double J) { row[l] += to * J * share(t, free[l]); });
            }
        }
        for (const Flank& f : flanks) row.push_back(f.per[k]);
    }
    solve_impacts(moves);
    const auto by = [&](std::size_t a, std::size_t b) {
        double sum = 0.0;
        for (std::size_t k = 0; k < n; ++k) sum += flanks[a].per[k] * moves[k].c[n + b];
        return sum;
    };
    std::vector<double> P(flanks.size());
    for (unsigned active = 0; active < 1u << flanks.size(); ++active) {
        std::vector<std::size_t> of;
        for (std::size_t f = 0; f < flanks.size(); ++f)
            if (active >> f & 1) of.push_back(f);
        std::vector<ImpactRow> W(of.size());
        for (std::size_t a = 0; a < of.size(); ++a) {
            for (const std::size_t b : of) W[a].c.push_back(by(of[a], b));
            W[a].c.push_back(flanks[of[a]].before - flanks[of[a]].target);
        }
        bool holds = solve_impacts(W);
        std::fill(P.begin(), P.end(), 0.0);
        for (std::size_t a = 0; a < of.size(); ++a) {
            P[of[a]] = W[a].c.back();
            holds = holds && P[of[a]] >= 0.0;
        }
        for (std::size_t f = 0; f < flanks.size() && holds; ++f) {
            if (active >> f & 1) continue;
            double after = flanks[f].before, size = std::fabs(after);
            for (const std::size_t a : of) {
                after -= by(f, a) * P[a];
                size += std::fabs(by(f, a) * P[a]);
            }
            holds = after <= flanks[f].target + few_roundings * size;
        }
        if (holds) break;
    }
    MovedShafts moved{};
    for (std::size_t f = 0; f < flanks.size(); ++f) {
        if (P[f] == 0.0) continue;
        const ContactPlace& p = places().contacts[flanks[f].contact];
        now.memory[places().gears[static_cast<std::size_t>(p.element)].impact_loss] +=
            0.5 * (flanks[f].before + flanks[f].target) * P[f];
        for (int s = 0; s < shafts; ++s)
            for (std::size_t k = 0; k < n; ++k) {
                const double change = share(s, free[k]) * moves[k].c[n + f] * P[f];
                now.x[places().shafts[s].speed] -= change;
                moved[static_cast<std::size_t>(s)] = moved[static_cast<std::size_t>(s)] || change != 0.0;
            }
    }
    return moved;
}

// The regime after a strike. past: what was before it.
template <class Sizes>
template <class Cache, class Now>
Found SwitchedTrain<Sizes>::find_after(Cache& cache, Now& now, const MovedShafts& struck, Event event, const Now& past,
                                       Key& key) const {
    constexpr double few_roundings = 8.0 * std::numeric_limits<double>::epsilon();
    const Rest before = event.at_rest;
    for (int c = 0; c < contacts(); ++c) {
        const ContactPlace& p = places().contacts[c];
        if (p.bilateral) continue;
        bool moved = false;
        double speed = 0.0, size = 0.0;
        p.each_shaft([&](int shaft, double per) {
            moved = moved || struck[static_cast<std::size_t>(shaft)];
            speed += per * now.x[places().shafts[shaft].speed];
            size += std::fabs(per * now.x[places().shafts[shaft].speed]) +
                    std::fabs(per * past.x[places().shafts[shaft].speed]);
        });
        if (!moved && p.flanks == nowhere) continue;
        const bool same = std::fabs(speed) <= few_roundings * size;
        event.at_rest[c] = same && p.may_rest(now.x);
        const int mode = p.flanks != nowhere || speed < 0.0 ? -1 : +1;
        const GearPlace* gear =
            p.kind == ContactPlace::gear ? &places().gears[static_cast<std::size_t>(p.element)] : nullptr;
        if (gear != nullptr && gear->hysteresis != nowhere && !before[c] && (same || mode != key.modes[c]))
            now.memory[gear->hysteresis] =
                assembly_.stiffness_factor(p.element, key) *
                train().gears[static_cast<std::size_t>(p.element)].law.hysteresis_capacity(now.x[gear->twist]);
        if (!event.at_rest[c] || !before[c]) key.modes[c] = static_cast<std::int8_t>(mode);
    }
    stop(now.x, event.at_rest);
    for (int c = 0; c < contacts(); ++c) event.stopped[c] = event.at_rest[c] && !before[c];
    Now on_the_way = past;
    on_the_way.x = now.x;
    on_the_way.memory = now.memory;
    return find(cache, now, on_the_way, event, key);
}

// How long flanks that have just parted go on to strike; -1 if they do not, or their flights are to be seen.
template <class Sizes>
template <class E, class Now>
double SwitchedTrain<Sizes>::time_to_rest(const E& e, const Now& now, int contact) const {
    constexpr double smallest_height = 1e-6, epsilon = std::numeric_limits<double>::epsilon();
    const ContactPlace& p = places().contacts[contact];
    const double restitution = train().gears[static_cast<std::size_t>(p.element)].restitution;
    const double side = now.x[p.flanks] > 0.0 ? 1.0 : -1.0;
    double v = -side * speed_of(contact, now);
    if (!(v > 0.0) || !(restitution < 1.0)) return -1.0;
    std::decay_t<decltype(regime_of(e).guards[0].form)> approach;
    p.each_shaft([&](int s, double per) { approach.c[places().shafts[s].speed] += side * per; });
    auto along = flow(e, now);
    const double a0 = along.rate(approach, 1), a1 = along.rate(approach, 2), a2 = along.rate(approach, 3);
    if (!(a0 > rounding * along.rate_magnitude(approach, 1))) return -1.0;
    const double first = 2.0 * v / a0, all = first / (1.0 - restitution);
    const bool small = 0.5 * v * v <= smallest_height * 2.0 * p.reach * a0;
    const bool even = std::fabs(a1) * all <= 1e-4 * a0 && std::fabs(a2) * all * all <= 1e-8 * a0;
    if (!(small && even) && first > 1e4 * epsilon * std::fabs(now.time)) return -1.0;
    // Flights under an acceleration that changes little, until it is constant to rounding.
    double t = 0.0;
    for (int flight = 0; flight < 100000; ++flight) {
        const double a = a0 + t * (a1 + 0.5 * t * a2), b = a1 + t * a2, left = 2.0 * v / (a * (1.0 - restitution));
        if (!(a > 0.0)) return all;
        if (std::fabs(b) * left <= epsilon * a || left <= epsilon * t) return t + left;
        double flies = 2.0 * v / a;
        for (int k = 0; k < 6; ++k) flies = 2.0 * (v - b * flies * flies / 6.0) / a;
        v = restitution * (flies * (a + 0.5 * b * flies) - v);
        t += flies;
    }
    return t;
}

template <class Sizes>
template <class Cache, class Now, class G>
Found SwitchedTrain<Sizes>::strikes(Cache& cache, Now& now, const G& fired, Key& key) const {
    const int contact = fired.contact;
    const ContactPlace& p = places().contacts[contact];
    const auto gear = static_cast<std::size_t>(p.element);
    double& clock = now.x[places().gears[gear].clock];
    clock = 0.0;
    if (fired.branch != nowhere) {
        cross(fired, key);
        return Found::yes;
    }
    const auto& old = cache.regime(key);
    Event event;
    for (std::size_t g = 0; g < train().gears.size(); ++g) event.gear[g] = evaluate(n_, old.output_torque[g], now);
    each_coupling_contact([&](int c) { event.coupling[c] = evaluate(n_, old.contact_torque[c], now); });
    std::copy_n(old.at_rest.begin(), contacts(), event.at_rest.begin());
    now.x[p.flanks] = std::copysign(p.reach, now.x[p.flanks]);
    const Now past = now;
    const Key from = key;
    Found found = find_after(cache, now, strike(now, key, contact, train().gears[gear].restitution), event, past, key);
    if (found != Found::yes || key.modes[contact] == 0) return found;
    const double left = time_to_rest(look_up(cache, key), now, contact);
    if (left < 0.0) return found;
    const Now apart = now;
    const Key key_apart = key;
    now = past;
    key = from;
    const MovedShafts all = strike(now, key, contact, 0.0);
    clock = left;
    found = find_after(cache, now, all, event, past, key);
    if (found == Found::yes && key.modes[contact] == 0) return found;
    now = apart;
    key = key_apart;
    return Found::yes;
}

}  // namespace lostmotion::model
