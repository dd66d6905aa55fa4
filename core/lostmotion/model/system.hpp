// A train as the solvers see it: a switched linear system of compile-time dimensions.
#pragma once

#include <type_traits>

#include "modes.hpp"
#include "pack.hpp"
#include "scales.hpp"

namespace lostmotion::model {

// Dimensions of the kernel for trains, which takes the narrowest that holds one. Guards are 64 at most: the solver
// keeps them as bits of a word. Every input that there is room for costs time at every event check, so there is room
// for few.
using Narrow = Dims<4, 1, 4, 6, 8, 32>;
using Middle = Dims<8, 2, 6, 10, 12, 64>;
using Wide = Dims<16, 4, 16, 20, 24, 64>;
using Widest = std::conditional_t<holds(Kernel::wide), Wide, std::conditional_t<holds(Kernel::middle), Middle, Narrow>>;

template <class D>
struct TrainRegime : PackedRegime<D> {
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
        Regime r{pack<D>(rows, assembly_), {}};
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
    void near_event(const FormTable<D, D::guards>& guards, typename FormTable<D, D::guards>::Values& out) const {
        search_.near_event(guards, out);
    }
    template <class X, class AtRest>
    void stop(X& x, AtRest& at_rest) const {
        search_.stop(x, at_rest);
    }
    // Inputs that depend on the state: what the chords of a torque over angle leave of its sine.
    void set_remainders(const Key& key, const State& x, const typename D::Memory& memory, InputsOf<D>& u,
                        InputsOf<D>* rate = nullptr) const {
        each_remainder([&](const AngleTorque& law, const AngleTorquePlace& p, const ShaftPlace& shaft) {
            const Remainder rest(law.torque, x[shaft.angle], x[shaft.speed], memory[p.turn], key.branch[p.piece]);
            u[p.remainder] = rest.value;
            if (rate != nullptr) (*rate)[p.remainder] = rest.rate;
        });
    }
    // The same for the search of the next regime, where no piece is known yet: the law is continuous.
    void set_remainders(InstantOf<D>& now) const {
        each_remainder([&](const AngleTorque& law, const AngleTorquePlace& p, const ShaftPlace& shaft) {
            const double phi = now.x[shaft.angle], turn = law.torque.turn(phi);
            const Remainder rest(law.torque, phi, now.x[shaft.speed], turn, law.torque.piece(phi - turn));
            now.input[0][p.remainder] = rest.value;
            now.input[1][p.remainder] = rest.rate;
            now.input_magnitudes[p.remainder] = std::fabs(law.torque.smooth(phi));
        });
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
    struct Remainder {
        double value, rate;

        Remainder(const PeriodicCurve& curve, double phi, double speed, double turn, int piece)
            : value(curve.smooth(phi) - curve.at_zero(piece) - curve.slope(piece) * (phi - turn)),
              rate((curve.smooth_slope(phi) - curve.slope(piece)) * speed) {}
    };
    template <class Use>
    void each_remainder(Use&& use) const {
        const Places& places = assembly_.places();
        for (std::size_t k = 0; k < places.angle_torques.size(); ++k) {
            const AngleTorque& law = assembly_.train().angle_torques[k];
            if (places.angle_torques[k].remainder != nowhere)
                use(law, places.angle_torques[k], places.shafts[static_cast<std::size_t>(law.shaft)]);
        }
    }

    const Assembly& assembly_;
    SwitchedTrain<D> search_;
    std::array<int, D::coupled> twists_{};
    int n_twists_ = 0;
    mutable bool overflowed_ = false;
};

}  // namespace lostmotion::model
