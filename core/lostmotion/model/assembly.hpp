// Composes the elements of a train into the equations and guards of a regime.
//
// The torques of a shaft are added up in one order: motors, gears and couplings that turn it; viscous friction; the
// load; its dry contact; gears and couplings that it turns. Losses act on the contact of the input shaft, whose
// capacity is the sum over all that is dry there: one speed, one sign.
#pragma once

#include <algorithm>
#include <utility>

#include "places.hpp"
#include "statics.hpp"

namespace lostmotion::model {

class Assembly {
 public:
    explicit Assembly(Train train) : train_(std::move(train)), places_(train_), terms_(places_.layout) {}
    Assembly(const Assembly&) = delete;
    Assembly& operator=(const Assembly&) = delete;

    const Train& train() const { return train_; }
    const Places& places() const { return places_; }
    const Layout& layout() const { return places_.layout; }

    Regime build(const Key& key) const;

    // The ratio of the twist's rate to the speed of the input shaft: 1/i, less the slope of a transmission error.
    double per_input(int gear, const Key& key) const {
        const Gear& g = train_.gears[gear];
        const int k = places_.gears[gear].error_piece;
        return k == nowhere ? 1.0 / g.law.ratio : 1.0 / g.law.ratio - g.transmission_error.slope(key.branch[k]);
    }
    // The speed of a contact, as a form.
    Row contact_speed(int contact) const {
        const ContactPlace& c = places_.contacts[contact];
        Row f = terms_.state(places_.shafts[c.a].speed, c.per_a);
        if (c.b != nowhere) f += terms_.state(places_.shafts[c.b].speed, c.per_b);
        return f;
    }
    Row twist_rate(int gear, const Key& key) const {
        const Gear& g = train_.gears[gear];
        return terms_.state(places_.shafts[g.input].speed, per_input(gear, key)) -
               terms_.state(places_.shafts[g.output].speed);
    }
    // P(d) in its piece; 0 of a rigid gear.
    Row spring_torque(int gear, const Key& key) const {
        const Gear& g = train_.gears[gear];
        if (g.rigid()) return Row{};
        const int piece = key.branch[places_.gears[gear].piece];
        return terms_.state(places_.gears[gear].twist, g.law.curve.slope(piece)) +
               terms_.one(g.law.curve.offset(piece));
    }
    Row angle_torque(int k, const Key& key) const {
        const PeriodicCurve& curve = train_.angle_torques[k].torque;
        const AngleTorquePlace& p = places_.angle_torques[k];
        const int piece = key.branch[p.piece];
        return terms_.one(curve.at_zero(piece)) +
               terms_.state(places_.shafts[train_.angle_torques[k].shaft].angle, curve.slope(piece)) -
               terms_.memory(p.turn, curve.slope(piece));
    }
    // Torque against the motion of a shaft.
    Row drag_torque(int shaft, const Key& key) const {
        const ShaftPlace& p = places_.shafts[shaft];
        const TorsionCurve& drag = train_.shafts[shaft].drag;
        const int piece = p.drag_piece == nowhere ? 0 : key.branch[p.drag_piece];
        return terms_.state(p.speed, drag.slope(piece)) + terms_.one(drag.offset(piece));
    }
    // Dry friction of a shaft that slips, without brakes and gears.
    Row sliding_friction(int shaft, const Key& key) const {
        const ShaftPlace& p = places_.shafts[shaft];
        const DryFriction& friction = train_.shafts[shaft].friction;
        const int piece = p.friction_piece == nowhere ? 0 : key.branch[p.friction_piece];
        return terms_.one(mode(key, p.contact) * (p.motor_friction + friction.at_zero(piece))) +
               terms_.state(p.speed, friction.per_speed(piece));
    }
    // What an engaged brake takes of a shaft that slips.
    Row brake_torque(int k, const Key& key) const {
        const BrakePlace& p = places_.brakes[k];
        return static_cast<double>(mode(key, places_.shafts[train_.brakes[k].shaft].contact)) *
               commanded(p.input, p.branch, train_.brakes[k].torque, key);
    }
    // Is the rate of the twist kept at zero?
    bool twist_rests(int gear, const Regime& r) const {
        const Gear& g = train_.gears[gear];
        if (g.rigid()) return true;
        if (r.ties.at_rest[g.input] && r.ties.at_rest[g.output]) return true;
        return !g.transmission_error.present() &&
               kept_at_rest({ContactPlace::gear, gear, g.input, g.output, 1.0 / g.law.ratio, -1.0}, r.ties);
    }
    // Capacity of a brake or clutch: linear in its input, 0 below 0 and 1 above 1.
    Row commanded(int input, int branch, double torque, const Key& key) const {
        const int b = key.branch[branch];
        return b < 0 ? Row{} : b > 0 ? terms_.one(torque) : terms_.input(input, torque);
    }

