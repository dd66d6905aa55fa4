// The motion of a drive in one combination of contact modes, curve piece and map cell, as Taylor series, with all the
// conditions ("guards") under which the combination holds.
#pragma once

#include <string>
#include <vector>

#include "drive.hpp"
#include "referee_parts.hpp"

namespace lostmotion::test::referee {

// The parameters in quadruple precision, and what follows from them.
struct Model {
    explicit Model(const Drive& p)
        : is_dc(p.motor.kind == Motor::dc),
          limits_voltage(is_dc && std::isfinite(p.motor.voltage_limit)),
          rigid(p.gearbox.compliance == Gearbox::rigid),
          has_map(p.gearbox.losses == Gearbox::loss_map),
          input_contact(has_map || p.motor.friction_torque > 0.0),
          twist_contact(rigid || p.gearbox.hysteresis_efficiency < 1.0),
          load_contact(p.load.friction_torque > 0.0),
          M_DR(p.motor.rated_torque),
          w_DR(p.motor.rated_speed),
          tau_a(p.motor.electrical_time_constant),
          k_N(p.motor.armature_voltage_constant),
          voltage_limit(limits_voltage ? p.motor.voltage_limit : 0.0),
          T_10(p.motor.friction_torque),
          J(Quad(p.motor.rotor_inertia) + Quad(p.gearbox.inertia)),
          b(p.gearbox.viscous_friction),
          i(p.gearbox.ratio),
          eta_H(p.gearbox.hysteresis_efficiency),
          eta(p.gearbox.efficiency),
          n_1R(p.gearbox.rated_input_speed),
          T_2R(p.gearbox.rated_output_torque),
          J_Z(p.load.inertia),
          b_Z(p.load.viscous_friction),
          T_f(p.load.friction_torque),
          map(has_map ? Map(p.gearbox.map) : Map()) {
        if (!rigid) pieces = curve_pieces(p.gearbox.curve);
    }

    Quad spring_torque(Quad d) const {
        for (const CurvePiece& p : pieces)
            if ((p.range.open_below || d >= p.range.lower) && (p.range.open_above || d <= p.range.upper))
                return p.slope * d + p.offset;
        return 0;
    }
    Quad capacity_after_turning(Quad d) const { return (1 - eta_H) / 2 * magnitude(spring_torque(d)); }

    bool is_dc, limits_voltage, rigid, has_map, input_contact, twist_contact, load_contact;
    Quad M_DR, w_DR, tau_a, k_N, voltage_limit, T_10, J, b, i, eta_H, eta, n_1R, T_2R, J_Z, b_Z, T_f;
    Map map;
    std::vector<CurvePiece> pieces;
};

struct Point {
    Quad M_D = 0, w_M = 0, w = 0, d = 0, phi = 0;
};

// Of a contact: the sign of its speed, 0 if it sticks.
inline constexpr int stuck = 0, absent = 2;

struct ContactModes {
    int amplifier = 0;  // sign of the voltage limit that acts, 0: none
    int input = absent, twist = absent, load = absent;
    bool operator==(const ContactModes&) const = default;
    bool all_stuck() const { return input == stuck && twist == stuck && load == stuck; }
    std::string text() const {
        const auto symbol = [](int mode) { return mode == absent ? "." : mode == stuck ? "0" : mode > 0 ? "+" : "-"; };
        return std::string(symbol(input)) + symbol(twist) + symbol(load) +
               (amplifier == 0  ? ""
                : amplifier > 0 ? " limit+"
                                : " limit-");
    }
};

inline constexpr int kept = -1;

struct Combination {
    ContactModes modes;
    const CurvePiece* piece = nullptr;                             // compliant gear
    const MapCell* cell = nullptr;                                 // input slips, loss map
    const StandstillCell *forward = nullptr, *backward = nullptr;  // input sticks, loss map
    Quad h = 0;
    // While all contacts are at rest: T_2 as it was, or at the limit with this number, which pushes it.
    Quad kept_torque = 0;
    int pushed_by = kept;
};

struct Guard {
    enum Kind { speed_of_input, speed_of_twist, speed_of_load, other } kind = other;
    const char* name = "";
    Series c;           // >= 0 while the combination holds
    Quad size = 0;      // of what it is a difference of
    bool zero = false;  // vanishes as long as the combination holds
    int zeros = 0;      // multiplicity of its zero at the start of the series
};

// Largest magnitudes so far: what rounding is measured by.
struct Sizes {
    Quad input_torque = 0, input_speed = 0, twist = 0;
};

struct Motion {
    Combination combination;
    bool possible = false;  // the accelerations exist
    Series M_D, w_M, w, d, phi, T_2;
    Quad step = 0;  // over which the series are good
    std::vector<Guard> guards;
};

// The inputs about the instant of interest: relative voltage and load torque.
struct Inputs {
    Series E, M_Z;
};

// A condition G + q T_2 >= 0 on the torque while all contacts are at rest.
struct TorqueLimit {
    const char* name = "";
    Series G;
    Quad q = 0;
    int winds = 0;  // of the input: the sign by which T_2 changes as it gives way
    // Whether T_2 goes along with the limit: only if giving way restores what holds.
    bool pushes() const { return winds == 0 ? q != 0 : winds * q > 0; }
};

class MotionBuilder {
 public:
    explicit MotionBuilder(const Model& model) : m_(model) {}

