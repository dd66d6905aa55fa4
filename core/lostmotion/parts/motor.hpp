// What drives the input shaft.
#pragma once

#include <cmath>
#include <limits>

#include "field.hpp"

namespace lostmotion {

struct Motor {
    enum Kind { dc, torque_source, stepper } kind = dc;

    double rotor_inertia = 0.0;              // J_M [kg m2]
    double friction_torque = 0.0;            // T_10 [N m], dry friction of the bearings
    double rated_torque = 1.0;               // M_DR [N m]
    double rated_speed = 1.0;                // omega_DR [rad/s]
    double electrical_time_constant = 1e-3;  // tau_a [s]; 0: the torque follows voltage and speed at once
    double armature_voltage_constant = 2.0;  // k_N [-], stall torque / rated torque at rated voltage
    double voltage_limit = std::numeric_limits<double>::infinity();  // of |E_Z| [-]
    // Of a stepper. Its command is the angle of the field phi* [rad]. With ideal current it turns its rotor with
    // -T_H sin(n (phi - phi*)) - T_D sin(4 n phi), n = steps_per_revolution/4; with a supply by `StepperWinding`.
    double steps_per_revolution = 200.0;
    double holding_torque = 1.0;      // T_H [N m]
    double detent_torque = 0.0;       // T_D [N m]
    double torque_error = 0.0;        // [N m], of the straight lines that stand for the sines; 0: T_H/1000
    double standstill_current = 1.0;  // share of the current that is left at rest
    double rated_current = 1.0;       // I [A] of a phase
    double resistance_phase = 1.0;    // R [ohm]
    double inductance_phase = 1e-3;   // L [H]
    double supply_voltage = 0.0;      // U [V]; 0: the current is ideal

    template <class Fields>
    void describe(Fields& f) {
        f.choice("kind", kind, {"dc", "torque_source", "stepper"});
        f.number({"rotor_inertia", "J_M", "kg*m^2", Range::not_negative, Given::needed, "J_M"}, rotor_inertia);
        f.number({"friction_torque", "T_10", "N*m", Range::not_negative, Given::has_default,
                  "T_10, dry friction of the bearings"},
                 friction_torque);
        f.number({"rated_torque", "M_DR", "N*m", Range::positive, Given::has_default, "M_DR"}, rated_torque);
        f.number({"rated_speed", "omega_DR", "rad/s", Range::positive, Given::may_be_left_out, "omega_DR"},
                 rated_speed);
        f.number({"electrical_time_constant", "tau_a", "s", Range::not_negative, Given::may_be_left_out,
                  "tau_a; 0: the torque follows voltage and speed at once, which is the default with stall_torque and "
                  "no_load_speed"},
                 electrical_time_constant);
        f.number({"armature_voltage_constant", "k_N", "", Range::above_one, Given::may_be_left_out,
                  "k_N, stall torque / rated torque at rated voltage"},
                 armature_voltage_constant);
        f.number({"command_limit", "", "", Range::limit, Given::none}, voltage_limit);
        f.number({"steps_per_revolution", "", "", Range::positive, Given::may_be_left_out,
                  "full steps of a stepper in a turn of its rotor, a multiple of 4: 200 of 1.8 deg, 400 of 0.9 deg"},
                 steps_per_revolution);
        f.number({"holding_torque", "T_H", "N*m", Range::positive, Given::may_be_left_out,
                  "T_H of a stepper, largest torque at standstill with rated current in both phases"},
                 holding_torque);
        f.number({"detent_torque", "T_D", "N*m", Range::not_negative, Given::may_be_left_out,
                  "T_D of a stepper, amplitude of the torque without current, with a period of one step"},
                 detent_torque);
        f.number({"torque_error", "", "N*m", Range::positive, Given::may_be_left_out,
                  "largest error of the straight lines that stand for the torque of a stepper over its angle; left "
                  "out, a thousandth of holding_torque"},
                 torque_error);
        f.number({"standstill_current", "", "", Range::share, Given::may_be_left_out,
                  "share of its current that a stepper keeps at rest; left out, all of it"},
                 standstill_current);
        f.number({"rated_current", "", "A", Range::positive, Given::may_be_left_out,
                  "current of a phase of a stepper, at which it has its holding torque with both phases on"},
                 rated_current);
        f.number({"resistance_phase", "", "ohm", Range::positive, Given::may_be_left_out,
                  "resistance of a phase of a stepper"},
                 resistance_phase);
        f.number({"inductance_phase", "", "H", Range::positive, Given::may_be_left_out,
                  "inductance of a phase of a stepper"},
                 inductance_phase);
        f.number({"supply_voltage", "", "V", Range::positive, Given::may_be_left_out,
                  "supply of the driver of a stepper: its current follows resistance, inductance and induced voltage; "
                  "left out, the current is ideal"},
                 supply_voltage);
    }

