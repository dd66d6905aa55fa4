// Which combination of modes follows.
#include "scales.hpp"
#include "switched_train.hpp"

namespace lostmotion::model {

SwitchedTrain::SwitchedTrain(const Assembly& assembly) : assembly_(assembly), regimes_(assembly) {
    int gears = 0, all = 0;
    places().each_striking([&](const ContactPlace& c, int) {
        ++all;
        gears += c.kind == ContactPlace::gear ? 1 : 0;
    });
    has_impacts_ = all > 0;
    least_flight_ = gears == 1 && all == 1 ? one_flight : flight_among_others;
    for (int c = 0; c < contacts(); ++c) {
        some_redundant_ = some_redundant_ || places().contacts[c].locked != nowhere;
        const ContactPlace& p = places().contacts[c];
        holds_more_[c] = !p.bilateral && holds_more(p);
        Row row;
        p.each_shaft([&](int s, double per) { row.c[places().shafts[s].speed] += per; });
        speeds_.emplace_back(row, assembly.layout());
    }
}

Key SwitchedTrain::branches_at(const SparseRegime& other, const Key& modes, const Instant& now) const {
    Key key;
    key.modes = modes.modes;
    Torques T_2{};
    for (std::size_t g = 0; g < train().gears.size(); ++g) T_2[g] = evaluate(other.output_torque[g], now);
    locate(now, other.key, key);
    locate_losses(now, T_2, key);
    return key;
}

auto SwitchedTrain::stopped(const Rest& at_rest) const -> const Stopped& {
    std::unique_ptr<Stopped>& known = stopped_[hash_of(at_rest) % stopped_.size()];
    if (known != nullptr && known->at_rest == at_rest) return *known;
    std::vector<std::int8_t> modes;
    for (int c = 0; c < contacts(); ++c) modes.push_back(at_rest[c] ? 0 : 1);
    known = std::make_unique<Stopped>(Stopped{at_rest, {}, places().ties(modes, nullptr, true)});
    for (int c = 0; c < contacts(); ++c)
        if (kept_at_rest(places().contacts[c], known->ties)) known->kept[c] = true;
    return *known;
}

Found SwitchedTrain::start(Instant& now, Key& key) {
    constexpr double few_roundings = 8.0 * std::numeric_limits<double>::epsilon();
    jams_at = nowhere;
    key = Key{};
    Event event;
    Rest given_rest{};
    now.reach(assembly_.layout());
    for (const auto& c : places().couplings)
        if (c->turn != nowhere) now.memory[c->turn] = c->turn_at(now.x[c->twist]);
    follow_given(now.x, now.input[0], key, given_rest);
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
        if (p.one_way && !p.gap.present() && speed > 0.0 && !same) return Found::inconsistent;
        key.modes[c] = p.one_way || speed < 0.0 ? -1 : +1;
        event.at_rest[c] = (p.bilateral || same) && p.may_rest(now);
        snap = snap || (same && !p.bilateral && speed != 0.0);
    }
    if (snap) stop(now, event.at_rest);
    // As if nothing had acted on the train, with brakes and clutches as they are commanded.
    Instant before = now.at_rest();
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
    set_turns(now, [](const ShaftElement&) { return true; });
    // A run that goes on from the end of another keeps the torques that rest has left open there, if it can.
    const auto has_torque = [&](const ContactPlace& p) { return p.locked != nowhere && now.memory[p.locked] != 0.0; };
    if (std::any_of(places().contacts.begin(), places().contacts.end(), has_torque)) {
        Instant going_on = now;
        Key kept = key;
        if (find(going_on, [&] { return now; }, event, kept) == Found::yes) {
            now = going_on;
            key = kept;
            return Found::yes;
        }
    }
    const Found found = find(now, [&] { return before; }, event, key);
    if (found == Found::inconsistent) jams_at = jams(now, event, key);
    return found;
}

// Sets the angles at which the present periods of those laws began that are wanted.
template <class Wanted>
void SwitchedTrain::set_turns(Instant& now, Wanted&& wanted) const {
    for (const auto& e : places().acting)
        if (e->turn != nowhere && wanted(*e)) now.memory[e->turn] = e->turn_at(places().instant_of(*e, now).angle);
}