    // From x on, with steps of at most `longest`.
    Motion build(const Combination& combination, const Point& x, const Inputs& u, const Sizes& sizes,
                 Quad longest) const {
        Motion motion;
        motion.combination = combination;
        motion.possible = expand(motion, x, u.E, u.M_Z);
        if (!motion.possible) return motion;
        motion.step = step_of(motion, u, longest);
        add_guards(motion, u.E, u.M_Z, grown(sizes, motion));
        return motion;
    }

    // Conditions on T_2 alone while all contacts are at rest: first the limits that may push it, then those of its
    // cells.
    std::vector<TorqueLimit> torque_limits(const Combination& c, Quad d, const Series& M_D, const Series& M_Z) const {
        std::vector<TorqueLimit> limits;
        if (!m_.rigid) {
            const Quad P = c.piece->slope * d + c.piece->offset;
            limits.push_back({"twist holds, forward", Series(P + c.h), -1});
            limits.push_back({"twist holds, backward", Series(c.h - P), 1});
        }
        limits.push_back({"load holds, forward", M_Z + m_.T_f, -1});
        limits.push_back({"load holds, backward", -M_Z + m_.T_f, 1});
        if (!m_.has_map) {
            const Quad alpha = 1 / (m_.i * m_.eta);
            limits.push_back({"input holds, forward", -M_D + m_.T_10, alpha, +1});
            limits.push_back({"input holds, backward", M_D + m_.T_10, -alpha, -1});
            return limits;
        }
        const Quad i = m_.i, T_2R = m_.T_2R;
        limits.push_back({"input holds, forward", -M_D + (m_.T_10 + T_2R * c.forward->at_zero / i),
                          (1 + c.forward->per_load) / i, +1});
        limits.push_back({"input holds, backward", M_D + (m_.T_10 + T_2R * c.backward->at_zero / i),
                          -(1 + c.backward->per_load) / i, -1});
        for (const int sign : {+1, -1}) {
            const Range& r = (sign > 0 ? c.forward : c.backward)->range;
            if (!r.open_below) limits.push_back({"map cell at standstill, lower", Series(-r.lower), sign / T_2R});
            if (!r.open_above) limits.push_back({"map cell at standstill, upper", Series(r.upper), -sign / T_2R});
        }
        return limits;
    }
    int limits_that_push() const { return m_.rigid ? 4 : 6; }

    // T_2 at the first instant of a combination, for a quick look at the cell.
    Quad torque_at(const Combination& c, const Point& x, const Inputs& u) const {
        const Quad M_D = m_.is_dc ? x.M_D : m_.M_DR * u.E[0];
        Quad T_2 = 0;
        return output_torque(c, gear_of(c), 0, M_D, x.w_M, x.w, x.d, u.M_Z[0], T_2) ? T_2 : nanq("");
    }

    Series motor_torque_at_rest(int amplifier, Quad M_D, const Series& E) const {
        Series torque(M_D);
        if (!m_.is_dc) return m_.M_DR * E;
        for (int k = 0; k < order; ++k) torque[k + 1] = torque_rate(amplifier, k, torque[k], 0, E[k]) / (k + 1);
        return torque;
    }

