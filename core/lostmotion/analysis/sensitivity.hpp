// How the state at the end of a run depends on that at its beginning: the product of the matrix exponentials of the
// regimes and of the jump (saltation) matrices at the switchings. Exact away from grazing.
#pragma once

#include <optional>

#include "../drive/contact.hpp"
#include "../simulation/result_names.hpp"
#include "../solver/exact_solver.hpp"

namespace lostmotion {

// What a motion is made of between two instants: the states, and what the drive remembers.
enum Component : int { hysteresis_component = n_states, locked_component, n_components };

inline const char* component_name(int k) {
    return k < n_states                ? state_names[static_cast<std::size_t>(k)].name
           : k == hysteresis_component ? "hysteresis_capacity"
                                       : "locked_torque";
}

using Components = std::array<double, n_components>;

struct Jacobian {
    std::array<Components, n_components> row{};

    static Jacobian identity() {
        Jacobian j;
        for (int k = 0; k < n_components; ++k) j.row[k][k] = 1.0;
        return j;
    }
    friend Jacobian operator*(const Jacobian& a, const Jacobian& b) {
        Jacobian out;
        for (int r = 0; r < n_components; ++r)
            for (int k = 0; k < n_components; ++k)
                if (a.row[r][k] != 0.0)
                    for (int c = 0; c < n_components; ++c) out.row[r][c] += a.row[r][k] * b.row[k][c];
        return out;
    }
};

// Gradient of a form over the components.
inline Components gradient(const LinearForm& f) {
    Components g{};
    for (int k = 0; k < n_states; ++k) g[k] = f.c[k];
    g[hysteresis_component] = f.c[hysteresis_capacity];
    g[locked_component] = f.c[locked_torque];
    return g;
}

// Observer of the exact solver. At a switching where a guard g falls through zero the components jump from y to R(y,
// t); a disturbance of y shifts the instant, too, so that it becomes (Leine and Nijmeijer 2004)
//     (dR + (f_after - dR f_before - R_t) grad g / g') times itself.
class Sensitivity {
 public:
    Sensitivity(const Drive& drive, RegimeCache<SwitchedDrive>& cache) : drive_(drive), cache_(cache) {}

    Jacobian jacobian = Jacobian::identity();
    State magnitude{};   // largest magnitude of each state at the ends of the segments
    bool smooth = true;  // false: a switching by grazing, or with a rate that is lost in rounding

    bool segment(const Segment<SwitchedDrive>& s) {
        if (!input_) input_.emplace(s.at.input());
        for (int k = 0; k < n_states; ++k)
            magnitude[k] = std::fmax(magnitude[k], std::fmax(std::fabs(s.at.x()[k]), std::fabs(s.x_end[k])));
        const Regime& r = s.entry.regime;
        regime_ = &r;
        x_ = s.x_end;
        memory_ = s.memory;
        if (!(s.end > s.begin)) return true;
        const auto G = s.entry.propagator.integral(s.end - s.begin);
        // x(s) = x + G x', column by column.
        for (int c = 0; c < n_components; ++c) {
            State rate{};
            for (int row = 0; row < n_states; ++row) {
                const Components g = gradient(r.rate[row]);
                for (int k = 0; k < n_components; ++k) rate[row] += g[k] * jacobian.row[k][c];
            }
            State change;
            (G * load(rate)).store(change.data());
            for (int row = 0; row < n_states; ++row) jacobian.row[row][c] += change[row];
        }
        return true;
    }

