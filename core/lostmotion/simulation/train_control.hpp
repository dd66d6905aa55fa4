// Controllers in a train.
#pragma once

#include <string>
#include <vector>

#include "../model/names.hpp"
#include "../model/shaft_angle.hpp"
#include "closed_loop.hpp"
#include "train_reader.hpp"

namespace lostmotion {

// What is wrong with the controllers of a train, or empty.
std::string check_control(const model::Assembly& a, const Control& control);

// The same in a kernel. The laws are those of `laws`, which must stay.
template <class D>
ClosedLoop<D> closed_loop_of(const model::Assembly& a, const Control& control, const std::vector<control::Axis>& laws) {
    const model::Layout& n = a.layout();
    ClosedLoop<D> loop{{control.tick}, laws, {}};
    for (const ControlledAxis& axis : control.axes) {
        const model::MotorPlace& motor = a.places().motors[static_cast<std::size_t>(axis.motor)];
        const auto packed = [&](const model::Row& row) { return model::pack<D>(row, n); };
        AxisPlace<D> p;
        p.input = motor.command;
        p.position_angle = packed(*model::shaft_angle(a, axis.position_shaft));
        p.speed_angle = packed(*model::shaft_angle(a, axis.speed_shaft));
        p.speed = packed(model::Row::unit(a.places().shafts[static_cast<std::size_t>(axis.speed_shaft)].speed));
        const Motor& law = a.train().motors[static_cast<std::size_t>(axis.motor)].law;
        const int rotor = a.train().motors[static_cast<std::size_t>(axis.motor)].shaft;
        p.motor_torque =
            packed(law.torque<model::Row>({motor.torque, a.places().shafts[static_cast<std::size_t>(rotor)].speed,
                                           n.first_input + motor.command, n.one}));
        if (const auto angle = model::shaft_angle(a, rotor)) p.rotor_angle = packed(*angle);
        p.rotor_speed = packed(model::Row::unit(a.places().shafts[static_cast<std::size_t>(rotor)].speed));
        if (axis.law.camera.present) p.shaft_angle = packed(*model::shaft_angle(a, axis.reference_shaft));
        loop.places.push_back(p);
    }
    return loop;
}

}  // namespace lostmotion