Found SwitchedTrain::next(Instant& now, int fired_number, Key& key, const Inputs& input, const Rest& given_rest) {
    tried_.clear();
    now.reach(assembly_.layout());
    jams_at = nowhere;
    regimes_.make_room();
    const SparseRegime& old = regimes_[key];
    const Guard* fired = fired_number == nowhere ? nullptr : &old.guards[static_cast<std::size_t>(fired_number)];
    if (fired != nullptr && fired->kind == Guard::impact) return strikes(now, *fired, key);
    // The angle of a field may have jumped.
    if (fired == nullptr) set_turns(now, [](const ShaftElement& e) { return e.position != nowhere; });
    Event event;
    event.before = event.from = key;
    Inputs left = input;
    left.reach(static_cast<std::size_t>(assembly_.layout().inputs));
    std::swap(left, now.input[0]);
    for (std::size_t g = 0; g < train().gears.size(); ++g) event.gear[g] = evaluate(old.output_torque[g], now);
    each_coupling_contact([&](int c) { event.coupling[c] = evaluate(old.contact_torque[c], now); });
    std::swap(left, now.input[0]);
    double margin_size = 0.0, near = 0.0;
    if (fired != nullptr) {
        event.with_guard = true;
        event.kind = fired->kind;
        event.contact = fired->contact;
        event.branch = fired->branch;
        event.neighbour = fired->neighbour;
        event.memory = fired->memory;
        event.shift = fired->shift;
        if (fired->is_edge()) cross(*fired, event.from);
    }
    Rest before{};
    for (int c = 0; c < contacts(); ++c) before[c] = old.at_rest[c];
    for (int c = 0; c < contacts(); ++c) event.at_rest[c] = before[c] || given_rest[c];
    if (fired != nullptr && fired->kind == Guard::speed) event.at_rest[fired->contact] = true;
    stop(now, event.at_rest);
    for (int c = 0; c < contacts(); ++c) event.stopped[c] = event.at_rest[c] && !before[c];
    if (fired != nullptr && fired->kind == Guard::capacity) {
        margin_size = magnitude(fired->form, now);
        near = old.near_event[static_cast<std::size_t>(fired_number)];
    }
    const auto memory = now.memory;
    turn(now, event.at_rest, before, key);
    by_trials_ = event.with_guard && (event.kind == Guard::capacity || event.kind == Guard::speed) &&
                 !some_redundant_ && !has_impacts_ && places().driven.empty();
    if (event.with_guard && event.kind == Guard::capacity && breaks_away(now, event, margin_size, near, key))
        return Found::yes;
    const auto past = [&] {
        Instant out = now;
        out.memory = memory;
        out.input[0] = left;
        return out;
    };
    Found found = find(now, past, event, key);
    if (!by_trials_ || found != Found::yes) tried_.clear();
    if (found != Found::inconsistent) return found;
    if (drop_rounding(old, past(), event)) found = find(now, past, event, key);
    if (found == Found::inconsistent) found = locks(now, event, past(), key);
    if (found == Found::inconsistent) jams_at = jams(now, event, key);
    return found;
}

// Torques that are but rounding beside those that their elimination mixes them with are none: a capacity that has
// fallen to zero cannot hold them. True if there are some.
bool SwitchedTrain::drop_rounding(const SparseRegime& old, const Instant& past, Event& event) const {
    double largest = 0.0;
    for (const auto* forms : {&old.output_torque, &old.contact_torque})
        for (const LinearForm& form : *forms) largest = std::fmax(largest, magnitude(form, past));
    bool some = false;
    for (auto* torques : {&event.gear, &event.coupling})
        for (double& torque : *torques)
            if (torque != 0.0 && std::fabs(torque) <= rounding * largest) {
                torque = 0.0;
                some = true;
            }
    return some;
}

void SwitchedTrain::note(const Trial& trial) {
    by_trials_ = by_trials_ && trial.end != nullptr;
    if (by_trials_) tried_.push_back(trial.end);
}