    bool has_winding() const { return kind == stepper && supply_voltage > 0.0; }
    double pole_pairs() const { return 0.25 * steps_per_revolution; }
    double error_of_torque() const { return torque_error > 0.0 ? torque_error : 1e-3 * holding_torque; }

    // The terms of its forms: M_D, w_M, the command E_C and 1.
    struct Terms {
        int torque, speed, command, one;
    };

    // Whether the torque is a state; else it follows from command and speed.
    bool has_torque_state() const { return kind == dc && electrical_time_constant > 0.0; }

    // Torque on the rotor [N m]. A torque source follows its command, in units of the rated torque, without delay.
    template <class F>
    F torque(const Terms& of) const {
        return has_torque_state() ? F::unit(of.torque) : torque(of, F::unit(of.command));
    }
    // Of a motor whose torque is no state, with the voltage, or the command of a torque source, as a form. That of a DC
    // motor is the limit of eq. (2) for tau_a = 0: M_D = M_DR (k_N E_Z - (k_N - 1) w/w_DR).
    template <class F>
    F torque(const Terms& of, const F& voltage) const {
        if (kind == torque_source) return rated_torque * voltage;
        return stall_torque() * voltage -
               F::unit(of.speed, rated_torque * (armature_voltage_constant - 1.0) / rated_speed);
    }

    // dM_D/dt by eq. (2), with E_Z = E_C, or the limit with the sign of `amplifier` if that is not 0.
    template <class F>
    F torque_rate(const Terms& of, int amplifier) const {
        return torque_rate(of, amplifier == 0 ? F::unit(of.command) : F::unit(of.one, amplifier * voltage_limit));
    }
    // The same with E_Z as a form.
    template <class F>
    F torque_rate(const Terms& of, const F& voltage) const {
        if (kind == torque_source) return F{};
        const F m_D = F::unit(of.torque, 1.0 / rated_torque);
        const F back_emf = F::unit(of.speed, (armature_voltage_constant - 1.0) / rated_speed);
        return rated_torque / electrical_time_constant * (armature_voltage_constant * voltage - back_emf - m_D);
    }

    bool limits_voltage() const { return kind == dc && voltage_limit < std::numeric_limits<double>::infinity(); }

    // Speed [rad/s] that balances the coupling of both equations against a torque of 1 N m; without back-e.m.f., what
    // that torque gives within its time constant.
    double balanced_speed(double inertia) const {
        if (kind != dc) return 1.0;
        if (!has_torque_state()) return rated_speed;
        const double back_emf = inertia * (armature_voltage_constant - 1.0) * rated_torque;
        return back_emf > 0.0 ? std::sqrt(electrical_time_constant * rated_speed / back_emf)
                              : electrical_time_constant / inertia;
    }

    // Torque [N m] at standstill per unit of command.
    double stall_torque() const { return kind == dc ? armature_voltage_constant * rated_torque : rated_torque; }
};

}  // namespace lostmotion
