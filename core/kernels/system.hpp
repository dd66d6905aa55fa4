// A train as the solvers see it: a switched linear system of compile-time dimensions.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "lostmotion/model/scales.hpp"
#include "lostmotion/model/switched_train.hpp"
#include "lostmotion/parts/stepper_winding.hpp"
#include "pack.hpp"
#include "unchanged_contacts.hpp"

namespace lostmotion::model {

// Dimensions of the kernels whose sizes are known when they are compiled; a train takes the smallest that holds it, or
// else that for any size. Every input that there is room for costs time at every event check, so there is room for few.
using Least = Dims<4, 1, 2, 2, 3, 16>;  // motor, gear and load, as the paper has them
using Middle = Dims<8, 2, 6, 10, 12, 64>;

template <class D>
class TrainSystem {
 public:
    using Dims = D;
    using Key = model::Key;
    using Guard = SparseRegime::Guard;
    using Regime = SparseRegime;
    using State = StateOf<D>;

    explicit TrainSystem(const Assembly& assembly)
        : assembly_(assembly), counts_(counts_of(assembly.layout())), search_(assembly) {
        for (const GearPlace& g : assembly.places().gears) {
            if (g.twist != nowhere) twists_[n_twists_++] = g.twist;
            has_parametric_work_ = has_parametric_work_ || g.parametric_work != nowhere;
        }
    }

    const Assembly& assembly() const { return assembly_; }
    const CountsOf<D>& counts() const { return counts_; }
    // Conditions that end a regime, at most.
    int most_guards() const {
        if constexpr (std::same_as<D, Any>)
            return assembly_.places().most_guards();
        else
            return D::guards;
    }
    // Whether a regime has had more guards than there is room for: then nothing that follows is certain.
    bool overflowed() const { return overflowed_; }
    SwitchedTrain& search() const { return search_; }

    SharedRegime build(const Key& key) const {
        const SharedRegime& out = search_.regimes().share(key);
        if (out->guards.size() > static_cast<std::size_t>(D::guards)) overflowed_ = true;
        return out;
    }
    const std::vector<Regime::PowerTerms>& flows(const Regime& r) const { return search_.regimes().flows(r); }
    // In these modes, at the instant and the torques of another regime.
    SharedRegime build_at(const Regime& other, const Key& modes, const InstantOf<D>& now) const {
        return build(search_.branches_at(other, modes, by_layout(now)));
    }
    Found start(InstantOf<D>& now, Key& key) const {
        Instant& at = by_layout(now);
        const Found found = search_.start(at, key);
        take(at, now);
        add_parametric_work(assembly_.meshes_at(now.x), key, now);
        return certain(found);
    }
    // Regime that follows `key`: after a guard of its own has reached zero or, without one, after an input has changed.
    // Most regimes go on or lead across an edge: there is nothing to search then. input: the inputs up to this instant.
    template <class Cache>
    Found next(Cache& cache, InstantOf<D>& now, const Guard* fired, Key& key, const InputsOf<D>& input) const {
        std::optional<Key> before;
        if (has_parametric_work_) before = key;
        Flags given_rest{};
        const bool comes_to_rest = fired == nullptr && search_.follow_given(now.x, now.input[0], key, given_rest);
        Found found = Found::yes;
        const auto without_search = [&] {
            if (fired == nullptr) return !comes_to_rest && stays<D>(cache.entry(key), now, input);
            return fired->is_edge() ? goes_on<D>(cache, now, *fired, key)
                                    : goes_as_before<D>(search_, cache, now, *fired, key);
        };
        if (!without_search()) {
            const auto number = fired == nullptr ? nowhere : fired - cache.regime(key).guards.data();
            Instant& at = by_layout(now);
            SwitchedTrain::Inputs left;
            copy_numbers(input, assembly_.layout().inputs, left);
            const Key from = key;
            found = search_.next(at, static_cast<int>(number), key, left, given_rest);
            take(at, now);
            if (fired != nullptr && found == Found::yes) remember<D>(search_, cache, *fired, from);
        }
        if (before) add_parametric_work(*before, key, now);
        return certain(found);
    }
    template <class Now, class AtRest>
    void stop(Now& now, AtRest& at_rest) const {
        search_.stop(now, at_rest);
    }
    // Inputs that depend on the state: what straight lines leave of smooth laws, and windings of steppers.
    void set_remainders(const Key& key, const State& x, const typename D::Memory& memory, InputsOf<D>& u,
                        InputsOf<D>* rate = nullptr) const {
        set_windings(x, u, rate);
        for (const auto& e : assembly_.places().acting) {
            if (e->remainder == nowhere) continue;
            const ShaftPlace& p = assembly_.places().shafts[static_cast<std::size_t>(e->shaft)];
            const auto position = static_cast<std::size_t>(e->position);
            const double field_speed = rate == nullptr || e->position == model::nowhere ? 0.0 : (*rate)[position];
            const auto rest = e->remainder_at({x[p.speed] - field_speed, e->seen(x[p.angle], u), 0.0, memory[e->turn]},
                                              key.branch[e->branch]);
            u[e->remainder] = rest.value;
            if (rate != nullptr) (*rate)[e->remainder] = rest.rate;
        }
    }
    // The same for the search of the next regime, where no piece is known yet: the law is continuous.
    void set_remainders(InstantOf<D>& now) const {
        set_windings(now.x, now.input[0], &now.input[1], &now.input_magnitudes);
        for (const auto& e : assembly_.places().acting) {
            if (e->remainder == nowhere) continue;
            ShaftInstant here = assembly_.places().instant_of(*e, now);
            here.turn = e->turn_at(here.angle);
            if (e->position != model::nowhere) here.speed -= now.input[1][e->position];
            const auto rest = e->remainder_at(here, e->next(0, here));
            now.input[0][e->remainder] = rest.value;
            now.input[1][e->remainder] = rest.rate;
            now.input_magnitudes[e->remainder] = rest.magnitude;
        }
    }
    int n_twists() const { return n_twists_; }
    int twist_state(int t) const { return twists_[static_cast<std::size_t>(t)]; }
    const LinearForm& torque_at_load(const Regime& r) const {
        return r.output_torque[assembly_.train().gears.empty() ? 0 : assembly_.train().gears.size() - 1];
    }
    bool has_dry_contacts() const {
        const auto& contacts = assembly_.places().contacts;
        return std::any_of(contacts.begin(), contacts.end(), [](const ContactPlace& c) { return !c.bilateral; });
    }

