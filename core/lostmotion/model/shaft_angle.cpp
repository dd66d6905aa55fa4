#include "shaft_angle.hpp"

namespace lostmotion::model {

std::optional<Row> shaft_angle(const Assembly& a, int shaft) {
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
