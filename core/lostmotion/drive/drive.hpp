// The drive: composes its parts into the equations and guards of a regime (docs/theory.md).
#pragma once

#include <algorithm>

#include "../kernel/elimination.hpp"
#include "../parts/gearbox.hpp"
#include "../parts/load.hpp"
#include "../parts/motor.hpp"
#include "regime.hpp"

namespace lostmotion {

class Drive {
 public:
    Motor motor;
    Gearbox gearbox;
    Load load;

    double input_inertia() const { return motor.rotor_inertia + gearbox.inertia; }  // J_MR
    bool rigid() const { return gearbox.compliance == Gearbox::rigid; }
    bool has(Contact c) const {
        switch (c) {
            case input_contact: return motor.friction_torque > 0.0 || gearbox.losses == Gearbox::loss_map;
            case twist_contact: return rigid() || gearbox.has_hysteresis();
            default: return load.friction_torque > 0.0;
        }
    }

    // Torque [N m] that the input contact holds at most before it turns in direction s, or takes while it does: the
    // friction of the motor and, with a loss map, what the gear loses.
    double input_capacity(double T_2, double w_M, int s) const {
        return motor.friction_torque + gearbox.loss_torque(T_2, w_M, s) / gearbox.ratio;
    }

    // The speed of a contact, as a form.
    LinearForm contact_speed(Contact c) const {
        switch (c) {
            case input_contact: return LinearForm::unit(motor_speed);
            case twist_contact:
                return LinearForm::unit(motor_speed, 1.0 / gearbox.ratio) - LinearForm::unit(load_speed);
            default: return LinearForm::unit(load_speed);
        }
    }

    // The smallest acceleration-per-torque of the rigidly coupled drive over all cells of the map. If it is not
    // positive, rigid friction jams (Painleve): there are instants with no motion or with several.
    double min_rigid_inertia() const {
        const double i2 = gearbox.ratio * gearbox.ratio;
        double least = gearbox.losses == Gearbox::constant_efficiency ? 1.0 / gearbox.efficiency : 1.0;
        if (gearbox.losses == Gearbox::loss_map) least = std::min(least, 1.0 + gearbox.map.least_slope_over_load());
        return input_inertia() + least * load.inertia / i2;
    }

    // Magnitudes of the states in which the coupling of the equations is balanced (all time constants of like weight).
    // They serve to measure rates by a matrix norm, nothing else.
    State balanced_scale() const {
        const double i = gearbox.ratio, J = input_inertia();
        State s{};
        s[motor_torque] = 1.0;
        s[motor_speed] = motor.balanced_speed(J);
        if (rigid()) {
            s[load_speed] = s[motor_speed] / i;
            s[twist] = s[load_angle] = s[load_speed] * J;
        } else {
            const double k = gearbox.curve.max_slope();
            s[twist] = s[motor_speed] / i / std::sqrt(k / (i * i * J));
            s[load_speed] = s[twist] * std::sqrt(k / load.inertia);
            s[load_angle] = s[twist];
        }
        return s;
    }
    // Magnitudes that the states have at rated speed and torque, for error control.
    State rated_scale() const {
        const double w = gearbox.rated_input_speed, i = gearbox.ratio;
        const double d = rigid() ? 1.0 : gearbox.rated_output_torque / gearbox.curve.max_slope();
        return State{{motor.rated_torque, w, w / i, d, 1.0}};
    }

    Regime build(const RegimeKey& key) const;

 private:
    // Equations while the reactions of the stuck contacts are still unknown: three more terms.
    static constexpr int n_open = static_cast<int>(n_terms) + n_contacts;
    using Open = Form<n_open>;

    struct Equations {
        Open T_2, T_1, F_input, H, F_load, M_D, input_acceleration, load_acceleration;
    };
    Equations compose(const RegimeKey& key, const Regime& r) const;
    bool solve_reactions(const RegimeKey& key, const Regime& r, Equations& e) const;
    void add_guards(const RegimeKey& key, const Equations& e, Regime& r) const;
    void add_loss_guards(const RegimeKey& key, const Equations& e, Regime& r) const;
    void add_turning(const RegimeKey& key, Regime& r) const;

