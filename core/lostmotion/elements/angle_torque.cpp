#include "angle_torque.hpp"

namespace lostmotion::model {

// As seen() has it.
auto AngleTorqueOnShaft::angle(const Site& on) const -> Row {
    if (position == nowhere) return on.angle();
    return on.angle() - on.terms.input(position) + on.terms.one(0.5 * curve_.period());
}

auto AngleTorqueOnShaft::torque(const Site& on, const Key& key) const -> Row {
    if (is_whole()) return on.terms.input(remainder);
    const int k = piece(key) % curve_.pieces();
    Row T = on.terms.one(curve_.at_zero(k)) + curve_.slope(k) * angle(on) - on.terms.memory(turn, curve_.slope(k));
    return T *= share(piece(key));
}

void AngleTorqueOnShaft::add_guards(const Site& on, const Key& key, bool turns, std::vector<Guard>& guards) const {
    const int k = piece(key), n = own_pieces();
    if (!is_whole() && (turns || position != nowhere))
        add_piece_guards(on.terms, angle(on), curve_, turn, branch, key, guards);
    if (!has_command()) return;
    const Row above = on.terms.input(command) - on.terms.one(full_current);
    guards.push_back({.form = k < n ? above : -above,
                      .kind = Guard::input_limit,
                      .branch = branch,
                      .neighbour = k < n ? k + n : k - n});
}

auto AngleTorqueOnShaft::remainder_at(const ShaftInstant& now, int branch) const -> Remainder {
    const double smooth = curve_.smooth(now.angle), current = share(branch);
    return {current * smooth, current * curve_.smooth_slope(now.angle) * now.speed, std::fabs(smooth)};
}

}  // namespace lostmotion::model
