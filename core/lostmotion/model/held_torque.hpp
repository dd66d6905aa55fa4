// Torques that rest leaves open: where they come to lie.
#pragma once

#include <array>
#include <limits>

#include "../elements/regime.hpp"

namespace lostmotion::model {

struct HeldTorque {
    double value;
    Bound bound;
};

// As it was before, or at the nearest value that its own contact and the friction of the shaft behind it can hold.
// torques: of gears and couplings before, by contact. value(form): of a form now.
template <class Form, class Torques, class Value>
HeldTorque held_torque(const LockedTorque<Form>& l, const Torques& torques, Value&& value) {
    constexpr double unbounded = std::numeric_limits<double>::infinity();
    HeldTorque low{l.has_low ? value(l.low) : -unbounded, Bound::low},
        high{l.has_high ? value(l.high) : unbounded, Bound::high};
    if (l.on_held_shaft) {
        double needs = value(l.needs);
        for (std::size_t c = 0; c < torques.size(); ++c)
            if (l.needs_torque[c] != 0.0) needs += l.needs_torque[c] * torques[c];
        const double friction = value(l.friction);
        HeldTorque lower = low, upper = high;
        if (needs - friction > low.value) lower = {needs - friction, Bound::friction_below};
        if (needs + friction < high.value) upper = {needs + friction, Bound::friction_above};
        if (lower.value <= upper.value) {
            low = lower;
            high = upper;
        }
    }
    const double before = torques[l.contact];
    if (before < low.value) return low;
    if (before > high.value) return high;
    return {before, Bound::none};
}

}  // namespace lostmotion::model
