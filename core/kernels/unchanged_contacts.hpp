// Whether contacts go on as they were where an edge is crossed or an input changes, in a kernel: then there is nothing
// to search.
#pragma once

#include "lostmotion/kernel/bit_set.hpp"
#include "lostmotion/kernel/flow.hpp"
#include "lostmotion/model/guards_after.hpp"
#include "lostmotion/model/sparse_regime.hpp"
#include "lostmotion/model/switched_train.hpp"
#include "pack.hpp"

namespace lostmotion::model {

// Which guards of a regime of a kernel do not hold just after now, but for those that are ignored: some of a law or an
// input, or else of contacts?
struct Broken {
    bool of_laws = false, of_contacts = false;
};
template <class D, class E, class ByValue>
Broken broken(const E& e, const InstantOf<D>& now, const BitSet<D::guards>& ignored, ByValue&& by_value_alone) {
    const auto each_near_zero = [&](auto&& use) {
        typename std::decay_t<decltype(e.guards)>::Values constant, value, size;
        e.guards.constants(now.memory, constant);
        e.guards.evaluate(constant, now.x, now.input[0], value);
        e.guards.magnitudes(magnitudes(now.memory), magnitudes(now.x), now.input_magnitudes, size);
        BitSet<D::guards> near;
        for (int g = 0; g < e.guards.rows(); g += vec_width) {
            const Vec clear = clear_of_zero * load(size.data() + g) + load(e.near_event.data() + g);
            near.set(g, all_bits & ~above(load(value.data() + g), clear));
        }
        (near - ignored - e.behind).each([&](int g) {
            return use(e.regime->guards[static_cast<std::size_t>(g)], value[g], size[g]);
        });
    };
    Violated of_contacts;
    const auto* left =
        first_left<LinearForm>(Flow<D>(e.rates, now), e.regime->drivers, each_near_zero, by_value_alone, of_contacts);
    return {left != nullptr, of_contacts.any};
}
template <class D, class E, class ByValue>
bool all_hold(const E& e, const InstantOf<D>& now, const BitSet<D::guards>& ignored, ByValue&& by_value_alone) {
    const Broken b = broken<D>(e, now, ignored, by_value_alone);
    return !b.of_laws && !b.of_contacts;
}

// The guards of speeds of contacts that move: their modes were chosen by these speeds.
template <class D, class E, class AtRest>
BitSet<D::guards> moving(const E& e, const AtRest& at_rest) {
    BitSet<D::guards> out;
    for (int k = 0; k < e.n_speeds; ++k)
        if (!at_rest[e.regime->guards[e.speeds[k]].contact]) out.set(e.speeds[k]);
    return out;
}

// Across an edge of a law or a limit the motion is smooth enough for every contact to go on as it was; if that is
// consistent there is nothing to search.
template <class D, class Regimes>
bool goes_on(Regimes& regimes, InstantOf<D>& now, const SparseRegime::Guard& fired, Key& key) {
    auto& from = regimes.entry(key);
    const auto& e = regimes.beyond(from, static_cast<int>(&fired - from.regime->guards.data()), [&] {
        Key beyond = key;
        cross(fired, beyond);
        return beyond;
    });
    if (!e.regime->solvable) return false;
    const auto before = now.memory;
    shift(fired, now.memory);
    if (all_hold<D>(e, now, {}, [](const SparseRegime::Guard&) { return false; })) {
        key = e.regime->key;
        return true;
    }
    now.memory = before;
    return false;
}

// A contact has come to rest or to its limit, in a regime where it has done so before: if all regimes that the search
// has tried then turn out as they did, so would the search.
template <class D, class Regimes>
bool goes_as_before(SwitchedTrain& search, Regimes& regimes, InstantOf<D>& now, const SparseRegime::Guard& fired,
                    Key& key) {
    auto& from = regimes.entry(key);
    const auto g = static_cast<int>(&fired - from.regime->guards.data());
    const auto* known = from.tried_after(g);
    if (known == nullptr || known->regimes.empty()) return false;
    const bool comes_to_rest = fired.kind == GuardKinds::speed;
    if (!comes_to_rest && magnitude<D>(fired.form, now.x, now.memory, now.input_magnitudes) <= from.near_event[g])
        return false;
    const auto x = now.x;
    const auto memory = now.memory;
    Flags at_rest = from.regime->at_rest;
    if (comes_to_rest) at_rest[fired.contact] = true;
    search.stop(now, at_rest);
    search.turn(now, at_rest, from.regime->at_rest, key);
    // The margins of a contact that has just come to a stop are zero by chance only.
    const auto by_value_alone = [&](const SparseRegime::Guard& guard) {
        return comes_to_rest && guard.kind == GuardKinds::capacity && guard.contact == fired.contact;
    };
    const auto turns_the_other_way = [&](const auto& e) {
        Flow<D> along(e.rates, now);
        const LinearForm& speed = search.speed(fired.contact);
        const auto after = sign_after(along, speed, evaluate<D>(speed, now.x, now.memory, now.input[0]),
                                      magnitude<D>(speed, now.x, now.memory, now.input_magnitudes));
        return SwitchedTrain::turns_the_other_way(fired.neighbour, after);
    };
    const auto turns_out_as_before = [&](std::size_t k) {
        const auto& e = *known->regimes[k];
        const bool holds = k + 1 == known->regimes.size(), breaks_away = !comes_to_rest && k == 0;
        if (breaks_away) at_rest[fired.contact] = false;
        const Broken b = broken<D>(e, now, moving<D>(e, at_rest), by_value_alone);
        if (breaks_away) at_rest[fired.contact] = true;
        if (b.of_laws) return false;
        if (!holds) return b.of_contacts || (&e == &from && !comes_to_rest);
        return !b.of_contacts && !(breaks_away && turns_the_other_way(e));
    };
    for (std::size_t k = 0; k < known->regimes.size(); ++k) {
        if (turns_out_as_before(k)) continue;
        now.x = x;
        now.memory = memory;
        return false;
    }
    search.searches.trials += static_cast<long>(known->regimes.size());
    key = known->regimes.back()->regime->key;
    return true;
}
// Keeps the regimes that the search has tried, for the next event of this kind. Most events come once, so it waits for
// the second.
template <class D, class Regimes>
void remember(const SwitchedTrain& search, Regimes& regimes, const SparseRegime::Guard& fired, const Key& before) {
    constexpr std::size_t most = 9;
    if (search.tried().empty() || search.tried().size() > most) return;
    auto& from = regimes.entry(before);
    const auto g = static_cast<int>(&fired - from.regime->guards.data());
    auto* known = from.tried_after(g);
    if (known == nullptr) {
        from.tried.push_back({g, {}});
        return;
    }
    known->regimes.clear();
    for (const SparseRegime* r : search.tried()) known->regimes.push_back(&regimes.entry(r->key));
}

// An input has changed: does the regime go on? The contacts that move keep their direction. A guard that is zero to
// rounding has not ended it; the solver finds it if it goes on to fall.
// input: the inputs up to this instant.
template <class D, class E>
bool stays(const E& e, const InstantOf<D>& now, const InputsOf<D>& input) {
    // Has what drives a contact at its limit turned back where the inputs jump? A breakpoint that is met but for
    // rounding is no jump: else a contact would hold anew what it holds at rest, and another come to its limit.
    for (const auto& driver : e.regime->drivers) {
        double change = 0.0, size = 0.0;
        for (const auto& [i, share] : driver.torque.of_inputs()) {
            change += share * (now.input[0][i] - input[i]);
            size += std::fabs(share) * std::fmax(std::fabs(input[i]), std::fabs(now.input[0][i]));
        }
        if (change < -rounding * size) return false;
    }
    return all_hold<D>(e, now, moving<D>(e, e.regime->at_rest),
                       [](const SparseRegime::Guard& g) { return g.kind != GuardKinds::set_off; });
}

}  // namespace lostmotion::model
