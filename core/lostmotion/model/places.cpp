#include "places.hpp"

#include <functional>
#include <utility>

#include "../parts/stepper_winding.hpp"

namespace lostmotion::model {

ContactPlace twist_place(const Gear& g, int gear) {
    ContactPlace c{ContactPlace::gear, gear, g.input, g.output, 1.0 / g.law.ratio, -1.0, g.rigid()};
    c.housing = g.housing;
    if (g.housing != nowhere) c.per_housing = g.per_housing();
    c.one_way = g.strikes();
    return c;
}

Places::Places(const Train& train, bool with_remainders)
    : motors(train.motors.size()),
      shafts(train.shafts.size()),
      gears(train.gears.size()),
      controllers(train.controllers.size()),
      acting(shaft_elements(train)),
      couplings(coupling_elements(train)) {
    for (std::size_t k = 0; k < controllers.size(); ++k)
        motors[train.controllers[k].motor].controller = static_cast<int>(k);
    for (std::size_t s = 0; s < shafts.size(); ++s) {
        shafts[s].inertia = train.shafts[s].inertia;
        shafts[s].viscous_friction = train.shafts[s].viscous_friction;
        if (train.shafts[s].given_motion) driven.push_back(static_cast<int>(s));
    }
    for (const MassMatrix& m : train.mass_matrices)
        for (std::size_t a = 0; a < m.shafts.size(); ++a) {
            shafts[m.shafts[a]].inertia = m.matrix[a][a];
            for (std::size_t b = 0; b < a; ++b)
                if (m.matrix[a][b] != 0.0) coupled_inertias.push_back({m.shafts[a], m.shafts[b], m.matrix[a][b]});
        }
    for (const ShaftMotor& m : train.motors) {
        shafts[m.shaft].inertia += m.law.rotor_inertia;
        shafts[m.shaft].motor_friction += m.law.friction_torque;
    }
    for (const Gear& g : train.gears) {
        shafts[g.input].inertia += g.law.inertia;
        if (g.housing == nowhere) shafts[g.input].viscous_friction += g.law.viscous_friction;
    }
    place_states(train);
    place_contacts(train);
    find_massless();
    place_inputs(train);
    for (const auto& e : acting) {
        if (e->motor() != nowhere) e->position = motors[e->motor()].command;
        if (with_remainders && e->is_smooth()) e->remainder = layout.inputs++;
    }
    for (std::size_t m = 0; m < motors.size(); ++m)
        if (with_remainders && motors[m].current != nowhere)
            motors[m].winding = std::exchange(layout.inputs, layout.inputs + StepperWinding::inputs);
    place_memory_and_branches(train);
    layout.arrange();
}

void Places::place_states(const Train& train) {
    std::vector<bool> by_angle(shafts.size());
    for (const auto& e : acting)
        if (e->over_angle()) by_angle[e->shaft] = true;
    for (const Gear& g : train.gears)
        if (g.over_angle()) {
            by_angle[g.input] = true;
            if (g.housing != nowhere) by_angle[g.housing] = true;
        }
    std::size_t further = 0;  // of windings and controllers
    for (const ShaftMotor& m : train.motors)
        if (m.law.has_winding()) {
            by_angle[m.shaft] = true;
            further += 2;
        }
    for (const LinearController& c : train.controllers) {
        for (std::size_t s = 0; s < shafts.size(); ++s)
            if (c.takes_angle(static_cast<int>(s))) by_angle[s] = true;
        further += c.states.size();
    }
    const bool all = motors.size() + shafts.size() + gears.size() + further +
                         static_cast<std::size_t>(std::count(by_angle.begin(), by_angle.end(), true)) <=
                     smallest;
    int next = 0;
    for (std::size_t m = 0; m < motors.size(); ++m)
        if (all || train.motors[m].law.has_torque_state()) motors[m].torque = next++;
    for (ShaftPlace& s : shafts) s.speed = next++;
    for (std::size_t g = 0; g < gears.size(); ++g)
        if (all || !train.gears[g].rigid()) gears[g].twist = next++;
    for (const auto& c : couplings)
        if (c->pitch() > 0.0) c->twist = next++;
    first_clock_ = next;
    const auto strikes = [](const auto& e) { return e->strikes() != nullptr; };
    next += static_cast<int>(std::count_if(train.gears.begin(), train.gears.end(), std::mem_fn(&Gear::strikes)) +
                             std::count_if(couplings.begin(), couplings.end(), strikes) +
                             std::count_if(acting.begin(), acting.end(), strikes));
    for (std::size_t s = 0; s < shafts.size(); ++s)
        if (by_angle[s]) shafts[s].angle = next++;
    for (std::size_t k = 0; k < controllers.size(); ++k) {
        controllers[k].first_state = next;
        next += static_cast<int>(train.controllers[k].states.size());
    }
    for (std::size_t m = 0; m < motors.size(); ++m)
        if (train.motors[m].law.has_winding()) motors[m].current = std::exchange(next, next + 2);
    layout.coupled = next;
    // Parts that hang together, by the last shaft of each.
    std::vector<int> last(shafts.size());
    for (std::size_t s = 0; s < shafts.size(); ++s) last[s] = static_cast<int>(s);
    const auto join = [&](int a, int b) {
        const int from = std::min(last[a], last[b]), to = std::max(last[a], last[b]);
        for (int& l : last)
            if (l == from) l = to;
    };
    for (const Gear& g : train.gears)
        if (g.housing == nowhere) join(g.input, g.output);  // else its twist leaves one angle open
    for (const auto& c : couplings)
        if (c->is_dry()) join(c->input, c->output);  // what never holds its shafts together leaves each its angle
    for (std::size_t s = 0; s < shafts.size(); ++s)
        if (last[s] == static_cast<int>(s)) last_shaft.push_back(static_cast<int>(s));
    layout.angles = static_cast<int>(last_shaft.size());
}

// Each shaft, then the gears that it turns, then the couplings.
void Places::place_contacts(const Train& train) {
    const auto dry = [&](std::size_t s) {
        if (shafts[s].motor_friction > 0.0 || train.shafts[s].friction.present()) return true;
        const auto on = [s](const auto& e) { return e->is_dry() && e->shaft == static_cast<int>(s); };
        return std::any_of(acting.begin(), acting.end(), on) ||
               std::any_of(train.gears.begin(), train.gears.end(),
                           [s](const Gear& g) { return g.input == static_cast<int>(s) && g.has_dry_losses(); });
    };
    for (std::size_t s = 0; s < shafts.size(); ++s) {
        if (dry(s)) {
            shafts[s].contact = static_cast<int>(contacts.size());
            contacts.push_back({ContactPlace::shaft, static_cast<int>(s), static_cast<int>(s)});
        }
        for (std::size_t k = 0; k < gears.size(); ++k) {
            const Gear& g = train.gears[k];
            if (g.input != static_cast<int>(s) || !(g.rigid() || g.strikes() || g.law.has_hysteresis())) continue;
            gears[k].contact = static_cast<int>(contacts.size());
            contacts.push_back(twist_place(g, static_cast<int>(k)));
            if (g.strikes())
                contacts.back().gap = {{-0.5 * g.flank_backlash, 0.5 * g.flank_backlash, g.restitution},
                                       gears[k].twist};
        }
    }
    for (std::size_t k = 0; k < couplings.size(); ++k) {
        if (!couplings[k]->is_dry()) continue;
        couplings[k]->contact = static_cast<int>(contacts.size());
        contacts.push_back(coupling_place(*couplings[k], static_cast<int>(k)));
        if (const Ends* ends = couplings[k]->strikes()) contacts.back().gap = {*ends, couplings[k]->twist};
    }
    for (std::size_t k = 0; k < acting.size(); ++k) {
        const Ends* ends = acting[k]->strikes();
        if (ends == nullptr) continue;
        acting[k]->contact = static_cast<int>(contacts.size());
        ContactPlace& c =
            contacts.emplace_back(ContactPlace{ContactPlace::stop, static_cast<int>(k), acting[k]->shaft});
        c.one_way = true;
        c.gap = {*ends, shafts[acting[k]->shaft].angle};
    }
    int clock = first_clock_;
    each_striking([&](const ContactPlace&, int c) { contacts[c].gap.clock = clock++; });
    layout.contacts = static_cast<int>(contacts.size());
}

bool Places::moves_no_inertia(int shaft, const Ties& t) const {
    for (std::size_t s = 0; s < shafts.size(); ++s) {
        const bool given = std::find(driven.begin(), driven.end(), static_cast<int>(s)) != driven.end();
        if (t.of[s].has(shaft) && (given || shafts[s].inertia > 0.0)) return false;
    }
    return true;
}

void Places::find_massless() {
    std::vector<std::int8_t> rigid(contacts.size(), 1);
    std::vector<double> inertia;
    for (std::size_t c = 0; c < contacts.size(); ++c)
        if (contacts[c].bilateral) rigid[c] = 0;
    for (const ShaftPlace& s : shafts) inertia.push_back(s.inertia);
    const Ties tied = ties(rigid, inertia.data());
    for (std::size_t s = 0; s < shafts.size(); ++s) {
        bool follows = false;
        tied.each_share(static_cast<int>(s), [&](int k, double) { follows = follows || moves_no_inertia(k, tied); });
        if (!follows) continue;
        shafts[s].massless = static_cast<int>(massless.size());
        massless.push_back(static_cast<int>(s));
    }
}

void Places::place_inputs(const Train& train) {
    for (MotorPlace& m : motors)
        if (m.controller == nowhere) m.command = layout.inputs++;
    for (std::size_t s = 0; s < shafts.size(); ++s)
        if (train.shafts[s].loaded) shafts[s].load = layout.inputs++;
    for (const int s : driven) {
        shafts[s].given_speed = layout.inputs++;
        shafts[s].given_acceleration = layout.inputs++;
    }
    for (const auto& e : acting)
        if (e->has_command()) e->command = layout.inputs++;
    for (std::size_t m = 0; m < motors.size(); ++m)
        if (const Motor& law = train.motors[m].law; law.has_winding() && law.standstill_current < 1.0)
            motors[m].level = layout.inputs++;
    for (const auto& c : couplings)
        if (c->has_command()) c->command = layout.inputs++;
    for (std::size_t k = 0; k < controllers.size(); ++k) {
        controllers[k].reference = layout.inputs++;
        if (train.controllers[k].takes(LinearController::Signal::reference_rate))
            controllers[k].reference_rate = layout.inputs++;
    }
}

void Places::place_memory_and_branches(const Train& train) {
    for (std::size_t k = 0; k < gears.size(); ++k)
        if (train.gears[k].law.has_hysteresis())
            gears[k].hysteresis = layout.memory++;
        else if (train.gears[k].strikes())
            contacts[gears[k].contact].gap.impact_loss = layout.memory++;
        else if (train.gears[k].may_lock())
            gears[k].impact_loss = layout.memory++;
    for (ContactPlace& c : contacts)
        if (c.gap.present() && c.kind != ContactPlace::gear) c.gap.impact_loss = layout.memory++;
    for (const auto& c : couplings) {
        if (c->pitch() > 0.0) c->turn = layout.memory++;
        if (c->strikes() != nullptr) contacts[c->contact].gap.turn = c->turn;
    }
    // What is redundant while some contacts are stuck is so while all are.
    const std::vector<std::int8_t> all_stuck(contacts.size(), 0);
    const Ties stuck = ties(all_stuck);
    for (std::size_t c = 0; c < contacts.size(); ++c)
        if (stuck.redundant[c] && contacts[c].kind != ContactPlace::shaft) contacts[c].locked = layout.memory++;

    int& next = layout.branches;
    for (std::size_t m = 0; m < motors.size(); ++m)
        if (train.motors[m].limited() && motors[m].controller == nowhere) motors[m].branch = next++;
    for (std::size_t s = 0; s < shafts.size(); ++s)
        if (train.shafts[s].friction.pieces() > 1) shafts[s].friction_piece = next++;
    for (std::size_t k = 0; k < gears.size(); ++k) {
        const Gear& g = train.gears[k];
        if (g.strikes())
            contacts[gears[k].contact].gap.side = next++;
        else if (!g.rigid())
            gears[k].piece = next++;
        if (g.has_dry_losses()) {
            gears[k].cell = next++;
            gears[k].cell_back = next++;
        }
        if (g.parts_flanks()) gears[k].flanks = next++;
        const auto place = [&](OverAngle& law) {
            law.piece = next++;
            if (shafts[g.input].contact != nowhere && g.housing == nowhere) law.corner = next++;
            law.turn = layout.memory++;
        };
        if (g.transmission_error.present()) place(gears[k].error);
        if (g.mesh_stiffness.present()) {
            place(gears[k].mesh);
            gears[k].parametric_work = layout.memory++;
        }
    }
    for (const auto& c : couplings)
        if (c->piecewise_law() != nullptr) c->branch = next++;
    for (const auto& e : acting) {
        if (e->piecewise_law() != nullptr) e->branch = next++;
        if (e->period() > 0.0) e->turn = layout.memory++;
    }
    for (ContactPlace& c : contacts)
        if (c.gap.present() && c.kind != ContactPlace::gear) c.gap.side = next++;
    for (std::size_t k = 0; k < controllers.size(); ++k) {
        if (train.controllers[k].limited()) controllers[k].branch = next++;
        if (train.controllers[k].curved) controllers[k].piece = next++;
    }
}

}  // namespace lostmotion::model
