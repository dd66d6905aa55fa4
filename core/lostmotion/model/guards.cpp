#include "guards.hpp"

namespace lostmotion::model {

auto RegimeGuards::add(const Row& form, Guard::Kind kind, int contact, int branch, int neighbour) -> Guard& {
    return regime_.guards.emplace_back(form, kind, contact, branch, neighbour);
}

void RegimeGuards::add_all() {
    add_speed_guards();
    add_gear_capacities();
    add_coupling_capacities();
    for (int s = static_cast<int>(train_.shafts.size()) - 1; s >= 0; --s) add_shaft_guards(s);
    add_turning();
    add_gaps();
    for (std::size_t g = 0; g < train_.gears.size(); ++g) add_twist_pieces(static_cast<int>(g));
    for (std::size_t s = 0; s < train_.shafts.size(); ++s) add_speed_pieces(static_cast<int>(s));
    add_input_limits();
    add_coupling_pieces();
    add_output_limits();
    for (std::size_t g = 0; g < train_.gears.size(); ++g) {
        if (!turns(train_.gears[g].input, train_.gears[g].housing)) continue;
        places_.gears[g].each_over_angle(train_.gears[g], [&](const PeriodicCurve& curve, const OverAngle& law) {
            add_piece_guards(terms_, forms_.input_angle(static_cast<int>(g)), curve, law.turn, law.piece, regime_.key,
                             regime_.guards);
        });
    }
    for (const auto& e : places_.acting)
        e->add_guards(forms_.site(e->shaft), regime_.key, turns(e->shaft, nowhere), regime_.guards);
}

void RegimeGuards::add_speed_guards() {
    for (int c = 0; c < layout_.contacts; ++c) {
        const int mode = regime_.key.modes[c];
        if (mode == 0 && regime_.ties.redundant[c]) add_given_speed(c);
        if (mode == 0 || held_in_motion(c) || places_.contacts[c].gap.present()) continue;
        // (16) sets the hysteresis anew whenever the twist rate reaches zero, whether it then changes sign or not.
        add(static_cast<double>(mode) * forms_.contact_speed(c), Guard::speed, c, nowhere, 0).by_grazing =
            places_.contacts[c].kind == ContactPlace::gear;
    }
}

// A contact whose speed is given, at rest while that is zero.
void RegimeGuards::add_given_speed(int contact) {
    if (regime_.kept_at_rest[contact]) return;
    for (const int s : {+1, -1})
        add(-static_cast<double>(s) * forms_.contact_speed(contact), Guard::set_off, contact, nowhere, s);
}

void RegimeGuards::add_gear_capacities() {
    for (std::size_t g = 0; g < train_.gears.size(); ++g) {
        const GearPlace& p = places_.gears[g];
        if (p.hysteresis == nowhere || regime_.key.modes[p.contact] != 0) continue;
        const Row h = terms_.memory(p.hysteresis), &H = regime_.gear_hysteresis[g];
        add(h - H, Guard::capacity, p.contact, nowhere, +1);
        add(h + H, Guard::capacity, p.contact, nowhere, -1);
    }
}

// What is rigid strikes at the ends of its gap. What touches parts where it would pull; while impacts accumulate, it
// does so until the clock has run down.
void RegimeGuards::add_gaps() {
    places_.each_striking([&](const ContactPlace& c, int contact) {
        const Gap& gap = c.gap;
        const int side = regime_.key.branch[gap.side];
        if (regime_.key.modes[contact] != 0) {
            if (regime_.kept_at_rest[contact]) return;
            const Row at = gap.turn == nowhere ? terms_.state(gap.at) : terms_.state(gap.at) - terms_.memory(gap.turn);
            add(terms_.one(gap.high) - at, Guard::impact, contact, nowhere, 0);
            Guard& low = add(terms_.one(-gap.low) + at, gap.passes ? Guard::edge : Guard::impact, contact, nowhere, 0);
            if (gap.passes) {
                low.branch = gap.side;
                low.memory = gap.turn;
                low.shift = gap.low - gap.high;
            }
            return;
        }
        if (!regime_.ties.redundant[contact])
            add((side > 0 ? 1.0 : -1.0) * regime_.contact_torque[contact], Guard::capacity, contact, nowhere, -1);
        if (std::abs(side) == 2) add(terms_.state(gap.clock), Guard::impact, contact, gap.side, side / 2);
    });
}

void RegimeGuards::add_coupling_capacities() {
    for (const auto& c : places_.couplings) {
        if (!c->is_dry() || c->strikes() != nullptr || regime_.key.modes[c->contact] != 0) continue;
        const Row& torque = regime_.contact_torque[c->contact];
        const Row capacity = forms_.coupling_capacity(*c, regime_, true);
        if (!c->is_one_way()) add(capacity - torque, Guard::capacity, c->contact, nowhere, +1);
        add(capacity + torque, Guard::capacity, c->contact, nowhere, -1);
    }
}

// Capacity of the contact of a shaft while it is stuck, edges of the cells of its gears while it slips.
void RegimeGuards::add_shaft_guards(int shaft) {
    const ShaftPlace& p = places_.shafts[shaft];
    if (p.contact == nowhere) return;
    const auto each_gear = [&](auto&& use) {
        for (std::size_t g = 0; g < train_.gears.size(); ++g)
            if (train_.gears[g].input == shaft && train_.gears[g].has_dry_losses()) use(static_cast<int>(g));
    };
    if (regime_.key.modes[p.contact] != 0) {
        each_gear([&](int g) { add_loss_edges(g); });
        return;
    }
    if (regime_.ties.redundant[p.contact]) return;
    for (const int s : {+1, -1}) {
        Row F = forms_.held_friction(shaft, regime_.key);
        each_gear([&](int g) { add_loss_cells(g, s, F); });
        for (std::size_t g = 0; g < train_.gears.size(); ++g)
            if (train_.gears[g].input == shaft && train_.gears[g].over_angle())
                F += forms_.beyond_corner(static_cast<int>(g), s, regime_.key, regime_.output_torque[g]);
        add(F - static_cast<double>(s) * regime_.contact_torque[p.contact], Guard::capacity, p.contact, nowhere, s);
    }
}

void RegimeGuards::add_loss_cells(int gear, int s, Row& capacity) {
    const Gear& g = train_.gears[gear];
    const GearPlace& p = places_.gears[gear];
    const int contact = places_.shafts[g.input].contact, branch = s > 0 ? p.cell : p.cell_back;
    const int j = regime_.key.branch[branch];
    const LossTerms<Row> losses = forms_.losses(gear, regime_.output_torque[gear]);
    const Row mu = losses.load(s);
    capacity += losses.at_rest(g.loss_at_standstill(j), s);
    const double low = g.load_lower(j), high = g.load_upper(j);
    const bool bounded = std::isfinite(low) && std::isfinite(high);
    const double scale = bounded ? 1.0 / (high - low) : 1.0;
    const auto edge = [&](const Row& form, int neighbour) {
        const bool end = neighbour < 0 || neighbour >= g.load_intervals();
        add(scale * form, end ? Guard::outside : Guard::edge, contact, branch, neighbour);
    };
    if (std::isfinite(high)) edge(terms_.one(high) - mu, j + 1);
    if (std::isfinite(low)) edge(mu - terms_.one(low), j - 1);
    regime_.in_data = regime_.in_data && g.load_interval_in_data(j);
}

void RegimeGuards::add_loss_edges(int gear) {
    const Gear& g = train_.gears[gear];
    const GearPlace& p = places_.gears[gear];
    const int contact = places_.shafts[g.input].contact;
    const double s = regime_.key.modes[contact];
    const LossTerms<Row> losses = forms_.losses(gear, regime_.output_torque[gear]);
    Edge edges[3];
    const int n = g.loss_edges(regime_.key.branch[p.cell], edges);
    for (int k = 0; k < n; ++k)
        add(losses.edge(edges[k].inside, s), edges[k].neighbour < 0 ? Guard::outside : Guard::edge, contact, p.cell,
            edges[k].neighbour);
    regime_.in_data = regime_.in_data && g.in_data(regime_.key.branch[p.cell]);
}

// The contact of a shaft that "slips" but is kept at rest by others is at its limit: one torque that rest leaves open
// goes along with that limit, as a play does. Were the contact stuck, that torque would stay, and the contact be
// overcome as long as the torque that holds it moves away from it; once that turns back, it stays.
void RegimeGuards::add_turning() {
    for (int c = 0; c < layout_.contacts; ++c)
        if (places_.contacts[c].kind == ContactPlace::shaft && regime_.key.modes[c] != 0 && regime_.at_rest[c])
            add_driver(c);
    regime_.driving_input = nowhere;
    if (regime_.drivers.size() != 1) return;
    const Driver<Row>& only = regime_.drivers[0];
    const auto is_zero = [](double v) { return v == 0.0; };
    if (!std::all_of(only.rate.c.begin(), only.rate.c.end(), is_zero)) return;
    int driving = nowhere;
    for (int i = 0; i < layout_.inputs; ++i) {
        const double share = only.torque.c[layout_.first_input + i];
        if (share == 0.0) continue;
        if (driving != nowhere) return;
        driving = i;
        regime_.driving_way = share > 0.0 ? 1.0 : -1.0;
    }
    regime_.driving_input = driving;
}

void RegimeGuards::add_driver(int contact) {
    Regime stuck;
    Key key = regime_.key;
    key.modes[contact] = 0;
    equations_.set_key(key, stuck);
    equations_.compose(key, stuck);
    Row& overcome = stuck.contact_torque[contact];
    if (!Statics(places_, equations_.inertias(), stuck).solve({{&overcome, 1}})) return;
    // The torque that its rest leaves open in addition.
    int open = 0;
    while (open < layout_.contacts && (!stuck.ties.redundant[open] || regime_.ties.redundant[open])) ++open;
    if (open == layout_.contacts) return;
    const ContactPlace& place = places_.contacts[open];
    const double overcomes = regime_.key.modes[contact] * overcome.c[layout_.first_memory + place.locked];
    if (overcomes == 0.0) return;
    const Row& torque = place.kind == ContactPlace::gear
                            ? regime_.output_torque[static_cast<std::size_t>(place.element)]
                            : regime_.contact_torque[static_cast<std::size_t>(open)];
    Driver<Row> driver{contact};
    // What an elimination leaves of a term that cancels is none.
    const double scale = std::copysign(largest_share(torque), -overcomes);
    const auto share = [&](int term) {
        const double s = torque.c[term] / scale;
        return std::fabs(s) > 1e-14 ? s : 0.0;
    };
    bool by_states = false, by_inputs = false;
    for (int k = 0; k < layout_.states; ++k)
        if (driver.torque.c[k] = moves(k) ? share(k) : 0.0; driver.torque.c[k] != 0.0) {
            driver.rate += driver.torque.c[k] * regime_.rate[k];
            by_states = true;
        }
    for (int i = layout_.first_input; i < layout_.first_input + layout_.inputs; ++i) {
        driver.torque.c[i] = share(i);
        by_inputs = by_inputs || driver.torque.c[i] != 0.0;
    }
    if (by_inputs)
        regime_.drivers.push_back(driver);
    else if (by_states)
        add(driver.rate, Guard::turning, contact, nowhere, 0);
}

// Of the terms that may change while the regime lasts.
double RegimeGuards::largest_share(const Row& torque) const {
    double largest = 0.0;
    for (int k = 0; k < layout_.states; ++k)
        if (moves(k)) largest = std::max(largest, std::fabs(torque.c[k]));
    for (int i = 0; i < layout_.inputs; ++i) largest = std::max(largest, std::fabs(torque.c[layout_.first_input + i]));
    return largest > 0.0 ? largest : 1.0;
}

bool RegimeGuards::moves(int state) const {
    const Row& rate = regime_.rate[static_cast<std::size_t>(state)];
    return std::any_of(rate.c.begin(), rate.c.end(), [](double v) { return v != 0.0; });
}

// Pieces of the torsion curve, and where the flanks part and touch again.
void RegimeGuards::add_twist_pieces(int gear) {
    const Gear& g = train_.gears[gear];
    const GearPlace& p = places_.gears[gear];
    if (p.piece == nowhere || regime_.twist_rests[gear]) return;
    const TorsionCurve& curve = g.law.curve;
    const int piece = regime_.key.branch[p.piece];
    const int slip = p.contact == nowhere ? 0 : regime_.key.modes[p.contact];
    if (piece < curve.last_piece())
        add(terms_.one(curve.upper(piece)) - terms_.state(p.twist), Guard::edge, p.contact, p.piece, piece + 1).behind =
            slip < 0;
    if (piece > curve.first_piece())
        add(terms_.state(p.twist) - terms_.one(curve.lower(piece)), Guard::edge, p.contact, p.piece, piece - 1).behind =
            slip > 0;
    if (p.flanks == nowhere || piece == 0) return;
    const double way = piece > 0 ? 1.0 : -1.0;
    const Row P = forms_.spring_torque(gear, regime_.key),
              damping = g.mesh_damping * forms_.twist_rate(gear, regime_.key), pressed = way * (P + damping),
              spare = way * (P - damping);
    const auto change = [&](const Row& form, Gear::Flanks to) { add(form, Guard::edge, p.contact, p.flanks, to); };
    switch (regime_.key.branch[p.flanks]) {
        case Gear::parted: return change(-1.0 * pressed, Gear::touching);
        case Gear::limited: return change(-1.0 * spare, Gear::touching);
        default:
            change(pressed, Gear::parted);
            if (g.damping_limited) change(spare, Gear::limited);
    }
}

void RegimeGuards::add_speed_pieces(int shaft) {
    const ShaftPlace& p = places_.shafts[shaft];
    const Shaft& law = train_.shafts[shaft];
    if (regime_.ties.at_rest[shaft]) return;
    const Row w = terms_.state(p.speed);
    if (p.friction_piece != nowhere && regime_.key.modes[p.contact] != 0) {
        const double s = regime_.key.modes[p.contact];
        const int k = regime_.key.branch[p.friction_piece];
        if (k + 1 < law.friction.pieces())
            add(terms_.one(law.friction.speeds[k + 1]) - s * w, Guard::edge, p.contact, p.friction_piece, k + 1);
        if (k > 0) add(s * w - terms_.one(law.friction.speeds[k]), Guard::edge, p.contact, p.friction_piece, k - 1);
    }
}

void RegimeGuards::add_input_limits() {
    for (std::size_t m = 0; m < train_.motors.size(); ++m)
        if (const MotorPlace& p = places_.motors[m]; p.branch != nowhere) {
            const double most = train_.motors[m].command_limit();
            const int contact = places_.shafts[train_.motors[m].shaft].contact;
            add_limit_guards(terms_, terms_.input(p.command), -most, most, regime_.key,
                             {.kind = Guard::input_limit, .contact = contact, .branch = p.branch}, regime_.guards);
        }
}

// Limits of their commands, pieces of their laws over the slip.
void RegimeGuards::add_coupling_pieces() {
    for (const auto& c : places_.couplings) {
        const Between shafts = forms_.between(*c, regime_.ties, regime_.key);
        const bool slips = std::any_of(shafts.slip.c.begin(), shafts.slip.c.end(), [](double v) { return v != 0.0; });
        c->add_guards(shafts, regime_.key, slips, regime_.guards);
    }
}

// Where the output of a controller reaches its limit, or comes back from it, and where its curve bends.
void RegimeGuards::add_output_limits() {
    for (std::size_t k = 0; k < train_.controllers.size(); ++k) {
        const int branch = places_.controllers[k].branch;
        if (const int piece = places_.controllers[k].piece; piece != nowhere)
            add_piece_guards(terms_, forms_.controller_input(static_cast<int>(k)), train_.controllers[k].curve, piece,
                             regime_.key, regime_.guards);
        if (branch == nowhere) continue;
        const double most = train_.controllers[k].limit;
        add_limit_guards(terms_, forms_.controller_output(static_cast<int>(k), regime_.key), -most, most, regime_.key,
                         {.kind = Guard::edge, .branch = branch}, regime_.guards);
    }
}

}  // namespace lostmotion::model
