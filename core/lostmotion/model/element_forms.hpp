// Speeds and torques of the elements of a train in a regime, as linear forms: each law is stated here once.
#pragma once

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
    double per_input(int gear, const Key& key) const;
    // The same for the speed of the housing.
    double per_housing(int gear, const Key& key) const { return 1.0 - per_input(gear, key); }
    // The angle that laws of the gear depend on: of the input, relative to the housing.
    Row input_angle(int gear) const;
    // Where the input shaft rests on a corner of such a law, at the end of its piece in the direction `way`: by how
    // much the torque that the shaft takes on the other side exceeds that of this piece, at the output torque T_2.
    Row beyond_corner(int gear, int way, const Key& key, const Row& T_2) const;
    // Of the stiffness, over the angle of the input shaft.
    double stiffness_factor(int gear, const Key& key) const;
    // The pieces of the stiffness over the angles of a state.
    template <class State>
    Key meshes_at(const State& x) const {
        Key key;
        for (std::size_t g = 0; g < train_.gears.size(); ++g)
            if (const int branch = places_.gears[g].mesh.piece; branch != nowhere) {
                const PeriodicCurve& mesh = train_.gears[g].mesh_stiffness;
                const double phi = angle_of_input(g, x);
                key.branch[static_cast<std::size_t>(branch)] =
                    static_cast<std::int16_t>(mesh.piece(phi - mesh.turn(phi)));
            }
        return key;
    }
    template <class State>
    double angle_of_input(std::size_t gear, const State& x) const {
        const Gear& g = train_.gears[gear];
        const double phi = x[places_.shafts[g.input].angle];
        return g.housing == nowhere ? phi : phi - x[places_.shafts[g.housing].angle];
    }
    // The speed of a contact, as a form.
    Row contact_speed(int contact) const;
    Row twist_rate(int gear, const Key& key) const;
    // P(d) in its piece; 0 of a rigid gear.
    Row spring_torque(int gear, const Key& key) const;
    Motor::Terms motor_terms(int motor) const;
    // The loss law of a gear, where T_2 is its output torque.
    LossTerms<Row> losses(int gear, const Row& T_2) const;
    Site site(int shaft) const { return {terms_, places_.shafts[shaft]}; }
    // Viscous friction of a gear on a housing that turns, between that and its input shaft; 0 of others, whose shaft
    // has it.
    Row housing_friction(int gear, const Regime& r) const;
    // The speed of a shaft where it acts: 0 at rest, in terms of those that it follows where it is tied to others.
    Row shaft_speed(int shaft, const Regime& r) const;
    // Dry friction of a shaft that slips, without what acts on it and gears.
    Row sliding_friction(int shaft, const Key& key) const;
    // What a shaft holds at rest, without gears.
    Row held_friction(int shaft, const Key& key) const;
    // The shafts that a coupling joins; its slip as tied_speed() has it.
    Between between(const CouplingElement& c, const Ties& ties, const Key& key) const;
    // What its dry contact takes while it slips, or holds at rest.
    Row coupling_capacity(const CouplingElement& c, const Regime& r, bool at_rest) const {
        return c.capacity(between(c, r.ties, r.key), r.key, at_rest);
    }
    // What a coupling passes on from its input to its output, by its contact and beside it.
    Row coupling_torque(const CouplingElement& c, const Regime& r) const;
    // What a dry element takes of a shaft that slips.
    Row dry_torque(const ShaftElement& e, const Key& key) const {
        return static_cast<double>(mode(key, places_.shafts[e.shaft].contact)) * e.friction(site(e.shaft), key, false);
    }
    // The torque with which a shaft presses on an element.
    Row pressing_torque(int element, const Key& key) const {
        const ShaftElement& e = *places_.acting[element];
        return -e.torque(site(e.shaft), key);
    }
    // Is the rate of the twist kept at zero?
    bool twist_rests(int gear, const Ties& ties) const;

    // Of a stepper, the electrical angle of its field before its rotor: n (phi* - phi).
    Row field_lead(int motor) const;
    // What a controller takes.
    Row controller_signal(int k, const LinearController::Signal& signal) const;
    Row controller_error(int k) const {
        return terms_.input(places_.controllers[k].reference) - controller_signal(k, train_.controllers[k].compared);
    }
    // v, its output without a limit.
    // Before its curve; before its limit.
    Row controller_input(int k) const;
    Row controller_output(int k, const Key& key) const;
    // u, the command of its motor.
    Row controller_command(int k, const Key& key) const;
    Row controller_rate(int k, std::size_t state, const Key& key) const;

 private:
    static int mode(const Key& key, int contact) { return key.modes[contact]; }

    Train train_;
    Places places_;
    Terms terms_;
};

}  // namespace lostmotion::model
