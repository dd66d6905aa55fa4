// Where a dry contact acts.
#pragma once

namespace lostmotion::model {

inline constexpr int nowhere = -1;

// A contact: of one shaft with the frame, of two with one another, or of a gear with its housing as well.
struct ContactPlace {
    enum Kind { shaft, gear, coupling } kind = shaft;
    int element = 0;
    int a = 0, b = nowhere;           // shafts
    double per_a = 1.0, per_b = 0.0;  // its speed is per_a w_a + per_b w_b + per_housing w_housing
    bool bilateral = false;           // a rigid gear: stuck, without limit
    bool one_way = false;             // a freewheel: stuck or -1; rigid flanks: pressed or -1
    int locked = nowhere;             // memory: its torque while the motion does not determine it
    int housing = nowhere;
    double per_housing = 0.0;
    int flanks = nowhere;  // of rigid flanks with backlash: the state that their twist is
    double reach = 0.0;    // and half the backlash [rad]

    // May it be at rest where the states are these? Flanks are only where they touch.
    template <class X>
    bool may_rest(const X& x) const {
        return flanks == nowhere || x[flanks] == reach || x[flanks] == -reach;
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
