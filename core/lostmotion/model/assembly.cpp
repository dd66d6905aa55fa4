#include "assembly.hpp"

namespace lostmotion::model {

void Assembly::build(const Key& key, Regime& r) const {
    r.clear();
    r.key = key;
    r.ties = places().ties(key.modes);
    for (int c = 0; c < layout().contacts; ++c)
        r.at_rest[c] = (!places().contacts[c].gap.present() || key.modes[c] == 0) &&
                       (r.ties.redundant[c] || kept_at_rest(places().contacts[c], r.ties));

    equations_.compose(key, r);
    for (const int s : places().driven) r.drive_torque.push_back(equations_.drive_torque(s, r.motion[s]));
    Statics statics(places(), key, r.ties, r.motion);
    r.solvable = statics.solve(
        {r.motor_torque, r.output_torque, r.input_torque, r.gear_hysteresis, r.contact_torque, r.drive_torque});
    r.massless = statics.massless();
    equations_.set_rates(key, r);
    equations_.add_coupled_inertias(r);
    RegimeGuards(equations_, *this, r).add_all();
    for (Guard& g : r.guards) r.put_massless_speeds(g.form);
    for (LockedTorque<Row>& l : r.locked)
        for (Row* f : {&l.low, &l.high, &l.needs, &l.friction}) r.put_massless_speeds(*f);
}

}  // namespace lostmotion::model
