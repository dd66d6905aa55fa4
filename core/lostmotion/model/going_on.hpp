// Whether contacts go on as they were where an edge is crossed or an input changes, in a kernel: then there is nothing
// to search.
#pragma once

#include "../kernel/bit_set.hpp"
#include "../kernel/flow.hpp"
#include "guards_after.hpp"
#include "pack.hpp"
#include "sparse_regime.hpp"

namespace lostmotion::model {

// Do all guards of a regime of a kernel hold just after now, but for those that are ignored?
template <class D, class E, class ByValue>
bool all_hold(const E& e, const InstantOf<D>& now, const BitSet<D::guards>& ignored, ByValue&& by_value_alone) {
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
    return first_left<LinearForm>(Flow<D>(e.rates, now), e.regime->drivers, each_near_zero, by_value_alone,
                                  of_contacts) == nullptr &&
           !of_contacts.any;
}

// Across an edge of a law or a limit the motion is smooth enough for every contact to go on as it was; if that is
// consistent there is nothing to search.
template <class D, class Regimes>
bool goes_on(Regimes& regimes, InstantOf<D>& now, const SparseRegime::Guard& fired, Key& key) {
    if (!fired.is_edge()) return false;
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
    BitSet<D::guards> moving;  // the modes of contacts that move were chosen by their speeds
    for (int k = 0; k < e.n_speeds; ++k)
        if (!e.regime->at_rest[e.regime->guards[e.speeds[k]].contact]) moving.set(e.speeds[k]);
    return all_hold<D>(e, now, moving, [](const SparseRegime::Guard& g) { return g.kind != GuardKinds::set_off; });
}

}  // namespace lostmotion::model
