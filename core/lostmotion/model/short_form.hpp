// The drive of the paper as a train, and its parameters by their keys in scenario files.
#pragma once

#include <array>
#include <string_view>

#include "train.hpp"

namespace lostmotion::model {

// A motor that turns a load through a gearbox.
inline Train drive_train() {
    Train t;
    t.short_form = true;
    t.shafts.resize(2);
    t.shafts[0].name = "motor";
    t.shafts[1].name = "load";
    t.shafts[1].loaded = true;
    t.motors.resize(1);
    t.motors[0].name = "motor";
    t.gears.resize(1);
    t.gears[0].name = "gearbox";
    t.gears[0].output = 1;
    return t;
}

struct Parameter {
    const char *key, *unit;
    double& (*in)(Train&);  // of a train in the short form
};

template <double Motor::* member>
double& of_motor(Train& t) {
    return t.motors[0].law.*member;
}
template <double Gearbox::* member>
double& of_gearbox(Train& t) {
    return t.gears[0].law.*member;
}
template <double Shaft::* member>
double& of_load(Train& t) {
    return t.shafts[1].*member;
}
inline double& mesh_damping(Train& t) { return t.gears[0].mesh_damping; }
inline double& friction_of_load(Train& t) { return t.shafts[1].friction.torque; }

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
    Parameter{"gearbox.mesh_damping", "N*m*s/rad", mesh_damping},
    Parameter{"gearbox.hysteresis.efficiency", "", of_gearbox<&Gearbox::hysteresis_efficiency>},
    Parameter{"gearbox.losses.efficiency", "", of_gearbox<&Gearbox::efficiency>},
    Parameter{"load.inertia", "kg*m^2", of_load<&Shaft::inertia>},
    Parameter{"load.viscous_friction", "N*m*s/rad", of_load<&Shaft::viscous_friction>},
    Parameter{"load.friction_torque", "N*m", friction_of_load},
};

// nullptr: there is none of this key.
inline const Parameter* find_parameter(std::string_view key) {
    for (const Parameter& p : parameters)
        if (p.key == key) return &p;
    return nullptr;
}

}  // namespace lostmotion::model
