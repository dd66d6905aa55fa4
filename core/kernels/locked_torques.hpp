// Where the torques that rest leaves open come from: what their values depend on.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "lostmotion/model/held_torque.hpp"
#include "lostmotion/solver/components.hpp"
#include "system.hpp"

namespace lostmotion {

template <class D>
class LockedTorques {
 public:
    using System = model::TrainSystem<D>;
    using Regime = typename System::Regime;
    using State = StateOf<D>;
    using Memory = typename D::Memory;
    using Locked = model::LockedTorque<LinearForm>;
    using Torques = Few<double, 12>;  // by contact

    explicit LockedTorques(const System& system) : system_(system) {}

    // Each torque is as it was or at a bound in a regime, which is that at rest or, where contacts have come to their
    // limits and turn back at once, that at the limits, which gives the other torques.
    struct Hold {
        model::SharedRegime at_limit;      // empty: the regime at rest itself
        std::vector<model::Bound> bounds;  // in the order of that regime's locked torques
    };
    // torques: those before. Nothing if the torques are elsewhere.
    std::optional<Hold> find(const Regime& rest, const Torques& torques, const State& x, const Memory& memory,
                             const InputsOf<D>& u) const {
        Hold hold;
        if (holds(rest, rest, torques, x, memory, u, hold.bounds)) return hold;
        std::vector<const typename System::Guard*> used_up;
        for (const auto& guard : rest.guards)
            if (used_up.size() < max_at_limit && guard.kind == model::Guard::capacity &&
                is_zero(guard.form, x, memory, u))
                used_up.push_back(&guard);
        InstantOf<D> now{};
        now.x = x;
        now.memory = memory;
        now.input[0] = u;
        for (std::size_t count = 1; count <= used_up.size(); ++count)
            for (unsigned some = 1; some < 1u << used_up.size(); ++some) {
                if (static_cast<std::size_t>(std::popcount(some)) != count) continue;
                model::Key modes = rest.key;
                for (std::size_t k = 0; k < used_up.size(); ++k)
                    if (some >> k & 1)
                        modes.modes[used_up[k]->contact] = static_cast<std::int8_t>(used_up[k]->neighbour);
                auto at_limit = system_.build_at(rest, modes, now);
                if (!at_limit->solvable || !holds(*at_limit, rest, torques, x, memory, u, hold.bounds)) continue;
                hold.at_limit = std::move(at_limit);
                return hold;
            }
        return std::nullopt;
    }
    std::optional<Hold> find(const ResetOf<System>& r) const {
        Torques torques{};
        const auto& contacts = system_.assembly().places().contacts;
        for (std::size_t c = 0; c < contacts.size(); ++c)
            if (contacts[c].kind != model::ContactPlace::shaft)
                torques[c] = evaluate<D>(torque(r.before, static_cast<int>(c)), r.x, r.memory, r.input[0]);
        return find(r.after, torques, r.switching.x, r.switching.memory, r.input_after[0]);
    }
    // Torques that the regime at rest leaves open and that the one at the limits gives, where there is one.
    template <class Use>
    void each_given(const Hold& hold, const Regime& rest, Use&& use) const {
        if (!hold.at_limit) return;
        for (const Locked& l : rest.locked)
            if (!hold.at_limit->redundant[l.contact]) use(l);
    }
    // What a contact of a gear or of a coupling takes.
    const LinearForm& torque(const Regime& r, int contact) const {
        const model::ContactPlace& c = system_.assembly().places().contacts[static_cast<std::size_t>(contact)];
        return c.kind == model::ContactPlace::gear ? r.output_torque[c.element] : r.contact_torque[contact];
    }

 private:
    static constexpr std::size_t max_at_limit = 6;  // contacts that come to their limits together

    static double magnitude_of(const LinearForm& f, const State& x, const Memory& m, const InputsOf<D>& u) {
        return lostmotion::magnitude<D>(f, x, m, u);
    }
    static bool is_zero(const LinearForm& f, const State& x, const Memory& m, const InputsOf<D>& u) {
        return std::fabs(evaluate<D>(f, x, m, u)) <= rounding * magnitude_of(f, x, m, u);
    }
    // Are the torques that rest leaves open those that this regime gives?
    bool holds(const Regime& r, const Regime& rest, const Torques& torques, const State& x, const Memory& memory,
               const InputsOf<D>& u, std::vector<model::Bound>& bounds) const {
        bounds.resize(r.locked.size());
        Memory m = memory;
        for (const Locked& l : r.locked) m[l.memory] = torques[l.contact];
        for (std::size_t k = 0; k < r.locked.size(); ++k) {
            const Locked& l = r.locked[k];
            double magnitude = std::fabs(torques[l.contact]);
            const model::HeldTorque held = model::held_torque(l, torques, [&](const LinearForm& form) {
                magnitude += magnitude_of(form, x, m, u);
                return evaluate<D>(form, x, m, u);
            });
            bounds[k] = held.bound;
            if (!(std::fabs(held.value - memory[l.memory]) <= rounding * magnitude)) return false;
            m[l.memory] = memory[l.memory];
        }
        for (const Locked& l : rest.locked) {
            if (r.redundant[l.contact]) continue;
            const LinearForm& given = torque(r, l.contact);
            const double was = memory[l.memory], gap = evaluate<D>(given, x, memory, u) - was;
            if (!(std::fabs(gap) <= rounding * (magnitude_of(given, x, memory, u) + std::fabs(was)))) return false;
        }
        return true;
    }

    const System& system_;
};

}  // namespace lostmotion
