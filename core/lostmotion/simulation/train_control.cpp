#include "train_control.hpp"

#include "../model/names.hpp"
#include "../model/shaft_angle.hpp"

namespace lostmotion {

std::string check_control(const model::Assembly& a, const Control& control) {
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

std::vector<AxisRows> axis_rows(const model::Assembly& a, const Control& control) {
    std::vector<AxisRows> out;
    for (const ControlledAxis& axis : control.axes) {
        const auto speed_of = [&](int shaft) { return a.places().shafts[static_cast<std::size_t>(shaft)].speed; };
        const model::MotorPlace& place = a.places().motors[static_cast<std::size_t>(axis.motor)];
        const model::ShaftMotor& motor = a.train().motors[static_cast<std::size_t>(axis.motor)];
        const int rotor = speed_of(motor.shaft);
        out.push_back({place.command,
                       {*model::shaft_angle(a, axis.position_shaft), *model::shaft_angle(a, axis.speed_shaft),
                        model::Row::unit(speed_of(axis.speed_shaft)),
                        motor.law.torque<model::Row>(
                            {place.torque, rotor, a.layout().first_input + place.command, a.layout().one}),
                        model::shaft_angle(a, motor.shaft).value_or(model::Row{}), model::Row::unit(rotor),
                        axis.law.camera.present ? *model::shaft_angle(a, axis.reference_shaft) : model::Row{}}});
    }
    return out;
}

}  // namespace lostmotion
