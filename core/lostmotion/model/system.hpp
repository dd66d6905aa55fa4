// A train as the solvers see it: a switched linear system of compile-time dimensions.
#pragma once

#include "modes.hpp"
#include "pack.hpp"
#include "scales.hpp"

namespace lostmotion::model {

// Dimensions of the kernel for trains. Guards are 64 at most: the solver keeps them as bits of a word.
using Narrow = Dims<4, 1, 6, 6, 8, 32>;
using Middle = Dims<8, 2, 8, 10, 12, 64>;
using Wide = Dims<16, 4, 16, 20, 24, 64>;

template <class D>
struct TrainRegime : PackedRegime<D> {
    model::Key key;
    model::Regime rows;  // as composed: torques and power flows of the elements
};

template <class D>
class TrainSystem {
 public:
    using Dims = D;
    using Key = model::Key;
    using Guard = PackedGuard<D>;
    using Regime = TrainRegime<D>;
    using State = StateOf<D>;

    explicit TrainSystem(const Assembly& assembly) : assembly_(assembly), search_(assembly, D{}) {
        for (const GearPlace& g : assembly.places().gears)
            if (g.twist != nowhere) twists_[n_twists_++] = g.twist;
    }

    const Assembly& assembly() const { return assembly_; }
    // Whether a regime has had more guards than there is room for: then nothing that follows is certain.
    bool overflowed() const { return overflowed_; }

    Regime build(const Key& key) const {
        model::Regime rows = assembly_.build(key);
        Regime r{pack<D>(rows, assembly_), key, {}};
        r.rows = std::move(rows);
        if (!r.complete) overflowed_ = true;
        return r;
    }
    template <class Cache>
    Found start(Cache& cache, InstantOf<D>& now, Key& key) const {
        const Found found = search_.start(cache, now, key);
        return overflowed_ ? Found::outside : found;
    }
    template <class Cache>
    Found next(Cache& cache, InstantOf<D>& now, const Guard* fired, Key& key, const InputsOf<D>& input) const {
        const Found found = search_.next(cache, now, fired, key, input);
        return overflowed_ ? Found::outside : found;
    }
    template <class X, class AtRest>
    void stop(X& x, AtRest& at_rest) const {
        search_.stop(x, at_rest);
    }
    int n_twists() const { return n_twists_; }
    int twist_state(int t) const { return twists_[static_cast<std::size_t>(t)]; }
    const LinearFormOf<D>& torque_at_load(const Regime& r) const {
        return r.output_torque[assembly_.train().gears.empty() ? 0 : assembly_.train().gears.size() - 1];
    }
    bool has_dry_contacts() const {
        const auto& contacts = assembly_.places().contacts;
        return std::any_of(contacts.begin(), contacts.end(), [](const ContactPlace& c) { return !c.bilateral; });
    }

    State balanced_scale() const {
        State s;
        s.fill(1.0);
        model::balanced_scale(assembly_, s, D::coupled);
        return s;
    }
    State rated_scale() const {
        State s;
        s.fill(1.0);
        model::rated_scale(assembly_, s);
        return s;
    }

 private:
    const Assembly& assembly_;
    SwitchedTrain<D> search_;
    std::array<int, D::coupled> twists_{};
    int n_twists_ = 0;
    mutable bool overflowed_ = false;
};

}  // namespace lostmotion::model
