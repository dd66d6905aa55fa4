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

// The most that losses of a map change per torque.
double steepest(const LossGrid& map) {
    double largest = 0.0;
    for (int j = 0; j < map.load_intervals(); ++j)
        for (int i = 0; i < map.n_speeds; ++i)
            largest = std::fmax(largest,
                                std::fabs(map.value(j + 1, i) - map.value(j, i)) / (map.loads[j + 1] - map.loads[j]));
    return largest;
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
        if (laws_.has_gap && curve.odd()) laws_.half_gap = curve.upper(0);
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
    if (laws_.losses == DriveLaws::by_map) laws_.steepest = steepest(laws_.map);
    laws_.torque_source = train_.motors[0].law.kind == Motor::torque_source;
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

DriveSheet sheet_of(const model::Train& train, double half_gap) {
    const model::ShaftMotor& motor = train.motors[0];
    const model::Gear& gear = train.gears[0];
    const model::Shaft &first = train.shafts[0], &last = train.shafts[1];
    DriveSheet s{};
    s.rotor_inertia = motor.law.rotor_inertia;
    s.motor_friction = motor.law.friction_torque;
    s.rated_torque = motor.law.rated_torque;
    s.rated_speed = motor.law.rated_speed;
    s.time_constant = motor.law.electrical_time_constant;
    s.voltage_constant = motor.law.armature_voltage_constant;
    s.command_limit = motor.limited() ? motor.command_limit() : unlimited;
    s.motor_inertia = first.inertia;
    s.motor_viscous = first.viscous_friction;
    s.shaft_friction = first.friction.sliding(0.0);
    s.shaft_breakaway = first.friction.breakaway_torque;
    s.ratio = gear.law.ratio;
    s.gear_inertia = gear.law.inertia;
    s.gear_viscous = gear.law.viscous_friction;
    s.hysteresis_efficiency = gear.law.has_hysteresis() ? gear.law.hysteresis_efficiency : 1.0;
    s.rated_input_speed = gear.law.rated_input_speed;
    s.rated_output_torque = gear.rated_torque();
    s.drive_efficiency = gear.efficiencies ? gear.efficiencies->driving() : gear.law.efficiency;
    s.backdrive_efficiency = gear.efficiencies ? gear.efficiencies->overrunning() : 0.0;
    s.mesh_damping = gear.mesh_damping;
    s.backlash = 2.0 * half_gap;
    s.load_inertia = last.inertia;
    s.load_viscous = last.viscous_friction;
    s.load_friction = last.friction.sliding(0.0);
    s.load_breakaway = last.friction.breakaway_torque;
    return s;
}

}  // namespace lostmotion::batch