    static constexpr Motor::Terms motor_terms{motor_torque, motor_speed, command, one};
    template <class F>
    LossTerms<F> losses_of(const F& T_2) const {
        return gearbox.loss_terms(one, motor_speed, T_2);
    }
    static LinearForm closed(const Open& f) {
        LinearForm g;
        std::copy_n(f.c.begin(), n_terms, g.c.begin());
        return g;
    }
    static Open reaction(Contact c) { return Open::unit(static_cast<int>(n_terms) + c); }
};

inline Regime Drive::build(const RegimeKey& key) const {
    Regime r;
    r.key = key;
    // Two of the three speeds w_M, dd/dt, w at rest imply the third.
    const int stuck = (key.modes[0] == 0) + (key.modes[1] == 0) + (key.modes[2] == 0);
    for (int c = 0; c < n_contacts; ++c) r.at_rest[c] = key.modes[c] == 0 || stuck >= 2;

    r.resting[motor_speed] = r.at_rest[input_contact];
    r.resting[load_speed] = r.at_rest[load_contact];
    r.following[load_speed] = r.at_rest[twist_contact];

    Equations e = compose(key, r);
    r.solvable = solve_reactions(key, r, e);

    r.rate[motor_torque] = motor.torque_rate<LinearForm>(motor_terms, key.amplifier);
    if (!r.at_rest[input_contact]) r.rate[motor_speed] = closed(e.input_acceleration);
    if (!r.at_rest[load_contact])
        r.rate[load_speed] =
            r.at_rest[twist_contact] ? r.rate[motor_speed] / gearbox.ratio : closed(e.load_acceleration);
    if (!r.at_rest[twist_contact]) r.rate[twist] = contact_speed(twist_contact);
    if (!r.at_rest[load_contact]) r.rate[load_angle] = LinearForm::unit(load_speed);

    r.output_torque = closed(e.T_2);
    r.source_torque = closed(e.M_D);
    r.input_friction = closed(e.F_input);
    r.input_torque = closed(e.T_1);
    r.loss_torque = closed(gearbox.ratio * e.T_1 - e.T_2);
    r.hysteresis_torque = closed(e.H);
    r.load_friction = closed(e.F_load);
    add_guards(key, e, r);
    return r;
}

inline Drive::Equations Drive::compose(const RegimeKey& key, const Regime& r) const {
    const auto [input, slip, bearing] = key.modes;
    const double i = gearbox.ratio;
    const bool all_stuck = input == 0 && slip == 0 && bearing == 0;
    Equations e;
    e.M_D = motor.torque<Open>(motor_terms);

    // Output torque: rigid, it is whatever is needed (7); else T_2 = P(d) + H (15). While everything is at rest, the
    // split between the contacts is not determined by the motion; T_2 then stays as it was.
    const TorsionCurve& curve = gearbox.curve;
    const Open P =
        rigid() ? Open{} : Open::unit(twist, curve.slope(key.piece)) + Open::unit(one, curve.offset(key.piece));
    if (all_stuck)
        e.H = Open::unit(locked_torque) - P;
    else if (slip == 0)
        e.H = reaction(twist_contact);
    else if (slip != absent)
        e.H = Open::unit(hysteresis_capacity, slip);
    e.T_2 = P + e.H;

    // Losses: (5b), or (12) with M_2B sign(w_M) written out in one cell of the map.
    e.T_1 = e.T_2 / i;
    if (gearbox.losses == Gearbox::constant_efficiency) e.T_1 = e.T_1 / gearbox.efficiency;
    if (input == 0) {
        e.F_input = reaction(input_contact);
    } else if (input != absent) {
        const double s = input;
        e.F_input = Open::unit(one, s * motor.friction_torque);
        if (gearbox.losses == Gearbox::loss_map) {
            const Open M_2B_signed = losses_of(e.T_2).turning(gearbox.map.plane(key.cell), s);
            e.F_input += M_2B_signed / i;
            e.T_1 += M_2B_signed / i;
        }
    }

    if (bearing == 0)
        e.F_load = reaction(load_contact);
    else if (bearing != absent)
        e.F_load = Open::unit(one, bearing * load.friction_torque);

    // Eq. (3); F_input holds T_10 sign(w_M) and, with a loss map, the loss part of T_1.
    const Open transmitted = gearbox.losses == Gearbox::loss_map ? e.T_2 / i : e.T_1;
    const Open w_M = r.at_rest[input_contact] ? Open{} : Open::unit(motor_speed);
    const Open w = r.at_rest[load_contact]    ? Open{}
                   : r.at_rest[twist_contact] ? Open::unit(motor_speed, 1.0 / i)
                                              : Open::unit(load_speed);
    e.input_acceleration = (e.M_D - gearbox.viscous_friction * w_M - e.F_input - transmitted) / input_inertia();
    e.load_acceleration = (e.T_2 - load.viscous_friction * w - Open::unit(load_torque) - e.F_load) / load.inertia;
    return e;
}

// Finds the reactions of the stuck contacts from the condition that their speeds stay zero.
inline bool Drive::solve_reactions(const RegimeKey& key, const Regime& r, Equations& e) const {
    const bool all_stuck = key.modes[0] == 0 && key.modes[1] == 0 && key.modes[2] == 0;
    const double i = gearbox.ratio;
    const std::array<Open, n_contacts> speed_rate{e.input_acceleration, e.input_acceleration / i - e.load_acceleration,
                                                  e.load_acceleration};
    std::array<Open, n_contacts> rows;
    std::array<int, n_contacts> unknowns{};
    std::size_t n = 0;
    for (int c = 0; c < n_contacts; ++c) {
        if (key.modes[c] != 0 || (all_stuck && c == twist_contact)) continue;
        rows[n] = speed_rate[c];
        unknowns[n++] = static_cast<int>(n_terms) + c;
    }
    const auto subtract = [](Open& f, double factor, const Open& row) { f -= factor * row; };
    if (!eliminate(rows, unknowns, n, subtract)) return false;
    for (Open* f : {&e.T_2, &e.T_1, &e.F_input, &e.H, &e.F_load, &e.input_acceleration, &e.load_acceleration})
        substitute(*f, rows, unknowns, n, subtract);
    // Turning the rotor forward must need more torque, not less: else the friction jams. While it rests at its limit
    // this goes for the torque T_2 that it would wind up by giving way.
    const LinearForm result = closed(r.at_rest[input_contact] ? e.T_2 : e.input_acceleration);
    const double per_torque = motor.kind == Motor::dc ? result.c[motor_torque] : result.c[command];
    const bool decides = !r.at_rest[input_contact] || key.modes[input_contact] == +1 || key.modes[input_contact] == -1;
    return !decides || per_torque > 0.0;
}

inline void Drive::add_guards(const RegimeKey& key, const Equations& e, Regime& r) const {
    const auto add = [&r](const LinearForm& form, Guard::Kind kind, Contact contact, int neighbour) {
        r.guards[r.n_guards++] = Guard{form, kind, contact, neighbour};
    };
    for (int k = 0; k < n_contacts; ++k) {
        const auto c = static_cast<Contact>(k);
        const int mode = key.modes[k];
        if (mode != +1 && mode != -1) continue;
        add(static_cast<double>(mode) * contact_speed(c), Guard::speed, c, 0);
        // (16) sets the hysteresis anew whenever the twist rate reaches zero, whether it then changes sign or not.
        r.guards[r.n_guards - 1].by_grazing = c == twist_contact;
    }
    if (key.modes[twist_contact] == 0 && !rigid()) {
        const LinearForm h = LinearForm::unit(hysteresis_capacity), H = closed(e.H);
        add(h - H, Guard::capacity, twist_contact, +1);
        add(h + H, Guard::capacity, twist_contact, -1);
    }
    if (key.modes[load_contact] == 0) {
        const LinearForm T = LinearForm::unit(one, load.friction_torque), F = closed(e.F_load);
        add(T - F, Guard::capacity, load_contact, +1);
        add(T + F, Guard::capacity, load_contact, -1);
    }
    if (key.modes[input_contact] != absent) add_loss_guards(key, e, r);
    add_turning(key, r);

    const TorsionCurve& curve = gearbox.curve;
    if (!rigid() && !r.at_rest[twist_contact]) {
        const int slip = key.modes[twist_contact];
        const auto edge = [&](const LinearForm& form, int way) {
            add(form, Guard::torsion_piece, twist_contact, key.piece + way);
            r.guards[r.n_guards - 1].behind = slip == -way;
        };
        if (key.piece < curve.outermost_piece())
            edge(LinearForm::unit(one, curve.upper(key.piece)) - LinearForm::unit(twist), +1);
        if (key.piece > -curve.outermost_piece())
            edge(LinearForm::unit(twist) - LinearForm::unit(one, curve.lower(key.piece)), -1);
    }
    if (motor.limits_voltage()) {
        const LinearForm E = LinearForm::unit(command), limit = LinearForm::unit(one, motor.voltage_limit);
        if (key.amplifier <= 0)
            add(key.amplifier == 0 ? limit - E : -limit - E, Guard::amplifier, input_contact, key.amplifier + 1);
        if (key.amplifier >= 0)
            add(key.amplifier == 0 ? limit + E : E - limit, Guard::amplifier, input_contact, key.amplifier - 1);
    }
}

// Everything is at rest, and one contact "slips": it is at its limit, and T_2 goes along with that as long as what
// drives it there goes on. When it turns back T_2 stays.
inline void Drive::add_turning(const RegimeKey& key, Regime& r) const {
    const auto [input, slip, bearing] = key.modes;
    if (slip != 0 || input == absent || bearing == absent || (input == 0) == (bearing == 0)) return;
    if (input == 0) {
        r.driving_input = load_torque - first_input;
        r.driving_way = -bearing;
    } else if (motor.kind == Motor::torque_source) {
        r.driving_input = command - first_input;
        r.driving_way = input;
    } else {
        r.guards[r.n_guards++] = Guard{static_cast<double>(input) * r.rate[motor_torque], Guard::turning};
    }
}

// Capacity of the input contact while it is stuck, cell edges while it slips.
inline void Drive::add_loss_guards(const RegimeKey& key, const Equations& e, Regime& r) const {
    const bool has_map = gearbox.losses == Gearbox::loss_map;
    const LossTerms<LinearForm> losses = losses_of(closed(e.T_2));
    const auto add = [&r](const LinearForm& form, Guard::Kind kind, int neighbour) {
        r.guards[r.n_guards++] = Guard{form, kind, input_contact, neighbour};
    };
    if (key.modes[input_contact] == 0) {
        for (const int s : {+1, -1}) {
            LinearForm F = LinearForm::unit(one, motor.friction_torque);
            if (has_map) {
                const int j = s > 0 ? key.cell : key.cell_back;
                const auto kind = s > 0 ? Guard::loss_cell : Guard::loss_cell_back;
                const LinearForm mu = losses.load(s);
                F += losses.at_rest(gearbox.map.line_at_standstill(j), s);
                const double low = gearbox.map.load_interval_lower(j), high = gearbox.map.load_interval_upper(j);
                const bool first = j == 0, last = j + 1 == gearbox.map.load_intervals();
                add(1.0 / (high - low) * (LinearForm::unit(one, high) - mu), last ? Guard::outside : kind, j + 1);
                add(1.0 / (high - low) * (mu - LinearForm::unit(one, low)), first ? Guard::outside : kind, j - 1);
                r.in_data = r.in_data && gearbox.map.load_interval_in_data(j);
            }
            add(F - static_cast<double>(s) * closed(e.F_input), Guard::capacity, s);
        }
    } else if (has_map) {
        const double s = key.modes[input_contact];
        Edge edges[3];
        const int n = gearbox.map.edges(key.cell, edges);
        for (int k = 0; k < n; ++k)
            add(losses.edge(edges[k].inside, s), edges[k].neighbour < 0 ? Guard::outside : Guard::loss_cell,
                edges[k].neighbour);
        r.in_data = gearbox.map.in_data(key.cell);
    }
}

}  // namespace lostmotion
