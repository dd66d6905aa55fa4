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
inline std::string check_control(const model::Assembly& a, const Control& control) {
    const auto told = [&](int shaft, const char* has, const char* remedy) -> std::string {
        if (model::shaft_angle(a, shaft)) return "";
        return "shaft '" + a.train().shafts[static_cast<std::size_t>(shaft)].name + "' " + has +
               ", but its angle does not follow from that of the load: a clutch or a transmission error lies "
               "between; " +
               remedy;
    };
    for (const ControlledAxis& axis : control.axes) {
        for (const int shaft : {axis.position_shaft, axis.speed_shaft})
            if (const std::string error = told(shaft, "carries an encoder", "put the encoder on another shaft");
                !error.empty())
                return error;
        if (axis.law.camera.present)
            if (const std::string error =
                    told(axis.reference_shaft, "carries a camera", "put the camera on another shaft");
                !error.empty())
                return error;
        if (!axis.law.field_orientation) continue;
        const int rotor = a.train().motors[static_cast<std::size_t>(axis.motor)].shaft;
        if (const std::string error =
                told(rotor, "is that of a motor under field-oriented control", "take a current loop of kind \"pi\"");
            !error.empty())
            return error;
    }
    return "";
}

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
        p.motor_torque =
            packed(law.kind == Motor::dc ? model::Row::unit(motor.torque)
                                         : model::Row::unit(n.first_input + motor.command, law.rated_torque));
        const int rotor = a.train().motors[static_cast<std::size_t>(axis.motor)].shaft;
        if (const auto angle = model::shaft_angle(a, rotor)) p.rotor_angle = packed(*angle);
        p.rotor_speed = packed(model::Row::unit(a.places().shafts[static_cast<std::size_t>(rotor)].speed));
        if (axis.law.camera.present) p.shaft_angle = packed(*model::shaft_angle(a, axis.reference_shaft));
        loop.places.push_back(p);
    }
    return loop;
}

}  // namespace lostmotion
