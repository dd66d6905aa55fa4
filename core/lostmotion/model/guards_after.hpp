// Which guards of a regime do not hold just after an instant.
#pragma once

#include <vector>

#include "../base/sign.hpp"
#include "../elements/contact_place.hpp"
#include "../elements/regime.hpp"

namespace lostmotion::model {

// A guard of a contact that is violated.
struct Violation {
    int contact = nowhere, mode = 0;  // the mode that it suggests
    int order = 0;
    double relative = 0.0;
    bool turning = false;
};
// What is violated of the contacts; each violation by itself only where there is a list for them.
struct Violated {
    std::vector<Violation>* each = nullptr;
    bool any = false, only_turning = true;

    void clear() {
        if (each != nullptr) each->clear();
        any = false;
        only_turning = true;
    }
    void add(const Violation& v) {
        if (each != nullptr) each->push_back(v);
        any = true;
        only_turning = only_turning && v.turning;
    }
};

// Crosses an edge: takes the branch beyond it and, where that shifts a memory, shifts it.
template <class G>
void cross(const G& guard, Key& key) {
    if (guard.branch != nowhere) key.branch[guard.branch] = static_cast<std::int16_t>(guard.neighbour);
}
template <class G, class Memory>
void shift(const G& guard, Memory& memory) {
    if (guard.branch != nowhere && guard.memory != nowhere) memory[guard.memory] += guard.shift;
}

// Does what drives a contact at its limit turn back just after now?
template <class F, class Form>
bool turns_back(F& along, const Form& torque) {
    for (int k = 1; k + 1 < static_cast<int>(n_derivatives); ++k) {
        const double rate = along.rate(torque, k);
        if (std::fabs(rate) > along.noise(along.rate_magnitude(torque, k), along.rate(torque, k + 1)))
            return rate < 0.0;
    }
    return false;
}

// A guard of a law or an input that does not hold just after now; those of contacts are collected.
// each_near_zero(use): calls use(guard, value, magnitude) for each guard that is not clear of zero, until it returns
// false. by_value_alone(guard): one that is zero to rounding holds, whatever its derivatives.
template <class Form, class F, class Drivers, class EachNearZero, class ByValue>
const GuardOf<Form>* first_left(F&& along, const Drivers& drivers, EachNearZero&& each_near_zero,
                                ByValue&& by_value_alone, Violated& of_contacts) {
    const GuardOf<Form>* left = nullptr;
    for (const Driver<Form>& driver : drivers)
        if (turns_back(along, driver.torque)) of_contacts.add({driver.contact, 0, n_derivatives, 0.0, true});
    each_near_zero([&](const GuardOf<Form>& guard, double value, double size) {
        const Sign s = sign_after(along, guard.form, value, size, by_value_alone(guard));
        if (s.sign >= 0) return true;
        if (!guard.is_of_contact()) {
            left = &guard;
            return false;
        }
        of_contacts.add({guard.contact, guard.kind == GuardKinds::speed ? 0 : guard.neighbour,
                         s.order - Guard::acceleration_order(guard.kind), -s.relative,
                         guard.kind == GuardKinds::turning});
        return true;
    });
    return left;
}

}  // namespace lostmotion::model
