// From one regime to the next: what both solvers do at an event.
#pragma once

#include <optional>

#include "contact.hpp"
#include "kernel/inputs.hpp"

namespace lostmotion {

enum class Status {
    done,
    interrupted,
    jammed,   // no combination of contact modes is consistent
    outside,  // left the extended loss map, or the range of the arithmetic
    zeno,     // switching instants accumulate
    unseen,   // a nonlinear remainder acts on a drive whose contacts would not feel it
};

inline Status status_of(Found found) {
    if (found == Found::yes) return Status::done;
    return found == Found::outside ? Status::outside : Status::jammed;
}

// What ended a regime.
struct Switching {
    double time = 0.0;
    Guard::Kind kind = Guard::speed;
    Contact contact = input_contact;
    bool input_jump = false;  // an input changed its value or slope; kind and contact mean nothing
    int guard = -1;           // its number among those of the regime before; -1: an input jumped
    RegimeKey before, after;
    State x{};
    Memory memory;                                   // after it, as x
    double torque_before = 0.0, torque_after = 0.0;  // T_2 [N m], left and right limit
};

// Inputs and their rates at an instant, for the search of contact modes. At a jump: the right limit.
inline void see_inputs(const InputState<DriveDims>& input, double time, Instant& now) {
    now.time = time;
    input.jet(n_derivatives, now.input.data());
    now.input_size = input.sizes();
}

// Whether an observer of a run is to be told of the next switching: if it has switching(), and wants_switching() does
// not say otherwise.
template <class Observer>
bool wants_switching(const Observer& observer) {
    if constexpr (!requires(Observer o, Switching s) { o.switching(s); })
        return false;
    else if constexpr (requires { observer.wants_switching(); })
        return observer.wants_switching();
    else
        return true;
}

// Finds the regime that follows after `fired` has reached zero, with the inputs of that instant, or, if it is nullptr,
// after an input has jumped. Tells the observer, if it wants to know.
template <class System, class Cache, class Observer>
Status switch_regime(const System& system, Cache& cache, InputState<DriveDims>& input, double time, const Guard* fired,
                     Instant& now, RegimeKey& key, Observer& observer) {
    if (fired != nullptr && fired->kind == Guard::outside) return Status::outside;
    const bool wanted = wants_switching(observer);
    Switching s;
    if (wanted) {
        const Regime& old = cache.regime(key);
        if (fired == nullptr) input.anchor_left(time);
        s.time = time;
        s.input_jump = fired == nullptr;
        s.before = key;
        s.torque_before = evaluate(old.output_torque, now.x, now.memory, input.values());
        if (fired != nullptr) {
            s.kind = fired->kind;
            s.contact = fired->contact;
            s.guard = static_cast<int>(fired - old.guards.data());
        }
    }
    // An input that drives a contact to its limit has taken the torque with it up to here.
    std::optional<std::array<double, n_inputs>> before;
    if (fired == nullptr) {
        if (cache.regime(key).driving_input >= 0) {
            input.anchor_left(time);
            before = input.values();
        }
        input.anchor(time);
    }
    see_inputs(input, time, now);
    const Found found = system.next(cache, now, fired, key, before.value_or(now.input[0]));
    if (found != Found::yes) return status_of(found);
    if constexpr (requires { observer.switching(s); }) {
        if (wanted) {
            s.after = key;
            s.x = now.x;
            s.memory = now.memory;
            s.torque_after = evaluate(cache.regime(key).output_torque, now.x, now.memory, now.input[0]);
            observer.switching(s);
        }
    }
    return Status::done;
}

// Counts switchings that crowd: true if more than a hundred lie within a few thousand roundings of the time.
class Accumulation {
 public:
    bool add(double time, double unit) {
        if (count_ == 0 || time - since_ > span * std::fmax(std::fabs(time), unit)) {
            count_ = 0;
            since_ = time;
        }
        return ++count_ > most;
    }

 private:
    static constexpr int most = 100;
    static constexpr double span = 1e4 * std::numeric_limits<double>::epsilon();
    int count_ = 0;
    double since_ = 0.0;
};

}  // namespace lostmotion
