#include "scales.hpp"

namespace lostmotion::model {

double rated_speed(const Train& train, int shaft) {
    for (const Gear& g : train.gears)
        if (g.input == shaft) return g.law.rated_input_speed;
    for (const Gear& g : train.gears)
        if (g.output == shaft) return g.law.rated_input_speed / g.reduction();
    for (const ShaftMotor& m : train.motors)
        if (m.shaft == shaft) return m.law.rated_speed;
    return 1.0;
}

double rated_torque(const Train& train, int shaft) {
    for (const Gear& g : train.gears)
        if (g.output == shaft) return g.law.rated_output_torque;
    for (const ShaftMotor& m : train.motors)
        if (m.shaft == shaft) return m.law.rated_torque;
    return 1.0;
}

}  // namespace lostmotion::model
