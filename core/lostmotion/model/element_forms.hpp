// Speeds and torques of the elements of a train in a regime, as linear forms: each law is stated here once.
#pragma once

#include <array>
#include <bit>
#include <utility>

#include "places.hpp"

namespace lostmotion::model {

class ElementForms {
 public:
    explicit ElementForms(Train train, bool with_remainders)
        : train_(std::move(train)), places_(train_, with_remainders), terms_(places_.layout) {}
    ElementForms(const ElementForms&) = delete;
    ElementForms& operator=(const ElementForms&) = delete;

    const Train& train() const { return train_; }
    const Places& places() const { return places_; }
    const Layout& layout() const { return places_.layout; }
    const Terms& terms() const { return terms_; }

    // The ratio of the twist's rate to the speed of the input shaft: 1/i, less the slope of a transmission error.
    double per_input(int gear, const Key& key) const {
        const Gear& g = train_.gears[gear];
        const int k = places_.gears[gear].error_piece;
        return k == nowhere ? 1.0 / g.law.ratio : 1.0 / g.law.ratio - g.transmission_error.slope(key.branch[k]);
    }
    // The same for the speed of the housing.
    double per_housing(int gear, const Key& key) const { return 1.0 - per_input(gear, key); }
    // The angle that the transmission error depends on: of the input, relative to the housing.
    Row error_angle(int gear) const {
        const Gear& g = train_.gears[gear];
        Row angle = terms_.state(places_.shafts[g.input].angle);
        if (g.housing != nowhere) angle -= terms_.state(places_.shafts[g.housing].angle);
        return angle;
    }
    // Where the input shaft rests on a corner of the transmission error: by how much the torque that it takes on the
    // other side differs from that of this piece, times the output torque T_2.
    Row beyond_corner(int gear, const Key& key, const Row& T_2) const {
        const Gear& g = train_.gears[gear];
        const GearPlace& p = places_.gears[gear];
        const PeriodicCurve& e = g.transmission_error;
        const int k = key.branch[p.error_piece], n = e.pieces();
        const double more = e.slope(k) - e.slope((k + key.branch[p.error_corner] + n) % n);
        return more / (g.law.losses == Gearbox::constant_efficiency ? g.law.efficiency : 1.0) * T_2;
    }
    // The speed of a contact, as a form.
    Row contact_speed(int contact) const {
        const ContactPlace& c = places_.contacts[contact];
        Row f;
        c.each_shaft([&](int s, double per) { f.c[places_.shafts[s].speed] += per; });
        return f;
    }
    Row twist_rate(int gear, const Key& key) const {
        const Gear& g = train_.gears[gear];
        Row rate = terms_.state(places_.shafts[g.input].speed, per_input(gear, key)) -
                   terms_.state(places_.shafts[g.output].speed);
        if (g.housing != nowhere) rate += terms_.state(places_.shafts[g.housing].speed, per_housing(gear, key));
        return rate;
    }
    // P(d) in its piece; 0 of a rigid gear.
    Row spring_torque(int gear, const Key& key) const {
        const Gear& g = train_.gears[gear];
        if (g.rigid()) return Row{};
        const int piece = key.branch[places_.gears[gear].piece];
        return terms_.state(places_.gears[gear].twist, g.law.curve.slope(piece)) +
               terms_.one(g.law.curve.offset(piece));
    }
    Motor::Terms motor_terms(int motor) const {
        const MotorPlace& p = places_.motors[motor];
        const int command = p.command == nowhere ? layout().one : layout().first_input + p.command;
        return {p.torque, places_.shafts[train_.motors[motor].shaft].speed, command, layout().one};
    }
    // The loss law of a gear, where T_2 is its output torque.
    LossTerms<Row> losses(int gear, const Row& T_2) const {
        const Gear& g = train_.gears[gear];
        return g.loss_terms(layout().one, places_.shafts[g.input].speed, T_2);
    }
    Site site(int shaft) const { return {terms_, places_.shafts[shaft]}; }
    // Viscous friction of a gear on a housing that turns, between that and its input shaft; 0 of others, whose shaft
    // has it.
    Row housing_friction(int gear, const Regime& r) const {
        const Gear& g = train_.gears[gear];
        if (g.housing == nowhere) return Row{};
        return g.law.viscous_friction * (shaft_speed(g.input, r) - shaft_speed(g.housing, r));
    }
    // The speed of a shaft where it acts: 0 at rest, in terms of those that it follows where it is tied to others.
    Row shaft_speed(int shaft, const Regime& r) const {
        Row f;
        r.ties.each_share(shaft, [&](int k, double share) { f.c[places_.shafts[k].speed] = share; });
        return f;
    }
    // Dry friction of a shaft that slips, without what acts on it and gears.
    Row sliding_friction(int shaft, const Key& key) const {
        const ShaftPlace& p = places_.shafts[shaft];
        const DryFriction& friction = train_.shafts[shaft].friction;
        const int piece = p.friction_piece == nowhere ? 0 : key.branch[p.friction_piece];
        return terms_.one(mode(key, p.contact) * (p.motor_friction + friction.at_zero(piece))) +
               terms_.state(p.speed, friction.per_speed(piece));
    }
    // What a shaft holds at rest, without gears.
    Row held_friction(int shaft, const Key& key) const {
        Row F = terms_.one(places_.shafts[shaft].motor_friction + train_.shafts[shaft].friction.holding());
        for (const auto& e : places_.acting)
            if (e->is_dry() && e->shaft == shaft) F += e->friction(site(shaft), key, true);
        return F;
    }
    // The shafts that a coupling joins; its slip as tied_speed() has it.
    Between between(const CouplingElement& c, const Ties& ties) const {
        Between shafts{terms_, {}};
        std::array<double, max_shafts> slip;
        for (unsigned left = tied_speed(coupling_place(c, nowhere), ties, slip); left != 0; left &= left - 1) {
            const int k = std::countr_zero(left);
            shafts.slip.c[places_.shafts[k].speed] = slip[k];
        }
        return shafts;
    }
    // What its dry contact takes while it slips, or holds at rest.
    Row coupling_capacity(const CouplingElement& c, const Regime& r, bool at_rest) const {
        return c.capacity(between(c, r.ties), r.key, at_rest);
    }
    // What a coupling passes on from its input to its output, by its contact and beside it.
    Row coupling_torque(const CouplingElement& c, const Regime& r) const {
        const Row torque = c.torque(between(c, r.ties), r.key);
        return c.contact == nowhere ? torque : r.contact_torque[c.contact] + torque;
    }
    // What a dry element takes of a shaft that slips.
    Row dry_torque(const ShaftElement& e, const Key& key) const {
        return static_cast<double>(mode(key, places_.shafts[e.shaft].contact)) * e.friction(site(e.shaft), key, false);
    }
    // Is the rate of the twist kept at zero?
    bool twist_rests(int gear, const Regime& r) const {
        const Gear& g = train_.gears[gear];
        if (g.rigid()) return true;
        if (r.ties.at_rest[g.input] && r.ties.at_rest[g.output] && g.housing == nowhere) return true;
        return !g.transmission_error.present() && kept_at_rest(twist_place(g, gear), r.ties);
    }

