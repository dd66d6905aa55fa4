#include "sensitive_solving.hpp"

namespace lostmotion {

bool acts_at_the_same_instants(const Control& a, const Control& b) {
    const auto same = [](const control::Schedule& s, const control::Schedule& t) {
        return s.every == t.every && s.phase == t.phase;
    };
    if (a.tick != b.tick || a.axes.size() != b.axes.size()) return false;
    const std::vector<control::Axis> one = a.laws(), other = b.laws();
    for (std::size_t k = 0; k < one.size(); ++k) {
        const control::Axis &s = one[k], &t = other[k];
        if (s.slots() != t.slots() || s.delay.samples != t.delay.samples || !same(s.speed_schedule, t.speed_schedule) ||
            !same(s.position_schedule, t.position_schedule) || !same(s.current_schedule, t.current_schedule))
            return false;
    }
    return true;
}

DerivativeFault check_derivatives(const Control& control, const std::vector<Variation>& variations) {
    for (const ControlledAxis& axis : control.axes) {
        if (axis.law.field_orientation)
            return {{}, "field-oriented control has no derivatives here; take a current loop of kind \"pi\""};
        if (axis.law.camera.present && axis.law.camera.pixel > 0.0)
            return {{}, "a camera of finite resolution has no derivative; leave its pixels out"};
        for (const auto* encoder : {&axis.law.speed_sensor.encoder, &axis.law.position_sensor.encoder})
            if (encoder->step() > 0.0 && encoder->error > 0.0)
                return {{},
                        "an encoder with a resolution and an interpolation error has no derivatives here; leave one "
                        "of them out"};
    }
    for (const Variation& v : variations)
        for (const Neighbour& n : v.neighbours)
            if (n.control && !acts_at_the_same_instants(control, *n.control))
                return {v.name, "changes the instants at which a controller acts, which has no derivative"};
    return {};
}

}  // namespace lostmotion
