// A referee for trains that shares no code with the model: time stepping after Moreau. Each step of fixed length solves
// for speeds and contact torques at its end together (implicit Euler), all combinations of modes being tried where the
// last one does not hold. Friction acts on speeds, not accelerations: there are no events, guards, pieces or
// derivatives that could be wrong in the same way. It converges with the first power of the step.
//
// J. J. Moreau: Unilateral contact and dry friction in finite freedom dynamics, CISM Courses 302 (1988) 1-82.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "lostmotion/base/signal.hpp"
#include "lostmotion/model/train.hpp"

namespace lostmotion::model {

// The value of a signal, without the solvers' machinery.
inline double plain_value(const Signal& s, double t) {
    const Breakpoint* b = &s.breakpoints.front();
    for (const Breakpoint& k : s.breakpoints)
        if (k.time <= t) b = &k;
    double sum = b->value + b->slope * (t - b->time);
    for (const Sine& w : s.sines) sum += w.amplitude * std::sin(2.0 * std::numbers::pi * w.frequency * t + w.phase);
    return sum;
}

class TrainSteps {
 public:
    // inputs: motors, loads of loaded shafts, brakes, commanded clutches, in this order.
    TrainSteps(const Train& train, const std::vector<Signal>& inputs) : train_(train), inputs_(inputs) {
        const auto shafts = train.shafts.size();
        speed.assign(shafts, 0.0);
        angle.assign(shafts, 0.0);
        twist.assign(train.gears.size(), 0.0);
        output_torque.assign(train.gears.size(), 0.0);
        capacity.assign(train.gears.size(), 0.0);
        motor_torque.assign(train.motors.size(), 0.0);
        direction_.assign(train.gears.size(), 0);
        inertia_.assign(shafts, 0.0);
        viscous_.assign(shafts, 0.0);
        bearing_.assign(shafts, 0.0);
        for (std::size_t s = 0; s < shafts; ++s) {
            inertia_[s] = train.shafts[s].inertia;
            viscous_[s] = train.shafts[s].viscous_friction;
        }
        for (const ShaftMotor& m : train.motors) {
            inertia_[at(m.shaft)] += m.law.rotor_inertia;
            bearing_[at(m.shaft)] += m.law.friction_torque;
        }
        for (const Gear& g : train.gears) {
            inertia_[at(g.input)] += g.law.inertia;
            if (g.housing < 0) viscous_[at(g.input)] += g.law.viscous_friction;
        }
        place_contacts();
    }

    std::vector<double> speed, angle, twist, motor_torque, capacity, output_torque;
    bool stopped = false;  // no combination of modes is consistent
    long searches = 0;

    void run(double duration, long steps) {
        for (long k = 0; k < steps && !stopped; ++k) step(duration * static_cast<double>(k) / steps, duration / steps);
    }
    void step(double t, double h) {
        see_inputs(t + 0.5 * h);
        h_ = h;
        choose_flanks();
        for (int again = 0; again < 3; ++again) {
            if (!solve_modes()) {
                stopped = true;
                return;
            }
            if (!turning_points()) break;
        }
        accept();
    }

 private:
    static constexpr int max_unknowns = 160;
    static constexpr double slack = 1e-8;  // of a speed or, relative to 1 N m, a torque
    // sum_k c[k] z[k] + one, z: [speeds at the end of the step][torques of the contacts]
    struct Linear {
        std::array<double, max_unknowns> c{};
        double one = 0.0;
        void add(const Linear& o, double factor) {
            for (int k = 0; k < max_unknowns; ++k) c[at(k)] += factor * o.c[at(k)];
            one += factor * o.one;
        }
    };
    struct Capacity {
        double slipping = 0.0, holding = 0.0;
    };
    enum What { of_shaft, of_gear, of_clutch, of_freewheel };
    struct Place {
        What what;
        int element;
    };
    // flanks: of each gear, whether damping acts (1), has the torque of the spring (2), they have parted (-1) or
    // neither (0).
    struct Modes {
        std::vector<int> contact, overrun, flanks;
    };

