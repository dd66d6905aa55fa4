// The two phases of a stepper and the driver that limits their current.
//
//   L i' = u - R i - e,  e = K w (-sin, cos)(n phi),  M = K (i_b cos(n phi) - i_a sin(n phi)),  K = T_H/(sqrt(2) I)
//
// The driver wants sqrt(2) I (cos, sin)(n phi*), the rated current in both phases in full steps. Its voltage
// R i* + e + g L (i* - i) takes the current there with the time constant 1/g; beyond the supply the driver gives the
// supply, in that direction. Torque and rates are products of states, which no regime has: they enter as inputs of the
// adaptive solver.
#pragma once

#include <array>
#include <cmath>

#include "../base/sine.hpp"
#include "motor.hpp"

namespace lostmotion {

struct StepperWinding {
    static constexpr int inputs = 3;             // torque, and the rates of both currents
    static constexpr double regulation = 1e5;    // g [1/s]
    static constexpr double full_current = 0.5;  // of the command of the current

    const Motor& motor;

    struct State {
        double angle, speed;        // [rad], [rad/s] of the rotor
        double field;               // [rad]
        double level;               // command of the current: below 1/2 it is reduced
        std::array<double, 2> i{};  // currents [A]
    };
    struct Rates {
        double torque, torque_rate;  // [N m], [N m/s]
        std::array<double, 2> rate;  // of the currents [A/s]
    };

    double largest_current() const { return std::sqrt(2.0) * motor.rated_current; }
    std::array<double, 2> wanted(double field, double level) const {
        const double most = largest_current() * (level < full_current ? motor.standstill_current : 1.0);
        const auto [sin, cos] = sine_cosine(motor.pole_pairs() * field);
        return {most * cos, most * sin};
    }
    Rates rates(const State& at) const {
        const double n = motor.pole_pairs(), R = motor.resistance_phase, L = motor.inductance_phase;
        const double K = motor.holding_torque / largest_current();
        const auto [sin, cos] = sine_cosine(n * at.angle);
        const std::array<double, 2> want = wanted(at.field, at.level), turn{-sin, cos};
        std::array<double, 2> u;
        for (std::size_t k = 0; k < 2; ++k)
            u[k] = R * want[k] + K * at.speed * turn[k] + regulation * L * (want[k] - at.i[k]);
        const double asked = std::sqrt(u[0] * u[0] + u[1] * u[1]);
        const double share = asked > motor.supply_voltage ? motor.supply_voltage / asked : 1.0;
        Rates out{};
        for (std::size_t k = 0; k < 2; ++k) {
            out.rate[k] = (share * u[k] - R * at.i[k] - K * at.speed * turn[k]) / L;
            out.torque += K * at.i[k] * turn[k];
            out.torque_rate += K * out.rate[k] * turn[k];
        }
        out.torque_rate -= K * n * at.speed * (at.i[0] * cos + at.i[1] * sin);
        return out;
    }
};

}  // namespace lostmotion
