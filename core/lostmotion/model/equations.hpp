// Equations of a regime: torques, accelerations and rates from the forms of the elements.
//
// The torques of a shaft are added up in one order: motors, gears and couplings that turn it; viscous friction; what
// acts on it; the load; its dry contact; gears and couplings that it turns; gears whose housing it is. Losses act on
// the contact of the input shaft, whose capacity is the sum over all that is dry there: one speed, one sign.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "element_forms.hpp"
#include "statics.hpp"

namespace lostmotion::model {

class Equations {
 public:
    explicit Equations(const ElementForms& forms)
        : forms_(forms),
          train_(forms.train()),
          places_(forms.places()),
          layout_(forms.layout()),
          terms_(forms.terms()),
          inertias_(forms.places()) {}

    const Inertias& inertias() const { return inertias_; }
    // Sets the key of a regime, and what its modes determine; that stays where the key before has the same modes.
    void set_key(const Key& key, Regime& r) const;
    // Torques, and the net torque of each shaft, in terms of the reactions of the stuck contacts as well.
    void compose(const Key& key, Regime& r) const;
    // What the given motion of a shaft turns it with, beside all that else acts on it: J w' less that.
    Row drive_torque(int shaft, const Row& others) const {
        const ShaftPlace& p = places_.shafts[shaft];
        return terms_.input(p.given_acceleration, p.inertia) - others;
    }
    // Once the accelerations are known: what those of other shafts ask, by the mass matrix, of drives of given motions
    // and of shafts at rest.
    void add_coupled_inertias(Regime& r) const;
    // Rates of the states, from accelerations without reactions.
    void set_rates(const Key& key, Regime& r) const;

 private:
    void compose_motors(const Key& key, Regime& r) const;
    Row field_torque(int motor, const Key& key) const;
    void compose_gear(int gear, const Key& key, Regime& r) const;
    void compose_coupling(const CouplingElement& c, const Key& key, Regime& r) const;
    Row shaft_friction(int shaft, const Key& key, const Regime& r) const;
    Row net_torque(int shaft, const Key& key, const Regime& r) const;
    LockedTorque<Row> locked_torque(int contact, const Key& key, const Regime& r) const;
    void add_held_shaft(const ContactPlace& at, const Key& key, const Regime& r, LockedTorque<Row>& locked) const;

    int mode(const Key& key, int contact) const { return key.modes[contact]; }
    // What a stuck contact takes: found from its rest, or, where the motion does not determine it, as it was. The
    // friction of a shaft whose given speed is zero takes nothing.
    Row held(int contact, const Regime& r) const {
        if (!r.ties.redundant[contact]) return terms_.reaction(contact);
        const int locked = places_.contacts[contact].locked;
        return locked == nowhere ? Row{} : terms_.memory(locked);
    }

    const ElementForms& forms_;
    const Train& train_;
    const Places& places_;
    const Layout& layout_;
    const Terms& terms_;
    const Inertias inertias_;
};

}  // namespace lostmotion::model
