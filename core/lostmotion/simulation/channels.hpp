// The channels of a record: what is read of a drive at an instant. At a jump a channel has its right limit.
#pragma once

#include <array>

#include "enum_table.hpp"

namespace lostmotion {

enum Channel : int {
    ch_command,
    ch_load_torque,
    ch_motor_torque,
    ch_motor_speed,
    ch_load_speed,
    ch_load_angle,
    ch_twist,
    ch_output_torque,
    ch_input_torque,
    ch_loss_coefficient,
    ch_input_contact,
    ch_twist_contact,
    ch_load_contact,
    n_channels
};

struct ChannelName {
    Channel value;
    const char *name, *symbol, *unit, *meaning;
};
inline constexpr std::array<ChannelName, n_channels> channel_names{{
    {ch_command, "command", "E_C", "1", "control signal, relative armature voltage"},
    {ch_load_torque, "load_torque", "M_Z", "N*m", "disturbance torque on the load"},
    {ch_motor_torque, "motor_torque", "M_D", "N*m", "torque of the motor"},
    {ch_motor_speed, "motor_speed", "w_M", "rad/s", "speed of rotor and input shaft"},
    {ch_load_speed, "load_speed", "w", "rad/s", "speed of the load"},
    {ch_load_angle, "load_angle", "phi", "rad", "angle of the load"},
    {ch_twist, "twist", "d", "rad", "torsion of the gearbox, input angle / ratio - output angle"},
    {ch_output_torque, "output_torque", "T_2", "N*m", "torque of the gearbox on the load"},
    {ch_input_torque, "input_torque", "T_1", "N*m", "torque of the gearbox on the input shaft"},
    {ch_loss_coefficient, "loss_coefficient", "m_2B", "1",
     "torque lost in the gearbox, at the output, / rated output torque"},
    {ch_input_contact, "input_contact", "", "1", "input shaft: +1 or -1 slipping, 0 stuck"},
    {ch_twist_contact, "twist_contact", "", "1", "twist: +1 or -1 slipping, 0 stuck"},
    {ch_load_contact, "load_contact", "", "1", "load bearing: +1 or -1 slipping, 0 stuck"},
}};
static_assert(in_order(channel_names));

inline constexpr auto all_channels = [] {
    std::array<int, n_channels> all{};
    for (int c = 0; c < n_channels; ++c) all[static_cast<std::size_t>(c)] = c;
    return all;
}();

}  // namespace lostmotion
