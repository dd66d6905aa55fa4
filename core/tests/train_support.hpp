// Trains shared by the tests.
#pragma once

#include <algorithm>

#include "kernels/pack.hpp"
#include "lostmotion/model/power_flows.hpp"
#include "lostmotion/model/switched_train.hpp"
#include "support.hpp"

namespace lostmotion::model {

// Elements with little more than what a test is about.
inline Shaft shaft(double inertia) {
    Shaft s;
    s.inertia = inertia;
    return s;
}
inline ShaftMotor torque_motor(int at) {
    ShaftMotor m;
    m.shaft = at;
    m.law.kind = Motor::torque_source;
    return m;
}
inline Gear rigid_gear(int input, int output, double ratio) {
    Gear g;
    g.input = input;
    g.output = output;
    g.law.ratio = ratio;
    return g;
}
inline Gear spring(int input, int output, double ratio, const TorsionCurve& curve) {
    Gear g = rigid_gear(input, output, ratio);
    g.law.compliance = Gearbox::torsion_curve;
    g.law.curve = curve;
    return g;
}

// Kinetic and elastic energy [J].
template <class X>
double stored_energy(const Assembly& a, const X& x) {
    X zero = x;
    std::fill(zero.begin(), zero.end(), 0.0);
    return stored_change(a, zero, x).all;
}

// Dimensions for more than any train of the tests has.
using WidestTest = Dims<24, 6, 14, 16, 20, 96>;

}  // namespace lostmotion::model

namespace lostmotion::test {

// What the results of a train of a drive are called, in the order of Quantity.
inline constexpr std::array<const char*, n_quantities> quantity_names{"motor_torque",
                                                                      "motor_speed",
                                                                      "load_speed",
                                                                      "gearbox_twist",
                                                                      "load_angle",
                                                                      "motor_command",
                                                                      "load_load_torque",
                                                                      "gearbox_output_torque",
                                                                      "gearbox_input_torque",
                                                                      "motor_contact",
                                                                      "gearbox_twist_contact",
                                                                      "load_contact"};
inline constexpr const char *from_source = "motor: motor", *in_input_damper = "motor: viscous friction",
                            *in_motor_friction = "motor: dry friction", *in_gear = "gearbox: mesh",
                            *in_hysteresis = "gearbox: hysteresis and damping",
                            *in_load_damper = "load: viscous friction", *in_load_friction = "load: dry friction",
                            *to_load = "load: load";
inline constexpr std::array flows{from_source, in_input_damper,  in_motor_friction, in_load_damper,
                                  to_load,     in_load_friction, in_gear,           in_hysteresis};

inline model::Train train_of(const Drive& d) {
    model::Train t;
    t.shafts.resize(2);
    t.shafts[0].name = "motor";
    t.shafts[1].name = "load";
    t.shafts[1].inertia = d.load.inertia;
    t.shafts[1].viscous_friction = d.load.viscous_friction;
    t.shafts[1].friction.torque = d.load.friction_torque;
    t.shafts[1].loaded = true;
    t.motors.push_back({"motor", 0, d.motor});
    model::Gear g;
    g.name = "gearbox";
    g.input = 0;
    g.output = 1;
    g.law = d.gearbox;
    t.gears.push_back(g);
    return t;
}

}  // namespace lostmotion::test
