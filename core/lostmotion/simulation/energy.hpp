// Energy ledger of a run: every flow integrated on its own, so that the balance is a check and not an identity.
#pragma once

#include "../drive/contact.hpp"
#include "../parts/power.hpp"
#include "energy_ledger.hpp"
#include "power_integral.hpp"

namespace lostmotion {

class EnergyMeter {
 public:
    explicit EnergyMeter(const Drive& drive) : drive_(drive) {}
    EnergyLedger ledger;
    Interruption& interruption() { return integral_.interruption; }

    void begin(const State& x) { measure(x, ledger.kinetic_begin, ledger.elastic_begin); }
    void end(const State& x) { measure(x, ledger.kinetic_end, ledger.elastic_end); }

    // False ends the run.
    bool segment(const Segment<SwitchedDrive>& s) {
        if (!(s.end > s.begin)) return true;
        const Regime& r = s.entry.regime;
        if (r.at_rest[input_contact] && r.at_rest[load_contact]) return true;
        if (!integral_.add(s, factors(r, s.memory))) return false;
        ledger.flow = integral_.flow;
        ledger.turned_over = integral_.turned_over;
        return true;
    }

 private:
    using Integral = PowerIntegral<DriveDims, n_flows>;

    Integral::Factors factors(const Regime& r, const Memory& m) const {
        Integral::Factors factors;
        const LinearForm w_M = LinearForm::unit(motor_speed), w = LinearForm::unit(load_speed);
        const auto friction = [&](Contact c, double torque) {
            const int mode = r.key.modes[c];
            return LinearForm::unit(one, mode == absent ? 0.0 : mode * torque);
        };
        const auto set = [&factors](EnergyFlow flow, const Power<LinearForm>& p) {
            factors.set(flow, p.torque, p.speed);
        };
        set(from_source, {r.source_torque, w_M});
        set(in_input_damper, viscous_power(drive_.gearbox.viscous_friction, w_M));
        set(in_motor_friction, {friction(input_contact, drive_.motor.friction_torque), w_M});
        set(in_gear, mesh_power(r.input_torque, r.output_torque, 1.0 / drive_.gearbox.ratio, w_M));
        set(in_hysteresis,
            {r.at_rest[twist_contact] ? LinearForm{} : r.hysteresis_torque, drive_.contact_speed(twist_contact)});
        set(in_load_damper, viscous_power(drive_.load.viscous_friction, w));
        set(in_load_friction, {friction(load_contact, drive_.load.friction_torque), w});
        set(to_load, {LinearForm::unit(load_torque), w});
        factors.hold(m);
        return factors;
    }

    void measure(const State& x, double& kinetic, double& elastic) const {
        kinetic =
            kinetic_energy(drive_.input_inertia(), x[motor_speed]) + kinetic_energy(drive_.load.inertia, x[load_speed]);
        elastic = drive_.rigid() ? 0.0 : drive_.gearbox.curve.energy(x[twist]);
    }

    const Drive& drive_;
    Integral integral_;
};

}  // namespace lostmotion
