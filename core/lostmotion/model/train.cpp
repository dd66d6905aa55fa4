#include "train.hpp"

namespace lostmotion::model {

namespace {

// The field of a stepper, and what its magnets do without current.
void add_stepper(const ShaftMotor& m, int motor, ShaftElements& all) {
    const double n = m.law.pole_pairs(), error = m.law.error_of_torque();
    // The angle to the field is counted from half a period before it.
    if (!m.law.has_winding()) {
        const AngleTorque field{m.name + "_current", m.shaft,
                                PeriodicCurve::sine(m.law.holding_torque, n, 0.0, error, true)};
        all.push_back(std::make_unique<AngleTorqueOnShaft>(field, motor, m.law.standstill_current));
    }
    if (m.law.detent_torque > 0.0)
        all.push_back(on_shaft(
            AngleTorque{m.name, m.shaft, PeriodicCurve::sine(-m.law.detent_torque, 4.0 * n, 0.0, error, true)}));
}

}  // namespace

ShaftElements shaft_elements(const Train& train) {
    ShaftElements all;
    Train::each_kind(train, [&](const char*, const char*, const auto& elements) {
        for (const auto& e : elements) all.push_back(on_shaft(e));
    });
    for (std::size_t m = 0; m < train.motors.size(); ++m)
        if (train.motors[m].law.kind == Motor::stepper) add_stepper(train.motors[m], static_cast<int>(m), all);
    for (std::size_t s = 0; s < train.shafts.size(); ++s)
        if (const Shaft& shaft = train.shafts[s]; shaft.has_drag())
            all.push_back(std::make_unique<DragOnShaft>(shaft.name, static_cast<int>(s), shaft.drag));
    return all;
}

CouplingElements coupling_elements(const Train& train) {
    CouplingElements all;
    Train::each_coupling_kind(train, [&](const char*, const char*, const auto& elements) {
        for (const auto& e : elements) all.push_back(between_shafts(e));
    });
    return all;
}

}  // namespace lostmotion::model
