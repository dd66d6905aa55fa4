// A servo cascade on the paper's drive: current and speed loop every 125 us, position loop every 1 ms.
#pragma once

#include "kernels/closed_loop.hpp"
#include "paper_run.hpp"

namespace lostmotion {

// resolution: of the encoder [rad], 0 for none. amplitude: of the sine of 1 Hz that the load follows [rad].
inline Control cascade(const test::Drive& drive, double resolution, double amplitude) {
    Control c;
    c.tick = 125e-6;
    ControlledAxis axis;
    control::Axis& a = axis.law;
    a.mode = control::Axis::position_mode;
    a.ratio = drive.gearbox.ratio;
    a.delay.samples = 1;
    a.speed_sensor.encoder.resolution = resolution;
    a.position_schedule.every = 8;
    a.position_loop.gain = 10.0;
    a.position_loop.feedforward = 1.0;
    a.speed_loop.gain = 8.29e-3;
    a.speed_loop.integral_gain = 0.1266;
    a.speed_loop.torque_limit = 1.5;
    control::CurrentLoop& loop = a.current_loop.emplace();
    loop.armature_voltage_constant = drive.motor.armature_voltage_constant;
    loop.electrical_time_constant = drive.motor.electrical_time_constant;
    loop.rated_speed = drive.motor.rated_speed;
    loop.rated_torque = drive.motor.rated_torque;
    a.reference.sines.push_back({amplitude, 1.0, 0.0});
    c.axes.push_back(axis);
    return c;
}

}  // namespace lostmotion
