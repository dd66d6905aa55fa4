// From one regime to the next: what both solvers do at an event.
#pragma once

#include "contact.hpp"
#include "signal.hpp"

namespace lostmotion {

enum class Status {
    done,
    interrupted,
    jammed,   // no combination of contact modes is consistent
    outside,  // left the extended loss map, or the range of the arithmetic
    zeno,     // switching instants accumulate
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
inline void see_inputs(const InputState& input, double time, Instant& now) {
    now.time = time;
    input.jet(n_derivatives, now.input.data());
    now.input_size = input.sizes();
}

// Finds the regime that follows after `fired` has reached zero, with the inputs of that instant, or, if it is nullptr,
// after an input has jumped. torques: whether those of the record are wanted.
template <class System, class Cache>
Status switch_regime(const System& system, Cache& cache, InputState& input, double time, const Guard* fired, bool torques,
                     Instant& now, RegimeKey& key, Switching& s) {
    s.time = time;
    s.before = key;
    s.input_jump = fired == nullptr;
    const Regime& old = cache.regime(key);
    if (fired != nullptr) {
        s.kind = fired->kind;
        s.contact = fired->contact;
        s.guard = static_cast<int>(fired - old.guards.data());
        if (fired->kind == Guard::outside) return Status::outside;
    } else {
        input.anchor_left(time);
        if (torques) s.torque_before = evaluate(old.output_torque, now.x, now.memory, input.values());
        input.anchor(time);
    }
    see_inputs(input, time, now);
    if (fired != nullptr && torques) s.torque_before = evaluate(old.output_torque, now.x, now.memory, now.input[0]);
    const Found found = system.next(cache, now, fired, key);
    if (found != Found::yes) return status_of(found);
    s.after = key;
    s.x = now.x;
    s.memory = now.memory;
    if (torques) s.torque_after = evaluate(cache.regime(key).output_torque, now.x, now.memory, now.input[0]);
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
