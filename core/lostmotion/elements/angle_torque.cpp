#include "angle_torque.hpp"

namespace lostmotion::model {

auto AngleTorqueOnShaft::torque(const Site& on, const Key& key) const -> Row {
    const int k = piece(key);
    Row T = on.terms.one(curve_.at_zero(k)) + on.angle(curve_.slope(k)) - on.terms.memory(turn, curve_.slope(k));
    if (remainder != nowhere) T += on.terms.input(remainder);
    return T;
}

auto AngleTorqueOnShaft::remainder_at(const ShaftInstant& now, int k) const -> Remainder {
    const double smooth = curve_.smooth(now.angle);
    return {smooth - curve_.at_zero(k) - curve_.slope(k) * (now.angle - now.turn),
            (curve_.smooth_slope(now.angle) - curve_.slope(k)) * now.speed, std::fabs(smooth)};
}

}  // namespace lostmotion::model