    State balanced_scale() const {
        State s = filled<D>(counts_, 1.0);
        model::balanced_scale(assembly_, s, D::coupled);
        return s;
    }
    State rated_scale() const {
        State s = filled<D>(counts_, 1.0);
        model::rated_scale(assembly_, s);
        return s;
    }

 private:
    template <class Magnitudes = InputsOf<D>>
    void set_windings(const State& x, InputsOf<D>& u, InputsOf<D>* rate = nullptr,
                      Magnitudes* magnitudes = nullptr) const {
        const Places& places = assembly_.places();
        for (std::size_t m = 0; m < places.motors.size(); ++m) {
            const MotorPlace& p = places.motors[m];
            if (p.winding == nowhere) continue;
            const StepperWinding winding{assembly_.train().motors[m].law};
            const ShaftPlace& shaft = places.shafts[static_cast<std::size_t>(assembly_.train().motors[m].shaft)];
            const double level = p.level == nowhere ? 1.0 : u[p.level];
            const auto flow =
                winding.rates({x[shaft.angle], x[shaft.speed], u[p.command], level, {x[p.current], x[p.current + 1]}});
            u[p.winding] = flow.torque;
            for (int k = 0; k < 2; ++k) u[p.winding + 1 + k] = flow.rate[static_cast<std::size_t>(k)];
            if (rate != nullptr) (*rate)[p.winding] = flow.torque_rate;
            if (magnitudes != nullptr) (*magnitudes)[p.winding] = winding.motor.holding_torque;
        }
    }
    Found certain(Found found) const {
        return search_.interruption.requested() ? Found::interrupted : overflowed_ ? Found::outside : found;
    }
    // An instant as the search has it, and what this has changed of it.
    Instant& by_layout(const InstantOf<D>& now) const {
        const Layout& n = assembly_.layout();
        at_.reach(n);
        at_.time = now.time;
        unpack_state<D>(now.x, n, at_.x.data());
        copy_numbers(now.memory, n.memory, at_.memory);
        for (std::size_t k = 0; k < n_derivatives; ++k) copy_numbers(now.input[k], n.inputs, at_.input[k]);
        copy_numbers(now.input_magnitudes, n.inputs, at_.input_magnitudes);
        return at_;
    }
    void take(const Instant& at, InstantOf<D>& now) const {
        const Layout& n = assembly_.layout();
        for (int k = 0; k < n.states; ++k) now.x[state_place<D>(n, k)] = at.x.data()[k];
        make_room(now.memory, n.memory);
        std::copy_n(at.memory.data(), n.memory, now.memory.data());
    }
    // Numbers that a train of any size has not been asked for are zero.
    template <class From, class To>
    static void copy_numbers(const From& from, int count, To& to) {
        to.reach(static_cast<std::size_t>(count));
        const int known = std::min(count, static_cast<int>(from.size()));
        std::copy_n(from.data(), known, to.data());
        std::fill(to.data() + known, to.data() + count, 0.0);
    }
    // A step of the stiffness changes the energy of a spring at the twist that it has.
    void add_parametric_work(const Key& before, const Key& after, InstantOf<D>& now) const {
        for (std::size_t g = 0; g < assembly_.train().gears.size(); ++g) {
            const GearPlace& p = assembly_.places().gears[g];
            if (p.parametric_work == nowhere) continue;
            const auto gear = static_cast<int>(g);
            now.memory[p.parametric_work] +=
                (assembly_.stiffness_factor(gear, after) - assembly_.stiffness_factor(gear, before)) *
                assembly_.train().gears[g].law.curve.energy(now.x[p.twist]);
        }
    }

    const Assembly& assembly_;
    const CountsOf<D> counts_;
    mutable SwitchedTrain search_;
    mutable Instant at_;  // its memory is used again
    ListOf<D, int, D::coupled> twists_{};
    int n_twists_ = 0;
    bool has_parametric_work_ = false;
    mutable bool overflowed_ = false;
};

}  // namespace lostmotion::model