// Tries the combinations of modes. Usually pieces and cells are found by a walk from those before. If the guards that
// are zero or nearly so leave none, the motion is too small beside its torques for rounding to tell which of them
// rise: then the combination that violates its guards least is taken. A train that jams violates them by more.
Found SwitchedTrain::find(Instant& now, const std::function<Instant()>& before, Event event, Key& key) {
    const Key from = key;
    bool may_hold_more = false;
    for (int c = 0; c < contacts(); ++c) may_hold_more = may_hold_more || (event.at_rest[c] && holds_more_[c]);
    const bool tries_all = !may_hold_more && combinations(event) <= few;
    const Key path = tries_all ? from : follow(now, before(), event, from);
    const auto search = [&] {
        return tries_all ? enumerate(now, event, from, key) : pivot(now, event, path, from, key);
    };
    // What approaches without a gap strikes next.
    for (int c = 0; c < contacts() && has_impacts_; ++c)
        event.strikes[c] =
            places().contacts[c].gap.present() && !event.at_rest[c] && !has_gap(c, now) && approach(c, now);
    const Found first = search();
    if (first == Found::yes) return first;
    by_trials_ = false;
    event.from_each_load =
        std::any_of(train().gears.begin(), train().gears.end(), [](const Gear& g) { return g.has_dry_losses(); });
    if (event.from_each_load && search() == Found::yes) return Found::yes;
    event.closest = true;
    return search() == Found::yes ? Found::yes : first;
}

// In how many ways contacts at rest may stick and slip.
double SwitchedTrain::combinations(const Event& event) const {
    double n = 1.0;
    for (int c = 0; c < contacts(); ++c)
        if (event.at_rest[c] && !places().contacts[c].bilateral) n *= places().contacts[c].one_way ? 2.0 : 3.0;
    return n;
}

// One of them: the last contact changes first, from stuck to the way of the event to the other way. next(n): the mode
// of the next contact, below n. Returns how many contacts slip.
template <class Next>
int SwitchedTrain::combination(Next&& next, const Event& event, const Key& from, Key& out) const {
    int slips = 0;
    const int ahead = event.ahead();
    for (int c = contacts(); c-- > 0;) {
        const ContactPlace& p = places().contacts[c];
        if (p.bilateral) continue;
        out.modes[c] = from.modes[c];
        if (event.at_rest[c]) {
            const std::uint64_t mode = next(std::uint64_t{p.one_way ? 2u : 3u});
            out.modes[c] = static_cast<std::int8_t>(mode == 0 ? 0 : p.one_way ? -1 : mode == 1 ? ahead : -ahead);
        }
        slips += out.modes[c] != 0;
    }
    return slips;
}
int SwitchedTrain::numbered_combination(std::uint64_t number, const Event& event, const Key& from, Key& out) const {
    const auto next = [&](std::uint64_t n) {
        const std::uint64_t mode = number % n;
        number /= n;
        return mode;
    };
    return combination(next, event, from, out);
}

double SwitchedTrain::torque_change(const SparseRegime& r, const Instant& now, const Event& event) const {
    double sum = 0.0;
    for (std::size_t g = 0; g < train().gears.size(); ++g)
        sum += std::fabs(evaluate(r.output_torque[g], now) - event.gear[g]);
    each_coupling_contact([&](int c) { sum += std::fabs(evaluate(r.contact_torque[c], now) - event.coupling[c]); });
    return sum;
}

// The size of the angle at which a turn ends, the same for the pieces on both sides: what one of them counts as zero
// must not be clear of zero for the other.
double SwitchedTrain::size_at_turn(const Guard& guard, const Instant& now) {
    double angle = 0.0;
    for (const auto& [k, factor] : guard.form.of_coupled()) angle += std::fabs(factor * now.x.data()[k]);
    for (const auto& [k, factor] : guard.form.of_angles()) angle += std::fabs(factor * now.x.data()[now.coupled + k]);
    return 2.0 * angle + guard.size_at_least();
}

const SwitchedTrain::Guard* SwitchedTrain::first_left(const SparseRegime& r, const Instant& now,
                                                      const std::vector<std::size_t>& ignored, const Event& event,
                                                      Violated& of_contacts) {
    const auto each_near_zero = [&](auto&& use) {
        for (std::size_t g = 0; g < r.guards.size(); ++g) {
            const Guard& guard = r.guards[g];
            if (guard.behind || is_of_moving(guard, event)) continue;
            if (!ignored.empty() && std::ranges::find(ignored, g) != ignored.end()) continue;
            auto [value, of_terms] = sized(guard.form, now);
            const double size = guard.shift == 0.0 ? of_terms : size_at_turn(guard, now);
            if (value > clear_of_zero * size + r.near_event[g]) continue;
            if (std::fabs(value) <= clear_of_zero * r.near_event[g] && event.was_at_limit(guard)) value = 0.0;
            if (!use(guard, value, size)) return;
        }
    };
    return model::first_left<LinearForm>(
        SparseFlow(r.rate, now, room_), r.drivers, each_near_zero,
        [&](const Guard& g) { return event.by_value_alone(g); }, of_contacts);
}