    template <class T>
    static std::size_t at(T k) {
        return static_cast<std::size_t>(k);
    }
    const Gear& gear(int g) const { return train_.gears[at(g)]; }
    static bool is_coupling(const Place& p) { return p.what == of_clutch || p.what == of_freewheel; }
    std::pair<int, int> joined(const Place& p) const {
        if (p.what == of_freewheel)
            return {train_.freewheels[at(p.element)].input, train_.freewheels[at(p.element)].output};
        return {train_.clutches[at(p.element)].input, train_.clutches[at(p.element)].output};
    }
    int shafts() const { return static_cast<int>(train_.shafts.size()); }
    int gears() const { return static_cast<int>(train_.gears.size()); }
    int unknowns() const { return shafts() + static_cast<int>(places_.size()); }
    bool lossy(int g) const { return gear(g).efficiencies.has_value() || gear(g).law.losses == Gearbox::loss_map; }

    void place_contacts() {
        shaft_contact_.assign(train_.shafts.size(), -1);
        gear_contact_.assign(train_.gears.size(), -1);
        for (int s = 0; s < shafts(); ++s) {
            const DryFriction& f = train_.shafts[at(s)].friction;
            bool dry = bearing_[at(s)] > 0.0 || f.torque > 0.0 || f.breakaway_torque > 0.0 || !f.torques.empty();
            for (const Brake& b : train_.brakes) dry |= b.shaft == s;
            for (int g = 0; g < gears(); ++g) dry |= gear(g).input == s && lossy(g);
            if (!dry) continue;
            shaft_contact_[at(s)] = static_cast<int>(places_.size());
            places_.push_back({of_shaft, s});
        }
        for (int g = 0; g < gears(); ++g) {
            const Gearbox& law = gear(g).law;
            if (law.compliance != Gearbox::rigid && !(law.hysteresis_efficiency < 1.0)) continue;
            gear_contact_[at(g)] = static_cast<int>(places_.size());
            places_.push_back({of_gear, g});
        }
        for (std::size_t k = 0; k < train_.clutches.size(); ++k) places_.push_back({of_clutch, static_cast<int>(k)});
        for (std::size_t k = 0; k < train_.freewheels.size(); ++k)
            places_.push_back({of_freewheel, static_cast<int>(k)});
        modes_.contact.assign(places_.size(), 0);
        modes_.overrun.assign(train_.gears.size(), 0);
        modes_.flanks.assign(train_.gears.size(), 0);
    }

    void see_inputs(double t) {
        std::size_t next = 0;
        const auto take = [&] { return next < inputs_.size() ? plain_value(inputs_[next++], t) : 0.0; };
        command_.clear();
        for (std::size_t m = 0; m < train_.motors.size(); ++m) command_.push_back(take());
        load_.assign(train_.shafts.size(), 0.0);
        for (std::size_t s = 0; s < train_.shafts.size(); ++s)
            if (train_.shafts[s].loaded) load_[s] = take();
        brake_.assign(train_.shafts.size(), {});
        clutch_.clear();
        for (const Brake& b : train_.brakes) {
            const double engaged = std::clamp(take(), 0.0, 1.0);
            brake_[at(b.shaft)].slipping += b.torque * engaged;
            brake_[at(b.shaft)].holding += std::max(b.torque, b.breakaway_torque) * engaged;
        }
        for (const Clutch& c : train_.clutches) {
            const double engaged = c.safety ? 1.0 : std::clamp(take(), 0.0, 1.0);
            clutch_.push_back({c.torque * engaged, std::max(c.torque, c.breakaway_torque) * engaged});
        }
    }

