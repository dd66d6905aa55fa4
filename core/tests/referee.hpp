// An independent solver to judge the others by: quadruple precision, Taylor series, and at every switching all
// combinations of contact modes, curve pieces and map cells tried one by one. Slow and plain.
//
// It shares the parameters of a drive with the library, and nothing else. The rules it follows are those of
// docs/theory.md, "The drive" and "Contacts".
#pragma once

#include <algorithm>
#include <cstdio>

#include "referee_motion.hpp"

namespace lostmotion::test::referee {

struct Case {
    Drive drive;
    Signals signals;
    State start{};                  // M_D, w_M, w, d, phi
    double duration = 1.0;          // [s]
    double sample_interval = 1e-3;  // [s]
    std::size_t max_switchings = 100000;
};

enum class Outcome {
    done,
    no_continuation,        // no combination is consistent: jammed
    several_continuations,  // several are, with different motions
    too_many_switchings
};

struct Switch {
    double time = 0.0;
    std::string cause;  // names of the guards that ended the combination, or "input"
    ContactModes before, after;
    double h = 0.0;    // [N m] after it
    double T_2 = 0.0;  // [N m] after it
};

struct Result {
    Outcome outcome = Outcome::done;
    std::string details;
    double time = 0.0;                  // [s] reached
    State x{};                          // there
    std::vector<State> samples;         // at k * sample_interval; right limits
    std::vector<double> output_torque;  // T_2 [N m], likewise
    std::vector<Switch> switchings;
    long steps = 0, combinations_tried = 0;
};

inline std::string text(Quad a) {
    char s[64];
    quadmath_snprintf(s, sizeof s, "%.20Qg", a);
    return s;
}

class Referee {
 public:
    explicit Referee(const Case& c) : case_(c), model_(c.drive), builder_(model_) {}

    Result run() {
        begin();
        Motion motion;
        if (!decide(motion, "start", ContactModes{})) return finish();
        const Quad end = case_.duration;
        while (t_ < end) {
            const Quad stop =
                earlier(earlier(end, next_knot_after(case_.signals[0], t_)), next_knot_after(case_.signals[1], t_));
            const bool whole = motion.step >= stop - t_;
            const Quad step = whole ? stop - t_ : motion.step;
            // What happens at a breakpoint to within rounding happens at the breakpoint: it is looked for a little
            // beyond it.
            const Quad same_instant = whole ? Quad(1e-26) * (stop + case_.duration) : Quad(0);
            std::vector<Quad> zeros;
            const Quad first = first_zeros(motion, step + same_instant, zeros);
            const bool switches = first < never;
            const bool at_stop = whole && first >= step - same_instant;
            const Quad used = at_stop || !switches ? step : first;
            sample(motion, used, at_stop ? stop : t_ + used);
            move(motion, used);
            if (at_stop) t_ = stop;
            ++result_.steps;
            std::string cause;
            if (switches) cause = apply(motion, zeros, larger(first, at_stop ? step : Quad(0)) + same_instant);
            if (at_stop && t_ < end) cause += cause.empty() ? "input" : ", input";
            if (cause.empty()) {
                continue_same(motion);
                continue;
            }
            if (result_.switchings.size() >= case_.max_switchings) {
                result_.outcome = Outcome::too_many_switchings;
                return finish();
            }
            if (!decide(motion, cause, motion.combination.modes)) return finish();
        }
        sample(motion, 0, end);
        return finish();
    }

 private:
    static constexpr double never = HUGE_VAL;
    static Quad earlier(Quad a, Quad b) { return a < b ? a : b; }
    static int sign(Quad a) { return a > 0 ? 1 : a < 0 ? -1 : 0; }

    Inputs inputs_at(Quad t) const { return {series(case_.signals[0], t), series(case_.signals[1], t)}; }

    void begin() {
        const auto [M_D, w_M, w, d, phi] = case_.start;
        x_ = {M_D, w_M, w, d, phi};
        if (model_.rigid) x_.w = x_.w_M / model_.i;
        T_2_ = model_.spring_torque(x_.d);
    }

    // Zeros of all guards within the step, from its start; returns the first.
    static Quad first_zeros(const Motion& motion, Quad step, std::vector<Quad>& zeros) {
        Quad first = never;
        for (const Guard& g : motion.guards) {
            Quad at = nowhere;
            if (!g.zero) {
                // Without the zero at the start itself.
                const Series p = without_zeros(stretched(g.c, step), g.zeros);
                const Quad size = g.zeros > 0 ? sum_of_magnitudes(p) : g.size;
                at = FirstZero::of(p, Quad(1e-28) * size);
            }
            zeros.push_back(at <= 1 ? at * step : Quad(never));
            first = earlier(first, zeros.back());
        }
        return first;
    }