    Sizes grown(Sizes s, const Motion& motion) const {
        const auto sum = [&](const Series& c) { return sum_of_magnitudes(stretched(c, motion.step)); };
        s.input_torque = larger(s.input_torque, larger(sum(motion.M_D), sum(motion.T_2) / m_.i));
        s.input_speed = larger(s.input_speed, larger(sum(motion.w_M), m_.i * sum(motion.w)));
        s.twist = larger(s.twist, sum(motion.d));
        return with_torques_of_twist(s);
    }
    // By what is there at one instant.
    Sizes grown(Sizes s, const Point& x, const Inputs& u, Quad h) const {
        s.input_speed = larger(s.input_speed, larger(magnitude(x.w_M), m_.i * magnitude(x.w)));
        s.twist = larger(s.twist, magnitude(x.d));
        const Quad output = larger(larger(magnitude(u.M_Z[0]), m_.T_f), larger(h, m_.b_Z * magnitude(x.w)));
        const Quad input = larger(larger(magnitude(x.M_D), m_.is_dc ? Quad(0) : m_.M_DR * magnitude(u.E[0])),
                                  larger(m_.T_10, m_.b * magnitude(x.w_M)));
        s.input_torque = larger(s.input_torque, larger(input, output / m_.i));
        return with_torques_of_twist(s);
    }

 private:
    // At the end of a play the torque is as uncertain as the twist.
    Sizes with_torques_of_twist(Sizes s) const {
        for (const CurvePiece& p : m_.pieces) s.input_torque = larger(s.input_torque, p.slope * s.twist / m_.i);
        return s;
    }

    // T_1 = alpha T_2 + beta w_M + gamma
    struct Gear {
        Quad alpha, beta, gamma;
    };
    Gear gear_of(const Combination& c) const {
        if (!m_.has_map) return {1 / (m_.i * m_.eta), 0, 0};
        if (!c.cell) return {1 / m_.i, 0, 0};  // input stuck
        // T_1 = (T_2 + s T_2R (a_0 + a_mu s T_2/T_2R + a_v s w_M/n_1R)) / i, s^2 = 1
        const Form2& a = c.cell->loss;
        return {(1 + a.per_load) / m_.i, m_.T_2R * a.per_speed / (m_.n_1R * m_.i),
                c.modes.input * m_.T_2R * a.at_zero / m_.i};
    }

    Quad torque_rate(int amplifier, int k, Quad M_D, Quad w_M, Quad E) const {
        const Quad voltage = amplifier == 0 ? E : k == 0 ? amplifier * m_.voltage_limit : Quad(0);
        return (m_.M_DR * (m_.k_N * voltage - (m_.k_N - 1) * w_M / m_.w_DR) - M_D) / m_.tau_a;
    }
    // Torques that do not come through the gear: J dw_M/dt = Q - alpha T_2, J_Z dw/dt = T_2 - L.
    Quad input_side(const Combination& c, const Gear& g, int k, Quad M_D, Quad w_M) const {
        const int sign = c.modes.input == absent ? 0 : c.modes.input;
        return M_D - (m_.b + g.beta) * w_M - (k == 0 ? g.gamma + sign * m_.T_10 : Quad(0));
    }
    Quad load_side(const Combination& c, int k, Quad w, Quad M_Z) const {
        const int sign = c.modes.load == absent ? 0 : c.modes.load;
        return M_Z + m_.b_Z * w + (k == 0 ? sign * m_.T_f : Quad(0));
    }

    // k-th coefficient of T_2 from the k-th coefficients of the state; not while all contacts are at rest.
    bool output_torque(const Combination& c, const Gear& g, int k, Quad M_D, Quad w_M, Quad w, Quad d, Quad M_Z,
                       Quad& T_2) const {
        if (c.modes.twist != stuck) {
            const int sign = c.modes.twist == absent ? 0 : c.modes.twist;
            T_2 = c.piece->slope * d + (k == 0 ? c.piece->offset + sign * c.h : Quad(0));
            return true;
        }
        // The twist sticks: dw_M/dt = i dw/dt.
        const Quad Q = input_side(c, g, k, M_D, w_M), L = load_side(c, k, w, M_Z);
        if (c.modes.input == stuck) {
            T_2 = L;
            return true;
        }
        const Quad carried = c.modes.load == stuck ? Quad(0) : m_.i / m_.J_Z;
        const Quad denominator = g.alpha / m_.J + carried;
        if (magnitude(denominator) <= Quad(1e-28) * (1 / (m_.i * m_.J) + carried)) return false;
        T_2 = (Q / m_.J + carried * L) / denominator;
        return true;
    }