    Linear speed_of(int s) const {
        Linear f;
        f.c[at(s)] = 1.0;
        return f;
    }
    Linear torque_of(int contact) const {
        Linear f;
        f.c[at(shafts() + contact)] = 1.0;
        return f;
    }
    // Of the input shaft of a gear to its housing.
    double relative(int g, const std::vector<double>& of) const {
        return of[at(gear(g).input)] - (gear(g).housing < 0 ? 0.0 : of[at(gear(g).housing)]);
    }
    double error_slope(int g) const {
        const PeriodicCurve& e = gear(g).transmission_error;
        if (!e.present()) return 0.0;
        constexpr double small = 1e-7;
        const double phi = relative(g, angle) + 0.5 * h_ * relative(g, speed);
        return (e(phi + small) - e(phi - small)) / (2.0 * small);
    }
    Linear twist_rate(int g) const {
        Linear f;
        f.c[at(gear(g).input)] += 1.0 / gear(g).law.ratio - error_slope(g);
        f.c[at(gear(g).output)] -= 1.0;
        if (gear(g).housing >= 0) f.c[at(gear(g).housing)] += 1.0 - 1.0 / gear(g).law.ratio + error_slope(g);
        return f;
    }
    // Of the stiffness, in the middle of the step.
    double factor(int g) const {
        const PeriodicCurve& mesh = gear(g).mesh_stiffness;
        if (!mesh.present()) return 1.0;
        const double phi = relative(g, angle) + 0.5 * h_ * relative(g, speed);
        return mesh.value(mesh.piece(phi - mesh.turn(phi)));
    }
    double spring(int g, double d) const { return factor(g) * gear(g).law.curve.torque(d); }
    bool has_gap(int g) const { return gear(g).law.curve.torque(1e-12) == 0.0; }
    void choose_flanks() {
        for (int g = 0; g < gears(); ++g) {
            if (gear(g).law.compliance == Gearbox::rigid || gear(g).mesh_damping == 0.0) continue;
            modes_.flanks[at(g)] = has_gap(g) && gear(g).law.curve.torque(twist[at(g)]) == 0.0 ? 0 : 1;
            if (modes_.flanks[at(g)] == 0 || !has_gap(g)) continue;
            const double rate = value(twist_rate(g), speed);
            const double P = spring(g, twist[at(g)]);
            const double damping = gear(g).mesh_damping * rate;
            if (P * (P + damping) < 0.0) modes_.flanks[at(g)] = -1;
            if (gear(g).damping_limited && P * (damping - P) > 0.0) modes_.flanks[at(g)] = 2;
        }
    }
    // T_2 at the end of the step.
    Linear mesh_torque(int g, const Modes& m) const {
        const Gear& e = gear(g);
        const int contact = gear_contact_[at(g)];
        if (e.law.compliance == Gearbox::rigid) return torque_of(contact);
        Linear f;
        if (m.flanks[at(g)] < 0) return f;
        const Linear rate = twist_rate(g);
        // The slope of the curve in the direction in which the twist goes is found by one small difference.
        constexpr double small = 1e-9;
        const double P = spring(g, twist[at(g)]);
        const double way = value(rate, speed) >= 0.0 ? small : -small;
        f.one = P;
        f.add(rate, h_ * (spring(g, twist[at(g)] + way) - P) / way);
        if (m.flanks[at(g)] == 1) f.add(rate, e.mesh_damping);
        if (m.flanks[at(g)] == 2) {
            f.one += f.one;
            f.add(rate, h_ * (spring(g, twist[at(g)] + way) - P) / way);
        }
        if (contact >= 0) f.add(torque_of(contact), 1.0);
        return f;
    }
    // Loss of a mesh against the motion of its input shaft in direction s [N m at the input], of a load that it drives
    // or, `overrun`, that drives it.
    Linear mesh_loss(int g, double s, bool overrun, bool at_rest, const Linear& T_2) const {
        const Gear& e = gear(g);
        Linear f;
        double per_load;
        if (e.efficiencies) {
            per_load = overrun ? -(1.0 - e.efficiencies->overrunning()) : 1.0 / e.efficiencies->driving() - 1.0;
        } else {
            // A plane on either side of mu = 0, read off three of its points.
            const double mu = overrun ? -1.0 : 1.0, at_zero = e.law.map(0.0, 0.0), loaded = e.law.map(mu, 0.0);
            per_load = (loaded - at_zero) / mu;
            f.one = e.law.rated_output_torque * at_zero / e.law.ratio;
            if (!at_rest)
                f.c[at(e.input)] += s * e.law.rated_output_torque * (e.law.map(0.0, 1.0) - at_zero) /
                                    e.law.rated_input_speed / e.law.ratio;
        }
        f.add(T_2, s * per_load / e.law.ratio);
        return f;
    }
    // What a shaft takes at most while it slips in direction s, or holds before it does.
    Linear shaft_capacity(int s, double way, bool at_rest, const std::vector<Linear>& T_2,
                          const std::vector<double>* torque) const {
        const DryFriction& law = train_.shafts[at(s)].friction;
        Linear f;
        const double sliding = law.sliding(std::fabs(speed[at(s)]));
        f.one = bearing_[at(s)] + (at_rest ? brake_[at(s)].holding + std::max(law.breakaway_torque, law.sliding(0.0))
                                           : brake_[at(s)].slipping + sliding);
        for (int g = 0; g < gears(); ++g) {
            if (gear(g).input != s || !lossy(g)) continue;
            const bool overrun = torque != nullptr ? way * (*torque)[at(g)] < 0.0 : trial_.overrun[at(g)] != 0;
            f.add(mesh_loss(g, way, overrun, at_rest, T_2[at(g)]), 1.0);
        }
        return f;
    }

