// What belongs to each element of a train in its equations: states, contacts, memory, inputs, branches.
//
// Coupled states: [motor torques][shaft speeds][twists][angles that a torque or a controller depends on][states of
// controllers]. Angles: one for each part of the train that hangs together, that of its last shaft.
#pragma once

#include <algorithm>
#include <vector>

#include "ties.hpp"
#include "train.hpp"

namespace lostmotion::model {

// Where the twist of a gear rests or slips.
ContactPlace twist_place(const Gear& g, int gear);

// Of two shafts; element: its number.
inline ContactPlace coupling_place(const CouplingElement& c, int element) {
    return {ContactPlace::coupling, element, c.input, c.output, 1.0, -1.0, false, c.is_one_way()};
}

struct MotorPlace {
    int torque = nowhere;   // state
    int command = nowhere;  // input, unless a controller gives it
    int branch = nowhere;
    int controller = nowhere;  // its number
    // Of a stepper with a winding: the first of two states; the command of the current, an input; and the first of
    // `StepperWinding::inputs` inputs of the adaptive solver.
    int current = nowhere, level = nowhere, winding = nowhere;
};
// A law over the angle of an input shaft.
struct OverAngle {
    int piece = nowhere;   // branch
    int corner = nowhere;  // branch: +1, -1: the input shaft rests on the upper, the lower end of that piece
    int turn = nowhere;    // memory
};
struct GearPlace {
    int twist = nowhere, contact = nowhere;
    int hysteresis = nowhere;                                                    // memory
    int piece = nowhere, cell = nowhere, cell_back = nowhere, flanks = nowhere;  // branches
    int impact_loss = nowhere;      // memory: the energy that a lock in motion has taken [J]
    int parametric_work = nowhere;  // memory: the energy that steps of the stiffness have given [J]
    OverAngle error, mesh;

    // Calls use(curve, place) for each law of the gear over the angle of its input shaft.
    template <class Use>
    void each_over_angle(const Gear& g, Use&& use) const {
        if (g.transmission_error.present()) use(g.transmission_error, error);
        if (g.mesh_stiffness.present()) use(g.mesh_stiffness, mesh);
    }
};

// What couples two shafts by a mass matrix, off its diagonal: J_a w_a' + value w_b' = T_a, and likewise of b.
struct CoupledInertia {
    int a, b;
    double value;
};

struct ControllerPlace {
    int first_state = nowhere;
    int reference = nowhere, reference_rate = nowhere;  // inputs
    int branch = nowhere, piece = nowhere;              // branches: the limit, the curve
};

struct Places {
    Layout layout;
    std::vector<MotorPlace> motors;
    std::vector<ShaftPlace> shafts;
    std::vector<GearPlace> gears;
    std::vector<ControllerPlace> controllers;
    ShaftElements acting;
    CouplingElements couplings;
    std::vector<ContactPlace> contacts;
    std::vector<int> last_shaft;  // of each part of the train, whose angle is kept
    std::vector<int> driven;      // shafts whose motion is given
    std::vector<CoupledInertia> coupled_inertias;
    // Shafts without inertia that no rigid gear ties to others alone: their speeds follow from the balance of torques.
    std::vector<int> massless;

    // with_remainders: what piecewise-linear laws leave of smooth ones enters as further inputs.
    explicit Places(const Train& train, bool with_remainders = false);

    // modes: of the contacts; those beyond its end are stuck.
    template <class Modes>
    Ties ties(const Modes& modes, const double* inertia = nullptr, bool given_speeds_follow = false) const {
        return tie(contacts, static_cast<int>(shafts.size()), {modes.data(), modes.size()}, inertia,
                   {driven, given_speeds_follow, massless});
    }
    // How many conditions may end a regime: both ends of each piecewise law and each cell, what the contacts hold to
    // both sides with the cells of their losses, limits of commands, and what rest leaves open.
    int most_guards() const {
        const std::size_t elements =
            gears.size() + acting.size() + couplings.size() + motors.size() + controllers.size();
        return 4 * (layout.contacts + layout.branches + static_cast<int>(elements));
    }
    // The name of a coupling or an end stop.
    const std::string& name_of(const ContactPlace& c) const {
        return c.kind == ContactPlace::stop ? acting[c.element]->name : couplings[c.element]->name;
    }
    // Calls use(contact, its number) for each contact that strikes: flanks of gears, then others.
    template <class Use>
    void each_striking(Use&& use) const {
        for (std::size_t g = 0; g < gears.size(); ++g)
            if (const int c = gears[g].contact; c != nowhere && contacts[c].gap.present()) use(contacts[c], c);
        const auto each = [&](const auto& elements) {
            for (const auto& e : elements)
                if (e->strikes() != nullptr) use(contacts[e->contact], e->contact);
        };
        each(couplings);
        each(acting);
    }
    // Does nothing that moves with a free shaft have an inertia?
    bool moves_no_inertia(int shaft, const Ties& t) const;

    // Calls use(shaft, inertia) for each entry of a row of the mass matrix that is not zero off the diagonal.
    template <class Use>
    void each_coupled_inertia(int shaft, Use&& use) const {
        for (const CoupledInertia& c : coupled_inertias) {
            if (c.a == shaft) use(c.b, c.value);
            if (c.b == shaft) use(c.a, c.value);
        }
    }

    template <class Now>
    ShaftInstant instant_of(const ShaftElement& e, const Now& now) const {
        const ShaftPlace& p = shafts[e.shaft];
        return {now.x[p.speed], p.angle == nowhere ? 0.0 : e.seen(now.x[p.angle], now.input[0]),
                e.command == nowhere ? 0.0 : now.input[0][e.command], e.turn == nowhere ? 0.0 : now.memory[e.turn]};
    }
    template <class Now>
    CouplingInstant instant_of(const CouplingElement& c, const Now& now) const {
        return {now.x[shafts[c.input].speed] - now.x[shafts[c.output].speed],
                c.command == nowhere ? 0.0 : now.input[0][c.command]};
    }

 private:
    // The smallest kernel. A train that fits into it has a place for the torque of each motor and the twist of each
    // gear, whether they move or not: one motor, two shafts and a gear are always in the same order.
    static constexpr int smallest = 4;
    int first_clock_ = nowhere;  // state

    void place_states(const Train& train);
    void place_contacts(const Train& train);
    void find_massless();
    void place_inputs(const Train& train);
    void place_memory_and_branches(const Train& train);
};

}  // namespace lostmotion::model
