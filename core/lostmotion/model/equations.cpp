#include "equations.hpp"

namespace lostmotion::model {

void Equations::set_key(const Key& key, Regime& r) const {
    const bool same_modes = !r.ties.of.empty() && r.key.modes == key.modes;
    r.key = key;
    if (same_modes) return;
    r.ties = places_.ties(key.modes);
    for (int c = 0; c < layout_.contacts; ++c) {
        r.kept_at_rest[c] = kept_at_rest(places_.contacts[c], r.ties);
        r.at_rest[c] =
            (!places_.contacts[c].gap.present() || key.modes[c] == 0) && (r.ties.redundant[c] || r.kept_at_rest[c]);
    }
    for (std::size_t g = 0; g < train_.gears.size(); ++g)
        r.twist_rests[g] = forms_.twist_rests(static_cast<int>(g), r.ties);
    r.light_shafts = Statics(places_, inertias_, r).has_light_shafts();
}

void Equations::compose(const Key& key, Regime& r) const {
    const std::size_t gears = train_.gears.size();
    r.output_torque.resize(gears);
    r.input_torque.resize(gears);
    r.gear_hysteresis.resize(gears);
    r.contact_torque.resize(places_.contacts.size());
    r.motion.resize(train_.shafts.size());
    r.loss.resize(gears);
    compose_motors(key, r);
    for (std::size_t g = 0; g < gears; ++g) compose_gear(static_cast<int>(g), key, r);
    for (const auto& c : places_.couplings)
        if (c->is_dry()) compose_coupling(*c, key, r);
    for (const auto& e : places_.acting)
        if (e->contact != nowhere && mode(key, e->contact) == 0) r.contact_torque[e->contact] = held(e->contact, r);
    for (std::size_t s = 0; s < train_.shafts.size(); ++s) {
        const int c = places_.shafts[s].contact;
        if (c != nowhere) r.contact_torque[c] = shaft_friction(static_cast<int>(s), key, r);
    }
    for (std::size_t s = 0; s < train_.shafts.size(); ++s) r.motion[s] = net_torque(static_cast<int>(s), key, r);
    r.locked.clear();
    for (std::size_t c = places_.contacts.size(); c-- > 0;)
        if (r.ties.redundant[c] && places_.contacts[c].locked != nowhere)
            r.locked.push_back(locked_torque(static_cast<int>(c), key, r));
    // From here on the torque at the input includes the losses.
    for (std::size_t g = 0; g < gears; ++g) r.input_torque[g] += r.loss[g];
}

void Equations::compose_motors(const Key& key, Regime& r) const {
    for (std::size_t m = 0; m < train_.motors.size(); ++m) {
        const ShaftMotor& motor = train_.motors[m];
        const MotorPlace& p = places_.motors[m];
        const Motor::Terms of = forms_.motor_terms(static_cast<int>(m));
        const int limit = p.branch == nowhere ? 0 : key.branch[p.branch];
        if (motor.law.kind == Motor::stepper)
            r.motor_torque.push_back(field_torque(static_cast<int>(m), key));
        else if (motor.law.has_torque_state())
            r.motor_torque.push_back(motor.law.torque<Row>(of));
        else if (p.controller != nowhere)
            r.motor_torque.push_back(motor.law.torque(of, forms_.controller_command(p.controller, key)));
        else if (limit == 0)
            r.motor_torque.push_back(motor.law.torque<Row>(of));
        else if (motor.law.kind == Motor::torque_source)
            r.motor_torque.push_back(terms_.one(limit * motor.torque_limit));
        else
            r.motor_torque.push_back(motor.law.torque(of, terms_.one(limit * motor.command_limit())));
    }
}

// Of a stepper, whose torque acts as a law over the angle, or is that of its winding.
Row Equations::field_torque(int motor, const Key& key) const {
    if (const int input = places_.motors[motor].winding; input != nowhere) return terms_.input(input);
    Row sum;
    for (const auto& e : places_.acting)
        if (e->motor() == motor) sum += e->torque(forms_.site(e->shaft), key);
    return sum;
}

// T_2 = P(d) + H, with damping while the flanks touch, of a limited one at most another P; T_1 without the losses that
// act on the contact of the input shaft, which are `loss`: M_2B sign(w)/i with M_2B of one cell of the loss law (12).
void Equations::compose_gear(int gear, const Key& key, Regime& r) const {
    const Gear& g = train_.gears[gear];
    const GearPlace& p = places_.gears[gear];
    const double i = g.law.ratio;
    const Row P = forms_.spring_torque(gear, key);
    Row& H = r.gear_hysteresis[gear];
    if (p.contact != nowhere) {
        const int slip = mode(key, p.contact);
        if (slip != 0)
            H = g.strikes() ? Row{} : terms_.memory(p.hysteresis, slip);
        else if (r.ties.redundant[p.contact])
            H = held(p.contact, r) - P;
        else
            H = held(p.contact, r);
    }
    Row& T_2 = r.output_torque[gear];
    T_2 = P + H;
    if (p.contact != nowhere) r.contact_torque[p.contact] = H;
    const int flanks = p.flanks == nowhere ? int{Gear::touching} : key.branch[p.flanks];
    if (flanks == Gear::parted)
        T_2 = Row{};
    else if (flanks == Gear::limited)
        T_2 = 2.0 * P;
    else if (g.mesh_damping > 0.0 && !(g.has_backlash() && key.branch[p.piece] == 0) &&
             !std::as_const(r.twist_rests)[gear])
        T_2 += g.mesh_damping * forms_.twist_rate(gear, key);

    Row& T_1 = r.input_torque[gear];
    T_1 = T_2 / i;
    if (p.error.piece != nowhere) T_1 -= g.transmission_error.slope(key.branch[p.error.piece]) * T_2;
    if (!g.has_dry_losses()) {
        if (g.law.losses == Gearbox::constant_efficiency) T_1 = T_1 / g.law.efficiency;
        return;
    }
    const double s = mode(key, places_.shafts[g.input].contact);
    if (s == 0.0) return;
    r.loss[gear] = forms_.losses(gear, T_2).turning(g.loss_plane(key.branch[p.cell]), s) / g.reduction();
}

// What its dry contact takes.
void Equations::compose_coupling(const CouplingElement& c, const Key& key, Regime& r) const {
    const int slip = mode(key, c.contact);
    Row& torque = r.contact_torque[c.contact];
    if (slip == 0)
        torque = held(c.contact, r);
    else if (!c.is_one_way())
        torque = static_cast<double>(slip) * forms_.coupling_capacity(c, r, std::as_const(r.kept_at_rest)[c.contact]);
}

// What the dry contact of a shaft takes. One that "slips" while others keep it at rest gives all that it holds.
Row Equations::shaft_friction(int shaft, const Key& key, const Regime& r) const {
    const ShaftPlace& p = places_.shafts[shaft];
    if (mode(key, p.contact) == 0) return held(p.contact, r);
    Row F;
    if (r.ties.at_rest[shaft]) {
        F = static_cast<double>(mode(key, p.contact)) * forms_.held_friction(shaft, key);
    } else {
        F = forms_.sliding_friction(shaft, key);
        for (const auto& e : places_.acting)
            if (e->is_dry() && e->shaft == shaft) F += forms_.dry_torque(*e, key);
    }
    for (std::size_t g = 0; g < train_.gears.size(); ++g)
        if (train_.gears[g].input == shaft && train_.gears[g].has_dry_losses()) F += r.loss[g];
    return F;
}

Row Equations::net_torque(int shaft, const Key& key, const Regime& r) const {
    const ShaftPlace& p = places_.shafts[shaft];
    Row sum;
    for (std::size_t m = 0; m < train_.motors.size(); ++m)
        if (const Motor& law = train_.motors[m].law;
            train_.motors[m].shaft == shaft && (law.kind != Motor::stepper || law.has_winding()))
            sum += r.motor_torque[m];
    for (std::size_t g = 0; g < train_.gears.size(); ++g)
        if (train_.gears[g].output == shaft) sum += r.output_torque[g];
    for (const auto& c : places_.couplings)
        if (c->output == shaft) sum += forms_.coupling_torque(*c, r);
    sum -= p.viscous_friction * forms_.shaft_speed(shaft, r);
    for (const auto& e : places_.acting)
        if (!e->is_dry() && e->shaft == shaft && (e->acts_at_rest() || !r.ties.at_rest[shaft]))
            sum += e->torque(forms_.site(shaft), key);
    if (p.load != nowhere) sum -= terms_.input(p.load);
    if (p.contact != nowhere) sum -= r.contact_torque[p.contact];
    for (const auto& e : places_.acting)
        if (e->contact != nowhere && e->shaft == shaft) sum -= r.contact_torque[e->contact];
    for (std::size_t g = 0; g < train_.gears.size(); ++g)
        if (train_.gears[g].input == shaft) sum -= r.input_torque[g];
    for (const auto& c : places_.couplings)
        if (c->input == shaft) sum -= forms_.coupling_torque(*c, r);
    for (std::size_t g = 0; g < train_.gears.size(); ++g)
        if (train_.gears[g].housing == shaft) sum -= r.output_torque[g] - r.input_torque[g];
    for (std::size_t g = 0; g < train_.gears.size(); ++g) {
        const Gear& gear = train_.gears[g];
        if (gear.housing == nowhere || gear.law.viscous_friction == 0.0) continue;
        if (gear.input == shaft) sum -= forms_.housing_friction(static_cast<int>(g), r);
        if (gear.housing == shaft) sum += forms_.housing_friction(static_cast<int>(g), r);
    }
    return sum;
}

// What bounds a torque that rest leaves open. The shaft that it turns bounds it by its plain friction alone: losses
// there depend on the torque itself.
LockedTorque<Row> Equations::locked_torque(int contact, const Key& key, const Regime& r) const {
    const ContactPlace& c = places_.contacts[contact];
    LockedTorque<Row> locked;
    locked.contact = contact;
    locked.memory = c.locked;
    const auto between = [&locked](const Row& low, const Row& high) {
        locked.has_low = locked.has_high = true;
        locked.low = low;
        locked.high = high;
    };
    if (c.gap.present()) {
        (key.branch[c.gap.side] > 0 ? locked.has_low : locked.has_high) = true;
    } else if (c.kind == ContactPlace::gear && !c.bilateral) {
        const Row P = forms_.spring_torque(c.element, key), h = terms_.memory(places_.gears[c.element].hysteresis);
        between(P - h, P + h);
    } else if (c.one_way) {
        locked.has_low = true;
    } else if (c.kind == ContactPlace::coupling) {
        const Row most = forms_.coupling_capacity(*places_.couplings[c.element], r, true);
        between(-most, most);
    }
    const int turned = c.turned(), on = places_.shafts[turned].contact;
    const bool lossy = std::any_of(train_.gears.begin(), train_.gears.end(),
                                   [&](const Gear& g) { return g.input == turned && g.has_dry_losses(); });
    if (on != nowhere && mode(key, on) == 0 && !r.ties.redundant[on] && !lossy) add_held_shaft(c, key, r, locked);
    return locked;
}

// All that turns a shaft at rest but its friction and this torque.
void Equations::add_held_shaft(const ContactPlace& at, const Key& key, const Regime& r,
                               LockedTorque<Row>& locked) const {
    const int shaft = at.turned();
    locked.on_held_shaft = true;
    locked.friction = forms_.held_friction(shaft, key);
    locked.needs = -at.turns() * net_torque(shaft, key, r);
    locked.needs.c[layout_.first_memory + locked.memory] = 0.0;
    for (int c = 0; c < layout_.contacts; ++c) {
        const double share = std::exchange(locked.needs.c[layout_.terms + c], 0.0);
        const ContactPlace& other = places_.contacts[c];
        if (share == 0.0 || other.kind == ContactPlace::shaft) continue;
        locked.needs_torque[c] = share;
        if (other.kind == ContactPlace::gear) locked.needs -= share * forms_.spring_torque(other.element, key);
    }
}

void Equations::add_coupled_inertias(Regime& r) const {
    const auto add = [&](int shaft, Row& torque, double way = 1.0) {
        places_.each_coupled_inertia(
            shaft, [&](int other, double inertia) { torque += way * inertia * r.rate[places_.shafts[other].speed]; });
    };
    for (std::size_t k = 0; k < places_.driven.size(); ++k) add(places_.driven[k], r.drive_torque[k]);
    for (LockedTorque<Row>& l : r.locked) {
        if (!l.on_held_shaft) continue;
        add(places_.contacts[l.contact].turned(), l.needs, places_.contacts[l.contact].turns());
        l.needs.c[layout_.first_memory + l.memory] = 0.0;
    }
}

void Equations::set_rates(const Key& key, Regime& r) const {
    r.rate.resize(layout_.states);
    for (std::size_t m = 0; m < train_.motors.size(); ++m) {
        const Motor& motor = train_.motors[m].law;
        const MotorPlace& p = places_.motors[m];
        for (int k = 0; p.winding != nowhere && k < 2; ++k) r.rate[p.current + k] = terms_.input(p.winding + 1 + k);
        if (!motor.has_torque_state()) continue;
        const Motor::Terms terms = forms_.motor_terms(static_cast<int>(m));
        r.rate[p.torque] = p.controller == nowhere
                               ? motor.torque_rate<Row>(terms, p.branch == nowhere ? 0 : key.branch[p.branch])
                               : motor.torque_rate<Row>(terms, forms_.controller_command(p.controller, key));
    }
    for (std::size_t s = 0; s < train_.shafts.size(); ++s) {
        if (r.ties.at_rest[s] || places_.shafts[s].massless != nowhere) continue;
        Row& rate = r.rate[places_.shafts[s].speed];
        if (!r.ties.follows(static_cast<int>(s)))
            rate = r.motion[s];
        else
            r.ties.each_share(static_cast<int>(s), [&](int k, double share) { rate += share * r.motion[k]; });
    }
    for (std::size_t g = 0; g < train_.gears.size(); ++g) {
        const GearPlace& p = places_.gears[g];
        if (p.twist != nowhere && !std::as_const(r.twist_rests)[g])
            r.rate[p.twist] = forms_.twist_rate(static_cast<int>(g), key);
    }
    for (const auto& c : places_.couplings)
        if (c->twist != nowhere) r.rate[c->twist] = forms_.between(*c, r.ties, key).slip;
    for (const ContactPlace& c : places_.contacts)
        if (c.gap.present() && std::abs(key.branch[c.gap.side]) == 2) r.rate[c.gap.clock] = terms_.one(-1.0);
    for (std::size_t s = 0; s < train_.shafts.size(); ++s)
        if (places_.shafts[s].angle != nowhere && !r.ties.at_rest[s])
            r.rate[places_.shafts[s].angle] = terms_.state(places_.shafts[s].speed);
    for (std::size_t k = 0; k < train_.controllers.size(); ++k)
        for (std::size_t j = 0; j < train_.controllers[k].states.size(); ++j)
            r.rate[static_cast<std::size_t>(places_.controllers[k].first_state) + j] =
                forms_.controller_rate(static_cast<int>(k), j, key);
    for (int a = 0; a < layout_.angles; ++a) {
        const int s = places_.last_shaft[a];
        if (!r.ties.at_rest[s]) r.rate[layout_.coupled + a] = terms_.state(places_.shafts[s].speed);
    }
    for (Row& rate : r.rate) r.put_massless_speeds(rate);
}

}  // namespace lostmotion::model