    // All equations, linear in z.
    bool solve(std::vector<double>& z, std::vector<double>& T_2_values) const {
        const int n = unknowns();
        std::vector<Linear> T_2;
        for (int g = 0; g < gears(); ++g) T_2.push_back(mesh_torque(g, trial_));
        std::array<Linear, max_unknowns> row{};
        for (int s = 0; s < shafts(); ++s) momentum(s, T_2, row[at(s)]);
        for (std::size_t k = 0; k < places_.size(); ++k) row[at(shafts()) + k] = contact_row(static_cast<int>(k), T_2);
        z.assign(at(n), 0.0);
        for (int k = 0; k < n; ++k) {
            int pivot = k;
            for (int r = k + 1; r < n; ++r)
                if (std::fabs(row[at(r)].c[at(k)]) > std::fabs(row[at(pivot)].c[at(k)])) pivot = r;
            std::swap(row[at(k)], row[at(pivot)]);
            const double p = row[at(k)].c[at(k)];
            if (std::fabs(p) < 1e-13) return false;
            for (int r = k + 1; r < n; ++r) {
                const double factor = row[at(r)].c[at(k)] / p;
                if (factor == 0.0) continue;
                for (int c = k; c < n; ++c) row[at(r)].c[at(c)] -= factor * row[at(k)].c[at(c)];
                row[at(r)].one -= factor * row[at(k)].one;
            }
        }
        for (int k = n - 1; k >= 0; --k) {
            double sum = -row[at(k)].one;
            for (int c = k + 1; c < n; ++c) sum -= row[at(k)].c[at(c)] * z[at(c)];
            z[at(k)] = sum / row[at(k)].c[at(k)];
        }
        T_2_values.clear();
        for (const Linear& f : T_2) T_2_values.push_back(value(f, z));
        return true;
    }
    static double value(const Linear& f, const std::vector<double>& z) {
        double sum = f.one;
        for (std::size_t k = 0; k < z.size(); ++k) sum += f.c[k] * z[k];
        return sum;
    }
    // h/J (sum of torques) - (w - w_before) = 0
    void momentum(int s, const std::vector<Linear>& T_2, Linear& row) const {
        for (std::size_t m = 0; m < train_.motors.size(); ++m)
            if (train_.motors[m].shaft == s) row.add(drive(m), 1.0);
        for (int g = 0; g < gears(); ++g) {
            if (gear(g).output == s) row.add(T_2[at(g)], 1.0);
            const double efficiency =
                lossy(g) || gear(g).law.losses != Gearbox::constant_efficiency ? 1.0 : gear(g).law.efficiency;
            const double per_T_2 = (1.0 / gear(g).law.ratio - error_slope(g)) / efficiency;
            if (gear(g).input == s) row.add(T_2[at(g)], -per_T_2);
            if (gear(g).housing == s) row.add(T_2[at(g)], per_T_2 - 1.0);
            if (gear(g).housing < 0 || (gear(g).input != s && gear(g).housing != s)) continue;
            const double b = gear(g).input == s ? gear(g).law.viscous_friction : -gear(g).law.viscous_friction;
            row.c[at(gear(g).input)] -= b;
            row.c[at(gear(g).housing)] += b;
        }
        for (std::size_t k = 0; k < places_.size(); ++k) {
            if (places_[k].what == of_shaft && places_[k].element == s) row.add(torque_of(static_cast<int>(k)), -1.0);
            if (!is_coupling(places_[k])) continue;
            const auto [input, output] = joined(places_[k]);
            if (input == s) row.add(torque_of(static_cast<int>(k)), -1.0);
            if (output == s) row.add(torque_of(static_cast<int>(k)), 1.0);
        }
        for (const Damper& d : train_.dampers) {
            if (d.input != s && d.output != s) continue;
            const double way = d.input == s ? -1.0 : 1.0, slip = speed[at(d.input)] - speed[at(d.output)];
            const double per_slip = d.drag.slope(d.drag.locate(slip));
            row.one += way * (d.drag.torque(slip) - per_slip * slip);
            row.c[at(d.input)] += way * (per_slip + d.viscous_friction);
            row.c[at(d.output)] -= way * (per_slip + d.viscous_friction);
        }
        for (const AngleTorque& t : train_.angle_torques)
            if (t.shaft == s) row.one += t.torque(angle[at(s)] + 0.5 * h_ * speed[at(s)]);
        const TorsionCurve& drag = train_.shafts[at(s)].drag;
        const double w = speed[at(s)], slope = drag.slope(drag.locate(w));
        row.one -= load_[at(s)] + drag.torque(w) - slope * w;
        row.c[at(s)] -= viscous_[at(s)] + slope;
        const double scale = h_ / inertia_[at(s)];
        for (double& c : row.c) c *= scale;
        row.one = row.one * scale + w;
        row.c[at(s)] -= 1.0;
    }
    // tau M' + M = k_N E - (k_N - 1) w/w_R, in units of the rated torque, at the end of the step.
    Linear drive(std::size_t m) const {
        const ShaftMotor& e = train_.motors[m];
        Linear f;
        if (e.law.kind == Motor::torque_source) {
            f.one = std::clamp(e.law.rated_torque * command_[m], -e.torque_limit, e.torque_limit);
            return f;
        }
        const double voltage = std::clamp(command_[m], -e.law.voltage_limit, e.law.voltage_limit),
                     k = e.law.armature_voltage_constant, gain = h_ / e.law.electrical_time_constant;
        f.one = (motor_torque[m] + gain * e.law.rated_torque * k * voltage) / (1.0 + gain);
        f.c[at(e.shaft)] = -gain * e.law.rated_torque * (k - 1.0) / e.law.rated_speed / (1.0 + gain);
        return f;
    }
    Linear contact_speed(int k) const {
        const Place& p = places_[at(k)];
        if (p.what == of_shaft) return speed_of(p.element);
        if (p.what == of_gear) return twist_rate(p.element);
        const auto [input, output] = joined(p);
        Linear f = speed_of(input);
        f.c[at(output)] -= 1.0;
        return f;
    }
    Linear contact_row(int k, const std::vector<Linear>& T_2) const {
        const Place& p = places_[at(k)];
        const int mode = trial_.contact[at(k)];
        Linear f;
        if (mode == 0) {
            f = contact_speed(k);
            f.c[at(shafts() + k)] += 1e-10;  // where several contacts keep one speed at zero they share
            return f;
        }
        if (p.what == of_shaft) f = shaft_capacity(p.element, mode, false, T_2, nullptr);
        if (p.what == of_gear) f.one = capacity[at(p.element)];
        if (p.what == of_clutch) f.one = clutch_[at(p.element)].slipping;
        for (double& c : f.c) c *= mode;
        f.one *= mode;
        f.c[at(shafts() + k)] -= 1.0;
        return f;
    }