 private:
    void compose(const Key& key, Regime& r, std::vector<Row>& acceleration) const;
    void compose_motors(const Key& key, Regime& r) const;
    void compose_gear(int gear, const Key& key, Regime& r, std::vector<Row>& loss) const;
    void compose_coupling(int coupling, const Key& key, Regime& r) const;
    Row shaft_friction(int shaft, const Key& key, const Regime& r, const std::vector<Row>& loss) const;
    Row acceleration(int shaft, const Key& key, const Regime& r) const;
    void set_rates(const Key& key, const std::vector<Row>& acceleration, Regime& r) const;

    void add_speed_guards(Regime& r) const;
    void add_gear_capacities(Regime& r) const;
    void add_coupling_capacities(Regime& r) const;
    void add_shaft_guards(int shaft, Regime& r) const;
    void add_loss_cells(int gear, int sign, Row& capacity, Regime& r) const;
    void add_loss_edges(int gear, Regime& r) const;
    void add_twist_pieces(int gear, Regime& r) const;
    void add_speed_pieces(int shaft, Regime& r) const;
    void add_input_limits(Regime& r) const;
    void add_turning(Regime& r) const;
    void add_angle_pieces(int branch, int turn, int shaft, const PeriodicCurve& curve, Regime& r) const;

    Guard& add(Regime& r, const Row& form, Guard::Kind kind, int contact, int branch, int neighbour) const {
        r.guards.push_back(Guard{form, kind, contact, branch, neighbour});
        return r.guards.back();
    }
    // The speed of a shaft where it acts: 0 at rest, that of the leader where it is tied to one.
    Row speed(int shaft, const Regime& r) const {
        if (r.ties.at_rest[shaft]) return Row{};
        return terms_.state(places_.shafts[r.ties.leader[shaft]].speed, r.ties.factor[shaft]);
    }
    int mode(const Key& key, int contact) const { return key.modes[contact]; }
    // What a stuck contact takes: found from its rest, or, where the motion does not determine it, as it was.
    Row held(int contact, const Regime& r) const {
        return r.ties.redundant[contact] ? terms_.memory(places_.contacts[contact].locked) : terms_.reaction(contact);
    }