// Those with most contacts stuck first. While everything is at rest the torques stay as they were, and give way only if
// neither that nor a motion is consistent, and then by as little as they can.
Found SwitchedTrain::enumerate(Instant& now, const Event& event, const Key& from, Key& key) {
    Key modes;
    const auto before = now.memory;  // all that a trial may change
    Found worst = Found::inconsistent;
    numbered_combination(0, event, from, modes);  // that with most contacts stuck
    const bool tried = !event.closest && !at_its_limit(modes);
    by_trials_ = by_trials_ && tried;
    const auto settled = [&] {
        const Trial trial = settle(now, modes, event, key);
        note(trial);
        return trial.found;
    };
    if (tried) {
        worst = settled();
        if (worst == Found::yes) return worst;
    }
    slips_of_.resize(static_cast<std::size_t>(combinations(event)));
    for (std::size_t number = 0; number < slips_of_.size(); ++number)
        slips_of_[number] = numbered_combination(number, event, from, modes);
    if (tried) slips_of_[0] = -1;
    const double limit = event.closest ? max_violation : std::numeric_limits<double>::infinity();
    double smallest = limit;
    Key closest;
    auto of_closest = before;
    for (const bool at_limit : {false, true})
        for (int slips = 0; slips <= contacts(); ++slips)
            for (std::size_t number = 0; number < slips_of_.size(); ++number) {
                if (slips_of_[number] != slips) continue;
                numbered_combination(number, event, from, modes);
                if (at_its_limit(modes) != at_limit) continue;
                now.memory = before;
                const Found found = at_limit ? settle_at_limit(now, modes, event, key) : settled();
                if (found == Found::yes && !event.closest && !at_limit) return found;
                if (found == Found::outside) worst = found;
                if (found != Found::yes) continue;
                const double v =
                    event.closest ? violation(regimes_[key], now, event) : torque_change(regimes_[key], now, event);
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

Found SwitchedTrain::pivot(Instant& now, const Event& event, Key modes, const Key& from, Key& key) {
    by_trials_ = false;
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
    // Where none of these leads on: all at rest stuck but the one that breaks away, or all; then combinations spread
    // evenly over all, each once. Contacts that the event does not reach keep their modes.
    const bool breaks = event.with_guard && event.kind == Guard::capacity;
    int stuck = breaks ? 0 : 1;
    std::uint64_t drawn = 1;
    std::size_t begun = 0;  // how many had been tried at the last start
    const Key at_first = modes;
    Event reached = event;
    const std::vector<int> part = parts_at(event);
    Flags seen;  // of the parts
    const auto see = [&](int contact) { return !std::exchange(seen[part[places().contacts[contact].a]], true); };
    for (int c = 0; c < contacts(); ++c)
        if (event.stopped[c] || c == event.contact) see(c);
    const auto reach = [&] {
        bool more = false;
        for (const Tried& t : tried)
            for (const Violation& v : t.violations) more = see(v.contact) || more;
        if (more) drawn = 1;
        // Without any, losses leave no accelerations.
        const auto none = [&] {
            return std::none_of(part.begin(), part.end(), [&](int p) { return std::as_const(seen)[p]; });
        };
        if (none())
            for (const Gear& gear : train().gears)
                if (gear.has_dry_losses()) seen[part[gear.input]] = true;
        const bool all = none();
        for (int c = 0; c < contacts(); ++c)
            reached.at_rest[c] = event.at_rest[c] && (all || std::as_const(seen)[part[places().contacts[c].a]]);
    };
    const auto start_again = [&] {
        constexpr std::uint64_t stride = 2654435761u;  // Knuth's prime near the golden section of 2^32
        path.clear();
        begun = tried.size();
        while (stuck < 2) {
            numbered_combination(0, event, from, modes);
            if (stuck++ == 0) modes.modes[event.contact] = static_cast<std::int8_t>(event.neighbour);
            if (is_new()) return true;
        }
        reach();
        constexpr double countable = 0x1p62;
        const double count = combinations(reached);
        for (const auto all = static_cast<std::uint64_t>(std::fmin(count, countable)); drawn <= all;) {
            std::uint64_t number = drawn++ * stride;
            if (count < countable)
                numbered_combination(number % all, reached, at_first, modes);
            else
                combination([&](std::uint64_t n) { return ((number = number * 6364136223846793005u + 1) >> 33) % n; },
                            reached, at_first, modes);
            if (is_new()) return true;
        }
        return false;
    };
    while (tried.size() < longest_pivoting && !interruption.requested()) {
        now.memory = before;
        std::vector<Violation> violations;
        const Trial trial = settle(now, modes, event, key, {&violations});
        if (trial.found == Found::inconsistent && trial.turns_back &&
            settle_at_limit(now, modes, event, key) == Found::yes)
            return Found::yes;
        if (trial.found == Found::outside) worst = Found::outside;
        if (trial.found == Found::yes && !event.closest) return Found::yes;
        if (trial.found == Found::yes) {
            const double v = violation(regimes_[key], now, event);
            if (v < smallest) {
                smallest = v;
                closest = key;
                of_closest = now.memory;
            }
        }
        std::erase_if(violations, [&](const Violation& v) {
            return !event.at_rest[v.contact] || modes.modes[v.contact] == v.mode;
        });
        if (violations.empty() && trial.found == Found::inconsistent) violations = of_neighbours(modes, event);
        // Contacts that are tied together are violated alike, to rounding: then by their order, as in a mirror.
        std::stable_sort(violations.begin(), violations.end(),
                         [ahead = event.ahead()](const Violation& a, const Violation& b) {
                             const auto share = [](const Violation& v) { return static_cast<float>(v.relative); };
                             if (a.order != b.order) return a.order < b.order;
                             if (share(a) != share(b)) return share(a) > share(b);
                             return a.contact != b.contact ? a.contact < b.contact : a.mode * ahead < b.mode * ahead;
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

// What all contacts at rest may join, of each shaft: no other contact has to do with its accelerations at an event.
// All, where shafts have no inertia: springs and dampers tie their speeds.
std::vector<int> SwitchedTrain::parts_at(const Event& event) const {
    if (!places().massless.empty()) return std::vector<int>(places().shafts.size());
    Key together;
    for (int c = 0; c < contacts(); ++c) together.modes[c] = event.at_rest[c] ? std::int8_t{0} : std::int8_t{1};
    return parts(places(), together);
}

// Where friction that grows with the load makes a limit impossible to follow, others that are tied to the contact at
// its limit may have come to theirs: the torques between them are then the nearest that hold.
std::vector<Violation> SwitchedTrain::of_neighbours(const Key& modes, const Event& event) const {
    const std::vector<int> part = parts_at(event);
    Flags at_limit;
    for (int c = 0; c < contacts(); ++c)
        if (event.at_rest[c] && modes.modes[c] != 0) at_limit[part[places().contacts[c].a]] = true;
    std::vector<Violation> out;
    for (int c = 0; c < contacts(); ++c) {
        const ContactPlace& p = places().contacts[c];
        if (p.bilateral || !event.at_rest[c] || modes.modes[c] != 0 || !std::as_const(at_limit)[part[p.a]]) continue;
        for (const int way : {-1, +1})
            if (way < 0 || !p.one_way) out.push_back({c, way, n_derivatives, 0.0});
    }
    return out;
}

bool SwitchedTrain::holds_more(const ContactPlace& c) const {
    if (c.kind == ContactPlace::gear || c.kind == ContactPlace::stop) return false;
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
double SwitchedTrain::violation(const SparseRegime& r, const Instant& now, const Event& event) {
    SparseFlow along(r.rate, now, room_);
    double worst = 0.0;
    for (std::size_t g = 0; g < r.guards.size(); ++g) {
        const auto& guard = r.guards[g];
        if (is_of_moving(guard, event) || !guard.is_of_contact()) continue;
        double value = evaluate(guard.form, now);
        const double size = magnitude(guard.form, now);
        if (std::fabs(value) <= rounding * r.near_event[g] / far_from_event) value = 0.0;
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

}  // namespace lostmotion::model