    void sample(const Motion& m, Quad used, Quad end) {
        for (;; ++next_) {
            const Quad at = static_cast<double>(next_) * case_.sample_interval;
            if (at > case_.duration * (1.0 + 1e-15) || (at >= end && !(end == case_.duration && used == 0))) return;
            const Quad s = at - t_;
            result_.samples.push_back({static_cast<double>(value(m.M_D, s)), static_cast<double>(value(m.w_M, s)),
                                       static_cast<double>(value(m.w, s)), static_cast<double>(value(m.d, s)),
                                       static_cast<double>(value(m.phi, s))});
            result_.output_torque.push_back(static_cast<double>(value(m.T_2, s)));
        }
    }

    void move(const Motion& m, Quad s) {
        sizes_ = builder_.grown(sizes_, m);
        x_ = {value(m.M_D, s), value(m.w_M, s), value(m.w, s), value(m.d, s), value(m.phi, s)};
        T_2_ = value(m.T_2, s);
        t_ += s;
        // Speeds of stuck contacts are zero to the last bit.
        const ContactModes& modes = m.combination.modes;
        if (modes.twist == stuck) x_.w = x_.w_M / model_.i;
    }

    // Contacts that have stopped stop; the hysteresis is set anew.
    std::string apply(const Motion& m, const std::vector<Quad>& zeros, Quad latest) {
        std::string cause;
        bool input = m.combination.modes.input == stuck, twist = m.combination.modes.twist == stuck,
             load = m.combination.modes.load == stuck, turned = false;
        for (std::size_t k = 0; k < zeros.size(); ++k) {
            if (zeros[k] > latest + Quad(1e-22) * m.step) continue;
            cause += (cause.empty() ? "" : ", ") + std::string(m.guards[k].name);
            if (m.guards[k].kind == Guard::speed_of_input) input = true;
            if (m.guards[k].kind == Guard::speed_of_load) load = true;
            if (m.guards[k].kind == Guard::speed_of_twist) twist = turned = true;
        }
        // Two of the speeds w_M, w, w_M/i - w at zero bring the third there.
        if (input + twist + load >= 2) {
            x_.w_M = x_.w = 0;
            turned = turned || (m.combination.modes.twist != stuck && m.combination.modes.twist != absent);
        } else if (input) {
            x_.w_M = 0;
        } else if (load) {
            x_.w = 0;
        } else if (twist) {
            x_.w = x_.w_M / model_.i;
        }
        if (turned) h_ = model_.capacity_after_turning(x_.d);
        return cause;
    }

    void continue_same(Motion& motion) {
        const std::vector<Guard> before = motion.guards;
        motion = builder_.build(motion.combination, x_, inputs_at(t_), sizes_, case_.duration);
        for (std::size_t k = 0; k < before.size(); ++k) motion.guards[k].zero = before[k].zero;
    }

    // Signs of the derivatives at the start; false if the guard is negative just after it. `rest`: what decides if all
    // vanish.
    static bool holds(Guard& g, Quad step, bool rest) {
        // Over a time short enough that the terms of one exponential fall from the first on: a torque that creeps up to
        // its limit for ever, and is below rounding from it, is there.
        Quad power = 1;
        for (int k = 0; k <= order; ++k, power *= step / 16) {
            const Quad term = g.c[k] * power;
            if (magnitude(term) <= Quad(1e-25) * g.size) continue;
            g.zeros = k;
            return term > 0;
        }
        g.zero = true;
        return rest;
    }

    // The guard that fails, or nullptr. A contact that moves already needs no proof that it does.
    const Guard* failing(Motion& m) const {
        for (Guard& g : m.guards) {
            const bool moves = (g.kind == Guard::speed_of_input && x_.w_M != 0) ||
                               (g.kind == Guard::speed_of_load && x_.w != 0) ||
                               (g.kind == Guard::speed_of_twist && x_.w_M / model_.i != x_.w);
            if (moves) continue;
            if (!holds(g, m.step, g.kind == Guard::other)) return &g;
        }
        return nullptr;
    }

    std::vector<int> options(bool exists, Quad speed) const {
        if (!exists) return {absent};
        if (speed != 0) return {sign(speed)};
        return {+1, -1, stuck};
    }

