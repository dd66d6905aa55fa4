// What a gear takes of the torque that the contact of its input shaft holds at rest, and how that changes.
#pragma once

#include <algorithm>

#include "../model/assembly.hpp"

namespace lostmotion {

// What the contact holds, F, is shared by what is dry there as the capacities are (TrainReader): the gear takes F l/C,
// with C the capacity of the contact in the direction of F, and l the loss of the gear at its output torque T_2.
struct SharedTorque {
    double held = 0.0, capacity = 0.0, loss = 0.0;               // F, C, l [N m]
    double driven = 0.0;                                         // T_2 [N m] as it is turned in the direction of F
    double by_friction = 0.0, by_output = 0.0, by_margin = 0.0;  // derivatives by F, T_2 and the margin C - |F|
    const model::Row *friction = nullptr, *output = nullptr;     // F and T_2
    const model::Guard* margin = nullptr;                        // its guard; nullptr: nothing is shared

    double value() const { return held * loss / capacity; }
};

// value: of a form at the instant.
template <class Value>
SharedTorque shared_torque(const model::Assembly& a, const model::Regime& r, std::size_t gear, Value&& value) {
    const model::Gear& g = a.train().gears[gear];
    const int contact = a.places().shafts[static_cast<std::size_t>(g.input)].contact;
    if (!g.has_dry_losses() || r.key.modes[static_cast<std::size_t>(contact)] != 0) return {};
    SharedTorque out;
    out.friction = &r.contact_torque[static_cast<std::size_t>(contact)];
    out.output = &r.output_torque[gear];
    const double F = out.held = value(*out.friction);
    const int s = F >= 0.0 ? 1 : -1;
    const auto margin = std::ranges::find_if(r.guards, [&](const model::Guard& guard) {
        return guard.kind == model::Guard::capacity && guard.contact == contact && (guard.neighbour > 0) == (s > 0);
    });
    if (margin == r.guards.end()) return {};
    const double C = out.capacity = value(margin->form) + s * F;
    if (!(C > 0.0)) return {};
    out.margin = &*margin;
    out.driven = s * g.sense() * value(*out.output);
    const model::MeshLoss loss = g.loss(out.driven, 0.0);
    out.loss = loss.torque / g.reduction();
    out.by_margin = -F * out.loss / (C * C);
    out.by_friction = out.loss / C + s * out.by_margin;
    out.by_output = F * s * g.sense() * loss.per_torque / (g.reduction() * C);
    return out;
}

}  // namespace lostmotion