    void switching(const Switching& w) {
        const Regime &old = *regime_, &next = cache_.regime(w.after);
        input_->anchor_left(w.time);
        const auto u = input_->jet<2>();
        Jacobian jump = Jacobian::identity();
        const Components reset_rate = reset(w, old, u, jump);
        if (w.guard >= 0) {
            const Guard& guard = old.guards[w.guard];
            const Components f = flow(old, x_, memory_, u[0]), after = flow(next, w.x, w.memory, u[0]);
            State rate{};
            std::copy_n(f.begin(), n_states, rate.begin());
            const double fall = evaluate_rate(guard.form, rate, u[1]);
            double noise = 0.0;
            for (int k = 0; k < n_states; ++k) noise += std::fabs(guard.form.c[k] * rate[k]);
            noise = rounding * (noise + std::fabs(guard.form.c[command] * u[1][0]) +
                                std::fabs(guard.form.c[load_torque] * u[1][1]));
            if (!(fall < -noise)) {
                smooth = false;
            } else {
                const Components g = gradient(guard.form);
                Components gap = after;
                for (int r = 0; r < n_components; ++r) {
                    gap[r] -= reset_rate[r];
                    for (int k = 0; k < n_components; ++k) gap[r] -= jump.row[r][k] * f[k];
                }
                for (int r = 0; r < n_components; ++r)
                    for (int c = 0; c < n_components; ++c) jump.row[r][c] += gap[r] * g[c] / fall;
            }
        }
        jacobian = jump * jacobian;
    }

 private:
    using InputRates = std::array<std::array<double, n_inputs>, 2>;

    static Components flow(const Regime& r, const State& x, const Memory& m, const std::array<double, n_inputs>& u) {
        Components f{};
        for (int k = 0; k < n_states; ++k) f[k] = evaluate(r.rate[k], x, m, u);
        return f;
    }

    // Derivative of what a switching sets anew: speeds that stop, the hysteresis, the locked torque. Returns its
    // derivative with respect to time.
    Components reset(const Switching& w, const Regime& old, const InputRates& u, Jacobian& jump) const {
        Components time_rate{};
        std::array<bool, n_contacts> at_rest = old.at_rest;
        if (w.guard >= 0 && w.kind == Guard::speed) at_rest[w.contact] = true;
        if (at_rest[0] + at_rest[1] + at_rest[2] >= 2) at_rest = {true, true, true};
        if (at_rest[input_contact]) jump.row[motor_speed] = {};
        if (at_rest[load_contact]) jump.row[load_speed] = {};
        if (at_rest[twist_contact]) {
            jump.row[load_speed] = {};
            if (!at_rest[load_contact])
                for (int c = 0; c < n_components; ++c)
                    jump.row[load_speed][c] = jump.row[motor_speed][c] / drive_.gearbox.ratio;
        }
        const bool at_turning_point =
            at_rest[twist_contact] && !old.at_rest[twist_contact] && drive_.gearbox.has_hysteresis();
        const TorsionCurve& curve = drive_.gearbox.curve;
        const double d = x_[twist];
        const double stiffness = drive_.rigid() ? 0.0 : curve.slope(curve.locate(d));
        if (at_turning_point) {
            jump.row[hysteresis_component] = {};
            jump.row[hysteresis_component][twist] = drive_.gearbox.hysteresis_capacity_slope(d);
        }
        // The locked torque matters only while all contacts are at rest.
        jump.row[locked_component] = {};
        const Modes& modes = w.after.modes;
        if (modes[0] != 0 || modes[1] != 0 || modes[2] != 0) return time_rate;
        const double T_2 = evaluate(old.output_torque, x_, memory_, u[0]), locked = w.memory.locked_torque;
        if (locked == T_2) {
            jump.row[locked_component] = gradient(old.output_torque);
            time_rate[locked_component] =
                old.output_torque.c[command] * u[1][0] + old.output_torque.c[load_torque] * u[1][1];
        } else if (!drive_.rigid() && std::fabs(std::fabs(locked - curve.torque(d)) - w.memory.hysteresis_capacity) <=
                                          rounding * std::fabs(locked)) {
            const double sign = locked > curve.torque(d) ? 1.0 : -1.0;
            jump.row[locked_component] = jump.row[hysteresis_component];
            for (double& v : jump.row[locked_component]) v *= sign;
            jump.row[locked_component][twist] += stiffness;
        } else {
            time_rate[locked_component] = u[1][1];  // it follows the load torque, a friction torque off
        }
        return time_rate;
    }

    const Drive& drive_;
    RegimeCache<SwitchedDrive>& cache_;
    std::optional<InputState<DriveDims>> input_;
    // Where the last segment ended.
    const Regime* regime_ = nullptr;
    State x_{};
    Memory memory_;
};

}  // namespace lostmotion
