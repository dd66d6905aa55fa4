// The parameters of a drive that are plain numbers: what they are called in a scenario file, their SI unit, and where
// they are kept. Python's drive and what varies in a batch are made from this table.
#pragma once

#include <array>
#include <map>
#include <string>
#include <string_view>

#include "drive.hpp"

namespace lostmotion {

struct Parameter {
    const char *key, *unit;
    double& (*in)(Drive&);
};

template <auto part, auto member>
double& parameter_of(Drive& drive) {
    return drive.*part.*member;
}
template <double Motor::* member>
inline constexpr auto of_motor = &parameter_of<&Drive::motor, member>;
template <double Gearbox::* member>
inline constexpr auto of_gearbox = &parameter_of<&Drive::gearbox, member>;
template <double Load::* member>
inline constexpr auto of_load = &parameter_of<&Drive::load, member>;

inline constexpr std::array parameters{
    Parameter{"motor.rotor_inertia", "kg*m^2", of_motor<&Motor::rotor_inertia>},
    Parameter{"motor.friction_torque", "N*m", of_motor<&Motor::friction_torque>},
    Parameter{"motor.rated_torque", "N*m", of_motor<&Motor::rated_torque>},
    Parameter{"motor.rated_speed", "rad/s", of_motor<&Motor::rated_speed>},
    Parameter{"motor.electrical_time_constant", "s", of_motor<&Motor::electrical_time_constant>},
    Parameter{"motor.armature_voltage_constant", "", of_motor<&Motor::armature_voltage_constant>},
    Parameter{"motor.command_limit", "", of_motor<&Motor::voltage_limit>},
    Parameter{"gearbox.ratio", "", of_gearbox<&Gearbox::ratio>},
    Parameter{"gearbox.inertia", "kg*m^2", of_gearbox<&Gearbox::inertia>},
    Parameter{"gearbox.viscous_friction", "N*m*s/rad", of_gearbox<&Gearbox::viscous_friction>},
    Parameter{"gearbox.rated_input_speed", "rad/s", of_gearbox<&Gearbox::rated_input_speed>},
    Parameter{"gearbox.rated_output_torque", "N*m", of_gearbox<&Gearbox::rated_output_torque>},
    Parameter{"gearbox.hysteresis.efficiency", "", of_gearbox<&Gearbox::hysteresis_efficiency>},
    Parameter{"gearbox.losses.efficiency", "", of_gearbox<&Gearbox::efficiency>},
    Parameter{"load.inertia", "kg*m^2", of_load<&Load::inertia>},
    Parameter{"load.viscous_friction", "N*m*s/rad", of_load<&Load::viscous_friction>},
    Parameter{"load.friction_torque", "N*m", of_load<&Load::friction_torque>},
};

// nullptr: there is none of this key.
inline const Parameter* find_parameter(std::string_view key) {
    for (const Parameter& p : parameters)
        if (p.key == key) return &p;
    return nullptr;
}

// A drive of parameters by key, all of which must be in the table. Without a torsion curve the gearbox is rigid,
// without a loss map its efficiency is constant.
inline Drive drive_of(const std::map<std::string, double>& values, bool torque_source, const TorsionCurve* curve,
                      const LossMap* map) {
    Drive drive;
    for (const auto& [key, value] : values) find_parameter(key)->in(drive) = value;
    drive.motor.kind = torque_source ? Motor::torque_source : Motor::dc;
    if (curve != nullptr) {
        drive.gearbox.compliance = Gearbox::torsion_curve;
        drive.gearbox.curve = *curve;
    }
    if (map != nullptr) {
        drive.gearbox.losses = Gearbox::loss_map;
        drive.gearbox.map = *map;
    }
    return drive;
}

}  // namespace lostmotion