    Train train_;
    Places places_;
    Terms terms_;
};

inline Regime Assembly::build(const Key& key) const {
    Regime r;
    r.key = key;
    r.ties = tie(places_.contacts, static_cast<int>(train_.shafts.size()), key.modes.data());
    for (int c = 0; c < layout().contacts; ++c) r.at_rest[c] = kept_at_rest(places_.contacts[c], r.ties);

    std::vector<Row> acceleration(train_.shafts.size());
    compose(key, r, acceleration);
    std::vector<Row*> forms;
    for (std::vector<Row>* rows :
         {&r.output_torque, &r.input_torque, &r.gear_hysteresis, &r.contact_torque, &acceleration})
        for (Row& f : *rows) forms.push_back(&f);
    r.solvable = solve_reactions(places_.contacts, layout(), key, r.ties, acceleration, forms);
    set_rates(key, acceleration, r);

    add_speed_guards(r);
    add_gear_capacities(r);
    add_coupling_capacities(r);
    for (int s = static_cast<int>(train_.shafts.size()) - 1; s >= 0; --s) add_shaft_guards(s, r);
    add_turning(r);
    for (std::size_t g = 0; g < train_.gears.size(); ++g) add_twist_pieces(static_cast<int>(g), r);
    for (std::size_t s = 0; s < train_.shafts.size(); ++s) add_speed_pieces(static_cast<int>(s), r);
    add_input_limits(r);
    for (std::size_t g = 0; g < train_.gears.size(); ++g) {
        const GearPlace& p = places_.gears[g];
        if (p.error_piece != nowhere)
            add_angle_pieces(p.error_piece, p.error_turn, train_.gears[g].input, train_.gears[g].transmission_error, r);
    }
    for (std::size_t k = 0; k < train_.angle_torques.size(); ++k)
        add_angle_pieces(places_.angle_torques[k].piece, places_.angle_torques[k].turn, train_.angle_torques[k].shaft,
                         train_.angle_torques[k].torque, r);
    return r;
}

inline void Assembly::compose(const Key& key, Regime& r, std::vector<Row>& acceleration) const {
    const std::size_t gears = train_.gears.size();
    r.output_torque.resize(gears);
    r.input_torque.resize(gears);
    r.gear_hysteresis.resize(gears);
    r.contact_torque.resize(places_.contacts.size());
    std::vector<Row> loss(gears);
    compose_motors(key, r);
    for (std::size_t g = 0; g < gears; ++g) compose_gear(static_cast<int>(g), key, r, loss);
    for (std::size_t k = 0; k < train_.couplings.size(); ++k) compose_coupling(static_cast<int>(k), key, r);
    for (std::size_t s = 0; s < train_.shafts.size(); ++s) {
        const int c = places_.shafts[s].contact;
        if (c != nowhere) r.contact_torque[c] = shaft_friction(static_cast<int>(s), key, r, loss);
    }
    for (std::size_t s = 0; s < train_.shafts.size(); ++s)
        acceleration[s] = this->acceleration(static_cast<int>(s), key, r);
    // From here on the torque at the input tells of the losses, too.
    for (std::size_t g = 0; g < gears; ++g) r.input_torque[g] += loss[g];
}

inline void Assembly::compose_motors(const Key& key, Regime& r) const {
    for (std::size_t m = 0; m < train_.motors.size(); ++m) {
        const ShaftMotor& motor = train_.motors[m];
        const MotorPlace& p = places_.motors[m];
        const int limit = p.branch == nowhere ? 0 : key.branch[p.branch];
        if (motor.law.kind == Motor::dc)
            r.motor_torque.push_back(terms_.state(p.torque));
        else
            r.motor_torque.push_back(limit == 0 ? terms_.input(p.command, motor.law.rated_torque)
                                                : terms_.one(limit * motor.torque_limit));
    }
}

// T_2 = P(d) + H, with damping while the flanks touch; T_1 without the losses that act on the contact of the input
// shaft, which are `loss`: M_2B sign(w)/i with M_2B of one cell of the loss law (12).
inline void Assembly::compose_gear(int gear, const Key& key, Regime& r, std::vector<Row>& loss) const {
    const Gear& g = train_.gears[gear];
    const GearPlace& p = places_.gears[gear];
    const double i = g.law.ratio;
    const Row P = spring_torque(gear, key);
    Row& H = r.gear_hysteresis[gear];
    if (p.contact != nowhere) {
        const int slip = mode(key, p.contact);
        if (slip != 0)
            H = terms_.memory(p.hysteresis, slip);
        else if (r.ties.redundant[p.contact])
            H = held(p.contact, r) - P;
        else
            H = held(p.contact, r);
    }
    Row& T_2 = r.output_torque[gear];
    T_2 = P + H;
    if (p.contact != nowhere) r.contact_torque[p.contact] = H;
    const bool parted = p.parted != nowhere && key.branch[p.parted] != 0;
    if (parted)
        T_2 = Row{};
    else if (g.mesh_damping > 0.0 && !(g.has_backlash() && key.branch[p.piece] == 0) && !twist_rests(gear, r))
        T_2 += g.mesh_damping * twist_rate(gear, key);

    Row& T_1 = r.input_torque[gear];
    T_1 = T_2 / i;
    if (p.error_piece != nowhere) T_1 -= g.transmission_error.slope(key.branch[p.error_piece]) * T_2;
    if (!g.has_dry_losses()) {
        if (g.law.losses == Gearbox::constant_efficiency) T_1 = T_1 / g.law.efficiency;
        return;
    }
    const double s = mode(key, places_.shafts[g.input].contact);
    if (s == 0.0) return;
    const Plane m = g.loss_plane(key.branch[p.cell]);
    const double T_2R = g.rated_torque();
    const Row M_2B_signed = terms_.one(s * T_2R * m.at_zero) +
                            terms_.state(places_.shafts[g.input].speed, T_2R * m.per_speed / g.law.rated_input_speed) +
                            m.per_load * T_2;
    loss[gear] = M_2B_signed / i;
}

inline void Assembly::compose_coupling(int coupling, const Key& key, Regime& r) const {
    const Coupling& c = train_.couplings[coupling];
    const CouplingPlace& p = places_.couplings[coupling];
    const int slip = mode(key, p.contact);
    Row& torque = r.contact_torque[p.contact];
    if (slip == 0)
        torque = held(p.contact, r);
    else if (c.kind == Coupling::clutch)
        torque = static_cast<double>(slip) * commanded(p.input, p.branch, c.torque, key);
    else if (c.kind == Coupling::safety_clutch)
        torque = terms_.one(slip * c.torque);
}

// What the dry contact of a shaft takes.
inline Row Assembly::shaft_friction(int shaft, const Key& key, const Regime& r, const std::vector<Row>& loss) const {
    const ShaftPlace& p = places_.shafts[shaft];
    if (mode(key, p.contact) == 0) return held(p.contact, r);
    Row F = sliding_friction(shaft, key);
    for (std::size_t b = 0; b < train_.brakes.size(); ++b)
        if (train_.brakes[b].shaft == shaft) F += brake_torque(static_cast<int>(b), key);
    for (std::size_t g = 0; g < train_.gears.size(); ++g)
        if (train_.gears[g].input == shaft && train_.gears[g].has_dry_losses()) F += loss[g];
    return F;
}

inline Row Assembly::acceleration(int shaft, const Key& key, const Regime& r) const {
    const ShaftPlace& p = places_.shafts[shaft];
    Row sum;
    for (std::size_t m = 0; m < train_.motors.size(); ++m)
        if (train_.motors[m].shaft == shaft) sum += r.motor_torque[m];
    for (std::size_t g = 0; g < train_.gears.size(); ++g)
        if (train_.gears[g].output == shaft) sum += r.output_torque[g];
    for (std::size_t k = 0; k < train_.couplings.size(); ++k)
        if (train_.couplings[k].output == shaft) sum += r.contact_torque[places_.couplings[k].contact];
    for (std::size_t k = 0; k < train_.angle_torques.size(); ++k)
        if (train_.angle_torques[k].shaft == shaft) sum += angle_torque(static_cast<int>(k), key);
    sum -= p.viscous_friction * speed(shaft, r);
    if (train_.shafts[shaft].has_drag() && !r.ties.at_rest[shaft]) sum -= drag_torque(shaft, key);
    if (p.load != nowhere) sum -= terms_.input(p.load);
    if (p.contact != nowhere) sum -= r.contact_torque[p.contact];
    for (std::size_t g = 0; g < train_.gears.size(); ++g)
        if (train_.gears[g].input == shaft) sum -= r.input_torque[g];
    for (std::size_t k = 0; k < train_.couplings.size(); ++k)
        if (train_.couplings[k].input == shaft) sum -= r.contact_torque[places_.couplings[k].contact];
    return sum / p.inertia;
}

inline void Assembly::set_rates(const Key& key, const std::vector<Row>& acceleration, Regime& r) const {
    r.rate.resize(layout().states);
    for (std::size_t m = 0; m < train_.motors.size(); ++m) {
        const Motor& motor = train_.motors[m].law;
        const MotorPlace& p = places_.motors[m];
        if (motor.kind != Motor::dc) continue;
        // The motor states its law in terms of its own.
        const auto law = motor.torque_rate<Form<n_terms>>(p.branch == nowhere ? 0 : key.branch[p.branch]);
        Row& rate = r.rate[p.torque];
        rate.c[p.torque] = law.c[lostmotion::motor_torque];
        rate.c[places_.shafts[train_.motors[m].shaft].speed] = law.c[lostmotion::motor_speed];
        rate.c[layout().first_input + p.command] = law.c[lostmotion::command];
        rate.c[layout().one] = law.c[lostmotion::one];
    }
    for (std::size_t s = 0; s < train_.shafts.size(); ++s) {
        const int leader = r.ties.leader[s];
        if (r.ties.at_rest[s]) continue;
        r.rate[places_.shafts[s].speed] =
            leader == static_cast<int>(s) ? acceleration[s] : r.ties.factor[s] * acceleration[leader];
    }
    for (std::size_t g = 0; g < train_.gears.size(); ++g) {
        const GearPlace& p = places_.gears[g];
        if (p.twist != nowhere && !twist_rests(static_cast<int>(g), r))
            r.rate[p.twist] = twist_rate(static_cast<int>(g), key);
    }
    for (std::size_t s = 0; s < train_.shafts.size(); ++s)
        if (places_.shafts[s].angle != nowhere && !r.ties.at_rest[s])
            r.rate[places_.shafts[s].angle] = terms_.state(places_.shafts[s].speed);
    for (int a = 0; a < layout().angles; ++a) {
        const int s = places_.last_shaft[a];
        if (!r.ties.at_rest[s]) r.rate[layout().coupled + a] = terms_.state(places_.shafts[s].speed);
    }
}

inline void Assembly::add_speed_guards(Regime& r) const {
    for (int c = 0; c < layout().contacts; ++c) {
        const int mode = r.key.modes[c];
        if (mode == 0) continue;
        // (16) sets the hysteresis anew whenever the twist rate reaches zero, whether it then changes sign or not.
        add(r, static_cast<double>(mode) * contact_speed(c), Guard::speed, c, nowhere, 0).by_grazing =
            places_.contacts[c].kind == ContactPlace::gear;
    }
}

inline void Assembly::add_gear_capacities(Regime& r) const {
    for (std::size_t g = 0; g < train_.gears.size(); ++g) {
        const GearPlace& p = places_.gears[g];
        if (p.contact == nowhere || train_.gears[g].rigid() || r.key.modes[p.contact] != 0) continue;
        const Row h = terms_.memory(p.hysteresis), &H = r.gear_hysteresis[g];
        add(r, h - H, Guard::capacity, p.contact, nowhere, +1);
        add(r, h + H, Guard::capacity, p.contact, nowhere, -1);
    }
}

inline void Assembly::add_coupling_capacities(Regime& r) const {
    for (std::size_t k = 0; k < train_.couplings.size(); ++k) {
        const Coupling& c = train_.couplings[k];
        const CouplingPlace& p = places_.couplings[k];
        if (r.key.modes[p.contact] != 0) continue;
        const Row& torque = r.contact_torque[p.contact];
        Row capacity;
        if (c.kind == Coupling::clutch) capacity = commanded(p.input, p.branch, c.torque, r.key);
        if (c.kind == Coupling::safety_clutch) capacity = terms_.one(c.torque);
        if (c.kind != Coupling::freewheel) add(r, capacity - torque, Guard::capacity, p.contact, nowhere, +1);
        add(r, capacity + torque, Guard::capacity, p.contact, nowhere, -1);
    }
}

// Capacity of the contact of a shaft while it is stuck, edges of the cells of its gears while it slips.
inline void Assembly::add_shaft_guards(int shaft, Regime& r) const {
    const ShaftPlace& p = places_.shafts[shaft];
    if (p.contact == nowhere) return;
    const auto each_gear = [&](auto&& use) {
        for (std::size_t g = 0; g < train_.gears.size(); ++g)
            if (train_.gears[g].input == shaft && train_.gears[g].has_dry_losses()) use(static_cast<int>(g));
    };
    if (r.key.modes[p.contact] != 0) {
        each_gear([&](int g) { add_loss_edges(g, r); });
        return;
    }
    for (const int s : {+1, -1}) {
        Row F = terms_.one(p.motor_friction + train_.shafts[shaft].friction.holding());
        for (std::size_t b = 0; b < train_.brakes.size(); ++b)
            if (train_.brakes[b].shaft == shaft)
                F += commanded(places_.brakes[b].input, places_.brakes[b].branch, train_.brakes[b].torque, r.key);
        each_gear([&](int g) { add_loss_cells(g, s, F, r); });
        add(r, F - static_cast<double>(s) * r.contact_torque[p.contact], Guard::capacity, p.contact, nowhere, s);
    }
}

inline void Assembly::add_loss_cells(int gear, int s, Row& capacity, Regime& r) const {
    const Gear& g = train_.gears[gear];
    const GearPlace& p = places_.gears[gear];
    const int contact = places_.shafts[g.input].contact, branch = s > 0 ? p.cell : p.cell_back;
    const int j = r.key.branch[branch];
    const double T_2R = g.rated_torque();
    const Plane m = g.loss_at_standstill(j);
    const Row mu = s / T_2R * r.output_torque[gear];
    capacity += T_2R / g.law.ratio * (terms_.one(m.at_zero) + m.per_load * mu);
    const double low = g.load_lower(j), high = g.load_upper(j);
    const bool bounded = std::isfinite(low) && std::isfinite(high);
    const double scale = bounded ? 1.0 / (high - low) : 1.0;
    const auto edge = [&](const Row& form, int neighbour) {
        const bool end = neighbour < 0 || neighbour >= g.load_intervals();
        add(r, scale * form, end ? Guard::outside : Guard::edge, contact, branch, neighbour);
    };
    if (std::isfinite(high)) edge(terms_.one(high) - mu, j + 1);
    if (std::isfinite(low)) edge(mu - terms_.one(low), j - 1);
    r.in_data = r.in_data && g.load_interval_in_data(j);
}

inline void Assembly::add_loss_edges(int gear, Regime& r) const {
    const Gear& g = train_.gears[gear];
    const GearPlace& p = places_.gears[gear];
    const int contact = places_.shafts[g.input].contact;
    const double s = r.key.modes[contact], T_2R = g.rated_torque();
    Edge edges[3];
    const int n = g.loss_edges(r.key.branch[p.cell], edges);
    for (int k = 0; k < n; ++k) {
        const Plane& inside = edges[k].inside;
        add(r,
            terms_.one(inside.at_zero) +
                terms_.state(places_.shafts[g.input].speed, s * inside.per_speed / g.law.rated_input_speed) +
                s * inside.per_load / T_2R * r.output_torque[gear],
            edges[k].neighbour < 0 ? Guard::outside : Guard::edge, contact, p.cell, edges[k].neighbour);
    }
    r.in_data = r.in_data && g.in_data(r.key.branch[p.cell]);
}

// A shaft that "slips" but is kept at rest by others is at its limit: the torques go along with what drives it there,
// as long as that goes on. When it turns back the torques stay. What drives it is the torque that it would take if it
// were stuck, in terms of the states and inputs.
inline void Assembly::add_turning(Regime& r) const {
    for (int c = 0; c < layout().contacts; ++c) {
        if (places_.contacts[c].kind != ContactPlace::shaft || r.key.modes[c] == 0 || !r.at_rest[c]) continue;
        Regime stuck;
        stuck.key = r.key;
        stuck.key.modes[c] = 0;
        stuck.ties = tie(places_.contacts, static_cast<int>(train_.shafts.size()), stuck.key.modes.data());
        std::vector<Row> acceleration(train_.shafts.size());
        compose(stuck.key, stuck, acceleration);
        Row& torque = stuck.contact_torque[c];
        if (!solve_reactions(places_.contacts, layout(), stuck.key, stuck.ties, acceleration, {&torque})) continue;
        Row rate;
        for (int k = 0; k < layout().states; ++k) {
            // Of what acts on the shaft itself, the whole: no rounding of the elimination.
            double share = torque.c[k];
            if (std::fabs(std::fabs(share) - 1.0) < 1e-14) share = share > 0.0 ? 1.0 : -1.0;
            if (share != 0.0) rate += share * r.rate[k];
        }
        const double way = r.key.modes[c];
        const bool by_states = std::any_of(rate.c.begin(), rate.c.end(), [](double v) { return v != 0.0; });
        int inputs = 0, input = nowhere;
        for (int i = 0; i < layout().inputs; ++i)
            if (std::fabs(torque.c[layout().first_input + i]) > 1e-14) {
                ++inputs;
                input = i;
            }
        // Only a rate that is a form of the states, or that of one input, can be watched; with more of them the torques
        // follow all the time.
        if (by_states && inputs == 0) add(r, way * rate, Guard::turning, c, nowhere, 0);
        if (by_states || inputs != 1) continue;
        r.driving_input = input;
        r.driving_way = way * (torque.c[layout().first_input + input] > 0.0 ? 1.0 : -1.0);
        r.driven_contact = c;
    }
}

// Pieces of the torsion curve, and where the flanks part and touch again.
inline void Assembly::add_twist_pieces(int gear, Regime& r) const {
    const Gear& g = train_.gears[gear];
    const GearPlace& p = places_.gears[gear];
    if (twist_rests(gear, r)) return;
    const TorsionCurve& curve = g.law.curve;
    const int piece = r.key.branch[p.piece];
    const int slip = p.contact == nowhere ? 0 : r.key.modes[p.contact];
    if (piece < curve.outermost_piece())
        add(r, terms_.one(curve.upper(piece)) - terms_.state(p.twist), Guard::edge, p.contact, p.piece, piece + 1)
            .behind = slip < 0;
    if (piece > -curve.outermost_piece())
        add(r, terms_.state(p.twist) - terms_.one(curve.lower(piece)), Guard::edge, p.contact, p.piece, piece - 1)
            .behind = slip > 0;
    if (p.parted == nowhere || piece == 0) return;
    const bool parted = r.key.branch[p.parted] != 0;
    const Row pressed = terms_.state(p.twist, curve.slope(piece)) + terms_.one(curve.offset(piece)) +
                        g.mesh_damping * twist_rate(gear, r.key);
    add(r, ((piece > 0) != parted ? 1.0 : -1.0) * pressed, Guard::edge, p.contact, p.parted, parted ? 0 : 1);
}

inline void Assembly::add_speed_pieces(int shaft, Regime& r) const {
    const ShaftPlace& p = places_.shafts[shaft];
    const Shaft& law = train_.shafts[shaft];
    if (r.ties.at_rest[shaft]) return;
    const Row w = terms_.state(p.speed);
    if (p.friction_piece != nowhere && r.key.modes[p.contact] != 0) {
        const double s = r.key.modes[p.contact];
        const int k = r.key.branch[p.friction_piece];
        if (k + 1 < law.friction.pieces())
            add(r, terms_.one(law.friction.speeds[k + 1]) - s * w, Guard::edge, p.contact, p.friction_piece, k + 1);
        if (k > 0) add(r, s * w - terms_.one(law.friction.speeds[k]), Guard::edge, p.contact, p.friction_piece, k - 1);
    }
    if (p.drag_piece != nowhere) {
        const int k = r.key.branch[p.drag_piece], last = law.drag.outermost_piece();
        if (k < last) add(r, terms_.one(law.drag.upper(k)) - w, Guard::edge, nowhere, p.drag_piece, k + 1);
        if (k > -last) add(r, w - terms_.one(law.drag.lower(k)), Guard::edge, nowhere, p.drag_piece, k - 1);
    }
}

inline void Assembly::add_input_limits(Regime& r) const {
    const auto limits = [&](int input, int branch, double low, double high, int contact) {
        const int at = r.key.branch[branch];
        const Row u = terms_.input(input);
        if (at <= 0) add(r, terms_.one(at == 0 ? high : low) - u, Guard::input_limit, contact, branch, at + 1);
        if (at >= 0) add(r, u - terms_.one(at == 0 ? low : high), Guard::input_limit, contact, branch, at - 1);
    };
    for (std::size_t m = 0; m < train_.motors.size(); ++m)
        if (places_.motors[m].branch != nowhere) {
            const double most = train_.motors[m].command_limit();
            limits(places_.motors[m].command, places_.motors[m].branch, -most, most,
                   places_.shafts[train_.motors[m].shaft].contact);
        }
    for (std::size_t b = 0; b < train_.brakes.size(); ++b)
        limits(places_.brakes[b].input, places_.brakes[b].branch, 0.0, 1.0,
               places_.shafts[train_.brakes[b].shaft].contact);
    for (const CouplingPlace& c : places_.couplings)
        if (c.branch != nowhere) limits(c.input, c.branch, 0.0, 1.0, c.contact);
}

// Where the angle of a shaft leaves its piece. The last and the first piece are neighbours: then the angle at which the
// present turn began, which is remembered, moves by a period.
inline void Assembly::add_angle_pieces(int branch, int turn, int shaft, const PeriodicCurve& curve, Regime& r) const {
    if (r.ties.at_rest[shaft]) return;
    const int k = r.key.branch[branch], last = curve.pieces() - 1;
    const Row within = terms_.state(places_.shafts[shaft].angle) - terms_.memory(turn);
    const auto edge = [&](const Row& form, int neighbour, double shift) {
        Guard& g = add(r, form, Guard::edge, nowhere, branch, neighbour);
        g.memory = shift == 0.0 ? nowhere : turn;
        g.shift = shift;
    };
    edge(terms_.one(curve.upper(k)) - within, k == last ? 0 : k + 1, k == last ? curve.period() : 0.0);
    edge(within - terms_.one(curve.lower(k)), k == 0 ? last : k - 1, k == 0 ? -curve.period() : 0.0);
}

}  // namespace lostmotion::model
