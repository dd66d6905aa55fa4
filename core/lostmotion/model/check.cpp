#include "check.hpp"

#include "../base/decimal.hpp"
#include "assembly.hpp"
#include "eigenvalue.hpp"
#include "names.hpp"

namespace lostmotion::model {

std::string Fault::sentence() const { return kind.empty() ? reason : element() + ' ' + reason; }

Fault TrainCheck::operator()() const {
    for (const auto check : {&TrainCheck::shafts_exist, &TrainCheck::mass_matrices, &TrainCheck::controllers,
                             &TrainCheck::elements, &TrainCheck::inertias, &TrainCheck::rigid_loops,
                             &TrainCheck::turned, &TrainCheck::massless, &TrainCheck::what_strikes})
        if (Fault error = (this->*check)(); !error.empty()) return error;
    return {};
}

Fault TrainCheck::shafts_exist() const {
    if (train_.shafts.empty()) return Fault{} + "the train has no shaft";
    const auto missing = [](const Fault& what, int s) {
        return what + "names shaft number " + std::to_string(s) + ", which the train does not have";
    };
    const auto one = [&](const char* table, const char* kind, const auto& elements) -> Fault {
        for (std::size_t k = 0; k < elements.size(); ++k)
            if (!exists(elements[k].shaft)) return missing(named(table, kind, elements[k].name, k), elements[k].shaft);
        return {};
    };
    const auto two = [&](const char* table, const char* kind, const auto& elements) -> Fault {
        for (std::size_t k = 0; k < elements.size(); ++k) {
            const auto& e = elements[k];
            if (!exists(e.input)) return missing(named(table, kind, e.name, k), e.input);
            if (!exists(e.output)) return missing(named(table, kind, e.name, k), e.output);
            if (e.input == e.output)
                return named(table, kind, e.name, k) + "joins " + shaft(e.input) +
                       " with itself; give it another output";
        }
        return {};
    };
    for (Fault error : {one("motors", "motor", train_.motors), two("gears", "gear", train_.gears), housings()})
        if (!error.empty()) return error;
    Fault error;
    Train::each_coupling_kind(train_, [&](const char* table, const char* kind, const auto& elements) {
        if (error.empty()) error = two(table, kind, elements);
    });
    Train::each_kind(train_, [&](const char* table, const char* kind, const auto& elements) {
        if (error.empty()) error = one(table, kind, elements);
    });
    return error;
}

Fault TrainCheck::housings() const {
    for (std::size_t k = 0; k < train_.gears.size(); ++k) {
        const Gear& g = train_.gears[k];
        if (g.housing == nowhere) continue;
        const Fault name = named("gears", "gear", g.name, k);
        if (!exists(g.housing))
            return name + "names shaft number " + std::to_string(g.housing) +
                   " as its housing, which the train does not have";
        if (g.housing == g.input || g.housing == g.output)
            return name + "has its housing on " + shaft(g.housing) +
                   ", which it joins as well; give the housing a shaft of its own";
        if (g.has_dry_losses())
            return name + "has a housing that turns and losses that depend on the direction of its motion, which " +
                   "are solved against the frame only; leave one of them out";
    }
    return {};
}

Fault TrainCheck::controllers() const {
    std::vector<bool> controlled(train_.motors.size());
    for (std::size_t k = 0; k < train_.controllers.size(); ++k) {
        const LinearController& c = train_.controllers[k];
        const Fault name = named("controllers", "controller", c.name, k);
        if (c.motor < 0 || c.motor >= static_cast<int>(controlled.size()))
            return name + "turns a motor that the train does not have";
        if (controlled[static_cast<std::size_t>(c.motor)]) return name + "turns a motor that another one turns";
        controlled[static_cast<std::size_t>(c.motor)] = true;
        const std::size_t n = c.states.size(), m = c.signals.size();
        const auto wide = [](const auto& rows, std::size_t w) {
            return std::all_of(rows.begin(), rows.end(), [w](const auto& row) { return row.size() == w; });
        };
        if (c.A.size() != n || c.B.size() != n || !wide(c.A, n) || !wide(c.B, m) || c.C.size() != n ||
            c.D.size() != m || c.back_calculation.size() != n)
            return name + "has matrices that do not fit its states and signals";
        if (!(c.limit > 0.0)) return name + "has a limit that is not above 0";
        if (Fault error = too_fine(name + "with its curve ", c.curve.pieces()); !error.empty()) return error;
        for (const LinearController::Signal& s : c.signals)
            if (!exists(s.shaft)) return name + "takes the angle or speed of a shaft that the train does not have";
        if (!exists(c.compared.shaft)) return name + "compares with a shaft that the train does not have";
    }
    return {};
}

Fault TrainCheck::elements() const {
    for (std::size_t k = 0; k < train_.gears.size(); ++k) {
        const Gear& g = train_.gears[k];
        const Fault name = named("gears", "gear", g.name, k);
        if (g.law.ratio == 0.0) return name + "has the ratio 0; it must not be 0";
        if (g.efficiencies && !(g.efficiencies->driving() > 0.0))
            return name + "has a drive efficiency of " + general_text(g.efficiencies->driving(), 6) +
                   "; it must be > 0: no torque would turn it";
        if (Fault error = flanks(g, name); !error.empty()) return error;
        if (g.mesh_damping > 0.0 && g.rigid()) return name + "is rigid and has mesh damping; give it a stiffness";
        if (g.damping_limited && !g.parts_flanks())
            return name + "limits its mesh damping, which it does not have, or has no backlash; give it both";
        if (g.parts_flanks() && g.law.has_hysteresis())
            return name + "has backlash with both mesh damping and hysteresis; take one of them";
        if (g.transmission_error.present() && (g.rigid() || g.law.has_hysteresis()))
            return name + "has a transmission error; it needs a stiffness, without hysteresis";
        if (Fault error = too_fine(name + "with its transmission error ", g.transmission_error.pieces());
            !error.empty())
            return error;
        if (Fault error = mesh_stiffness(g, name); !error.empty()) return error;
        if (g.law.losses == Gearbox::loss_map)
            if (const std::size_t cells = 2 * g.law.map.speeds().size() * g.law.map.loads().size();
                cells > static_cast<std::size_t>(max_pieces))
                return name + "has a loss map of some " + std::to_string(cells) + " triangles; at most " +
                       std::to_string(max_pieces) + " are possible: leave out speeds or loads";
    }
    Fault error;
    Train::each_kind(train_, [&](const char* table, const char* kind, const auto& elements) {
        for (std::size_t k = 0; k < elements.size() && error.empty(); ++k)
            error = too_fine(named(table, kind, elements[k].name, k), on_shaft(elements[k])->pieces());
    });
    Train::each_coupling_kind(train_, [&](const char* table, const char* kind, const auto& elements) {
        for (std::size_t k = 0; k < elements.size() && error.empty(); ++k)
            error = too_fine(named(table, kind, elements[k].name, k), between_shafts(elements[k])->pieces());
    });
    for (const auto& e : shaft_elements(train_))
        if (e->motor() != nowhere && error.empty())
            error = too_fine(named("motors", "motor", train_.motors[static_cast<std::size_t>(e->motor())].name, 0),
                             e->pieces());
    if (!error.empty()) return error;
    for (std::size_t s = 0; s < train_.shafts.size(); ++s) {
        const DryFriction& f = train_.shafts[s].friction;
        const int drag = train_.shafts[s].drag.pieces();
        for (const auto& [what, pieces] : {std::pair{"with its friction ", f.pieces()}, {"with its drag ", drag}})
            if (Fault fine = too_fine(shaft(static_cast<int>(s)) + what, pieces); !fine.empty()) return fine;
        if (f.speeds.size() != f.torques.size() || (!f.speeds.empty() && f.speeds[0] != 0.0))
            return shaft(static_cast<int>(s)) + "has a friction curve that does not begin at speed 0";
        for (std::size_t k = 1; k < f.speeds.size(); ++k)
            if (!(f.speeds[k] > f.speeds[k - 1]))
                return shaft(static_cast<int>(s)) + "has a friction curve whose speeds do not rise";
    }
    return {};
}

Fault TrainCheck::mesh_stiffness(const Gear& g, const Fault& name) const {
    const PeriodicCurve& mesh = g.mesh_stiffness;
    if (!mesh.present()) return {};
    if (g.law.compliance == Gearbox::rigid)
        return name + "has a mesh stiffness over the angle and no stiffness, which it scales; give it one";
    for (int k = 0; k < mesh.pieces(); ++k)
        if (!(mesh.value(k) > 0.0) || !std::isfinite(mesh.value(k)))
            return name + "has a mesh stiffness of " + general_text(mesh.value(k), 6) +
                   " times its own; it must be > 0";
    return too_fine(name + "with its mesh stiffness ", mesh.pieces());
}

Fault TrainCheck::flanks(const Gear& g, const Fault& name) const {
    if (!g.strikes()) return {};
    if (g.law.compliance != Gearbox::rigid) return name + "has rigid flanks and a stiffness; leave one of them out";
    if (g.mesh_damping > 0.0 || g.transmission_error.present())
        return name + "has rigid flanks with " + (g.mesh_damping > 0.0 ? "mesh damping" : "a transmission error") +
               "; leave that out, or give a stiffness";
    return impacts(name, "has rigid flanks", "the gear", g.restitution);
}

// Impulses pass through all that is rigid: nothing there may lose energy, be given, or hold one way.
Fault TrainCheck::impacts(const Fault& name, const std::string& rigid, const std::string& it,
                          double restitution) const {
    const auto lossless = [](const Gear& o) {
        return !o.has_dry_losses() && o.law.losses == Gearbox::constant_efficiency && o.law.efficiency == 1.0;
    };
    if (!(restitution >= 0.0 && restitution <= 1.0))
        return name + rigid + " and a restitution of " + general_text(restitution, 6) + "; it must lie from 0 to 1";
    for (std::size_t k = 0; k < train_.gears.size(); ++k)
        if (const Gear& o = train_.gears[k]; (o.rigid() || o.strikes()) && !lossless(o))
            return named("gears", "gear", o.name, k) + "is rigid and has losses, which impacts in " + name +
                   " would depend on; give it a stiffness or no losses";
    for (std::size_t s = 0; s < train_.shafts.size(); ++s)
        if (train_.shafts[s].given_motion)
            return name + rigid + ", and the motion of " + shaft(static_cast<int>(s)) + " is given; give " + it +
                   " a stiffness, or a torque in place of the motion";
    for (const auto& c : coupling_elements(train_))
        if (c->is_one_way() && c->strikes() == nullptr)
            return name + rigid + " beside the freewheel '" + c->name + "'; give " + it + " a stiffness";
    return {};
}

Fault TrainCheck::what_strikes() const {
    const Places places(train_);
    for (std::size_t k = 0; k < train_.end_stops.size(); ++k) {
        const EndStops& e = train_.end_stops[k];
        const Fault name = named("end_stops", "end stops", e.name, k);
        if (!(e.upper > e.lower))
            return name + "have their upper stop at " + general_text(e.upper, 6) + ", not above the lower one at " +
                   general_text(e.lower, 6) + "; exchange them";
        if (e.stiffness == 0.0)
            if (Fault error = impacts(name, "are rigid", "them", e.restitution); !error.empty()) return error;
        if (e.damping > 0.0 && places.shafts[static_cast<std::size_t>(e.shaft)].massless != nowhere)
            return name + "have damping, and " + shaft(e.shaft) + "has no " + inertia(e.shaft) + "; give it one (" +
                   harmless_inertia(e.shaft) + " is harmless beside its neighbours)";
    }
    Fault error;
    Train::each_coupling_kind(train_, [&](const char* table, const char* kind, const auto& elements) {
        for (std::size_t k = 0; k < elements.size() && error.empty(); ++k)
            if (const auto e = between_shafts(elements[k]); e->strikes() != nullptr)
                error = impacts(named(table, kind, elements[k].name, k), "has teeth that strike", "what is beside it",
                                e->strikes()->restitution);
    });
    return error;
}

Fault TrainCheck::mass_matrices() const {
    constexpr double rounding = 1e-12;  // of entries that were computed, relative to the diagonal
    const auto number = [](double v) { return general_text(v, 6); };
    std::vector<std::string> of(train_.shafts.size());
    for (std::size_t k = 0; k < train_.mass_matrices.size(); ++k) {
        const MassMatrix& m = train_.mass_matrices[k];
        const std::size_t n = m.shafts.size();
        const Fault name = named("mass_matrices", "mass matrix", m.name, k);
        if (n == 0) return name + "names no shaft; give it shafts";
        for (const int s : m.shafts) {
            if (!exists(s)) return name + "names shaft number " + std::to_string(s) + ", which the train does not have";
            std::string& before = of[static_cast<std::size_t>(s)];
            if (before == name.element()) return name + "names " + shaft(s) + " twice; name it once";
            if (!before.empty())
                return name + "names " + shaft(s) + ", which is in " + before + " too; leave it in one";
            before = name.element();
            if (train_.shafts[static_cast<std::size_t>(s)].inertia != 0.0)
                return name + "holds the " + inertia(s) + " of " + shaft(s) + ", which has one of its own, " +
                       number(train_.shafts[static_cast<std::size_t>(s)].inertia) +
                       (is_slide(train_, s) ? " kg" : " kg*m^2") + "; leave that out and add it to the diagonal";
        }
        const auto& M = m.matrix;
        if (M.size() != n || std::any_of(M.begin(), M.end(), [n](const auto& row) { return row.size() != n; }))
            return name + "is for " + std::to_string(n) + " shafts; give its matrix " + std::to_string(n) +
                   " rows of " + std::to_string(n) + " numbers";
        for (std::size_t a = 0; a < n; ++a)
            for (std::size_t b = 0; b < a; ++b)
                if (!(std::fabs(M[a][b] - M[b][a]) <= rounding * std::sqrt(std::fabs(M[a][a] * M[b][b]))))
                    return name + "is not symmetric: between " + shaft(m.shafts[b]) + " and " + shaft(m.shafts[a]) +
                           " it has " + number(M[b][a]) + " and " + number(M[a][b]) + "; give both the same value";
        for (std::size_t a = 0; a < n; ++a)
            if (M[a][a] == 0.0)
                return name + "has no " + inertia(m.shafts[a]) + " of " + shaft(m.shafts[a]) +
                       " on its diagonal; give one, or leave it out of the matrix";
        bool positive = true;
        auto scaled = M;  // to ones on the diagonal, so that units do not matter
        for (std::size_t a = 0; a < n; ++a) {
            positive = positive && M[a][a] > 0.0;
            for (std::size_t b = 0; b < n; ++b) scaled[a][b] /= std::sqrt(std::fabs(M[a][a]) * std::fabs(M[b][b]));
        }
        if (!positive || !(smallest_eigenvalue(scaled) > rounding))
            return name + "is not positive definite: its smallest eigenvalue is " + number(smallest_eigenvalue(M)) +
                   "; with it some motion would have no kinetic energy";
    }
    return {};
}

Fault TrainCheck::inertias() const {
    const Places places(train_);
    for (std::size_t s = 0; s < train_.shafts.size(); ++s)
        if (!(places.shafts[s].inertia >= 0.0))
            return shaft(static_cast<int>(s)) + "has a negative " + inertia(static_cast<int>(s)) +
                   "; give it none or a positive one";
    return {};
}

// The speed of a shaft without inertia follows from dampers: nothing dry may depend on it, and one damper at least has
// to act in all states of the gears.
Fault TrainCheck::massless() const {
    if (Places(train_).massless.empty()) return {};
    const Assembly a(train_);
    const Places& places = a.places();
    const auto remedy = [&](int s) {
        return std::string("; give it ") + (is_slide(train_, s) ? "a mass (" : "an inertia (") + harmless_inertia(s) +
               " is harmless beside its neighbours)";
    };
    std::vector<std::int8_t> rigid(places.contacts.size(), 1);
    for (std::size_t c = 0; c < places.contacts.size(); ++c)
        if (places.contacts[c].bilateral) rigid[c] = 0;
    const Ties tied = places.ties(rigid);
    for (std::size_t c = 0; c < places.contacts.size(); ++c) {
        const Shares moves = rigid[c] == 0 ? Shares{} : tied_speed(places.contacts[c], tied);
        for (const int s : places.massless)
            if (moves.has(s))
                return shaft(s) + "has no " + inertia(s) + ", and " + contact_name(a, static_cast<int>(c)) +
                       " is a dry contact at it" + remedy(s) + ", or leave the contact out";
    }
    for (const LinearController& k : train_.controllers)
        for (const LinearController::Signal& y : k.signals)
            if (y.kind == LinearController::Signal::speed &&
                places.shafts[static_cast<std::size_t>(y.shaft)].massless != nowhere)
                return shaft(y.shaft) + "has no " + inertia(y.shaft) + ", and a controller takes its speed" +
                       remedy(y.shaft);
    // In the gaps of all gears, while all that is dry slips.
    Key open;
    for (std::size_t c = 0; c < places.contacts.size(); ++c)
        if (rigid[c] != 0) open.modes[c] = places.contacts[c].one_way ? -1 : 1;
    if (a.build(open).solvable) return {};
    int found = places.massless.front();
    for (const int s : places.massless) {
        Train damped = train_;
        damped.shafts[static_cast<std::size_t>(s)].viscous_friction += 1.0;
        if (!Assembly(std::move(damped)).build(open).solvable) continue;
        found = s;
        break;
    }
    return shaft(found) + "has no " + inertia(found) + ", and no damping acts on it in all states of its gears" +
           remedy(found) + ", or mesh damping to a gear without backlash";
}

// A ten-thousandth of the least inertia next to a shaft, as the shaft feels it: they swing at a hundred times the
// frequency of their neighbour.
std::string TrainCheck::harmless_inertia(int s) const {
    const Places places(train_);
    double least = 0.0, most = 0.0;
    for (const ShaftPlace& p : places.shafts) most = std::fmax(most, p.inertia);
    for (const Gear& g : train_.gears) {
        const double i = g.law.ratio,
                     J = g.input == s    ? places.shafts[static_cast<std::size_t>(g.output)].inertia / (i * i)
                         : g.output == s ? places.shafts[static_cast<std::size_t>(g.input)].inertia * i * i
                                         : 0.0;
        if (J > 0.0 && (least == 0.0 || J < least)) least = J;
    }
    return general_text(1e-4 * (least > 0.0 ? least : most), 1) + (is_slide(train_, s) ? " kg" : " kg*m^2");
}

Fault TrainCheck::rigid_loops() const {
    std::vector<ContactPlace> rigid;
    for (std::size_t k = 0; k < train_.gears.size(); ++k)
        if (train_.gears[k].rigid()) rigid.push_back(twist_place(train_.gears[k], static_cast<int>(k)));
    const int shafts = static_cast<int>(train_.shafts.size());
    std::vector<std::int8_t> modes(rigid.size(), 1);
    for (std::size_t k = 0; k < rigid.size(); ++k) {
        modes[k] = 0;
        const Ties ties = model::tie(rigid, shafts, modes);
        if (!ties.redundant[k] && !ties.at_rest[rigid[k].a]) continue;
        const auto gear = static_cast<std::size_t>(rigid[k].element);
        return named("gears", "gear", train_.gears[gear].name, gear) + "closes a loop of rigid gears with " +
               (ties.redundant[k] ? "the same ratio: its torque would not be determined"
                                  : "another ratio: nothing could turn") +
               "; give it a stiffness or leave it out";
    }
    return given_motions(rigid);
}

Fault TrainCheck::given_motions(const std::vector<ContactPlace>& rigid) const {
    std::vector<int> given;
    for (std::size_t s = 0; s < train_.shafts.size(); ++s)
        if (train_.shafts[s].given_motion) given.push_back(static_cast<int>(s));
    const std::vector<std::int8_t> stuck(rigid.size(), 0);
    const Ties ties = model::tie(rigid, static_cast<int>(train_.shafts.size()), stuck, nullptr, {given});
    for (std::size_t k = 0; k < rigid.size(); ++k)
        if (const auto gear = static_cast<std::size_t>(rigid[k].element); ties.redundant[k])
            return named("gears", "gear", train_.gears[gear].name, gear) +
                   "is rigid and joins shafts whose motions are both given; give it a stiffness, or leave one of the "
                   "speeds out";
    return {};
}

Fault TrainCheck::turned() const {
    std::vector<bool> acted_on(train_.shafts.size());
    const auto act_on = [&](int s) { acted_on[static_cast<std::size_t>(s)] = true; };
    for (const Gear& g : train_.gears) {
        act_on(g.input);
        act_on(g.output);
        if (g.housing != nowhere) act_on(g.housing);
    }
    for (const auto& c : coupling_elements(train_)) {
        act_on(c->input);
        act_on(c->output);
    }
    for (const ShaftMotor& m : train_.motors) act_on(m.shaft);
    for (const CoupledInertia& c : Places(train_).coupled_inertias) {
        act_on(c.a);
        act_on(c.b);
    }
    for (std::size_t s = 0; s < acted_on.size(); ++s)
        if (train_.shafts[s].given_motion) act_on(static_cast<int>(s));
    for (const auto& e : shaft_elements(train_))
        if (e->drives()) act_on(e->shaft);
    for (std::size_t s = 0; s < acted_on.size(); ++s)
        if (!acted_on[s] && !train_.shafts[s].loaded)
            return shaft(static_cast<int>(s)) + "is " + (is_slide(train_, static_cast<int>(s)) ? "moved" : "turned") +
                   " by nothing: no motor, gear or load " + torque_word(train_, static_cast<int>(s)) +
                   " acts on it; join it to the train";
    return {};
}

Fault TrainCheck::too_fine(const Fault& element, int pieces) {
    if (pieces <= max_pieces) return {};
    return element + "would take " + std::to_string(pieces) + " straight lines; at most " + std::to_string(max_pieces) +
           " are possible: allow a larger error";
}

std::string check_start(const Train& train, const std::vector<double>& speed) {
    const auto number = [](double v) { return general_text(v, 10); };
    const auto one = [&](int s) {
        return train.shafts[static_cast<std::size_t>(s)].name + " = " + number(speed[static_cast<std::size_t>(s)]) +
               ' ' + speed_unit(train, s);
    };
    const auto both = [&](int a, int b) { return one(a) + " and " + one(b); };
    constexpr double rounding = 1e-12;  // of speeds that were converted from other units
    const Places places(train);
    const auto follows = [&](int s) { return places.shafts[static_cast<std::size_t>(s)].massless != nowhere; };
    for (const Gear& g : train.gears) {
        if (follows(g.input) || follows(g.output) || (g.housing != nowhere && follows(g.housing))) continue;
        const double in = speed[static_cast<std::size_t>(g.input)] / g.law.ratio,
                     out = speed[static_cast<std::size_t>(g.output)],
                     housing =
                         g.housing == nowhere ? 0.0 : g.per_housing() * speed[static_cast<std::size_t>(g.housing)];
        const double size = std::fmax(std::fmax(std::fabs(in), std::fabs(out)), std::fabs(housing));
        if (!g.rigid() || std::fabs(in - out + housing) <= rounding * size) continue;
        if (g.housing != nowhere)
            return both(g.input, g.output) + " do not fit the rigid gear " + g.name + " on the housing " +
                   one(g.housing) + "; relative to it their quotient must be its ratio, " + number(g.law.ratio);
        const bool slides = is_slide(train, g.output);
        return both(g.input, g.output) + " do not fit " + (slides ? "" : "the rigid gear ") + g.name +
               (slides ? ", which is rigid" : "") + "; their quotient must be its ratio, " + number(g.law.ratio) +
               (slides ? " in SI" : "") + ", to twelve digits";
    }
    std::string error;
    Train::each_coupling_kind(train, [&](const char*, const char* kind, const auto& elements) {
        for (const auto& e : elements) {
            const double in = speed[static_cast<std::size_t>(e.input)], out = speed[static_cast<std::size_t>(e.output)];
            const bool ahead = in - out > rounding * std::fmax(std::fabs(in), std::fabs(out));
            if (error.empty() && ahead && between_shafts(e)->is_one_way())
                error = both(e.input, e.output) + " do not fit the " + kind + ' ' + e.name +
                        ", whose input cannot be faster than its output; give both the same speed";
        }
    });
    return error;
}

}  // namespace lostmotion::model
