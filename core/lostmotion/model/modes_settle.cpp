// One combination of modes: its pieces and cells, its locked torques, and whether it is consistent.
#include "switched_train.hpp"

namespace lostmotion::model {

// A form of a controller, which depends on states and inputs and has a constant.
double SwitchedTrain::value_of(const Instant& now, const Row& v) const {
    const Layout& n = assembly_.layout();
    double sum = v.c[n.one];
    for (int k = 0; k < n.coupled; ++k) sum += v.c[k] * now.x[k];
    for (int k = 0; k < n.inputs; ++k) sum += v.c[n.first_input + k] * now.input[0][k];
    return sum;
}

// The branches that the state and the inputs give, and what laws remember of those before.
void SwitchedTrain::locate(const Instant& now, const Key& from, Key& trial) const {
    const auto set = [&trial](int branch, int value) {
        if (branch != nowhere) trial.branch[branch] = static_cast<std::int16_t>(value);
    };
    for (std::size_t m = 0; m < train().motors.size(); ++m) {
        const double most = train().motors[m].command_limit();
        if (const MotorPlace& p = places().motors[m]; p.branch != nowhere)
            set(p.branch, side_of(now.input[0][p.command], -most, most));
    }
    for (const auto& c : places().couplings)
        if (c->branch != nowhere) {
            CouplingInstant here = places().instant_of(*c, now);
            here.sticks = c->contact != nowhere && trial.modes[c->contact] == 0;
            set(c->branch, c->next(from.branch[c->branch], here));
        }
    for (const auto& e : places().acting)
        if (e->branch != nowhere) set(e->branch, e->next(from.branch[e->branch], places().instant_of(*e, now)));
    for (std::size_t s = 0; s < train().shafts.size(); ++s) {
        const ShaftPlace& p = places().shafts[s];
        const double w = now.x[p.speed];
        if (p.friction_piece != nowhere && trial.modes[p.contact] != 0)
            set(p.friction_piece, train().shafts[s].friction.piece(w));
    }
    for (std::size_t g = 0; g < train().gears.size(); ++g) {
        const Gear& gear = train().gears[g];
        const GearPlace& p = places().gears[g];
        p.each_over_angle(gear, [&](const PeriodicCurve& curve, const OverAngle& law) {
            set(law.piece, curve.piece(assembly_.angle_of_input(g, now.x) - now.memory[law.turn]));
        });
        if (p.piece == nowhere) continue;
        const double d = now.x[p.twist];
        const int piece = gear.law.curve.locate(d);
        set(p.piece, piece);
        if (p.flanks == nowhere) continue;
        const double w_in = now.x[places().shafts[gear.input].speed], w_out = now.x[places().shafts[gear.output].speed];
        double rate = assembly_.per_input(static_cast<int>(g), trial) * w_in - w_out;
        if (gear.housing != nowhere)
            rate += assembly_.per_housing(static_cast<int>(g), trial) * now.x[places().shafts[gear.housing].speed];
        const double P = assembly_.stiffness_factor(static_cast<int>(g), trial) * gear.law.curve.torque(d);
        set(p.flanks, piece == 0 ? Gear::touching : gear.flanks(piece, P, gear.mesh_damping * rate));
    }
    places().each_striking([&](const ContactPlace& c, int contact) {
        const int side = static_cast<int>(c.gap.side_of(now));
        set(c.gap.side, trial.modes[contact] != 0 ? 0 : now.x[c.gap.clock] > 0.0 ? 2 * side : side);
    });
    for (std::size_t k = 0; k < train().controllers.size(); ++k) {
        const auto [branch, piece] = std::pair(places().controllers[k].branch, places().controllers[k].piece);
        const LinearController& c = train().controllers[k];
        if (piece != nowhere)
            set(piece, c.curve.locate(value_of(now, assembly_.controller_input(static_cast<int>(k)))));
        if (branch != nowhere)
            set(branch,
                side_of(value_of(now, assembly_.controller_output(static_cast<int>(k), trial)), -c.limit, c.limit));
    }
}

// The cells of the loss laws, at the output torques T_2.
void SwitchedTrain::locate_losses(const Instant& now, const Torques& T_2, Key& trial) const {
    for (std::size_t g = 0; g < train().gears.size(); ++g) {
        const Gear& gear = train().gears[g];
        if (!gear.has_dry_losses()) continue;
        const GearPlace& p = places().gears[g];
        const int s = trial.modes[places().shafts[gear.input].contact];
        const double mu = gear.sense() * T_2[g] / gear.rated_torque();
        const double speed = now.x[places().shafts[gear.input].speed];
        const auto cells = gear.loss_cells(s, mu, speed, gear.law.rated_input_speed);
        trial.branch[p.cell] = cells[0];
        trial.branch[p.cell_back] = cells[1];
    }
}

// Torques that the motion does not determine are held, from the load to the motors. Whether all contacts can hold them,
// the guards tell.
void SwitchedTrain::hold(const SparseRegime& r, Instant& now, const Event& event) const {
    if (r.locked.empty()) return;
    Torques torques{};
    for (int c = 0; c < contacts(); ++c) {
        const ContactPlace& p = places().contacts[c];
        if (p.kind != ContactPlace::shaft)
            torques[c] = p.kind == ContactPlace::gear ? event.gear[p.element] : event.coupling[c];
    }
    for (const auto& l : r.locked) now.memory[l.memory] = torques[l.contact];
    for (const auto& l : r.locked)
        now.memory[l.memory] = held_torque(l, torques, [&](const auto& form) { return evaluate(form, now); }).value;
}

// Is this combination of modes consistent? Pieces and cells are found by a walk that begins at what the torques were.
auto SwitchedTrain::settle(Instant& now, const Key& modes, const Event& event, Key& key, Violated violated) -> Trial {
    ++searches.trials;
    Key trial;
    trial.modes = modes.modes;
    locate(now, event.from, trial);
    Torques T_2 = event.gear;
    for (std::size_t g = 0; g < train().gears.size(); ++g) {
        const GearPlace& p = places().gears[g];
        if (train().gears[g].rigid() || train().gears[g].strikes()) continue;
        const int slip = p.contact == nowhere ? +2 : trial.modes[p.contact];
        if (slip == 0) continue;
        T_2[g] =
            assembly_.stiffness_factor(static_cast<int>(g), trial) * train().gears[g].law.curve.torque(now.x[p.twist]) +
            (slip == 2 ? 0.0 : slip * now.memory[p.hysteresis]);
    }
    locate_losses(now, T_2, trial);
    if (some_redundant_) hold(regimes_[trial], now, event);
    Trial result = walk(now, event, trial, key, violated);
    if (result.found == Found::inconsistent && settle_on_corner(now, event, trial, key)) {
        result.found = Found::yes;
        result.end = nullptr;
    }
    if (result.found != Found::inconsistent || !event.from_each_load) return result;
    // Where the first walk says of no contact that it has to change, the next that does leads on.
    const auto walk_from = [&](const Key& other) {
        const bool wanted = violated.each != nullptr && violated.each->empty();
        return walk(now, event, other, key, wanted ? violated : Violated{});
    };
    // The torque that keeps a twist at rest depends on the cell, and the cell on the torque.
    std::vector<std::size_t> at_rest;
    for (std::size_t g = 0; g < train().gears.size(); ++g) {
        const Gear& gear = train().gears[g];
        if (!gear.has_dry_losses() || places().gears[g].contact == nowhere) continue;
        if (trial.modes[places().shafts[gear.input].contact] == 0 || trial.modes[places().gears[g].contact] != 0)
            continue;
        at_rest.push_back(g);
        const double v = std::fabs(now.x[places().shafts[gear.input].speed]) / gear.law.rated_input_speed;
        for (int j = 0; j < gear.load_intervals(); ++j) {
            const double low = gear.load_lower(j), high = gear.load_upper(j);
            const double middle = std::isinf(low) ? high - 1.0 : std::isinf(high) ? low + 1.0 : 0.5 * (low + high);
            for (const int half : {0, 1}) {  // of the two triangles at this speed
                if (half == 1 && gear.efficiencies) continue;
                Key other = trial;
                other.branch[places().gears[g].cell] = static_cast<std::int16_t>(gear.loss_cell(middle, v) ^ half);
                const Trial again = walk_from(other);
                if (again.found == Found::yes) return again;
                result.turns_back = result.turns_back || again.turns_back;
            }
        }
    }
    // Those of several gears depend on one another: each drives or is driven.
    constexpr std::size_t most_at_once = 6;
    if (at_rest.size() < 2 || at_rest.size() > most_at_once) return result;
    for (std::size_t loads = 0; loads < std::size_t{1} << at_rest.size(); ++loads) {
        for (std::size_t k = 0; k < at_rest.size(); ++k) {
            const double torque = train().gears[at_rest[k]].rated_torque();
            T_2[at_rest[k]] = (loads >> k & 1) != 0 ? torque : -torque;
        }
        Key other = trial;
        locate_losses(now, T_2, other);
        const Trial again = walk_from(other);
        if (again.found == Found::yes) return again;
        result.turns_back = result.turns_back || again.turns_back;
    }
    return result;
}

// The torque that an input shaft feels jumps at the corners of a transmission error and at the steps of a stiffness. A
// shaft at rest on one may have
// that of either side, or, where both sides push it back, any between: does the piece on the other side of such a
// corner hold, or the corner itself?
bool SwitchedTrain::settle_on_corner(Instant& now, const Event& event, const Key& trial, Key& key) {
    const auto memory = now.memory;
    bool found = false;
    for (std::size_t g = 0; g < train().gears.size(); ++g)
        places().gears[g].each_over_angle(train().gears[g], [&](const PeriodicCurve& curve, const OverAngle& law) {
            const double phi = assembly_.angle_of_input(g, now.x);
            const int k = trial.branch[law.piece], last = curve.pieces() - 1;
            for (const bool ahead : {false, true}) {
                if (found) return;
                const double corner = now.memory[law.turn] + (ahead ? curve.upper(k) : curve.lower(k)),
                             off = std::fabs(phi - corner) / (std::fabs(phi) + curve.period());
                if (off <= on_corner) {
                    const bool turns = k == (ahead ? last : 0);
                    Key other = trial;
                    other.branch[law.piece] = static_cast<std::int16_t>(turns ? last - k : ahead ? k + 1 : k - 1);
                    if (turns) now.memory[law.turn] += ahead ? curve.period() : -curve.period();
                    found = walk(now, event, other, key).found == Found::yes;
                    if (found) return;
                    now.memory = memory;
                }
                if (off > rounding || law.corner == nowhere) continue;
                if (trial.modes[places().shafts[train().gears[g].input].contact] != 0) continue;
                Key between = trial;
                between.branch[law.corner] = ahead ? +1 : -1;
                found = walk(now, event, between, key).found == Found::yes;
                if (!found) now.memory = memory;
            }
        });
    return found;
}

// Is this combination, in which a contact is at its limit, consistent, or, if what drives it there turns back, does
// everything rest at those torques, or all whose limits turn back?
Found SwitchedTrain::settle_at_limit(Instant& now, const Key& modes, const Event& event, Key& key) {
    Event thorough = event;
    thorough.from_each_load = true;
    const Found found = settle(now, modes, thorough, key).found;
    if (found != Found::inconsistent || event.closest) return found;
    thorough.closest = true;
    if (settle(now, modes, thorough, key).found != Found::yes) return found;
    const auto& r = regimes_[key];
    Event standing = event;
    for (std::size_t g = 0; g < train().gears.size(); ++g) standing.gear[g] = evaluate(r.output_torque[g], now);
    each_coupling_contact([&](int c) { standing.coupling[c] = evaluate(r.contact_torque[c], now); });
    Key stuck = modes, some_stuck = modes;
    for (int c = 0; c < contacts(); ++c)
        if (r.at_rest[c]) stuck.modes[c] = 0;
    SparseFlow along(r.rate, now, room_);
    for (const auto& driver : r.drivers)
        if (turns_back(along, driver.torque)) some_stuck.modes[driver.contact] = 0;
    if (const Found all = settle(now, stuck, standing, key).found; all != Found::inconsistent) return all;
    return settle(now, some_stuck, standing, key).found;
}

// From a piece and a cell across each of their edges that is violated, until none is: do the contacts hold there?
auto SwitchedTrain::walk(Instant& now, const Event& event, Key trial, Key& key, Violated violated) -> Trial {
    constexpr int longest_walk = 400;
    Key previous = trial;
    std::vector<std::size_t> along;  // edges that lead back to where the walk came from: the motion goes along them
    bool plain = !event.closest;
    Trial result;
    for (int step = 0; step < longest_walk; ++step) {
        const SparseRegime& r = regimes_[trial];
        violated.clear();
        if (!r.solvable || interruption()) return result;
        const Guard* left = first_left(r, now, along, event, violated);
        if (left != nullptr && left->kind == Guard::outside) {
            result.found = Found::outside;
            return result;
        }
        if (left == nullptr) {
            if (violated.any && !event.closest) {
                result.turns_back = violated.only_turning;
                if (plain && along.empty()) result.end = &r;
                return result;
            }
            if (event.has_ended(trial) && !event.closest) {
                if (event.kind != Guard::edge && event.kind != Guard::input_limit) {
                    violated.add({event.contact, event.neighbour, n_derivatives, 0.0});
                    if (plain && along.empty()) result.end = &r;
                    return result;
                }
                trial.branch[event.branch] = static_cast<std::int16_t>(event.neighbour);
                if (event.memory != nowhere) now.memory[event.memory] += event.shift;
            }
            if (plain && along.empty() && trial == r.key) result.end = &r;
            key = trial;
            result.found = Found::yes;
            return result;
        }
        Key next = trial;
        cross(*left, next);
        if (step > 0 && next == previous) {
            along.push_back(static_cast<std::size_t>(left - r.guards.data()));
            continue;
        }
        shift(*left, now.memory);
        plain = plain && left->memory == nowhere;
        previous = std::exchange(trial, next);
        along.clear();
    }
    return result;
}

}  // namespace lostmotion::model
