#include "drive_control.hpp"

namespace lostmotion {

ClosedLoop<DriveDims> closed_loop_of(const Drive& drive, const Control& control,
                                     const std::vector<control::Axis>& laws) {
    const double i = drive.gearbox.ratio;
    const LinearForm of_motor = LinearForm::unit(load_angle, i) + LinearForm::unit(twist, i),
                     of_load = LinearForm::unit(load_angle);
    ClosedLoop<DriveDims> loop{{control.tick}, laws, {}};
    for (const ControlledAxis& axis : control.axes)
        loop.places.push_back({only_motor(axis.motor), axis.position_shaft == 0 ? of_motor : of_load,
                               axis.speed_shaft == 0 ? of_motor : of_load,
                               LinearForm::unit(axis.speed_shaft == 0 ? motor_speed : load_speed),
                               drive.motor.torque<LinearForm>({motor_torque, motor_speed, command, one}), of_motor,
                               LinearForm::unit(motor_speed), axis.reference_shaft == 0 ? of_motor : of_load});
    return loop;
}

}  // namespace lostmotion
