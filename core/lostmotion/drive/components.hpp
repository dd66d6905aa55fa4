// The components of the drive's motion, and how those that a switching sets anew depend on the ones before.
#pragma once

#include <vector>

#include "../solver/components.hpp"
#include "contact.hpp"

namespace lostmotion {

enum Component : int { hysteresis_component = n_states, locked_component, n_components };
static_assert(n_components == component_count<DriveDims>);

using Components = ComponentsOf<DriveDims>;
using Jacobian = JacobianOf<DriveDims>;

template <>
class ComponentLaws<SwitchedDrive> {
 public:
    explicit ComponentLaws(const SwitchedDrive& system) : system_(system) {}

    bool neutral(int k) const { return k == load_angle; }
    bool matters(const RegimeKey& key, int k) const {
        return k != locked_component || (key.modes[0] == 0 && key.modes[1] == 0 && key.modes[2] == 0);
    }
    double magnitude(int) const { return drive().gearbox.rated_output_torque; }
    double change(int, double from, double to) const { return to - from; }
    void add(State& x, Memory& memory, int k, double change) const {
        if (k < n_states)
            x[k] += change;
        else if (k == hysteresis_component)
            memory.hysteresis_capacity = std::fmax(0.0, memory.hysteresis_capacity + change);
        else
            memory.locked_torque += change;
    }
    void rewind(State& x, Memory&) const { x[load_angle] = 0.0; }
    void direct(const State& x, RegimeKey& key) const { system_.direct(x, key); }
    std::vector<Components> constraints(const RegimeKey&) const { return {}; }

    // Speeds that stop, the hysteresis, the locked torque.
    ResetRatesOf<DriveDims> reset(const ResetOf<SwitchedDrive>& r, Jacobian& jump) const {
        const Switching& w = r.switching;
        std::array<bool, n_contacts> at_rest = r.before.at_rest;
        if (w.guard >= 0 && w.kind == Guard::speed) at_rest[w.contact] = true;
        if (at_rest[0] + at_rest[1] + at_rest[2] >= 2) at_rest = {true, true, true};
        if (at_rest[input_contact]) jump.row[motor_speed] = {};
        if (at_rest[load_contact]) jump.row[load_speed] = {};
        if (at_rest[twist_contact]) {
            jump.row[load_speed] = {};
            if (!at_rest[load_contact])
                for (int c = 0; c < n_components; ++c)
                    jump.row[load_speed][c] = jump.row[motor_speed][c] / drive().gearbox.ratio;
        }
        const bool at_turning_point =
            at_rest[twist_contact] && !r.before.at_rest[twist_contact] && drive().gearbox.has_hysteresis();
        if (at_turning_point) {
            jump.row[hysteresis_component] = {};
            jump.row[hysteresis_component][twist] = drive().gearbox.hysteresis_capacity_slope(r.x[twist]);
        }
        return lock(r, jump);
    }

 private:
    const Drive& drive() const { return system_.drive(); }

    // The locked torque matters only while all contacts are at rest.
    ResetRatesOf<DriveDims> lock(const ResetOf<SwitchedDrive>& r, Jacobian& jump) const {
        const Switching& w = r.switching;
        const TorsionCurve& curve = drive().gearbox.curve;
        const double d = r.x[twist];
        ResetRatesOf<DriveDims> rates;
        jump.row[locked_component] = {};
        if (!matters(w.after, locked_component)) return rates;
        const double T_2 = evaluate(r.before.output_torque, r.x, r.memory, r.input[0]), locked = w.memory.locked_torque;
        if (locked == T_2) {
            jump.row[locked_component] = gradient<DriveDims>(r.before.output_torque);
            rates.by_time[locked_component] = r.before.output_torque.c[command] * r.input[1][0] +
                                              r.before.output_torque.c[load_torque] * r.input[1][1];
        } else if (!drive().rigid() && std::fabs(std::fabs(locked - curve.torque(d)) - w.memory.hysteresis_capacity) <=
                                           rounding * std::fabs(locked)) {
            const double sign = locked > curve.torque(d) ? 1.0 : -1.0;
            jump.row[locked_component] = jump.row[hysteresis_component];
            for (double& v : jump.row[locked_component]) v *= sign;
            jump.row[locked_component][twist] += curve.slope(curve.locate(d));
        } else {
            rates.by_time[locked_component] = r.input[1][1];  // it follows the load torque, a friction torque off
        }
        return rates;
    }

    const SwitchedDrive& system_;
};

}  // namespace lostmotion
