// A motor on a shaft of a train.
#pragma once

#include <algorithm>
#include <limits>
#include <string>

#include "motor.hpp"

namespace lostmotion::model {

struct ShaftMotor {
    std::string name;
    int shaft = 0;
    Motor law;
    double torque_limit = std::numeric_limits<double>::infinity();  // [N m] of a torque source

    template <class Fields>
    void describe(Fields& f) {
        f.number({"torque_limit", "", "N*m", Range::limit, Given::may_be_left_out, "largest torque of a torque source"},
                 torque_limit);
    }

    // A limit of the input: of the voltage, or of the torque that is asked for.
    bool limited() const {
        return law.kind == Motor::dc ? law.limits_voltage() : torque_limit < std::numeric_limits<double>::infinity();
    }
    // Torque [N m] at standstill under a constant command.
    double torque_at_rest(double u) const {
        if (law.kind == Motor::stepper) return 0.0;  // its field is a torque over the angle
        const double most = limited() ? command_limit() : std::numeric_limits<double>::infinity();
        return law.stall_torque() * std::clamp(u, -most, most);
    }
    double command_limit() const { return law.kind == Motor::dc ? law.voltage_limit : torque_limit / law.rated_torque; }
};

}  // namespace lostmotion::model