    // All combinations that could hold by the values at this instant.
    std::vector<Combination> combinations(const Inputs& u) const {
        std::vector<Combination> all;
        const Quad twist_rate = x_.w_M / model_.i - x_.w;
        std::vector<int> amplifier{0}, twist = options(model_.twist_contact, twist_rate);
        if (model_.limits_voltage) amplifier = {0, 1, -1};
        if (model_.rigid) twist = {stuck};
        for (const int a : amplifier)
            for (const int input : options(model_.input_contact, x_.w_M))
                for (const int d : twist)
                    for (const int load : options(model_.load_contact, x_.w)) {
                        // Where two of the three are at rest, so is the third.
                        if ((input == stuck) + (d == stuck) + (load == stuck) == 2 && input != absent && d != absent &&
                            load != absent)
                            continue;
                        add_pieces(all, {a, input, d, load}, u);
                    }
        return all;
    }
    bool near(Quad value, const Range& r, Quad tolerance) const {
        return (r.open_below || value >= r.lower - tolerance) && (r.open_above || value <= r.upper + tolerance);
    }
    void add_pieces(std::vector<Combination>& all, const ContactModes& modes, const Inputs& u) const {
        Combination c;
        c.modes = modes;
        c.h = h_;
        c.kept_torque = T_2_;
        if (model_.rigid) add_cells(all, c, u);
        for (const CurvePiece& p : model_.pieces) {
            c.piece = &p;
            if (near(x_.d, p.range, Quad(1e-24) * sizes_.twist)) add_cells(all, c, u);
        }
    }
    void add_cells(std::vector<Combination>& all, Combination c, const Inputs& u) const {
        if (!model_.has_map) {
            all.push_back(c);
        } else if (c.modes.input == stuck) {
            // Whether T_2 is in the cell is seen later.
            for (const StandstillCell& f : model_.map.standstill())
                for (const StandstillCell& b : model_.map.standstill()) {
                    c.forward = &f;
                    c.backward = &b;
                    if (c.modes.all_stuck() || in_standstill_cells(c, u)) all.push_back(c);
                }
        } else {
            for (const MapCell& cell : model_.map.cells()) {
                c.cell = &cell;
                if (in_cell(c, u)) all.push_back(c);
            }
        }
    }
    bool in_standstill_cells(const Combination& c, const Inputs& u) const {
        const Quad mu = builder_.torque_at(c, x_, u) / model_.T_2R;
        const Quad tolerance = Quad(1e-22) * (1 + magnitude(mu));
        return near(mu, c.forward->range, tolerance) && near(-mu, c.backward->range, tolerance);
    }
    bool in_cell(const Combination& c, const Inputs& u) const {
        const Quad v = c.modes.input * x_.w_M / model_.n_1R;
        const Quad T_2 = builder_.torque_at(c, x_, u);
        if (isnanq(T_2)) return true;  // to be reported
        const Quad mu = c.modes.input * T_2 / model_.T_2R;
        const Quad size_mu = larger(magnitude(mu), model_.i * sizes_.input_torque / model_.T_2R);
        const Quad size_v = larger(v, sizes_.input_speed / model_.n_1R);
        for (const Form2& e : c.cell->inside)
            if (e(mu, v) < -Quad(1e-22) * (magnitude(e.at_zero) + magnitude(e.per_load) * size_mu +
                                           magnitude(e.per_speed) * size_v))
                return false;
        return true;
    }

    // While all contacts are at rest the torque is not determined: it keeps its value, or goes to the nearest that
    // twist and load can hold. If the input cannot hold that one, and no other combination is consistent, it goes to
    // the nearest that all three can hold (`with_input`). The torques that can be held are an interval for each curve
    // piece and pair of cells; nearest first.
    std::vector<Combination> held(const std::vector<Combination>& all, const Inputs& u, bool with_input) const {
        std::vector<std::pair<Quad, Combination>> found;
        for (Combination c : all) {
            if (!c.modes.all_stuck()) continue;
            const Series M_D = builder_.motor_torque_at_rest(c.modes.amplifier, x_.M_D, u.E);
            const std::vector<TorqueLimit> limits = builder_.torque_limits(c, x_.d, M_D, u.M_Z);
            const int that_push = builder_.limits_that_push() - (with_input ? 0 : 2);
            Quad low = -HUGE_VALQ, high = HUGE_VALQ;
            for (int l = 0; l < static_cast<int>(with_input ? limits.size() : that_push); ++l) {
                if (limits[l].q > 0) low = larger(low, -limits[l].G[0] / limits[l].q);
                if (limits[l].q < 0) high = earlier(high, -limits[l].G[0] / limits[l].q);
            }
            c.kept_torque = T_2_ < low ? low : T_2_ > high ? high : T_2_;
            const Quad distance = magnitude(c.kept_torque - T_2_);
            const Quad size = model_.i * sizes_.input_torque + magnitude(c.kept_torque) + magnitude(T_2_);
            found.push_back({distance, c});
            for (int l = 0; l < that_push; ++l) {
                const TorqueLimit& limit = limits[l];
                const Quad room = limit.G[0] + limit.q * c.kept_torque;
                if (!limit.pushes() || magnitude(room) > Quad(1e-24) * magnitude(limit.q) * size) continue;
                c.pushed_by = l;
                found.push_back({distance, c});
            }
        }
        std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
        std::vector<Combination> sorted;
        for (const auto& [distance, c] : found) sorted.push_back(c);
        return sorted;
    }

