// Energy ledger of a run: every flow integrated on its own, so that the balance is a check and not an identity.
#pragma once

#include "../drive/contact.hpp"
#include "power_integral.hpp"

namespace lostmotion {

enum EnergyFlow : int {
    from_source,        // M_D w_M
    in_input_damper,    // b_MR w_M^2
    in_motor_friction,  // T_10 |w_M|
    in_gear,           // (T_1 - T_2/i) w_M: the losses of the mesh; negative where a constant efficiency creates energy
    in_hysteresis,     // H dd/dt
    in_load_damper,    // b_ZR w^2
    in_load_friction,  // dry friction of the load's bearing
    to_load,           // M_Z w
    n_flows
};

struct EnergyLedger {
    std::array<double, n_flows> flow{};                                                     // [J] since the start
    double kinetic_begin = 0.0, kinetic_end = 0.0, elastic_begin = 0.0, elastic_end = 0.0;  // [J]
    double turned_over = 0.0;  // [J] sum of the magnitudes of all flows, panel by panel (or of apparent energies)

    // What the balance fails by [J].
    double residual() const {
        double sum = flow[from_source] - (kinetic_end - kinetic_begin) - (elastic_end - elastic_begin);
        for (int k = from_source + 1; k < n_flows; ++k) sum -= flow[k];
        return sum;
    }
};

// What the ledger says, for everything outside the core; all in J.
struct EnergyEntry {
    const char* name;
    double (*of)(const EnergyLedger&);
};
template <EnergyFlow flow>
double flow_of(const EnergyLedger& e) {
    return e.flow[flow];
}
inline constexpr std::array energy_entries{
    EnergyEntry{"source", flow_of<from_source>},
    EnergyEntry{"input_damper", flow_of<in_input_damper>},
    EnergyEntry{"motor_friction", flow_of<in_motor_friction>},
    EnergyEntry{"gear_losses", flow_of<in_gear>},
    EnergyEntry{"hysteresis", flow_of<in_hysteresis>},
    EnergyEntry{"load_damper", flow_of<in_load_damper>},
    EnergyEntry{"load_friction", flow_of<in_load_friction>},
    EnergyEntry{"load_work", flow_of<to_load>},
    EnergyEntry{"kinetic_change", [](const EnergyLedger& e) { return e.kinetic_end - e.kinetic_begin; }},
    EnergyEntry{"elastic_change", [](const EnergyLedger& e) { return e.elastic_end - e.elastic_begin; }},
    EnergyEntry{"residual", [](const EnergyLedger& e) { return e.residual(); }},
    EnergyEntry{"turned_over", [](const EnergyLedger& e) { return e.turned_over; }},
};
static_assert(energy_entries.size() == n_flows + 4);

class EnergyMeter {
 public:
    explicit EnergyMeter(const Drive& drive) : drive_(drive) {}
    EnergyLedger ledger;

    void begin(const State& x) { measure(x, ledger.kinetic_begin, ledger.elastic_begin); }
    void end(const State& x) { measure(x, ledger.kinetic_end, ledger.elastic_end); }

    bool segment(const Segment<SwitchedDrive>& s) {
        if (!(s.end > s.begin)) return true;
        const Regime& r = s.entry.regime;
        if (r.at_rest[input_contact] && r.at_rest[load_contact]) return true;
        integral_.add(s, factors(r, s.memory));
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
        factors.set(from_source, r.source_torque, w_M);
        factors.set(in_input_damper, drive_.gearbox.viscous_friction * w_M, w_M);
        factors.set(in_motor_friction, friction(input_contact, drive_.motor.friction_torque), w_M);
        factors.set(in_gear, r.input_torque - r.output_torque / drive_.gearbox.ratio, w_M);
        factors.set(in_hysteresis, r.at_rest[twist_contact] ? LinearForm{} : r.hysteresis_torque,
                    drive_.contact_speed(twist_contact));
        factors.set(in_load_damper, drive_.load.viscous_friction * w, w);
        factors.set(in_load_friction, friction(load_contact, drive_.load.friction_torque), w);
        factors.set(to_load, LinearForm::unit(load_torque), w);
        factors.hold(m);
        return factors;
    }

    void measure(const State& x, double& kinetic, double& elastic) const {
        kinetic = 0.5 * drive_.input_inertia() * x[motor_speed] * x[motor_speed] +
                  0.5 * drive_.load.inertia * x[load_speed] * x[load_speed];
        elastic = drive_.rigid() ? 0.0 : drive_.gearbox.curve.energy(x[twist]);
    }

    const Drive& drive_;
    Integral integral_;
};

}  // namespace lostmotion