    // Are the modes of trial_ consistent? The side of each loss law follows from the torques.
    bool consistent() {
        for (int g = 0; g < gears(); ++g) trial_.overrun[at(g)] = modes_.overrun[at(g)];
        for (int pass = 0; pass < 4; ++pass) {
            if (!solve(z_, T_2_)) return false;
            if (!sides_hold()) continue;
            return contacts_hold();
        }
        return false;
    }
    // False, and set to what the torques say, if a loss law is on its wrong side.
    bool sides_hold() {
        bool hold = true;
        for (int g = 0; g < gears(); ++g) {
            if (!lossy(g)) continue;
            const int s = trial_.contact[at(shaft_contact_[at(gear(g).input)])];
            if (s == 0) continue;
            const int side = s * T_2_[at(g)] < 0.0 ? 1 : 0;
            if (side != trial_.overrun[at(g)] && std::fabs(T_2_[at(g)]) > slack) hold = false;
            trial_.overrun[at(g)] = side;
        }
        return hold;
    }
    bool contacts_hold() const {
        std::vector<Linear> T_2;
        for (int g = 0; g < gears(); ++g) T_2.push_back(mesh_torque(g, trial_));
        for (std::size_t k = 0; k < places_.size(); ++k) {
            const Place& p = places_[k];
            const int mode = trial_.contact[k];
            const double torque = z_[at(shafts()) + k];
            if (mode != 0) {
                if (mode * value(contact_speed(static_cast<int>(k)), z_) < -slack) return false;
                continue;
            }
            double forward = 0.0, backward = 0.0;
            if (p.what == of_shaft) {
                forward = value(shaft_capacity(p.element, 1.0, true, T_2, &T_2_), z_);
                backward = value(shaft_capacity(p.element, -1.0, true, T_2, &T_2_), z_);
            } else if (p.what == of_gear) {
                if (gear(p.element).law.compliance == Gearbox::rigid) continue;
                forward = backward = capacity[at(p.element)];
            } else {
                const bool freewheel = p.what == of_freewheel;
                forward = freewheel ? 1e300 : clutch_[at(p.element)].holding;
                backward = freewheel ? 0.0 : forward;
            }
            if (torque > forward + slack || -torque > backward + slack) return false;
        }
        return true;
    }