    bool expand(Motion& r, const Point& x, const Series& E, const Series& M_Z) const {
        const Combination& c = r.combination;
        const Gear g = gear_of(c);
        r.M_D = m_.is_dc ? Series(x.M_D) : m_.M_DR * E;
        r.w_M = Series(x.w_M);
        r.w = Series(x.w);
        r.d = Series(x.d);
        r.phi = Series(x.phi);
        if (c.modes.all_stuck()) {
            r.M_D = motor_torque_at_rest(c.modes.amplifier, x.M_D, E);
            r.T_2 = Series(c.kept_torque);
            if (c.pushed_by == kept) return true;
            const TorqueLimit limit = torque_limits(c, x.d, r.M_D, M_Z)[c.pushed_by];
            if (limit.q == 0) return false;
            r.T_2 = (-1 / limit.q) * limit.G;
            return true;
        }
        for (int k = 0; k <= order; ++k) {
            if (!output_torque(c, g, k, r.M_D[k], r.w_M[k], r.w[k], r.d[k], M_Z[k], r.T_2[k])) return false;
            if (k == order) break;
            const Quad n = k + 1;
            if (m_.is_dc) r.M_D[k + 1] = torque_rate(c.modes.amplifier, k, r.M_D[k], r.w_M[k], E[k]) / n;
            const bool both_stand = c.modes.twist == stuck && (c.modes.input == stuck || c.modes.load == stuck);
            if (!both_stand && c.modes.input != stuck)
                r.w_M[k + 1] = (input_side(c, g, k, r.M_D[k], r.w_M[k]) - g.alpha * r.T_2[k]) / (m_.J * n);
            if (c.modes.twist == stuck)
                r.w[k + 1] = r.w_M[k + 1] / m_.i;
            else if (c.modes.load != stuck)
                r.w[k + 1] = (r.T_2[k] - load_side(c, k, r.w[k], M_Z[k])) / (m_.J_Z * n);
            if (c.modes.twist != stuck) r.d[k + 1] = (r.w_M[k] / m_.i - r.w[k]) / n;
            r.phi[k + 1] = r.w[k] / n;
        }
        return true;
    }

    // The last four terms of each series are below 1e-33 of its largest.
    static Quad step_of(const Motion& r, const Inputs& u, Quad longest) {
        const Series* const all[] = {&r.M_D, &r.w_M, &r.w, &r.d, &r.phi, &u.E, &u.M_Z};
        Quad h = longest;
        for (const Series* c : all) {
            std::array<double, order + 1> logarithm;
            for (int k = 0; k <= order; ++k) logarithm[k] = log2_of_magnitude((*c)[k]);
            for (;; h *= Quad(0.85)) {
                const double log2_h = log2_of_magnitude(h);
                double largest = -HUGE_VAL, last = -HUGE_VAL;
                for (int k = 0; k <= order; ++k) {
                    const double term = logarithm[k] + k * log2_h;
                    largest = std::fmax(largest, term);
                    if (k > order - 4) last = std::fmax(last, term);
                }
                if (last <= largest - 110.0 || last == -HUGE_VAL) break;  // 2^-110 < 1e-33
            }
        }
        return h;
    }
    static double log2_of_magnitude(Quad a) {
        if (a == 0) return -HUGE_VAL;
        int exponent = 0;
        const double mantissa = static_cast<double>(magnitude(frexpq(a, &exponent)));
        return std::log2(mantissa) + exponent;
    }

