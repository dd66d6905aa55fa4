#include "kernel.hpp"

#include <tuple>

namespace lostmotion {

namespace {

// Has it nothing but motors, gears and shafts with plain friction? Then 16 conditions end each regime at most.
bool is_plain(const model::Train& t) {
    bool plain = t.motors.size() <= 1 && t.gears.size() <= 1 && t.controllers.empty();
    const auto none = [&](const char*, const char*, const auto& elements) { plain = plain && elements.empty(); };
    model::Train::each_kind(t, none);
    model::Train::each_coupling_kind(t, none);
    for (const model::Shaft& s : t.shafts) plain = plain && s.friction.speeds.empty() && !s.has_drag();
    for (const model::Gear& g : t.gears) plain = plain && !g.over_angle() && !g.parts_flanks();
    return plain;
}

}  // namespace

std::string KernelSizes::excess(const model::Train& train, const model::Layout& n) const {
    std::string out;
    for (const auto& [count, most, what] :
         {std::tuple{n.coupled, coupled, "coupled states"}, std::tuple{n.angles, angles, "parts that no gear joins"},
          std::tuple{n.inputs, inputs, "inputs"}, std::tuple{n.contacts, contacts, "dry contacts"},
          std::tuple{n.memory, memory, "torques and turns of angles to remember"},
          std::tuple{static_cast<int>(train.gears.size()), contacts, "gears"}})
        if (count > most)
            out += (out.empty() ? "" : ", ") + std::to_string(count) + " " + what + " (at most " +
                   std::to_string(most) + ")";
    return out;
}

bool KernelSizes::hold(const model::Train& train, const model::Layout& n) const {
    return (guards >= 32 || is_plain(train)) && excess(train, n).empty();
}

}  // namespace lostmotion
