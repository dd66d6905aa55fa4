// Observer that evaluates the exact state at equidistant instants.
#pragma once

#include <cstddef>
#include <limits>

#include "exact_solver.hpp"

namespace lostmotion {

// What is recorded of each instant. At a jump it is the right limit.
enum Channel : int {
    ch_command,
    ch_load_torque,
    ch_motor_torque,
    ch_motor_speed,
    ch_load_speed,
    ch_load_angle,
    ch_twist,
    ch_output_torque,
    ch_input_torque,
    ch_loss_coefficient,
    ch_input_contact,
    ch_twist_contact,
    ch_load_contact,
    n_channels
};

// Quantities of one instant that follow from state, inputs and regime.
struct Reading {
    std::array<double, n_channels> value;
};

inline double sign_of(double v) { return (v > 0.0) - (v < 0.0); }

// Shown mode of a contact: +-1 slipping, 0 stuck. One that the drive does not have shows the sign of its speed.
inline double shown_mode(const Drive& drive, const Regime& r, Contact c, const State& x) {
    if (r.at_rest[c]) return 0.0;
    const int mode = r.key.modes[c];
    if (mode != absent) return mode;
    return sign_of(evaluate(drive.contact_speed(c), x, {}, {}));
}

// `T_2` and so on are values of the regime's forms. While the input contact is stuck, the torque F that it holds is
// shared by bearing and gear in proportion to their capacities.
inline Reading read(const Drive& drive, const Regime& r, const State& x, const std::array<double, n_inputs>& u,
                    double M_D, double T_2, double T_1, double F) {
    const Gearbox& gearbox = drive.gearbox;
    double loss = 0.0;
    if (gearbox.losses == Gearbox::loss_map) {
        if (r.key.modes[input_contact] == 0) {
            const double s = F >= 0.0 ? 1.0 : -1.0;
            const double mu = s * T_2 / gearbox.rated_output_torque;
            const double M_2B = gearbox.loss_torque(mu, 0.0);
            const double capacity = drive.motor.friction_torque + M_2B / gearbox.ratio;
            if (capacity > 0.0) T_1 += F * (M_2B / gearbox.ratio) / capacity;
            loss = M_2B / gearbox.rated_output_torque;
        } else {
            loss = (gearbox.ratio * T_1 - T_2) * r.key.modes[input_contact] / gearbox.rated_output_torque;
        }
    } else {
        loss = (gearbox.ratio * T_1 - T_2) * sign_of(x[motor_speed]) / gearbox.rated_output_torque;
    }
    return {{u[0], u[1], M_D, x[motor_speed], x[load_speed], x[load_angle], x[twist], T_2, T_1, loss,
             shown_mode(drive, r, input_contact, x), shown_mode(drive, r, twist_contact, x),
             shown_mode(drive, r, load_contact, x)}};
}

inline Reading read(const Drive& drive, const Regime& r, const State& x, const Memory& m,
                    const std::array<double, n_inputs>& u) {
    return read(drive, r, x, u, evaluate(r.source_torque, x, m, u), evaluate(r.output_torque, x, m, u),
                evaluate(r.input_torque, x, m, u), evaluate(r.input_friction, x, m, u));
}

// Writes `count` samples at begin + k * interval, channel by channel: out[channel * count + k].
class Sampler {
 public:
    Sampler(const Drive& drive, double begin, double interval, std::size_t count, double* out)
        : drive_(drive), begin_(begin), interval_(interval), count_(count), out_(out) {}

    // Polled now and then; true ends the run.
    bool (*interrupted)(void*) = nullptr;
    void* interrupted_context = nullptr;

    std::size_t written() const { return next_; }
    double left_data_at = std::numeric_limits<double>::infinity();  // first instant outside the loss map's data [s]

    bool segment(const Segment<SwitchedDrive>& s, const std::vector<InputBasis>& basis) {
        const Regime& r = s.entry.regime;
        if (!r.in_data) left_data_at = std::fmin(left_data_at, s.begin);
        if (next_ >= count_ || !due(s)) return true;
        Propagator& p = s.entry.propagator;
        Cursor cursor(p, s.signals, basis, s.constant, s.begin, s.x);
        const int level = level_of_interval(p);
        cursor.advance(instant(next_) - s.begin);
        for (std::size_t count = 1;; ++count) {
            write(r, cursor.x(), s.memory, cursor.input().values());
            if (++next_ >= count_ || !due(s)) return true;
            if (count % 4096 == 0 && interrupted != nullptr && interrupted(interrupted_context)) return false;
            if (level >= 0)
                cursor.step(level);
            else
                cursor.advance(interval_);
            if (count % 64 == 0) cursor.anchor(instant(next_));
        }
    }
    void switching(const Switching&) {}

 private:
    double instant(std::size_t k) const { return begin_ + static_cast<double>(k) * interval_; }
    bool due(const Segment<SwitchedDrive>& s) const {
        const double t = instant(next_);
        return t < s.end || (s.last && t <= s.end * (1.0 + 4.0 * std::numeric_limits<double>::epsilon()));
    }
    // The level whose length is the sampling interval, or -1.
    int level_of_interval(Propagator& p) const {
        const int k = p.level_below(interval_);
        return p.level(k).length == interval_ ? k : -1;
    }
    void write(const Regime& r, const State& x, const Memory& m, const std::array<double, n_inputs>& u) {
        const Reading reading = read(drive_, r, x, m, u);
        for (int c = 0; c < n_channels; ++c) out_[c * count_ + next_] = reading.value[c];
    }

    const Drive& drive_;
    double begin_, interval_;
    std::size_t count_, next_ = 0;
    double* out_;
};

}  // namespace lostmotion
