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

#include "../kernel/sine.hpp"
#include "slots.hpp"
#include "synchronous_winding.hpp"

namespace lostmotion::control {

struct FieldOrientation {
    SynchronousWinding winding;
    double gain_d = 0.0, gain_q = 0.0;  // K_d, K_q [V/A]
    double integral_gain = 0.0;         // g R [V/A]
    double back_emf = 1.0;              // share of w_e psi that is compensated
    double decoupling = 1.0;            // share of w_e L i that is
    double field_weakening = 0.0;       // g_f
    double weakening_voltage = 1.0;     // u_f [V], above which the field is weakened; up to u_max there is a reserve
    double voltage_limit = 1.0;         // u_max, amplitude of a phase [V]
    double current_limit = 1.0;         // I_max, amplitude of a phase [A]
    double sample_time = 1e-3;          // T [s]
    double delay_time = 0.0;            // [s] from the sample until its voltage acts
    TickDelay delay;                    // the same in ticks
    int parts = 2;                      // of a tick, in each of which torque and speed are exchanged once

    // What the controller reads at a tick.
    struct Reading {
        double angle = 0.0;       // of the rotor, as measured [rad]
        double speed = 0.0;       // of the rotor, as measured [rad/s]
        double true_angle = 0.0;  // [rad], by which currents are turned from the stator's coordinates
        DirectQuadrature current;
    };

    void place(Slots& slots) {
        first_ = slots.take(n_own);
        steepest_ = circle_i_d();
        for (TickDelay* d : {&delay_d_, &delay_q_, &delay_angle_}) {
            *d = delay;
            d->place(slots);
        }
    }
    // The inverter holds the voltage that the turning rotor induces, as far as it can, so that no current flows.
    void start(double angle, double speed, double* slot) const {
        const double w_e = winding.pole_pairs * speed;
        slot[first_ + u_q] = std::clamp(w_e * winding.flux_linkage, -voltage_limit, voltage_limit);
        slot[first_ + stator_angle] = winding.pole_pairs * (angle + 0.5 * speed * delay_time);
        delay_d_.fill(0.0, slot);
        delay_q_.fill(slot[first_ + u_q], slot);
        delay_angle_.fill(slot[first_ + stator_angle], slot);
        slot[first_ + available] = largest_torque(0.0, w_e);
    }
    // The torque [N m] that the currents may rise to, as of the last sample.
    double available_torque(const double* slot) const { return slot[first_ + available]; }

    // The currents as the controller sees them.
    DirectQuadrature measured(const Reading& y) const {
        return turned(y.current, winding.pole_pairs * (y.true_angle - y.angle));
    }
    // The voltage for a torque [N m].
    void control(double torque, const Reading& y, double* slot) const {
        double* own = slot + first_;
        const double w_e = winding.pole_pairs * y.speed;
        const DirectQuadrature wanted = currents(torque, w_e, own);
        const DirectQuadrature i = measured(y);
        const double e_d = wanted.d - i.d, e_q = wanted.q - i.q;
        const double v_d = gain_d * e_d + own[integral_d] - decoupling * w_e * winding.inductance_q * i.q;
        const double v_q = gain_q * e_q + own[integral_q] + decoupling * w_e * winding.inductance_d * i.d +
                           back_emf * w_e * winding.flux_linkage;
        own[wanted_square] = v_d * v_d + v_q * v_q;
        const double share = std::fmin(1.0, voltage_limit / std::sqrt(own[wanted_square]));
        own[integral_d] += integral_gain * (e_d + (share - 1.0) * v_d / gain_d);
        own[integral_q] += integral_gain * (e_q + (share - 1.0) * v_q / gain_q);
        command({share * v_d, share * v_q}, y, slot);
    }
    // A voltage in coordinates of the rotor as it is read now, for the time that it will act.
    void command(DirectQuadrature voltage, const Reading& y, double* slot) const {
        double* own = slot + first_;
        own[u_d] = voltage.d;
        own[u_q] = voltage.q;
        own[stator_angle] = winding.pole_pairs * (y.angle + y.speed * (delay_time + 0.5 * sample_time));
    }
    bool finite(const double* slot) const {
        return std::isfinite(slot[first_ + u_d]) && std::isfinite(slot[first_ + u_q]) &&
               std::isfinite(slot[first_ + stator_angle]);
    }
    // What acts from this tick on.
    void act(std::int64_t tick, double* slot) const {
        double* own = slot + first_;
        own[acting_d] = delay_d_(own[u_d], tick, slot);
        own[acting_q] = delay_q_(own[u_q], tick, slot);
        own[acting_angle] = delay_angle_(own[stator_angle], tick, slot);
    }
    // The voltage that acts, in coordinates of the rotor at an angle [rad].
    DirectQuadrature voltage(double angle, const double* slot) const {
        const double* own = slot + first_;
        return turned({own[acting_d], own[acting_q]}, own[acting_angle] - winding.pole_pairs * angle);
    }

