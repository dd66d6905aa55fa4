// Which combination of modes follows.
#pragma once

#include "switched_train.hpp"

namespace lostmotion::model {

template <class Sizes>
void SwitchedTrain<Sizes>::set_near_event() {
    const Layout& n = assembly_.layout();
    near_state_.resize(static_cast<std::size_t>(n.states));
    near_input_.assign(static_cast<std::size_t>(n.inputs), far_from_event);
    rated_scale(assembly_, near_state_);
    for (double& x : near_state_) x *= far_from_event;
    for (int a = 0; a < n.angles; ++a) near_state_[n.coupled + a] = far_from_event;
    for (std::size_t s = 0; s < train().shafts.size(); ++s)
        if (const int load = places().shafts[s].load; load != nowhere)
            near_input_[load] = far_from_event * rated_torque(train(), static_cast<int>(s));
}

template <class Sizes>
template <class X, class AtRest>
void SwitchedTrain<Sizes>::stop(X& x, AtRest& at_rest) const {
    Rest now;
    for (int c = 0; c < contacts(); ++c)
        if (at_rest[c]) now[c] = true;
    const Stopped& all = stopped(now);
    for (int c = 0; c < contacts(); ++c) at_rest[c] = all.kept[c] && places().contacts[c].may_rest(x);
    if (places().driven.empty()) {
        set_tied_speeds(x, all.ties);
    } else {  // whose speeds stay what they are, to the last bit
        std::vector<std::int8_t> modes;
        for (int c = 0; c < contacts(); ++c) modes.push_back(at_rest[c] ? 0 : 1);
        set_tied_speeds(x, places().ties(modes.data()));
    }
}

template <class Sizes>
auto SwitchedTrain<Sizes>::stopped(const Rest& at_rest) const -> const Stopped& {
    std::unique_ptr<Stopped>& known = stopped_[hash_of(at_rest) % stopped_.size()];
    if (known != nullptr && known->at_rest == at_rest) return *known;
    std::vector<std::int8_t> modes;
    for (int c = 0; c < contacts(); ++c) modes.push_back(at_rest[c] ? 0 : 1);
    known = std::make_unique<Stopped>(Stopped{at_rest, {}, places().ties(modes.data(), nullptr, true)});
    for (int c = 0; c < contacts(); ++c)
        if (kept_at_rest(places().contacts[c], known->ties)) known->kept[c] = true;
    return *known;
}

template <class Sizes>
template <class X>
void SwitchedTrain<Sizes>::set_tied_speeds(X& x, const Ties& ties) const {
    for (std::size_t s = 0; s < train().shafts.size(); ++s) {
        double& w = x[places().shafts[s].speed];
        if (!ties.at_rest[s] && !ties.follows(static_cast<int>(s))) continue;
        w = 0.0;
        ties.each_share(static_cast<int>(s), [&](int k, double share) { w += x[places().shafts[k].speed] * share; });
    }
}

template <class Sizes>
template <class Now>
bool SwitchedTrain<Sizes>::follow_given(Now& now, const Key& key, Rest& rests) const {
    if (places().driven.empty()) return false;
    for (const int s : places().driven) now.x[places().shafts[s].speed] = now.input[0][places().shafts[s].given_speed];
    const Ties ties = places().ties(key.modes.data());
    bool some = false;
    for (int c = 0; c < contacts(); ++c) {
        if (key.modes[c] == 0) continue;
        const Shares moves = tied_speed(places().contacts[c], ties);
        const auto is_given = [&](int s) { return std::ranges::binary_search(places().driven, s); };
        if (moves.empty() || !std::ranges::all_of(moves, is_given, &Share::shaft)) continue;
        double speed = 0.0;
        for (const Share& s : moves) speed += s.share * now.x[places().shafts[s.shaft].speed];
        rests[c] = speed == 0.0;
        some = some || rests[c];
    }
    return some;
}

template <class Sizes>
template <class Cache, class Now>
Found SwitchedTrain<Sizes>::start(Cache& cache, Now& now, Key& key) const {
    constexpr double few_roundings = 8.0 * std::numeric_limits<double>::epsilon();
    key = Key{};
    Event event;
    Rest given_rest{};
    follow_given(now, key, given_rest);
    bool snap = !places().driven.empty();
    for (int c = 0; c < contacts(); ++c) {
        const ContactPlace& p = places().contacts[c];
        double speed = 0.0, size = 0.0;
        p.each_shaft([&](int s, double per) {
            speed += per * now.x[places().shafts[s].speed];
            size += std::fabs(per) *
                    std::fmax(std::fabs(now.x[places().shafts[s].speed]), rated_speed(train(), static_cast<int>(s)));
        });
        // Speeds that differ by rounding are the same: a state that a run has ended with may be that of the next. A
        // speed that has passed through zero there has the rounding of what it was before.
        const bool same = std::fabs(speed) <= few_roundings * size;
        if (p.one_way && p.flanks == nowhere && speed > 0.0 && !same) return Found::inconsistent;
        key.modes[c] = p.one_way || speed < 0.0 ? -1 : +1;
        event.at_rest[c] = (p.bilateral || same) && p.may_rest(now.x);
        snap = snap || (same && !p.bilateral && speed != 0.0);
    }
    if (snap) stop(now.x, event.at_rest);
    Now before = now;  // as if nothing had acted on the train, with brakes and clutches as they are commanded
    before.x = {};
    before.input = {};
    const auto keep = [&](const auto& e) {
        if (e->command != nowhere) before.input[0][e->command] = now.input[0][e->command];
    };
    std::for_each(places().acting.begin(), places().acting.end(), keep);
    std::for_each(places().couplings.begin(), places().couplings.end(), keep);
    const Key meshes = assembly_.meshes_at(now.x);
    for (std::size_t g = 0; g < train().gears.size(); ++g) {
        const Gear& gear = train().gears[g];
        const GearPlace& p = places().gears[g];
        p.each_over_angle(gear, [&](const PeriodicCurve& curve, const OverAngle& law) {
            now.memory[law.turn] = curve.turn(assembly_.angle_of_input(g, now.x));
        });
        const int locked = p.contact == nowhere ? nowhere : places().contacts[p.contact].locked;
        event.gear[g] = locked != nowhere ? now.memory[locked] : 0.0;
        if (gear.rigid() || gear.strikes()) continue;
        const double P =
            assembly_.stiffness_factor(static_cast<int>(g), meshes) * gear.law.curve.torque(now.x[p.twist]);
        const double h = p.hysteresis == nowhere ? 0.0 : now.memory[p.hysteresis];
        event.gear[g] = locked == nowhere ? P : std::clamp(event.gear[g], P - h, P + h);
    }
    each_coupling_contact([&](int c) {
        if (const int locked = places().contacts[c].locked; locked != nowhere) event.coupling[c] = now.memory[locked];
    });
    for (const auto& e : places().acting)
        if (e->turn != nowhere) now.memory[e->turn] = e->turn_at(now.x[places().shafts[e->shaft].angle]);
    // A run that goes on from the end of another keeps the torques that rest has left open there, if it can.
    const auto has_torque = [&](const ContactPlace& p) { return p.locked != nowhere && now.memory[p.locked] != 0.0; };
    if (std::any_of(places().contacts.begin(), places().contacts.end(), has_torque)) {
        Now going_on = now;
        Key kept = key;
        if (find(cache, going_on, now, event, kept) == Found::yes) {
            now = going_on;
            key = kept;
            return Found::yes;
        }
    }
    return find(cache, now, before, event, key);
}

template <class Sizes>
template <class Cache, class Now, class G, class Input>
Found SwitchedTrain<Sizes>::next(Cache& cache, Now& now, const G* fired, Key& key, const Input& input) const {
    if (fired != nullptr && fired->kind == Guard::impact) return strikes(cache, now, *fired, key);
    Rest given_rest{};
    const bool comes_to_rest = fired == nullptr && follow_given(now, key, given_rest);
    auto& ended = look_up(cache, key);
    if (fired != nullptr ? goes_on(cache, ended, now, *fired, key) : !comes_to_rest && stays(ended, now, input))
        return Found::yes;
    Now past = now;
    past.input[0] = input;
    const auto& old = regime_of(ended);
    Event event;
    event.before = key;
    for (std::size_t g = 0; g < train().gears.size(); ++g) event.gear[g] = evaluate(n_, old.output_torque[g], past);
    each_coupling_contact([&](int c) { event.coupling[c] = evaluate(n_, old.contact_torque[c], past); });
    double margin_size = 0.0, near = 0.0;
    if (fired != nullptr) {
        event.with_guard = true;
        event.kind = fired->kind;
        event.contact = fired->contact;
        event.branch = fired->branch;
        event.neighbour = fired->neighbour;
        event.memory = fired->memory;
        event.shift = fired->shift;
    }
    Rest before{};
    for (int c = 0; c < contacts(); ++c) before[c] = old.at_rest[c];
    for (int c = 0; c < contacts(); ++c) event.at_rest[c] = before[c] || given_rest[c];
    if (fired != nullptr && fired->kind == Guard::speed) event.at_rest[fired->contact] = true;
    stop(now.x, event.at_rest);
    past.x = now.x;
    for (int c = 0; c < contacts(); ++c) event.stopped[c] = event.at_rest[c] && !before[c];
    if (fired != nullptr && fired->kind == Guard::capacity) {
        margin_size = magnitude(n_, fired->form, now);
        near = near_event(fired->form);
    }
    for (std::size_t g = 0; g < train().gears.size(); ++g) {
        const GearPlace& p = places().gears[g];
        if (p.hysteresis != nowhere && event.at_rest[p.contact] && !before[p.contact])
            now.memory[p.hysteresis] = assembly_.stiffness_factor(static_cast<int>(g), key) *
                                       train().gears[g].law.hysteresis_capacity(now.x[p.twist]);
    }
    if (event.with_guard && event.kind == Guard::capacity && breaks_away(cache, now, event, margin_size, near, key))
        return Found::yes;
    const Found found = find(cache, now, past, event, key);
    return found == Found::inconsistent ? locks(cache, now, event, past, key) : found;
}

// A contact whose capacity has been overcome begins to slip that way, from rest: there is nothing to decide as long as
// all others go on as they were. If the capacity itself has gone with its margin, as where a load that alone holds a
// self-locking gear reverses, the contact may as well stay stuck.
template <class Sizes>
template <class Cache, class Now>
bool SwitchedTrain<Sizes>::breaks_away(Cache& cache, Now& now, const Event& event, double margin_size, double near,
                                       Key& key) const {
    if (margin_size <= near) return false;
    Key modes = key;
    modes.modes[event.contact] = static_cast<std::int8_t>(event.neighbour);
    if (at_its_limit(modes)) return false;
    Event slipping;
    slipping.at_rest = event.at_rest;
    slipping.at_rest[event.contact] = false;
    slipping.gear = event.gear;
    slipping.coupling = event.coupling;
    const auto memory = now.memory;
    Key slips;
    if (settle(cache, now, modes, slipping, slips).found == Found::yes) {
        // With a self-locking gear more torque may turn it the other way; by rounding it only seems to.
        if (!turns_the_other_way(look_up(cache, slips), now, event)) {
            key = slips;
            return true;
        }
    }
    now.memory = memory;
    return false;
}

// Does a contact that is to slip turn against that just after now, by more than rounding may make?
template <class Sizes>
template <class E, class Now>
bool SwitchedTrain<Sizes>::turns_the_other_way(const E& e, const Now& now, const Event& event) const {
    const ContactPlace& c = places().contacts[event.contact];
    std::decay_t<decltype(regime_of(e).guards[0].form)> speed;
    c.each_shaft([&](int s, double per) { speed.c[places().shafts[s].speed] += event.neighbour * per; });
    auto along = flow(e, now);
    return sign_after(along, speed, evaluate(n_, speed, now), magnitude(n_, speed, now)).relative < -max_violation;
}

// Tries the combinations of modes. Usually pieces and cells are found by a walk from those before. If the guards that
// are zero or nearly so leave none, the motion is too small beside its torques for rounding to tell which of them
// rise: then the combination that violates its guards least is taken. A train that jams violates them by more.
template <class Sizes>
template <class Cache, class Now>
Found SwitchedTrain<Sizes>::find(Cache& cache, Now& now, const Now& before, Event event, Key& key) const {
    const Key from = key;
    bool may_hold_more = false;
    for (int c = 0; c < contacts(); ++c) may_hold_more = may_hold_more || (event.at_rest[c] && holds_more_[c]);
    const bool tries_all = !may_hold_more && combinations(event) <= few;
    const Key path = tries_all ? from : follow(cache, now, before, event, from);
    const auto search = [&] {
        return tries_all ? enumerate(cache, now, event, from, key) : pivot(cache, now, event, path, from, key);
    };
    // Flanks without a gap that approach each other strike next: until then their ends are not to be seen.
    std::vector<std::pair<int, double>> hidden;
    for (int c = 0; c < contacts() && has_flanks_; ++c) {
        const ContactPlace& p = places().contacts[c];
        if (p.flanks == nowhere || event.at_rest[c] || has_gap(c, now) || !approach(c, now)) continue;
        hidden.emplace_back(p.flanks, std::exchange(now.x[p.flanks], 0.0));
    }
    const Found found = [&] {
        const Found first = search();
        if (first == Found::yes) return first;
        event.from_each_load =
            std::any_of(train().gears.begin(), train().gears.end(), [](const Gear& g) { return g.has_dry_losses(); });
        if (event.from_each_load && search() == Found::yes) return Found::yes;
        event.closest = true;
        return search() == Found::yes ? Found::yes : first;
    }();
    for (const auto& [twist, value] : hidden) now.x[twist] = value;
    return found;
}

template <class Sizes>
bool SwitchedTrain<Sizes>::at_its_limit(const Key& key) const {
    if (!some_redundant_) return false;
    Limit& known = limits_[hash_of(key.modes) % limits_.size()];
    if (!known.known || !(known.modes == key.modes)) known = {key.modes, true, pushes_against_rest(key)};
    return known.reached;
}

// A contact that "slips" while those that are stuck keep its speed at zero, or that would have to slip against another
// that is tied to it, does not move: it gives all that it can, and what everything at rest leaves open follows from
// that.
template <class Sizes>
bool SwitchedTrain<Sizes>::pushes_against_rest(const Key& key) const {
    const std::vector<ContactPlace>& all = places().contacts;
    const Ties ties = places().ties(key.modes.data());
    std::vector<int> direction(train().shafts.size());  // of each free shaft
    for (std::size_t k = 0; k < all.size(); ++k) {
        if (key.modes[k] == 0 || all[k].flanks != nowhere) continue;
        const ContactPlace& c = all[k];
        const Shares free = tied_speed(c, ties);
        if (free.empty()) return true;
        if (free.size() > 1) continue;
        const Share& only = *free.begin();
        const int way = key.modes[k] * (only.share > 0.0 ? 1 : -1);
        int& of_free = direction[static_cast<std::size_t>(only.shaft)];
        if (of_free * way < 0) return true;
        of_free = way;
    }
    return false;
}

// Those with most contacts stuck first. While everything is at rest the torques stay as they were, and give way only if
// neither that nor a motion is consistent, and then by as little as they can.
template <class Sizes>
template <class Cache, class Now>
Found SwitchedTrain<Sizes>::enumerate(Cache& cache, Now& now, const Event& event, const Key& from, Key& key) const {
    Key modes;
    slips_of_.resize(static_cast<std::size_t>(combinations(event)));
    for (std::size_t number = 0; number < slips_of_.size(); ++number)
        slips_of_[number] = combination(number, event, from, modes);
    const auto before = now.memory;  // all that a trial may change
    Found worst = Found::inconsistent;
    const double limit = event.closest ? max_violation : std::numeric_limits<double>::infinity();
    double smallest = limit;
    Key closest;
    auto of_closest = before;
    for (const bool at_limit : {false, true})
        for (int slips = 0; slips <= contacts(); ++slips)
            for (std::size_t number = 0; number < slips_of_.size(); ++number) {
                if (slips_of_[number] != slips) continue;
                combination(number, event, from, modes);
                if (at_its_limit(modes) != at_limit) continue;
                now.memory = before;
                const Found found = at_limit ? settle_at_limit(cache, now, modes, event, key)
                                             : settle(cache, now, modes, event, key).found;
                if (found == Found::yes && !event.closest && !at_limit) return found;
                if (found == Found::outside) worst = found;
                if (found != Found::yes) continue;
                const double v = event.closest ? violation(look_up(cache, key), now, event)
                                               : torque_change(cache.regime(key), now, event);
                if (v < smallest) {
                    smallest = v;
                    closest = key;
                    of_closest = now.memory;
                }
            }
    if (smallest == limit) {
        now.memory = before;
        key = from;
        return worst;
    }
    key = closest;
    now.memory = of_closest;
    return Found::yes;
}

template <class Sizes>
template <class Cache, class Now>
Found SwitchedTrain<Sizes>::pivot(Cache& cache, Now& now, const Event& event, Key modes, const Key& from,
                                  Key& key) const {
    const auto before = now.memory;
    struct Tried {
        Key modes;
        std::vector<Violation> violations;
    };
    std::vector<Tried> tried;
    std::vector<std::size_t> path;  // of those tried, as far as they may lead on
    double smallest = max_violation;
    Key closest;
    auto of_closest = before;
    Found worst = Found::inconsistent;
    const auto is_new = [&] {
        return std::none_of(tried.begin(), tried.end(), [&](const Tried& o) { return o.modes == modes; });
    };
    // Changes the mode that is violated most, of those that lead to a combination not yet tried, or all that are
    // violated at once. False if there is none.
    const auto lead_on = [&](const Tried& t) {
        for (const Violation& v : t.violations) {
            modes = t.modes;
            modes.modes[v.contact] = static_cast<std::int8_t>(v.mode);
            if (is_new()) return true;
            if (&v != &t.violations.front()) continue;
            for (const Violation& o : t.violations) modes.modes[o.contact] = static_cast<std::int8_t>(o.mode);
            if (is_new()) return true;
        }
        return false;
    };
    // Where none of these leads on: combinations spread evenly over all, each once.
    std::uint64_t drawn = 1;
    std::size_t begun = 0;  // how many had been tried at the last start
    const auto start_again = [&] {
        constexpr std::uint64_t stride = 2654435761u;  // Knuth's prime near the golden section of 2^32
        path.clear();
        begun = tried.size();
        constexpr double countable = 0x1p62;
        const double count = combinations(event);
        for (const auto all = static_cast<std::uint64_t>(std::fmin(count, countable)); drawn <= all;) {
            std::uint64_t number = drawn++ * stride;
            if (count < countable)
                combination(number % all, event, from, modes);
            else
                combination([&](std::uint64_t n) { return ((number = number * 6364136223846793005u + 1) >> 33) % n; },
                            event, from, modes);
            if (is_new()) return true;
        }
        return false;
    };
    while (tried.size() < longest_pivoting) {
        now.memory = before;
        std::vector<Violation> violations;
        const Trial trial = settle(cache, now, modes, event, key, {&violations});
        if (trial.found == Found::inconsistent && trial.turns_back &&
            settle_at_limit(cache, now, modes, event, key) == Found::yes)
            return Found::yes;
        if (trial.found == Found::outside) worst = Found::outside;
        if (trial.found == Found::yes && !event.closest) return Found::yes;
        if (trial.found == Found::yes) {
            const double v = violation(look_up(cache, key), now, event);
            if (v < smallest) {
                smallest = v;
                closest = key;
                of_closest = now.memory;
            }
        }
        std::erase_if(violations, [&](const Violation& v) {
            return !event.at_rest[v.contact] || modes.modes[v.contact] == v.mode;
        });
        std::sort(violations.begin(), violations.end(), [](const Violation& a, const Violation& b) {
            return a.order != b.order ? a.order < b.order : a.relative > b.relative;
        });
        path.push_back(tried.size());
        tried.push_back({modes, std::move(violations)});
        while (!path.empty() && !lead_on(tried[path.back()])) path.pop_back();
        if (!path.empty() && tried.size() - begun < from_one_start) continue;
        ++searches.fallbacks;
        if (!start_again()) break;
    }
    if (smallest < max_violation) {
        key = closest;
        now.memory = of_closest;
        return Found::yes;
    }
    now.memory = before;
    key = from;
    return worst;
}

template <class Sizes>
bool SwitchedTrain<Sizes>::holds_more(const ContactPlace& c) const {
    if (c.kind == ContactPlace::gear) return false;
    const auto element = static_cast<std::size_t>(c.element);
    if (c.kind == ContactPlace::coupling) return places().couplings[element]->holds_more();
    const DryFriction& friction = train().shafts[element].friction;
    return friction.holding() > friction.at_zero(0) ||
           std::any_of(places().acting.begin(), places().acting.end(),
                       [&](const auto& e) { return e->shaft == c.element && e->holds_more(); });
}

// By how much the contacts' guards of a regime are violated, each in units of the sum of its terms' magnitudes: by the
// value or, of one that is zero to rounding, by the rate. A value is zero, too, if it is so beside what the terms are
// at rated load and speed: an elimination leaves that where all else is zero. Higher derivatives, of which rounding may
// leave less, choose among combinations that all else allows.
template <class Sizes>
template <class E, class Now>
double SwitchedTrain<Sizes>::violation(const E& e, const Now& now, const Event& event) const {
    const auto& r = regime_of(e);
    const Guards ignored = moving(e, event.at_rest);
    auto along = flow(e, now);
    double worst = 0.0;
    for (std::size_t g = 0; g < guard_count(r); ++g) {
        const auto& guard = r.guards[g];
        if (ignored[static_cast<int>(g)] || !guard.is_of_contact()) continue;
        double value = evaluate(n_, guard.form, now);
        const double size = magnitude(n_, guard.form, now);
        if (std::fabs(value) <= rounding * near_event(guard.form) / far_from_event) value = 0.0;
        const double rate = along.rate(guard.form, 1);
        const bool zero = std::fabs(value) <= along.noise(size, rate);
        const bool nothing = value == 0.0 && rate == 0.0 && !event.by_value_alone(guard);
        if (nothing && sign_after(along, guard.form, value, size).sign < 0)
            worst = std::fmax(worst, 0.5 * max_violation);
        else if (zero && rate < 0.0 && !event.by_value_alone(guard))
            worst = std::fmax(worst, -rate / along.rate_magnitude(guard.form, 1));
        else if (!zero && value < 0.0)
            worst = std::fmax(worst, -value / size);
    }
    return worst;
}

// Across an edge of a law or a limit the motion is smooth enough for every contact to go on as it was; if that is
// consistent there is nothing to search.
template <class Sizes>
template <class Cache, class E, class Now, class G>
bool SwitchedTrain<Sizes>::goes_on(Cache& cache, E& from, Now& now, const G& fired, Key& key) const {
    if (!fired.is_edge()) return false;
    const auto& e = beyond(cache, from, fired);
    if (!regime_of(e).solvable) return false;
    const auto before = now.memory;
    shift(fired, now);
    Violated of_contacts;
    if (first_left(e, now, Guards{}, nullptr, of_contacts) == nullptr && !of_contacts.any) {
        key = regime_of(e).key;
        return true;
    }
    now.memory = before;
    return false;
}

// An input has changed: does the regime go on? The contacts that move keep their direction. A guard that is zero to
// rounding has not ended it; the solver finds it if it goes on to fall.
template <class Sizes>
template <class E, class Now, class Input>
bool SwitchedTrain<Sizes>::stays(const E& e, const Now& now, const Input& input) const {
    const auto& r = regime_of(e);
    for (const auto& driver : r.drivers)
        if (falls(driver, input, now.input[0])) return false;
    Event lasting;
    lasting.by_value = true;
    Violated of_contacts;
    return first_left(e, now, moving(e, r.at_rest), &lasting, of_contacts) == nullptr && !of_contacts.any;
}

}  // namespace lostmotion::model
