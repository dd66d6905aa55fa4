#include "drive_numbers.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "../model/drive_train.hpp"

namespace lostmotion::batch {

namespace {

constexpr double unlimited = std::numeric_limits<double>::infinity();
constexpr int most_degree = 23;
const std::vector<double> inverse = [] {
    std::vector<double> out(most_degree + 2);
    for (int k = 1; k < most_degree + 2; ++k) out[static_cast<std::size_t>(k)] = 1.0 / k;
    return out;
}();

// |A| t up to which a series of each degree d has all terms above rounding: (|A| t)^d = (d + 1)!/2^56.
std::vector<double> reaches() {
    std::vector<double> out(most_degree + 1);
    double factorial = 0x1p-56;
    for (int d = 1; d <= most_degree; ++d) {
        factorial *= d + 1;
        out[static_cast<std::size_t>(d)] = std::pow(factorial, 1.0 / d);
    }
    return out;
}

// The most that T_1 |i| changes per T_2.
double largest_share(const model::Gear& gear) {
    if (gear.efficiencies)
        return std::fmax(1.0 / gear.efficiencies->driving(), std::fabs(gear.efficiencies->overrunning()));
    if (gear.law.losses != Gearbox::loss_map) return 1.0 / gear.law.efficiency;
    const LossGrid map = gear.law.map.grid();
    double largest = 0.0;
    for (int j = 0; j < map.load_intervals(); ++j)
        for (int i = 0; i < map.n_speeds; ++i)
            largest = std::fmax(largest,
                                std::fabs(map.value(j + 1, i) - map.value(j, i)) / (map.loads[j + 1] - map.loads[j]));
    return 1.0 + largest;
}

}  // namespace

DriveKind::DriveKind(const model::Train& train) : train_(train), reach_(reaches()) {
    const model::Gear& gear = train_.gears[0];
    laws_.rigid = gear.rigid();
    if (laws_.rigid) {
        lower_ = {-unlimited};
        upper_ = {unlimited};
        slope_ = offset_ = root_ = {0.0};
    } else {
        const TorsionCurve& curve = gear.law.curve;
        for (int k = curve.first_piece(); k <= curve.last_piece(); ++k) {
            lower_.push_back(k > curve.first_piece() ? curve.lower(k) : -unlimited);
            upper_.push_back(k < curve.last_piece() ? curve.upper(k) : unlimited);
            slope_.push_back(curve.slope(k));
            offset_.push_back(curve.offset(k));
            root_.push_back(std::sqrt(curve.slope(k)));
        }
        laws_.zero = -curve.first_piece();
        laws_.has_gap = gear.has_backlash();
        if (laws_.has_gap && curve.odd()) half_gap_ = curve.upper(0);
    }
    laws_.pieces = static_cast<int>(slope_.size());
    laws_.lower = lower_.data();
    laws_.upper = upper_.data();
    laws_.slope = slope_.data();
    laws_.offset = offset_.data();
    laws_.root = root_.data();
    laws_.delays_torque = train_.motors[0].law.has_torque_state();
    laws_.limits_damping = gear.damping_limited;
    laws_.losses = gear.efficiencies                      ? DriveLaws::by_direction
                   : gear.law.losses == Gearbox::loss_map ? DriveLaws::by_map
                                                          : DriveLaws::constant;
    laws_.map = gear.law.map.grid();
    laws_.reach = reach_.data();
    laws_.inverse = inverse.data();
    laws_.most_degree = most_degree;
}

std::string not_walked(const model::Train& train) {
    const auto plain = [](const model::Shaft& s) {
        return s.friction.pieces() == 1 && !s.has_drag() && !s.given_motion;
    };
    if (!model::is_drive(train) || !plain(train.shafts[0]) || !plain(train.shafts[1]))
        return "is more than a motor, a gearbox with torsion curve and losses, and a load with plain friction";
    const model::Gear& gear = train.gears[0];
    if (gear.over_angle() || gear.strikes()) return "has flanks that strike, or a mesh that changes with the angle";
    const double motor = train.motors[0].law.rotor_inertia + gear.law.inertia + train.shafts[0].inertia;
    if (!(motor > 0.0) || !(train.shafts[1].inertia > 0.0)) return "has a shaft without inertia";
    if (gear.rigid() && train.shafts[1].friction.present()) return "has a rigid gear between two dry contacts";
    return "";
}

DriveNumbers numbers_of(const DriveKind& kind, const model::Train& train, double half_gap) {
    const model::ShaftMotor& motor = train.motors[0];
    const model::Gear& gear = train.gears[0];
    const model::Shaft &first = train.shafts[0], &last = train.shafts[1];
    const double i = gear.reduction();
    DriveNumbers n{};
    n.per_motor = 1.0 / (i * (motor.law.rotor_inertia + gear.law.inertia + first.inertia));
    n.per_load = 1.0 / last.inertia;
    n.motor_drag = i * (first.viscous_friction + gear.law.viscous_friction);
    n.load_drag = last.viscous_friction;
    n.motor_slips = motor.law.friction_torque + first.friction.sliding(0.0);
    n.motor_holds = motor.law.friction_torque + first.friction.holding();
    n.load_slips = last.friction.sliding(0.0);
    n.load_holds = last.friction.holding();
    n.stall_torque = motor.law.stall_torque();
    if (motor.law.kind == Motor::dc)
        n.back_torque =
            i * motor.law.rated_torque * (motor.law.armature_voltage_constant - 1.0) / motor.law.rated_speed;
    n.command_limit = motor.limited() ? motor.command_limit() : unlimited;
    n.per_ratio = 1.0 / i;
    n.driving = 1.0 / (gear.efficiencies ? gear.efficiencies->driving() : gear.law.efficiency);
    n.overrunning = gear.efficiencies ? gear.efficiencies->overrunning() : 0.0;
    n.rated_torque = gear.rated_torque();
    n.per_rated = 1.0 / n.rated_torque;
    n.speed_share = i / gear.law.rated_input_speed;
    n.mesh_damping = gear.mesh_damping;
    n.gap = half_gap - kind.half_gap();
    n.turned = gear.sense() < 0.0 ? -1 : 1;
    if (gear.has_dry_losses()) n.has |= DriveNumbers::dry_losses;
    if (gear.has_dry_losses() || n.motor_holds > 0.0) n.has |= DriveNumbers::of_motor;
    if (gear.law.has_hysteresis()) {
        n.has |= DriveNumbers::of_twist;
        n.hysteresis = 0.5 * (1.0 - gear.law.hysteresis_efficiency);
    }
    if (last.friction.present()) n.has |= DriveNumbers::of_load;
    const double doubled = gear.damping_limited ? 2.0 : 1.0;
    n.stiff = std::sqrt(doubled * (n.per_load + largest_share(gear) * n.per_ratio * n.per_motor));
    if (kind.laws().delays_torque) {
        n.delay = 1.0 / motor.law.electrical_time_constant;
        n.torque_scale = n.back_torque > 0.0 ? std::sqrt(n.delay * n.back_torque / n.per_motor) : n.delay / n.per_motor;
        n.per_torque_scale = 1.0 / n.torque_scale;
    }
    return n;
}

}  // namespace lostmotion::batch