    // Least current for a torque: i_d = D - sgn(D) sqrt(D^2 + i_q^2), D = psi/(2 (L_q - L_d)). The torque rises with
    // i_q, for i_q > 0 ever more steeply, so that Newton's steps from above go down to the root.
    DirectQuadrature least_current(double torque) const {
        const double linear = 1.5 * winding.pole_pairs * winding.flux_linkage, most = std::fabs(torque) / linear;
        if (winding.saliency() == 0.0 || torque == 0.0) return {0.0, torque / linear};
        const double D = -winding.flux_linkage / (2.0 * winding.saliency());
        double i_q = most, i_d = 0.0;
        for (int round = 0; round < 50; ++round) {
            const double root = std::copysign(std::sqrt(D * D + i_q * i_q), D);
            i_d = -i_q * i_q / (D + root);
            const double slope =
                1.5 * winding.pole_pairs * (winding.flux_linkage + winding.saliency() * (i_d - i_q * i_q / root));
            const double step = (winding.torque(i_d, i_q) - std::fabs(torque)) / slope;
            i_q -= step;
            if (!(step > 1e-15 * most)) break;
        }
        return {i_d, std::copysign(i_q, torque)};
    }

 private:
    enum OwnSlot : int {
        integral_d,
        integral_q,
        weakening,
        wanted_square,
        available,
        u_d,
        u_q,
        stator_angle,
        acting_d,
        acting_q,
        acting_angle,
        n_own
    };

    static DirectQuadrature turned(DirectQuadrature v, double angle) {
        const auto [sine, cosine] = sine_cosine(angle);
        return {cosine * v.d - sine * v.q, sine * v.d + cosine * v.q};
    }
    // Where the circle of the largest current has its largest torque.
    double circle_i_d() const {
        const double S = winding.saliency(), psi = winding.flux_linkage;
        if (S == 0.0) return 0.0;
        return 2.0 * S * current_limit * current_limit /
               (psi + std::sqrt(psi * psi + 8.0 * S * S * current_limit * current_limit));
    }
    // Beyond -psi/L_d the voltage would rise again.
    double least_i_d() const { return -std::fmin(current_limit, winding.flux_linkage / winding.inductance_d); }
    // Within the circle; where i_d gives no more voltage, that which is left is for i_q.
    double most_i_q(double i_d, double w_e) const {
        const double most = std::sqrt(current_limit * current_limit - i_d * i_d);
        if (i_d > least_i_d() || i_d <= -current_limit) return most;
        return std::fmin(most, voltage_limit / (std::fabs(w_e) * winding.inductance_q));
    }
    double largest_torque(double weakened, double w_e) const {
        const double i_d = std::clamp(steepest_ + weakened, least_i_d(), current_limit);
        return std::fabs(winding.torque(i_d, most_i_q(i_d, w_e)));
    }

    DirectQuadrature currents(double torque, double w_e, double* own) const {
        const double psi = winding.flux_linkage;
        const double w_b = std::fmax(std::fabs(w_e), voltage_limit / psi);
        const double spare = weakening_voltage * weakening_voltage - own[wanted_square];
        own[weakening] =
            std::clamp(own[weakening] + field_weakening * spare / (2.0 * w_b * w_b * winding.inductance_d * psi),
                       -current_limit, 0.0);
        own[available] = largest_torque(own[weakening], w_e);
        const double M = std::clamp(torque, -own[available], own[available]);
        const double i_d = std::clamp(least_current(M).d + own[weakening], least_i_d(), current_limit);
        const double i_q = M / (1.5 * winding.pole_pairs * (psi + winding.saliency() * i_d)), most = most_i_q(i_d, w_e);
        return {i_d, std::clamp(i_q, -most, most)};
    }

    double steepest_ = 0.0;  // [A]
    int first_ = 0;
    TickDelay delay_d_, delay_q_, delay_angle_;
};

}  // namespace lostmotion::control