    // What a controller takes.
    Row controller_signal(int k, const LinearController::Signal& signal) const {
        const ControllerPlace& p = places_.controllers[k];
        switch (signal.kind) {
            case LinearController::Signal::reference: return terms_.input(p.reference);
            case LinearController::Signal::reference_rate: return terms_.input(p.reference_rate);
            case LinearController::Signal::angle: return terms_.state(places_.shafts[signal.shaft].angle);
            default: return terms_.state(places_.shafts[signal.shaft].speed);
        }
    }
    Row controller_error(int k) const {
        return terms_.input(places_.controllers[k].reference) - controller_signal(k, train_.controllers[k].compared);
    }
    // v, its output without a limit.
    Row controller_output(int k) const {
        const LinearController& c = train_.controllers[k];
        Row v;
        for (std::size_t j = 0; j < c.states.size(); ++j)
            v += terms_.state(places_.controllers[k].first_state + static_cast<int>(j), c.C[j]);
        for (std::size_t j = 0; j < c.signals.size(); ++j) v += c.D[j] * controller_signal(k, c.signals[j]);
        return v;
    }
    // u, the command of its motor.
    Row controller_command(int k, const Key& key) const {
        const int branch = places_.controllers[k].branch;
        const int at = branch == nowhere ? 0 : key.branch[branch];
        return at == 0 ? controller_output(k) : terms_.one(at * train_.controllers[k].limit);
    }
    Row controller_rate(int k, std::size_t state, const Key& key) const {
        const LinearController& c = train_.controllers[k];
        Row rate;
        for (std::size_t j = 0; j < c.states.size(); ++j)
            rate += terms_.state(places_.controllers[k].first_state + static_cast<int>(j), c.A[state][j]);
        for (std::size_t j = 0; j < c.signals.size(); ++j) rate += c.B[state][j] * controller_signal(k, c.signals[j]);
        if (const double back = c.back_calculation[state]; back != 0.0)
            rate += back * (controller_command(k, key) - controller_output(k));
        return rate;
    }

 private:
    static int mode(const Key& key, int contact) { return key.modes[contact]; }

    Train train_;
    Places places_;
    Terms terms_;
};

}  // namespace lostmotion::model