    void add_guards(Motion& r, const Series& E, const Series& M_Z, const Sizes& sizes) const {
        const Combination& c = r.combination;
        const auto add = [&](Guard::Kind kind, const char* name, const Series& g, Quad size) {
            Guard guard;
            guard.kind = kind;
            guard.name = name;
            guard.c = g;
            guard.size = size;
            r.guards.push_back(guard);
        };
        const auto between = [&](const char* low, const char* high, const Series& g, const Range& range, Quad size) {
            if (!range.open_below) add(Guard::other, low, g - range.lower, larger(size, magnitude(range.lower)));
            if (!range.open_above) add(Guard::other, high, -g + range.upper, larger(size, magnitude(range.upper)));
        };
        if (m_.limits_voltage) {
            const Quad limit = m_.voltage_limit;
            if (c.modes.amplifier >= 0)
                add(Guard::other, "voltage limit +", c.modes.amplifier > 0 ? E - limit : -E + limit, limit);
            if (c.modes.amplifier <= 0)
                add(Guard::other, "voltage limit -", c.modes.amplifier < 0 ? -E - limit : E + limit, limit);
        }
        if (!m_.rigid) between("curve piece, lower end", "curve piece, upper end", r.d, c.piece->range, sizes.twist);
        const Quad torque = sizes.input_torque;
        if (c.modes.all_stuck()) {
            add_limits_of_held_torque(r, M_Z, torque);
            return;
        }
        if (c.modes.input == stuck) {
            const Series R = r.M_D - (m_.has_map ? 1 / m_.i : 1 / (m_.i * m_.eta)) * r.T_2;
            if (m_.has_map) {
                const Series F_forward =
                    Series(m_.T_10 + m_.T_2R * c.forward->at_zero / m_.i) + (c.forward->per_load / m_.i) * r.T_2;
                const Series F_backward =
                    Series(m_.T_10 + m_.T_2R * c.backward->at_zero / m_.i) - (c.backward->per_load / m_.i) * r.T_2;
                add(Guard::other, "input holds, forward", F_forward - R, torque);
                add(Guard::other, "input holds, backward", F_backward + R, torque);
                const Series mu = (1 / m_.T_2R) * r.T_2;
                const Quad size = m_.i * torque / m_.T_2R;
                between("standstill cell forward, lower", "standstill cell forward, upper", mu, c.forward->range, size);
                between("standstill cell backward, lower", "standstill cell backward, upper", -mu, c.backward->range,
                        size);
            } else {
                add(Guard::other, "input holds, forward", -R + m_.T_10, torque);
                add(Guard::other, "input holds, backward", R + m_.T_10, torque);
            }
        } else if (c.modes.input != absent) {
            add(Guard::speed_of_input, "speed of the input", c.modes.input * r.w_M, sizes.input_speed);
            if (c.cell) {
                const Series mu = (c.modes.input / m_.T_2R) * r.T_2, v = (c.modes.input / m_.n_1R) * r.w_M;
                for (const Form2& edge : c.cell->inside)
                    add(Guard::other, "map cell", edge.per_load * mu + edge.per_speed * v + edge.at_zero,
                        magnitude(edge.per_load) * m_.i * torque / m_.T_2R +
                            magnitude(edge.per_speed) * sizes.input_speed / m_.n_1R + magnitude(edge.at_zero));
            }
        }
        if (c.modes.twist == stuck && !m_.rigid) {
            const Series lambda = r.T_2 - c.piece->slope * r.d - c.piece->offset;
            add(Guard::other, "twist holds, forward", -lambda + c.h, m_.i * torque);
            add(Guard::other, "twist holds, backward", lambda + c.h, m_.i * torque);
        } else if (c.modes.twist != stuck && c.modes.twist != absent) {
            add(Guard::speed_of_twist, "speed of the twist", c.modes.twist * ((1 / m_.i) * r.w_M - r.w),
                sizes.input_speed / m_.i);
        }
        if (c.modes.load == stuck) {
            const Series R = r.T_2 - M_Z;
            add(Guard::other, "load holds, forward", -R + m_.T_f, m_.i * torque + m_.T_f);
            add(Guard::other, "load holds, backward", R + m_.T_f, m_.i * torque + m_.T_f);
        } else if (c.modes.load != absent) {
            add(Guard::speed_of_load, "speed of the load", c.modes.load * r.w, sizes.input_speed / m_.i);
        }
    }

    void add_limits_of_held_torque(Motion& r, const Series& M_Z, Quad torque) const {
        const Combination& c = r.combination;
        const std::vector<TorqueLimit> limits = torque_limits(c, r.d[0], r.M_D, M_Z);
        for (int l = 0; l < static_cast<int>(limits.size()); ++l) {
            Guard guard;
            guard.name = limits[l].name;
            // The limits that push are differences of torques at the input or the output, the others of relative loads.
            const Quad least = l < limits_that_push() ? Quad(1) : Quad(0);
            guard.size = magnitude(limits[l].G[0]) + larger(magnitude(limits[l].q) * m_.i, least) * torque;
            if (l == c.pushed_by) {
                // As long as the limit moves against the torque, the torque goes with it.
                guard.name = "pushes the held torque";
                guard.c = -(r.step * derivative(limits[l].G));
            } else {
                guard.c = limits[l].G + limits[l].q * r.T_2;
            }
            r.guards.push_back(guard);
        }
    }

    const Model& m_;
};

}  // namespace lostmotion::test::referee
