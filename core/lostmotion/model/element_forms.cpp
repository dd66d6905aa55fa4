#include "element_forms.hpp"

namespace lostmotion::model {

double ElementForms::per_input(int gear, const Key& key) const {
    const Gear& g = train_.gears[gear];
    const int k = places_.gears[gear].error.piece;
    return k == nowhere ? 1.0 / g.law.ratio : 1.0 / g.law.ratio - g.transmission_error.slope(key.branch[k]);
}

auto ElementForms::input_angle(int gear) const -> Row {
    const Gear& g = train_.gears[gear];
    Row angle = terms_.state(places_.shafts[g.input].angle);
    if (g.housing != nowhere) angle -= terms_.state(places_.shafts[g.housing].angle);
    return angle;
}

auto ElementForms::beyond_corner(int gear, int way, const Key& key, const Row& T_2) const -> Row {
    const Gear& g = train_.gears[gear];
    const GearPlace& p = places_.gears[gear];
    const double efficiency = g.law.losses == Gearbox::constant_efficiency ? g.law.efficiency : 1.0;
    const auto beyond = [way](const PeriodicCurve& curve, int k) {
        return (k + way + curve.pieces()) % curve.pieces();
    };
    const auto rests = [&](const OverAngle& law) { return law.corner != nowhere && key.branch[law.corner] == way; };
    Row more;
    if (rests(p.error)) {
        const PeriodicCurve& e = g.transmission_error;
        const int k = key.branch[p.error.piece];
        more = static_cast<double>(way) * (e.slope(k) - e.slope(beyond(e, k))) / efficiency * T_2;
    }
    if (rests(p.mesh)) {
        const PeriodicCurve& s = g.mesh_stiffness;
        const int k = key.branch[p.mesh.piece];
        more += way * (s.value(beyond(s, k)) / s.value(k) - 1.0) / efficiency / g.law.ratio * spring_torque(gear, key);
    }
    return more;
}

double ElementForms::stiffness_factor(int gear, const Key& key) const {
    const int branch = places_.gears[gear].mesh.piece;
    return branch == nowhere ? 1.0 : train_.gears[gear].mesh_stiffness.value(key.branch[branch]);
}

auto ElementForms::contact_speed(int contact) const -> Row {
    const ContactPlace& c = places_.contacts[contact];
    Row f;
    c.each_shaft([&](int s, double per) { f.c[places_.shafts[s].speed] += per; });
    return f;
}

auto ElementForms::twist_rate(int gear, const Key& key) const -> Row {
    const Gear& g = train_.gears[gear];
    Row rate = terms_.state(places_.shafts[g.input].speed, per_input(gear, key)) -
               terms_.state(places_.shafts[g.output].speed);
    if (g.housing != nowhere) rate += terms_.state(places_.shafts[g.housing].speed, per_housing(gear, key));
    return rate;
}

auto ElementForms::spring_torque(int gear, const Key& key) const -> Row {
    const Gear& g = train_.gears[gear];
    if (g.rigid() || g.strikes()) return Row{};
    const int piece = key.branch[places_.gears[gear].piece];
    const double factor = stiffness_factor(gear, key);
    return terms_.state(places_.gears[gear].twist, factor * g.law.curve.slope(piece)) +
           terms_.one(factor * g.law.curve.offset(piece));
}

auto ElementForms::field_lead(int motor) const -> Row {
    const ShaftMotor& m = train_.motors[motor];
    return m.law.pole_pairs() *
           (terms_.input(places_.motors[motor].command) - terms_.state(places_.shafts[m.shaft].angle));
}

auto ElementForms::motor_terms(int motor) const -> Motor::Terms {
    const MotorPlace& p = places_.motors[motor];
    const int command = p.command == nowhere ? layout().one : layout().first_input + p.command;
    return {p.torque, places_.shafts[train_.motors[motor].shaft].speed, command, layout().one};
}

auto ElementForms::losses(int gear, const Row& T_2) const -> LossTerms<Row> {
    const Gear& g = train_.gears[gear];
    return g.loss_terms(layout().one, places_.shafts[g.input].speed, T_2);
}

auto ElementForms::housing_friction(int gear, const Regime& r) const -> Row {
    const Gear& g = train_.gears[gear];
    if (g.housing == nowhere) return Row{};
    return g.law.viscous_friction * (shaft_speed(g.input, r) - shaft_speed(g.housing, r));
}

auto ElementForms::shaft_speed(int shaft, const Regime& r) const -> Row {
    Row f;
    r.ties.each_share(shaft, [&](int k, double share) { f.c[places_.shafts[k].speed] = share; });
    return f;
}

auto ElementForms::sliding_friction(int shaft, const Key& key) const -> Row {
    const ShaftPlace& p = places_.shafts[shaft];
    const DryFriction& friction = train_.shafts[shaft].friction;
    const int piece = p.friction_piece == nowhere ? 0 : key.branch[p.friction_piece];
    return terms_.one(mode(key, p.contact) * (p.motor_friction + friction.at_zero(piece))) +
           terms_.state(p.speed, friction.per_speed(piece));
}

auto ElementForms::held_friction(int shaft, const Key& key) const -> Row {
    Row F = terms_.one(places_.shafts[shaft].motor_friction + train_.shafts[shaft].friction.holding());
    for (const auto& e : places_.acting)
        if (e->is_dry() && e->shaft == shaft) F += e->friction(site(shaft), key, true);
    return F;
}

auto ElementForms::between(const CouplingElement& c, const Ties& ties, const Key& key) const -> Between {
    Between shafts{terms_, {}, c.contact == nowhere ? 0 : mode(key, c.contact)};
    for (const Share& k : tied_speed(coupling_place(c, nowhere), ties))
        shafts.slip.c[places_.shafts[k.shaft].speed] = k.share;
    return shafts;
}

auto ElementForms::coupling_torque(const CouplingElement& c, const Regime& r) const -> Row {
    const Row torque = c.torque(between(c, r.ties, r.key), r.key);
    return c.contact == nowhere ? torque : r.contact_torque[c.contact] + torque;
}

bool ElementForms::twist_rests(int gear, const Ties& ties) const {
    const Gear& g = train_.gears[gear];
    if (g.rigid()) return true;
    if (ties.at_rest[g.input] && ties.at_rest[g.output] && g.housing == nowhere) return true;
    return !g.transmission_error.present() && kept_at_rest(twist_place(g, gear), ties);
}

auto ElementForms::controller_signal(int k, const LinearController::Signal& signal) const -> Row {
    const ControllerPlace& p = places_.controllers[k];
    switch (signal.kind) {
        case LinearController::Signal::reference: return terms_.input(p.reference);
        case LinearController::Signal::reference_rate: return terms_.input(p.reference_rate);
        case LinearController::Signal::angle: return terms_.state(places_.shafts[signal.shaft].angle);
        default: return terms_.state(places_.shafts[signal.shaft].speed);
    }
}

auto ElementForms::controller_input(int k) const -> Row {
    const LinearController& c = train_.controllers[k];
    Row v;
    for (std::size_t j = 0; j < c.states.size(); ++j)
        v += terms_.state(places_.controllers[k].first_state + static_cast<int>(j), c.C[j]);
    for (std::size_t j = 0; j < c.signals.size(); ++j) v += c.D[j] * controller_signal(k, c.signals[j]);
    return v;
}

auto ElementForms::controller_output(int k, const Key& key) const -> Row {
    const LinearController& c = train_.controllers[k];
    Row v = controller_input(k);
    if (c.curved) v = on_piece(terms_, v, c.curve, key.branch[places_.controllers[k].piece]);
    if (c.droop != 0.0) v -= terms_.state(places_.shafts[train_.motors[c.motor].shaft].speed, c.droop);
    return v;
}

auto ElementForms::controller_command(int k, const Key& key) const -> Row {
    const int branch = places_.controllers[k].branch;
    const int at = branch == nowhere ? 0 : key.branch[branch];
    return at == 0 ? controller_output(k, key) : terms_.one(at * train_.controllers[k].limit);
}

auto ElementForms::controller_rate(int k, std::size_t state, const Key& key) const -> Row {
    const LinearController& c = train_.controllers[k];
    Row rate;
    for (std::size_t j = 0; j < c.states.size(); ++j)
        rate += terms_.state(places_.controllers[k].first_state + static_cast<int>(j), c.A[state][j]);
    for (std::size_t j = 0; j < c.signals.size(); ++j) rate += c.B[state][j] * controller_signal(k, c.signals[j]);
    if (const double back = c.back_calculation[state]; back != 0.0)
        rate += back * (controller_command(k, key) - controller_output(k, key));
    return rate;
}

}  // namespace lostmotion::model
