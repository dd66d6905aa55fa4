#include "assembly.hpp"

namespace lostmotion::model {

void Assembly::build(const Key& key, Regime& r) const {
    r.clear();
    equations_.set_key(key, r);
    equations_.compose(key, r);
    for (const int s : places().driven) r.drive_torque.push_back(equations_.drive_torque(s, r.motion[s]));
    r.solvable = Statics(places(), equations_.inertias(), r)
                     .solve({r.motor_torque, r.output_torque, r.input_torque, r.gear_hysteresis, r.contact_torque,
                             r.drive_torque});
    equations_.set_rates(key, r);
    equations_.add_coupled_inertias(r);
    RegimeGuards(equations_, *this, r).add_all();
    for (Guard& g : r.guards) r.put_massless_speeds(g.form);
    for (LockedTorque<Row>& l : r.locked)
        for (Row* f : {&l.low, &l.high, &l.needs, &l.friction}) r.put_massless_speeds(*f);
}

}  // namespace lostmotion::model
