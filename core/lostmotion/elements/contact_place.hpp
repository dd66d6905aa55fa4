// Where a dry contact acts.
#pragma once

#include <cmath>

namespace lostmotion::model {

inline constexpr int nowhere = -1;

// The ends of a gap at which what is rigid strikes, and with what restitution.
struct Ends {
    double low = 0.0, high = 0.0;  // [rad], of slides [m]
    double restitution = 0.0;      // speed at which they part over that at which they strike
    bool passes = false;           // the lower end gives way: from there on the next gap counts
};

// What strikes at the ends of a gap: rigid flanks, a shaft at its end stops.
struct Gap : Ends {
    int at = nowhere;           // state: where it is between the ends, a twist or an angle
    int turn = nowhere;         // memory: what the ends are counted from, if that moves
    int clock = nowhere;        // state: the time left until impacts have accumulated [s]
    int side = nowhere;         // branch: +1, -1 where they touch, +2, -2 while impacts accumulate, 0 apart
    int impact_loss = nowhere;  // memory: the energy that impulses have taken [J]

    bool present() const { return at != nowhere; }
    // At which end is it, or the nearer one? now: with states and memory.
    template <class Now>
    double side_of(const Now& now) const {
        return passes || now.x[at] > 0.5 * (low + high) ? 1.0 : -1.0;
    }
    template <class Now>
    double end(double side, const Now& now) const {
        return (turn == nowhere ? 0.0 : now.memory[turn]) + (side > 0.0 ? high : low);
    }
    // What is left of the gap there.
    template <class Now>
    double left(const Now& now) const {
        const double side = side_of(now);
        return side > 0.0 ? end(side, now) - now.x[at] : now.x[at] - end(side, now);
    }
    // Sum of the magnitudes of both ends.
    double size() const { return std::fabs(low) + std::fabs(high); }
};

// A contact: of one shaft with the frame, of a shaft with its end stops, of two with one another, or of a gear with its
// housing as well.
struct ContactPlace {
    enum Kind { shaft, gear, coupling, stop } kind = shaft;
    int element = 0;
    int a = 0, b = nowhere;           // shafts
    double per_a = 1.0, per_b = 0.0;  // its speed is per_a w_a + per_b w_b + per_housing w_housing
    bool bilateral = false;           // a rigid gear: stuck, without limit
    bool one_way = false;             // a freewheel: stuck or -1; what strikes: pressed or -1
    int locked = nowhere;             // memory: its torque while the motion does not determine it
    int housing = nowhere;
    double per_housing = 0.0;
    Gap gap{};

    // Couplings and end stops have a torque that is neither that of a gear nor friction of a shaft.
    bool has_own_torque() const { return kind == coupling || kind == stop; }
    // The shaft that its torque turns, and which way.
    int turned() const { return b == nowhere ? a : b; }
    double turns() const { return b == nowhere ? -1.0 : 1.0; }
    // May it be at rest where the states are these? What strikes is only where it touches.
    template <class Now>
    bool may_rest(const Now& now) const {
        return !gap.present() || now.x[gap.at] == gap.end(gap.side_of(now), now);
    }

    // Calls use(shaft, factor) for each part of its speed.
    template <class Use>
    void each_shaft(Use&& use) const {
        use(a, per_a);
        if (b != nowhere) use(b, per_b);
        if (housing != nowhere) use(housing, per_housing);
    }
};

}  // namespace lostmotion::model
