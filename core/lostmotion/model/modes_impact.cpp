// What impulses do: impacts of rigid flanks, the end of impacts that accumulate, and rigid gears that lock in motion.
//
// With an approach acceleration a > 0, flanks of one gear that part at the speed v meet again after 2 v/a, at the speed
// v, and the sum of all further flights is 2 v/(a (1 - e)). Flights that are less high than a share of the backlash are
// replaced by contact with the same mean torque: a clock runs for the sum of their durations, and then they touch. It
// does not run down where none of those that fly loses energy (e = 1).
//
// Flanks of several gears strike in turn. Let K be the kinetic energy of their approach speeds u, delta their gaps,
// lambda the torques that would press them if all touched. K + sum lambda delta is constant in flight and falls with
// each impact, so that no later gap of a gear exceeds (K + sum lambda delta)/lambda.
#include <bit>

#include "impulses.hpp"
#include "switched_train.hpp"

namespace lostmotion::model {

// Flanks have a gap if it is more than rounding makes of it, in space or in time.
bool SwitchedTrain::has_gap(int contact, const Instant& now) const {
    const ContactPlace& p = places().contacts[contact];
    return p.gap.left(now) > rounding * p.gap.size() + time_rounding * std::fabs(now.time * speed_of(contact, now));
}

// Do flanks close their gap, by more than rounding?
bool SwitchedTrain::approach(int contact, const Instant& now) const {
    double speed = 0.0, size = 0.0;
    places().contacts[contact].each_shaft([&](int s, double per) {
        speed += per * now.x[places().shafts[s].speed];
        size += std::fabs(per * now.x[places().shafts[s].speed]);
    });
    return places().contacts[contact].gap.side_of(now) * speed > 8.0 * std::numeric_limits<double>::epsilon() * size;
}

double SwitchedTrain::speed_of(int contact, const Instant& now) const {
    double speed = 0.0;
    places().contacts[contact].each_shaft([&](int s, double per) { speed += per * now.x[places().shafts[s].speed]; });
    return speed;
}

// Those that touch, and those that have no gap to be seen.
Impulses SwitchedTrain::impulses(const Instant& now, const Key& key) const {
    std::vector<double> speeds(train().shafts.size());
    for (std::size_t s = 0; s < train().shafts.size(); ++s) speeds[s] = now.x[places().shafts[s].speed];
    const Ties ties = places().ties(key.modes);
    std::vector<Flank> flanks;
    for (int c = 0; c < contacts(); ++c) {
        const ContactPlace& p = places().contacts[c];
        if (!p.gap.present()) continue;
        const bool apart = has_gap(c, now);
        if (apart && p.gap.left(now) > least_flight_ * p.gap.size()) continue;
        // While impacts accumulate flanks count as touching, but have a gap. Where others keep them at rest, it is open
        // whether they press.
        const bool touches = !(now.x[p.gap.clock] > 0.0) && (key.modes[c] == 0 || (!apart && kept_at_rest(p, ties)));
        flanks.push_back({c, p.gap.side_of(now), p.gap.restitution, apart, touches});
    }
    return Impulses(places(), std::move(flanks), speeds);
}

// The regime after impulses. past: what was before them.
Found SwitchedTrain::land(Instant& now, const Impulses& after, Event event, const Instant& past, Key& key) {
    const Rest before = event.at_rest;
    MovedShafts moved{};
    const auto changes = after.changes();
    for (std::size_t s = 0; s < train().shafts.size(); ++s) {
        now.x[places().shafts[s].speed] += changes[s];
        moved[s] = changes[s] != 0.0;
    }
    for (const Flank& f : after.flanks) {
        const ContactPlace& p = places().contacts[f.contact];
        if (f.struck) now.x[p.gap.at] = p.gap.end(f.side, now);
        event.at_rest[f.contact] = f.touches || (f.speed == 0.0 && p.may_rest(now));
        if (f.struck || !event.at_rest[f.contact]) now.x[p.gap.clock] = f.accumulates ? 1.0 : 0.0;
        now.memory[p.gap.impact_loss] += f.loss;
        if (!event.at_rest[f.contact] || !before[f.contact]) key.modes[f.contact] = -1;
    }
    return find_after(now, moved, event, before, past, key);
}

// The regime after some speeds have jumped. Of flanks the event says whether they rest. before: the contacts at rest
// before it.
Found SwitchedTrain::find_after(Instant& now, const MovedShafts& moved, Event event, const Rest& before,
                                const Instant& past, Key& key) {
    constexpr double few_roundings = 8.0 * std::numeric_limits<double>::epsilon();
    for (int c = 0; c < contacts(); ++c) {
        const ContactPlace& p = places().contacts[c];
        if (p.bilateral || p.gap.present()) continue;
        bool moves = false;
        double speed = 0.0, size = 0.0;
        p.each_shaft([&](int shaft, double per) {
            moves = moves || moved[static_cast<std::size_t>(shaft)];
            speed += per * now.x[places().shafts[shaft].speed];
            size += std::fabs(per * now.x[places().shafts[shaft].speed]) +
                    std::fabs(per * past.x[places().shafts[shaft].speed]);
        });
        if (!moves) continue;
        const bool same = std::fabs(speed) <= few_roundings * size;
        event.at_rest[c] = same;
        const int mode = speed < 0.0 ? -1 : +1;
        const GearPlace* gear =
            p.kind == ContactPlace::gear ? &places().gears[static_cast<std::size_t>(p.element)] : nullptr;
        if (gear != nullptr && gear->hysteresis != nowhere && !before[c] && (same || mode != key.modes[c]))
            now.memory[gear->hysteresis] =
                assembly_.stiffness_factor(p.element, key) *
                train().gears[static_cast<std::size_t>(p.element)].law.hysteresis_capacity(now.x[gear->twist]);
        if (!same || !before[c]) key.modes[c] = static_cast<std::int8_t>(mode);
    }
    stop(now, event.at_rest);
    for (int c = 0; c < contacts(); ++c) event.stopped[c] = event.at_rest[c] && !before[c];
    const auto on_the_way = [&, x = now.x, memory = now.memory] {
        Instant out = past;
        out.x = x;
        out.memory = memory;
        return out;
    };
    return find(now, on_the_way, event, key);
}

// How long flanks of one gear that have just parted go on to strike; -1 if they do not, or their flights are to be
// seen.
double SwitchedTrain::time_to_rest(const SparseRegime& r, const Instant& now, int contact) {
    constexpr double epsilon = std::numeric_limits<double>::epsilon();
    const ContactPlace& p = places().contacts[contact];
    const double restitution = p.gap.restitution, side = p.gap.side_of(now);
    double v = -side * speed_of(contact, now);
    if (!(v > 0.0)) return -1.0;
    Row row;
    p.each_shaft([&](int s, double per) { row.c[places().shafts[s].speed] += side * per; });
    const OwnForm approach(row, assembly_.layout());
    SparseFlow along(r.rate, now, room_);
    const double a0 = along.rate(approach, 1), a1 = along.rate(approach, 2), a2 = along.rate(approach, 3);
    if (!(a0 > rounding * along.rate_magnitude(approach, 1))) return -1.0;
    const bool elastic = !(restitution < 1.0);
    const double first = 2.0 * v / a0, all = elastic ? first : first / (1.0 - restitution);
    const bool small = 0.5 * v * v <= least_flight_ * p.gap.size() * a0;
    const bool even = std::fabs(a1) * all <= 1e-4 * a0 && std::fabs(a2) * all * all <= 1e-8 * a0;
    if (!(small && even) && first > unresolved * std::fabs(now.time)) return -1.0;
    if (elastic) return for_ever;
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

// The same of all flanks that strike in turn, and are pressed in this regime, in which they touch. energy: K. before:
// where their gaps were.
double SwitchedTrain::time_to_rest(const SparseRegime& r, const Instant& now, const Instant& before,
                                   const Impulses& joined, double energy) {
    SparseFlow along(r.rate, now, room_);
    struct Pressed {
        // most: the gap that counts as none; flight: its duration, by sqrt(energy); flights: of all, or without end
        double torque, rate, most, flight, flights;
    };
    std::vector<Pressed> all;
    for (std::size_t f = 0; f < joined.flanks.size(); ++f) {
        const Flank& flank = joined.flanks[f];
        if (!flank.accumulates && !(flank.struck && flank.touches)) continue;
        const ContactPlace& p = places().contacts[flank.contact];
        const auto& form = r.contact_torque[static_cast<std::size_t>(flank.contact)];
        const double torque = flank.side * evaluate(form, now);
        if (!(torque > rounding * magnitude(form, now))) return -1.0;
        energy += torque * p.gap.left(before);
        all.push_back({torque, along.rate(form, 1), least_flight_ * p.gap.size(),
                       2.0 * std::sqrt(2.0 * joined.inertia(f)) / torque, 1.0 / (1.0 - flank.restitution)});
    }
    double time = 0.0;
    for (const Pressed& p : all)
        time = std::fmax(time, p.flight * std::sqrt(energy) * (std::isfinite(p.flights) ? p.flights : 1.0));
    const bool small = std::all_of(all.begin(), all.end(), [&](const Pressed& p) {
        return energy <= p.most * p.torque && std::fabs(p.rate) * time <= 1e-4 * p.torque;
    });
    if (!small && !(time <= unresolved * std::fabs(now.time))) return -1.0;
    // Where one that flies loses energy, the others strike ever less, too.
    const bool loses = std::any_of(joined.flanks.begin(), joined.flanks.end(),
                                   [](const Flank& f) { return f.accumulates && f.restitution < 1.0; });
    return loses ? time : for_ever;
}

Found SwitchedTrain::strikes(Instant& now, const Guard& fired, Key& key) {
    const int contact = fired.contact;
    const ContactPlace& p = places().contacts[contact];
    now.x[p.gap.clock] = 0.0;
    if (fired.branch != nowhere) {
        cross(fired, key);
        return Found::yes;
    }
    now.x[p.gap.at] = p.gap.end(p.gap.side_of(now), now);
    double first = 0.0;
    for (int round = 0;; ++round) {
        const auto& old = regimes_[key];
        Event event;
        event.from = key;
        for (std::size_t g = 0; g < train().gears.size(); ++g) event.gear[g] = evaluate(old.output_torque[g], now);
        each_coupling_contact([&](int c) { event.coupling[c] = evaluate(old.contact_torque[c], now); });
        for (int c = 0; c < contacts(); ++c) event.at_rest[c] = old.at_rest[c];
        const Instant past = now;
        const Key from = key;
        Impulses struck = impulses(now, key);
        const double approach = struck.approach();
        if (round == 0) first = approach;
        // Speeds that have come to nothing end with all flanks together, so far as these press.
        const bool last = round >= most_rounds || approach <= negligible * first;
        struck.strike(last);
        const Found found = land(now, struck, event, past, key);
        if (found != Found::yes || last || close(now, struck, contact, event, past, from, key)) return found;
        if (struck.approach() == 0.0) return found;
    }
}

// Lets flanks touch whose flights are negligible: all that fly that low, or else ever fewer, or the struck ones alone.
// False if there are none.
bool SwitchedTrain::close(Instant& now, const Impulses& struck, int contact, const Event& event, const Instant& past,
                          const Key& from, Key& key) {
    const Instant apart = now;
    const Key key_apart = key;
    const std::size_t m = struck.flanks.size();
    const auto flies = [&](std::size_t f) { return key_apart.modes[struck.flanks[f].contact] != 0; };
    Impulses joined = struck;
    // Do those that are to accumulate rest together with those that touch, while no others strike? left: finds for how
    // long they go on to strike.
    const auto rest = [&](auto&& left) {
        std::vector<bool> some(m);
        for (std::size_t f = 0; f < m; ++f) some[f] = joined.flanks[f].accumulates || !flies(f);
        const double energy = joined.join(some);
        now = past;
        key = from;
        bool rests = land(now, joined, event, past, key) == Found::yes && !(joined.approach() > 0.0);
        for (std::size_t f = 0; f < m; ++f) rests = rests && (!some[f] || key.modes[joined.flanks[f].contact] == 0);
        const double time = rests ? left(energy) : -1.0;
        if (!(time >= 0.0)) return false;
        for (const Flank& f : joined.flanks)
            if (f.accumulates) now.x[places().contacts[f.contact].gap.clock] = time;
        return true;
    };
    std::vector<bool> set(m);
    for (std::size_t f = 0; f < m; ++f) set[f] = flies(f);
    while (true) {
        const auto several = std::count(set.begin(), set.end(), true);
        joined = struck;
        bool own = false;
        for (std::size_t f = 0; f < m; ++f) {
            joined.flanks[f].accumulates = set[f];
            own = own || (set[f] && joined.flanks[f].contact == contact);
        }
        if (several == 0 || (several == 1 && own)) break;
        if (rest([&](double energy) { return time_to_rest(regimes_[key], now, apart, joined, energy); })) return true;
        // Those that would part do not belong to them, or that which strikes or parts with the most energy.
        bool part = false;
        std::size_t most = m;
        for (std::size_t f = 0; f < m; ++f) {
            if (!set[f]) continue;
            const auto size = [&](std::size_t k) {
                return std::fabs(struck.flanks[k].speed) * std::sqrt(struck.inertia(k));
            };
            if (most == m || size(f) > size(most)) most = f;
            if (key.modes[struck.flanks[f].contact] == 0) continue;
            set[f] = false;
            part = true;
        }
        if (!part) set[most] = false;
    }
    now = apart;
    key = key_apart;
    if (key.modes[contact] == 0 || struck.approach() > 0.0) return false;
    const double left = time_to_rest(regimes_[key], now, contact);
    if (left < 0.0) return false;
    joined = struck;
    for (Flank& f : joined.flanks) f.accumulates = f.contact == contact;
    if (rest([&](double) { return left; })) return true;
    now = apart;
    key = key_apart;
    return false;
}

// Friction that grows with the load may lock a rigid gear in motion (theory.md): where no accelerations are consistent,
// the torque in ever stiffer meshes grows without limit in no time, and stops its input shaft with all that rigid gears
// tie to it. Contacts of limited torque take no part in that.
Found SwitchedTrain::locks(Instant& now, const Event& event, const Instant& past, Key& key) {
    const Instant moving = now;
    const Key from = key;
    Event after = event;
    after.with_guard = false;  // the regime that has ended may follow from rest
    constexpr std::size_t most_at_once = 6;
    std::vector<std::size_t> may;
    for (std::size_t g = 0; g < train().gears.size() && may.size() < most_at_once; ++g)
        if (train().gears[g].may_lock() && locks_in_motion(moving, event, from, g)) may.push_back(g);
    // One of them is where the old regime does not hold any more: a stop elsewhere might free it by what a damper does.
    std::size_t near = 0;
    const Flags fails = parts_that_fail(moving, event, from);
    const std::vector<int> part = parts_at(event);
    for (std::size_t k = 0; k < may.size(); ++k)
        if (fails[part[train().gears[may[k]].input]]) near |= std::size_t{1} << k;
    // As few as can be. Of several ways it is only known where they end the same.
    for (std::size_t many = 1; many <= may.size(); ++many) {
        Instant stopped = now;
        Key stopped_key = key;
        bool some = false, differ = false;
        for (std::size_t set = 1; set < std::size_t{1} << may.size(); ++set) {
            if (static_cast<std::size_t>(std::popcount(set)) != many || (near != 0 && (set & near) == 0)) continue;
            now = moving;
            MovedShafts moved{};
            std::vector<Flags> joined(may.size());
            Slowed slowed = Slowed::joined;
            bool goes_on = false;
            while (slowed == Slowed::joined && !goes_on) {
                slowed = Slowed::stopped;
                for (std::size_t k = 0; k < may.size() && slowed != Slowed::impossible; ++k)
                    if ((set >> k & 1) != 0) slowed = std::max(slowed, slow_down(now, may[k], joined[k], moved));
                if (slowed == Slowed::impossible) break;
                const Instant there = now;
                key = from;
                goes_on = find_after(now, moved, after, event.at_rest, past, key) == Found::yes;
                if (!goes_on) now = there;
            }
            // With what has joined it need not stop; how fast it goes on then depends on impulses within the meshes.
            goes_on = goes_on && slowed == Slowed::stopped;
            if (!goes_on) continue;
            differ = differ || (some && !(key == stopped_key && now.x == stopped.x));
            if (!some) stopped = now, stopped_key = key;
            some = true;
        }
        now = some && !differ ? stopped : moving;
        key = some && !differ ? stopped_key : from;
        if (some) return differ ? Found::inconsistent : Found::yes;
    }
    return Found::inconsistent;
}

// Parts of the train, by `parts_at`, in which a contact or the loss law of a gear leaves a regime.
Flags SwitchedTrain::parts_that_fail(const Instant& now, const Event& event, const Key& from) {
    const SparseRegime& r = regimes_[from];
    const std::vector<int> part = parts_at(event);
    SparseFlow along(r.rate, now, room_);
    Flags fails;
    for (std::size_t g = 0; g < r.guards.size(); ++g) {
        const Guard& guard = r.guards[g];
        const auto [value, size] = sized(guard.form, now);
        if (value > clear_of_zero * size + r.near_event[g] || sign_after(along, guard.form, value, size).sign >= 0)
            continue;
        if (guard.is_of_contact()) fails[part[places().contacts[guard.contact].a]] = true;
        for (std::size_t k = 0; k < train().gears.size() && guard.branch != nowhere; ++k)
            if (guard.branch == places().gears[k].cell || guard.branch == places().gears[k].cell_back)
                fails[part[train().gears[k].input]] = true;
    }
    return fails;
}

// The contact of the gear that is to be named where no combination of modes is consistent: a given motion drives it
// against its locking, or it might lock in motion, but the rule above does not apply.
int SwitchedTrain::jams(const Instant& now, const Event& event, const Key& from) {
    const auto first = [&](auto&& is) {
        for (std::size_t g = 0; g < train().gears.size(); ++g)
            if (train().gears[g].may_lock() && is(g)) return places().gears[g].contact;
        return nowhere;
    };
    const int driven = first([&](std::size_t g) { return given_behind(places(), train(), g) != nowhere; });
    return driven != nowhere ? driven : first([&](std::size_t g) { return locks_in_motion(now, event, from, g); });
}

// Is the effective inertia of all that rigid gears tie to the input of a gear negative, while all contacts of limited
// torque slip, if some of these gears drive and others are driven?
bool SwitchedTrain::locks_in_motion(const Instant& now, const Event& event, const Key& from, std::size_t gear) {
    const auto slips = [&](int contact) { return from.modes[contact] != 0 && !event.at_rest[contact]; };
    const auto input_of = [&](std::size_t g) { return places().shafts[train().gears[g].input].contact; };
    if (!slips(input_of(gear))) return false;
    Key moving;
    for (int c = 0; c < contacts(); ++c) {
        const bool rests = !places().contacts[c].bilateral && from.modes[c] == 0;
        moving.modes[c] = rests ? std::int8_t{-1} : from.modes[c];
    }
    locate(now, from, moving);
    const std::vector<int> part = parts(places(), moving);
    std::vector<std::size_t> tied;
    for (std::size_t g = 0; g < train().gears.size(); ++g) {
        const Gear& other = train().gears[g];
        const bool with_it = part[other.input] == part[train().gears[gear].input];
        if (other.rigid() && other.has_dry_losses() && with_it && slips(input_of(g))) tied.push_back(g);
    }
    constexpr std::size_t most_at_once = 6;
    if (tied.size() > most_at_once) return false;
    Torques T_2 = event.gear;
    for (std::size_t loads = 0; loads < std::size_t{1} << tied.size(); ++loads) {
        for (std::size_t k = 0; k < tied.size(); ++k) {
            const double torque = train().gears[tied[k]].rated_torque();
            T_2[tied[k]] = (loads >> k & 1) != 0 ? torque : -torque;
        }
        Key trial = moving;
        locate_losses(now, T_2, trial);
        if (!regimes_[trial].solvable) return true;
    }
    return false;
}

// Slows the input of a gear down with all that is tied to it, until it stops or a one-way contact takes hold, which has
// no limit either: what lies behind that has joined it from then on. Impossible if a part of all that could move by
// itself, or if flanks would approach without a gap.
auto SwitchedTrain::slow_down(Instant& now, std::size_t gear, Flags& joined, MovedShafts& moved) const -> Slowed {
    const int input = train().gears[gear].input;
    Key together;
    for (int c = 0; c < contacts(); ++c) {
        const bool tied = places().contacts[c].bilateral || c == places().shafts[input].contact || joined[c];
        together.modes[c] = tied ? std::int8_t{0} : std::int8_t{1};
    }
    const Ties ties = places().ties(together.modes);
    const std::vector<int> part = parts(places(), together);
    Instant stopped = now;
    for (std::size_t s = 0; s < train().shafts.size(); ++s) {
        if (part[s] != part[input]) continue;
        if (!ties.at_rest[s]) return Slowed::impossible;
        stopped.x[places().shafts[s].speed] = 0.0;
    }
    // The share of its speeds that is left where the first takes hold.
    double left = 0.0;
    int first = nowhere;
    for (int c = 0; c < contacts(); ++c) {
        const ContactPlace& p = places().contacts[c];
        if (!p.one_way || joined[c]) continue;
        const double at_rest = speed_of(c, stopped), share = at_rest / (at_rest - std::fmin(speed_of(c, now), 0.0));
        if (p.gap.present()) {
            if (!has_gap(c, now) && approach(c, stopped)) return Slowed::impossible;
        } else if (at_rest > 0.0 && (first == nowhere || share > left)) {
            left = share;
            first = c;
        }
    }
    double& lost = now.memory[places().gears[gear].impact_loss];
    const auto add_energy = [&](double sign) {
        for (std::size_t s = 0; s < train().shafts.size(); ++s) {
            const ShaftPlace& p = places().shafts[s];
            const double w = now.x[p.speed];
            if (part[s] != part[input]) continue;
            lost += sign * 0.5 * p.inertia * w * w;
            places().each_coupled_inertia(static_cast<int>(s), [&](int t, double J) {
                lost += sign * 0.5 * J * w * now.x[places().shafts[t].speed];
            });
        }
    };
    add_energy(+1.0);
    for (std::size_t s = 0; s < train().shafts.size(); ++s)
        if (part[s] == part[input]) {
            now.x[places().shafts[s].speed] *= left;
            moved[s] = true;
        }
    add_energy(-1.0);
    if (first == nowhere) return Slowed::stopped;
    joined[first] = true;
    return Slowed::joined;
}

}  // namespace lostmotion::model