    bool holds_more(const Place& p) const {
        if (p.what == of_gear || p.what == of_freewheel) return false;
        if (p.what == of_clutch) return clutch_[at(p.element)].holding > clutch_[at(p.element)].slipping;
        const DryFriction& law = train_.shafts[at(p.element)].friction;
        return brake_[at(p.element)].holding > brake_[at(p.element)].slipping ||
               law.breakaway_torque > law.sliding(0.0);
    }
    bool solve_modes() {
        trial_ = modes_;
        if (consistent()) return true;
        ++searches;
        // By the number of contacts that slip; what holds more than it takes while it slips breaks away last.
        std::vector<std::vector<int>> all{{}};
        for (const Place& p : places_) {
            const bool rigid = p.what == of_gear && gear(p.element).law.compliance == Gearbox::rigid;
            const bool one_way = p.what == of_freewheel;
            std::vector<std::vector<int>> longer;
            for (const auto& m : all)
                for (const int mode : {0, -1, 1}) {
                    if ((rigid && mode != 0) || (one_way && mode > 0)) continue;
                    longer.push_back(m);
                    longer.back().push_back(mode);
                }
            all = std::move(longer);
        }
        const auto slips = [&](const std::vector<int>& m) {
            int count = 0;
            for (std::size_t k = 0; k < m.size(); ++k)
                if (m[k] != 0) count += modes_.contact[k] == 0 && holds_more(places_[k]) ? 101 : 100;
            return count;
        };
        std::stable_sort(all.begin(), all.end(), [&](const auto& a, const auto& b) { return slips(a) < slips(b); });
        for (const auto& m : all) {
            trial_.contact = m;
            if (consistent()) return true;
        }
        return false;
    }

    // Sets the capacity of each twist anew that has stopped or turned; true if any has.
    bool turning_points() {
        bool any = false;
        for (int g = 0; g < gears(); ++g) {
            const int k = gear_contact_[at(g)];
            if (k < 0 || gear(g).law.compliance == Gearbox::rigid) continue;
            const int now = direction(g);
            if (direction_[at(g)] == 0 || now == direction_[at(g)]) continue;
            capacity[at(g)] = 0.5 * (1.0 - gear(g).law.hysteresis_efficiency) * std::fabs(spring(g, twist[at(g)]));
            direction_[at(g)] = 0;
            any = true;
        }
        return any;
    }
    int direction(int g) const {
        const double rate = value(twist_rate(g), z_);
        if (trial_.contact[at(gear_contact_[at(g)])] == 0 || std::fabs(rate) < 1e-9) return 0;
        return rate > 0.0 ? 1 : -1;
    }
    void accept() {
        modes_ = trial_;
        for (int g = 0; g < gears(); ++g) {
            output_torque[at(g)] = T_2_[at(g)];
            if (gear(g).law.compliance == Gearbox::rigid) continue;
            if (gear_contact_[at(g)] >= 0) direction_[at(g)] = direction(g);
            const PeriodicCurve& e = gear(g).transmission_error;
            const double phi = relative(g, angle), turned = h_ * relative(g, z_);
            twist[at(g)] += h_ * z_[at(gear(g).input)] / gear(g).law.ratio - h_ * z_[at(gear(g).output)];
            if (gear(g).housing >= 0) twist[at(g)] += (1.0 - 1.0 / gear(g).law.ratio) * h_ * z_[at(gear(g).housing)];
            if (e.present()) twist[at(g)] -= e(phi + turned) - e(phi);
        }
        for (std::size_t m = 0; m < train_.motors.size(); ++m) motor_torque[m] = value(drive(m), z_);
        for (int s = 0; s < shafts(); ++s) {
            speed[at(s)] = z_[at(s)];
            angle[at(s)] += h_ * speed[at(s)];
        }
        for (std::size_t k = 0; k < places_.size(); ++k)
            if (places_[k].what == of_shaft && modes_.contact[k] == 0) speed[at(places_[k].element)] = 0.0;
    }

    const Train& train_;
    std::vector<Signal> inputs_;
    std::vector<double> inertia_, viscous_, bearing_;
    std::vector<Place> places_;
    std::vector<int> shaft_contact_, gear_contact_, direction_;
    std::vector<double> command_, load_, z_, T_2_;
    std::vector<Capacity> brake_, clutch_;
    Modes modes_, trial_;
    double h_ = 0.0;
};

}  // namespace lostmotion::model
