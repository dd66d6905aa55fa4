// The angle of a shaft as a linear form of the state.
#pragma once

#include <optional>
#include <vector>

#include "assembly.hpp"

namespace lostmotion::model {

// From those angles that are states on through the gears: phi_in = i (phi_out + d). Nothing where none leads there:
// past a clutch, or a gear with a transmission error, whose law is not linear.
inline std::optional<Row> shaft_angle(const Assembly& a, int shaft) {
    const Train& train = a.train();
    const Places& places = a.places();
    std::vector<std::optional<Row>> angle(train.shafts.size());
    for (std::size_t s = 0; s < angle.size(); ++s)
        if (const int state = places.shafts[s].angle; state != nowhere) angle[s] = Row::unit(state);
    for (std::size_t part = 0; part < places.last_shaft.size(); ++part) {
        std::optional<Row>& last = angle[static_cast<std::size_t>(places.last_shaft[part])];
        if (!last) last = Row::unit(a.layout().coupled + static_cast<int>(part));
    }
    for (std::size_t round = 0; round < train.gears.size(); ++round)
        for (std::size_t g = 0; g < train.gears.size(); ++g) {
            const Gear& gear = train.gears[g];
            std::optional<Row>&in = angle[static_cast<std::size_t>(gear.input)],
            &out = angle[static_cast<std::size_t>(gear.output)];
            if (in.has_value() == out.has_value() || gear.transmission_error.present()) continue;
            if (gear.housing != nowhere) continue;  // each of its shafts has an angle, or one that another follows
            const Row twist = gear.rigid() ? Row{} : Row::unit(places.gears[g].twist);
            if (out)
                in = gear.law.ratio * (*out + twist);
            else
                out = *in / gear.law.ratio - twist;
        }
    return angle[static_cast<std::size_t>(shaft)];
}

}  // namespace lostmotion::model