    bool same_motion(const Motion& a, const Motion& b) const {
        const Quad h = earlier(a.step, b.step);
        const auto same = [&](const Series& p, const Series& q, Quad size) {
            for (const Quad c : stretched(p - q, h))
                if (magnitude(c) > Quad(1e-24) * size) return false;
            return true;
        };
        if (!same(a.M_D, b.M_D, sizes_.input_torque) || !same(a.w_M, b.w_M, sizes_.input_speed) ||
            !same(a.w, b.w, sizes_.input_speed / model_.i) || !same(a.d, b.d, sizes_.twist))
            return false;
        return a.combination.modes.all_stuck() || same(a.T_2, b.T_2, model_.i * sizes_.input_torque);
    }

    // Those of the trials that are consistent and have different motions.
    std::vector<Motion> consistent(const std::vector<Combination>& trials, const Inputs& u, std::string& rejected) {
        std::vector<Motion> found;
        for (const Combination& c : trials) {
            ++result_.combinations_tried;
            Motion trial = builder_.build(c, x_, u, sizes_, case_.duration);
            const Guard* fails = trial.possible ? failing(trial) : nullptr;
            if (!trial.possible || fails) {
                rejected += "\n  " + c.modes.text() + ": ";
                if (fails)
                    rejected += std::string(fails->name) + ", derivative " + std::to_string(fails->zeros) + " is " +
                                text(fails->zero ? Quad(0) : fails->c[fails->zeros]);
                else
                    rejected += "no effective inertia";
                continue;
            }
            bool known = false;
            for (const Motion& other : found) known = known || same_motion(trial, other);
            if (!known) found.push_back(trial);
        }
        return found;
    }

    // The one consistent combination from here on.
    bool decide(Motion& motion, const std::string& cause, const ContactModes before) {
        const Inputs u = inputs_at(t_);
        sizes_ = builder_.grown(sizes_, x_, u, h_);
        const std::vector<Combination> all = combinations(u);
        std::vector<Combination> trials;
        for (const Combination& c : all)
            if (!c.modes.all_stuck()) trials.push_back(c);
        for (const Combination& c : held(all, u, false)) trials.push_back(c);
        std::string rejected;
        std::vector<Motion> found = consistent(trials, u, rejected);
        if (found.empty()) found = consistent(held(all, u, true), u, rejected);
        if (found.size() != 1) {
            result_.outcome = found.empty() ? Outcome::no_continuation : Outcome::several_continuations;
            result_.details = "t = " + text(t_) + ", after " + cause + ", modes before " + before.text() + "\n  M_D " +
                              text(x_.M_D) + ", w_M " + text(x_.w_M) + ", w " + text(x_.w) + ", d " + text(x_.d) +
                              ", h " + text(h_) + ", T_2 " + text(T_2_);
            for (const Motion& m : found)
                result_.details += "\n  consistent: " + m.combination.modes.text() + ", T_2 " + text(m.T_2[0]) +
                                   ", dw_M/dt " + text(m.w_M[1]) + ", dw/dt " + text(m.w[1]);
            result_.details += "\n  rejected:" + rejected;
            return false;
        }
        motion = found.front();
        start_from_rest(motion);
        if (cause != "start")
            result_.switchings.push_back({static_cast<double>(t_), cause, before, motion.combination.modes,
                                          static_cast<double>(h_), static_cast<double>(motion.T_2[0])});
        return true;
    }

    // Derivatives found to vanish vanish to the last bit.
    static void start_from_rest(Motion& m) {
        for (const Guard& g : m.guards)
            for (int k = 0; k < g.zeros; ++k) {
                if (g.kind == Guard::speed_of_input) m.w_M[k] = 0;
                if (g.kind == Guard::speed_of_load) m.w[k] = 0;
            }
    }

    Result finish() {
        result_.time = static_cast<double>(t_);
        result_.x = {static_cast<double>(x_.M_D), static_cast<double>(x_.w_M), static_cast<double>(x_.w),
                     static_cast<double>(x_.d), static_cast<double>(x_.phi)};
        return result_;
    }

    const Case case_;
    const Model model_;
    const MotionBuilder builder_;
    Result result_;
    Quad t_ = 0, h_ = 0, T_2_ = 0;  // T_2: its last value
    Point x_;
    Sizes sizes_;
    std::size_t next_ = 0;  // sample
};

inline Result referee_run(const Case& c) { return Referee(c).run(); }

}  // namespace lostmotion::test::referee
