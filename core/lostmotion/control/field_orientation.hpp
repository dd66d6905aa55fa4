// Field-oriented current controller of a synchronous motor: both currents in coordinates of the rotor, with voltage
// circle, current circle, field weakening and maximum torque per ampere.
//
//   i_d* = i_d(maximum torque per ampere) + f,   f += g_f (u_f^2 - |u|^2)/(2 w_b^2 L_d psi), -I_max <= f <= 0
//   i_q* = M*/(1.5 p (psi + (L_d - L_q) i_d*)),   |i*| <= I_max, by way of i_q*
//   u_x = K_x (i_x* - i_x) + I_x + decoupling,   |u| <= u_max,   I_x += K_x (1 - a_x) (e_x + what the limit took/K_x)
//
// with a_x = exp(-R T/L_x), K_x = g R/(1 - a_x), so that each axis is the loop g/(z (z - 1)), and w_b = max(|w_e|,
// u_max/psi). The voltage is meant for the middle of the time that it will act: its angle in coordinates of the stator
// is that of the rotor ahead by w_e (delay + T/2).
#pragma once

#include <algorithm>
#include <cmath>

#include "../base/sine.hpp"
#include "current_loop.hpp"
#include "slots.hpp"
#include "synchronous_winding.hpp"

namespace lostmotion::control {

struct FieldOrientation {
    SynchronousWinding winding;
    double gain = 1.0 / 3.0;
    double back_emf = 1.0;
    double decoupling = 1.0;
    double field_weakening = 0.02;
    double weakening_voltage = 0.95;
    double voltage_limit = 1.0;  // u_max, amplitude of a phase [V]
    double current_limit = 1.0;  // I_max, amplitude of a phase [A]
    double sample_time = 1e-3;   // T [s]
    double delay_time = 0.0;     // [s] from the sample until its voltage acts
    SampleDelay delay;           // the same in samples
    int parts = 2;               // of a sample, in each of which torque and speed are exchanged once
    bool limited = true;         // by voltage and largest current; false in a linear model

    template <class Fields>
    void describe(Fields& f) {
        CurrentLoop::describe_shares(f, gain, back_emf);
        f.number({"decoupling", "", "", Range::share, Given::has_default,
                  "share of what the current of one axis induces in the other that is compensated"},
                 decoupling);
        f.number({"field_weakening", "g_f", "", Range::share, Given::has_default,
                  "share of the excess of the voltage that i_d makes up for in one sample time; 0: none"},
                 field_weakening);
        f.number(
            {"weakening_voltage", "u_f/u_max", "", Range::up_to_one, Given::has_default,
             "share of the largest voltage above which the field is weakened; the rest is a reserve to control the "
             "currents with"},
            weakening_voltage);
        f.number({"pole_pairs", "p", "", Range::positive, Given::none}, winding.pole_pairs);
        f.number({"resistance", "R", "ohm", Range::positive, Given::none}, winding.resistance);
        f.number({"inductance_d", "L_d", "H", Range::positive, Given::none}, winding.inductance_d);
        f.number({"inductance_q", "L_q", "H", Range::positive, Given::none}, winding.inductance_q);
        f.number({"flux_linkage", "psi", "V*s", Range::positive, Given::none}, winding.flux_linkage);
        f.number({"voltage_limit", "u_max", "V", Range::positive, Given::none}, voltage_limit);
        f.number({"current_limit", "I_max", "A", Range::positive, Given::none}, current_limit);
        f.number({"sample_time", "T", "s", Range::positive, Given::none}, sample_time);
        f.number({"delay_time", "", "s", Range::not_negative, Given::none}, delay_time);
        f.integer({.key = "delay", .given = Given::none}, delay.samples, 0, max_delay);
        f.integer({.key = "parts", .given = Given::none}, parts, 1, 1000);
    }

    // What the controller reads at a sample.
    struct Reading {
        double angle = 0.0;       // of the rotor, as measured [rad]
        double speed = 0.0;       // of the rotor, as measured [rad/s]
        double true_angle = 0.0;  // [rad], by which currents are turned from the stator's coordinates
        DirectQuadrature current;
    };

    void place(Slots& slots);
    // The inverter holds the voltage that the turning rotor induces, as far as it can, so that no current flows.
    void start(double angle, double speed, double* slot) const;
    // The torque [N m] that the currents may rise to, as of the last sample.
    double available_torque(const double* slot) const { return slot[first_ + available]; }

    // The currents as the controller sees them.
    DirectQuadrature measured(const Reading& y) const {
        return turned(y.current, winding.pole_pairs * (y.true_angle - y.angle));
    }
    // The currents for a torque [N m] at a speed of the rotor [rad/s], with the field weakened as the last voltage
    // needs.
    DirectQuadrature wanted(double torque, double speed, double* slot) const;
    // The voltage for them, with the currents as they are measured.
    void follow(DirectQuadrature wanted, DirectQuadrature measured, const Reading& y, double* slot) const;
    // Both.
    void control(double torque, const Reading& y, double* slot) const {
        follow(wanted(torque, y.speed, slot), measured(y), y, slot);
    }
    // As in a steady motion in which the controller asks for this voltage.
    void settle(double torque, double weakened, DirectQuadrature voltage, const Reading& y, double* slot) const;
    // Sign of the torque that the voltage circle allowed no more of at the last sample, or 0.
    double at_limit(const double* slot) const { return slot[first_ + beyond]; }
    // What the voltage circle leaves of a voltage in coordinates of the rotor.
    DirectQuadrature within_limits(DirectQuadrature voltage) const;
    // A voltage in coordinates of the rotor as it is read now, for the time that it will act.
    void command(DirectQuadrature voltage, const Reading& y, double* slot) const;
    bool finite(const double* slot) const;
    // What acts from this sample on.
    void act(double* slot) const;
    // The voltage that acts, in coordinates of the rotor at an angle [rad].
    DirectQuadrature voltage(double angle, const double* slot) const;

    // Least current for a torque: i_d = D - sgn(D) sqrt(D^2 + i_q^2), D = psi/(2 (L_q - L_d)). The torque rises with
    // i_q, for i_q > 0 ever more steeply, so that Newton's steps from above go down to the root.
    DirectQuadrature least_current(double torque) const;
    static DirectQuadrature turned(DirectQuadrature v, double angle);

 private:
    enum OwnSlot : int {
        integral_d,
        integral_q,
        weakening,
        wanted_square,
        beyond,
        available,
        u_d,
        u_q,
        stator_angle,
        acting_d,
        acting_q,
        acting_angle,
        n_own
    };

    // Share of a voltage with this square of its amplitude.
    double within_circle(double square) const {
        return limited ? std::fmin(1.0, voltage_limit / std::sqrt(square)) : 1.0;
    }
    // Where the circle of the largest current has its largest torque.
    double circle_i_d() const;
    // Beyond -psi/L_d the voltage would rise again.
    double least_i_d() const { return -std::fmin(current_limit, winding.flux_linkage / winding.inductance_d); }
    // Within the circle; where i_d gives no more voltage, that which is left is for i_q.
    double most_i_q(double i_d, double w_e) const;
    double largest_torque(double weakened, double w_e) const;

    double K_d_ = 0.0, K_q_ = 0.0, K_i_ = 0.0;  // [V/A]
    double steepest_ = 0.0;                     // [A]
    int first_ = 0;
    SampleDelay delay_d_, delay_q_, delay_angle_;
};

}  // namespace lostmotion::control
