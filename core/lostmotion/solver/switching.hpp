// From one regime to the next: what both solvers do at an event.
#pragma once

#include <optional>
#include <utility>

#include "../base/status.hpp"
#include "../kernel/flow.hpp"
#include "../kernel/inputs.hpp"
#include "../kernel/rates.hpp"
#include "observer.hpp"

namespace lostmotion {

// What ended a regime.
template <class System>
struct SwitchingOf {
    using D = typename System::Dims;
    using Guard = typename System::Guard;

    double time = 0.0;
    typename Guard::Kind kind = Guard::speed;
    typename D::Contact contact{};
    bool input_jump = false;  // an input changed its value or slope; kind and contact mean nothing
    int guard = -1;           // its number among those of the regime before; -1: an input jumped
    int branch = -1;          // the law whose branch it has left, if any
    typename System::Key before, after;
    StateOf<D> x{};
    typename D::Memory memory{};                     // after it, as x
    double torque_before = 0.0, torque_after = 0.0;  // T_2 [N m] at the load, left and right limit
};

// Inputs and their rates at an instant, for the search of contact modes. At a jump: the right limit.
template <class D>
void see_inputs(const InputState<D>& input, double time, InstantOf<D>& now) {
    now.time = time;
    input.template jet<n_derivatives>(now.input.data());
    now.input_magnitudes = input.magnitudes();
}

// The same, with those inputs that depend on the state, if the system has any.
template <class System, class D>
void see_inputs(const System& system, const InputState<D>& input, double time, InstantOf<D>& now) {
    see_inputs(input, time, now);
    if constexpr (requires { system.set_remainders(now); }) system.set_remainders(now);
}

// Does an input take the torque of a contact at its limit along in this regime?
template <class Regime>
bool follows_inputs(const Regime& r) {
    return !r.drivers.empty();
}

// What the search of modes has found to jam, if the system has one; else negative.
template <class System>
int jams_at(const System& system) {
    if constexpr (requires { system.search(); })
        return system.search().jams_at;
    else
        return -1;
}

// Completes a switching with what there is after it, and shows it.
template <class System, class Cache, class D>
void show_switching(const System& system, Cache& cache, const InstantOf<D>& now, const typename System::Key& key,
                    SwitchingOf<System>& s, Observer<System>& observer) {
    s.after = key;
    s.x = now.x;
    s.memory = now.memory;
    s.torque_after = evaluate<D>(system.torque_at_load(cache.regime(key)), now.x, now.memory, now.input[0]);
    observer.switching(s);
}

// Finds the regime that follows after `fired` has reached zero, with the inputs of that instant, or, if it is nullptr,
// after an input has jumped. Shows the switching to the observer, if it wants to see it.
template <class System, class Cache, class D>
Status switch_regime(const System& system, Cache& cache, InputState<D>& input, double time,
                     const typename System::Guard* fired, InstantOf<D>& now, typename System::Key& key,
                     Observer<System>& observer) {
    using Guard = typename System::Guard;
    if (fired != nullptr && fired->kind == Guard::outside) return Status::outside;
    // The torques that contacts pass on up to a jump of an input are those of its left limit.
    if (fired == nullptr) input.anchor_left(time);
    InputsOf<D> before = input.values();
    std::optional<SwitchingOf<System>> shown;
    if (observer.wants_switching()) {
        SwitchingOf<System>& s = shown.emplace();
        const auto& old = cache.regime(key);
        s.time = time;
        s.input_jump = fired == nullptr;
        s.before = key;
        s.torque_before = evaluate<D>(system.torque_at_load(old), now.x, now.memory, before);
        if (fired != nullptr) {
            s.kind = fired->kind;
            s.contact = fired->contact;
            s.branch = fired->branch;
            s.guard = static_cast<int>(fired - old.guards.data());
        }
    }
    if (fired == nullptr) input.anchor(time);
    see_inputs(system, input, time, now);
    if (fired != nullptr) {
        before = now.input[0];
    } else if constexpr (requires { system.set_remainders(now); }) {
        InstantOf<D> left = now;
        left.input[0] = before;
        system.set_remainders(left);
        before = left.input[0];
    }
    const Found found = system.next(cache, now, fired, key, before);
    if (found != Found::yes) return status_of(found);
    if (shown) show_switching(system, cache, now, key, *shown, observer);
    return Status::done;
}

// Finds the regime anew where the inputs have changed, from what they were up to here. Shows the switching to the
// observer, if there is one and it wants to see it. changed: whether there is.
template <class System, class Cache, class D>
Status follow_change(const System& system, Cache& cache, const InputsOf<D>& left, InstantOf<D>& now,
                     typename System::Key& key, Observer<System>& observer, bool& changed) {
    const bool wanted = observer.wants_switching();
    SwitchingOf<System> s;
    s.before = key;
    if (wanted) s.torque_before = evaluate<D>(system.torque_at_load(cache.regime(key)), now.x, now.memory, left);
    const Found found = system.next(cache, now, nullptr, key, left);
    changed = !(key == s.before);
    if (found != Found::yes || !changed) return status_of(found);
    if (wanted) {
        s.time = now.time;
        s.input_jump = true;
        show_switching(system, cache, now, key, s, observer);
    }
    return Status::done;
}

// Counts switchings that crowd: more than a hundred within a few thousand roundings of the time accumulate. Where the
// rates of the regime are faster than that time, the numbers do not resolve the instants of its motion.
class Accumulation {
 public:
    // rates(): of the regime.
    template <class Rates>
    Status add(double time, double unit, Rates&& rates) {
        const double resolved = span * std::fmax(std::fabs(time), unit);
        if (time - since_ > resolved) anew_ = false;
        if (count_ == 0 || time - since_ > resolved) {
            count_ = 0;
            since_ = time;
        }
        if (++count_ <= max_count) return Status::done;
        return resolved * rates().fastest() > 1.0 ? Status::outside : Status::zeno;
    }

    // Once at each accumulation.
    bool may_begin_anew() {
        count_ = 0;
        return !std::exchange(anew_, true);
    }

 private:
    static constexpr int max_count = 100;
    static constexpr double span = 1e4 * std::numeric_limits<double>::epsilon();
    int count_ = 0;
    bool anew_ = false;
    double since_ = 0.0;
};

}  // namespace lostmotion
