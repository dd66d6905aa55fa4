// Natural sizes of the states of a train.
#pragma once

#include <cmath>

#include "assembly.hpp"

namespace lostmotion::model {

// Speed that a shaft has at the ratings of what is on it [rad/s].
double rated_speed(const Train& train, int shaft);
// Torque on a shaft at those ratings [N m].
double rated_torque(const Train& train, int shaft);

// Sizes of the states of a controller, in those of what it takes and gives: the geometric mean of what drives a state
// and of what it takes to move the output by `of_output`.
template <class State>
void controller_scale(const Assembly& a, int controller, double of_output, State& s) {
    const LinearController& c = a.train().controllers[static_cast<std::size_t>(controller)];
    const ControllerPlace& p = a.places().controllers[static_cast<std::size_t>(controller)];
    for (std::size_t j = 0; j < c.states.size(); ++j) {
        double driven = 0.0;
        for (std::size_t k = 0; k < c.signals.size(); ++k) {
            const LinearController::Signal& y = c.signals[k];
            const ShaftPlace& shaft = a.places().shafts[static_cast<std::size_t>(y.shaft)];
            const double size = y.kind == LinearController::Signal::angle   ? s[shaft.angle]
                                : y.kind == LinearController::Signal::speed ? s[shaft.speed]
                                                                            : 0.0;
            driven = std::fmax(driven, std::fabs(c.B[j][k]) * size);
        }
        const double gain = std::fabs(c.C[j]) * (c.curved ? c.curve.max_slope() : 1.0);
        const double size = driven > 0.0 && gain > 0.0 ? std::sqrt(driven * of_output / gain)
                            : gain > 0.0               ? of_output / gain
                                                       : driven;
        s[p.first_state + static_cast<int>(j)] = size > 0.0 ? size : 1.0;
    }
}

// Sizes that the states have at rated speed and torque, for error control.
template <class State>
void rated_scale(const Assembly& a, State& s) {
    const Train& train = a.train();
    for (std::size_t m = 0; m < train.motors.size(); ++m) {
        const MotorPlace& p = a.places().motors[m];
        const Motor& law = train.motors[m].law;
        if (p.torque != nowhere) s[p.torque] = law.rated_torque;
        if (p.current != nowhere) s[p.current] = s[p.current + 1] = law.rated_current;
    }
    for (std::size_t n = 0; n < train.shafts.size(); ++n) {
        const ShaftPlace& p = a.places().shafts[n];
        s[p.speed] = rated_speed(train, static_cast<int>(n));
        if (p.angle != nowhere) s[p.angle] = 1.0;
    }
    for (std::size_t g = 0; g < train.gears.size(); ++g) {
        const Gear& gear = train.gears[g];
        if (const int k = a.places().gears[g].twist; k != nowhere)
            s[k] = gear.rigid()     ? 1.0
                   : gear.strikes() ? gear.flank_backlash
                                    : gear.law.rated_output_torque / gear.law.curve.max_slope();
    }
    for (const auto& c : a.places().couplings)
        if (c->twist != nowhere) s[c->twist] = c->pitch();
    for (std::size_t k = 0; k < train.controllers.size(); ++k) controller_scale(a, static_cast<int>(k), 1.0, s);
}

// Least inertia [kg m^2] of the input of a rigid gear in the size of an angle behind it. The size is arbitrary there,
// as no rate depends on an angle, but the norm is at least its inverse: a shaft of almost no inertia shortens all
// steps.
inline constexpr double least_inertia = 1e-10;

// Sizes in which the coupling of the equations is balanced: all shafts and twists with like energy, from the first
// motor on. They serve to measure rates by a matrix norm, nothing else. angle: of the parts of the train.
template <class State>
void balanced_scale(const Assembly& a, State& s, int first_angle) {
    const Train& train = a.train();
    const Places& p = a.places();
    double largest = 0.0;
    for (const ShaftPlace& shaft : p.shafts) largest = std::fmax(largest, shaft.inertia);
    if (!(largest > 0.0)) largest = 1.0;  // where all motion is given
    // A shaft without inertia follows others.
    const auto inertia = [&](int shaft) { return p.shafts[shaft].inertia > 0.0 ? p.shafts[shaft].inertia : largest; };
    const int first = train.motors.empty() ? 0 : train.motors[0].shaft;
    for (std::size_t m = 0; m < train.motors.size(); ++m)
        if (p.motors[m].torque != nowhere) s[p.motors[m].torque] = 1.0;
    const double w = train.motors.empty() ? 1.0 : train.motors[0].law.balanced_speed(inertia(first));
    for (std::size_t n = 0; n < train.shafts.size(); ++n)
        s[p.shafts[n].speed] = w * std::sqrt(inertia(first) / inertia(static_cast<int>(n)));
    s[p.shafts[first].speed] = w;
    for (int part = 0; part < a.layout().angles; ++part) s[first_angle + part] = s[p.shafts[p.last_shaft[part]].speed];
    for (std::size_t g = 0; g < train.gears.size(); ++g) {
        const Gear& gear = train.gears[g];
        const double in = s[p.shafts[gear.input].speed], i = gear.reduction(), J = inertia(gear.input);
        double& out = s[p.shafts[gear.output].speed];
        double twist;
        if (gear.rigid() || gear.strikes()) {
            out = in / i;
            twist = out * std::fmax(J, least_inertia);
        } else {
            const double k = gear.law.curve.max_slope();
            twist = in / i / std::sqrt(k / (i * i * J));
            out = twist * std::sqrt(k / inertia(gear.output));
        }
        if (p.gears[g].twist != nowhere) s[p.gears[g].twist] = twist;
        for (int part = 0; part < a.layout().angles; ++part)
            if (p.last_shaft[part] == gear.output) s[first_angle + part] = twist;
    }
    for (const auto& c : p.couplings)
        if (c->twist != nowhere) s[c->twist] = s[p.shafts[c->output].speed];
    for (std::size_t n = 0; n < train.shafts.size(); ++n)
        if (p.shafts[n].angle != nowhere) s[p.shafts[n].angle] = s[p.shafts[n].speed];
    for (const ShaftMotor& m : train.motors)
        if (m.law.kind == Motor::stepper)  // the field turns its rotor as a spring does
            s[p.shafts[m.shaft].angle] =
                s[p.shafts[m.shaft].speed] * std::sqrt(inertia(m.shaft) / (m.law.pole_pairs() * m.law.holding_torque));
    for (std::size_t k = 0; k < train.controllers.size(); ++k) {
        const ShaftMotor& motor = train.motors[static_cast<std::size_t>(train.controllers[k].motor)];
        const Motor& law = motor.law;
        const double of_output = law.has_torque_state()
                                     ? law.electrical_time_constant / law.stall_torque()
                                     : s[p.shafts[motor.shaft].speed] * inertia(motor.shaft) / law.rated_torque;
        controller_scale(a, static_cast<int>(k), of_output, s);
    }
}

}  // namespace lostmotion::model
