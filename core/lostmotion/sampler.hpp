// Observer that evaluates the exact state at equidistant instants.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>

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

inline constexpr auto all_channels = [] {
    std::array<int, n_channels> all{};
    for (int c = 0; c < n_channels; ++c) all[static_cast<std::size_t>(c)] = c;
    return all;
}();

// Quantities of one instant that follow from state, inputs and regime.
struct Reading {
    std::array<double, n_channels> value;
};

inline double sign_of(double v) { return (v > 0.0) - (v < 0.0); }

// Reads the channels in one regime.
class Reader {
 public:
    Reader(const Drive& drive, const Regime& r, const Memory& m) : drive_(drive), regime_(r) {
        const std::array<const LinearForm*, 4> forms{&r.source_torque, &r.output_torque, &r.input_torque,
                                                     &r.input_friction};
        for (int k = 0; k < 4; ++k) forms_.set(k, *forms[k]);
        forms_.constants(m, constant_);
        has_map_ = drive.gearbox.losses == Gearbox::loss_map;
        for (int c = 0; c < n_contacts; ++c) {
            const int mode = r.key.modes[c];
            shows_speed_[c] = mode == absent && !r.at_rest[c];
            mode_[c] = r.at_rest[c] ? 0.0 : mode;
        }
    }

    [[gnu::always_inline]] Reading operator()(const State& x, const std::array<double, n_inputs>& u) const {
        std::array<double, 4> out;
        forms_.evaluate(constant_, x, u, out);
        const auto [M_D, T_2, T_1_moving, F] = out;
        const Gearbox& gearbox = drive_.gearbox;
        double T_1 = T_1_moving, loss;
        const int mode = regime_.key.modes[input_contact];
        if (has_map_ && mode == 0) {
            // The torque F that the standing contact holds is shared by bearing and gear as their capacities are.
            const double s = F >= 0.0 ? 1.0 : -1.0;
            const double M_2B = gearbox.loss_torque(s * T_2 / gearbox.rated_output_torque, 0.0);
            const double capacity = drive_.motor.friction_torque + M_2B / gearbox.ratio;
            if (capacity > 0.0) T_1 += F * (M_2B / gearbox.ratio) / capacity;
            loss = M_2B / gearbox.rated_output_torque;
        } else {
            const double s = has_map_ ? mode : sign_of(x[motor_speed]);
            loss = (gearbox.ratio * T_1 - T_2) * s / gearbox.rated_output_torque;
        }
        return {{u[0], u[1], M_D, x[motor_speed], x[load_speed], x[load_angle], x[twist], T_2, T_1, loss,
                 shown_mode(input_contact, x), shown_mode(twist_contact, x), shown_mode(load_contact, x)}};
    }

 private:
    // Mode of a contact: +-1 slipping, 0 stuck. One that the drive does not have shows the sign of its speed.
    double shown_mode(Contact c, const State& x) const {
        if (!shows_speed_[c]) return mode_[c];
        return sign_of(c == input_contact  ? x[motor_speed]
                       : c == load_contact ? x[load_speed]
                                           : x[motor_speed] / drive_.gearbox.ratio - x[load_speed]);
    }

    const Drive& drive_;
    const Regime& regime_;
    FormTable<4> forms_;  // M_D, T_2, T_1, F
    FormTable<4>::Values constant_;
    bool has_map_;
    std::array<bool, n_contacts> shows_speed_;
    std::array<double, n_contacts> mode_;
};

// Writes `count` samples at begin + k * interval, channel by channel: out[c * count + k] is that of channels[c].
class Sampler {
 public:
    Sampler(const Drive& drive, double begin, double interval, std::size_t count, double* out,
            std::span<const int> channels = all_channels)
        : drive_(drive), begin_(begin), interval_(interval), count_(count), out_(out), channels_(channels) {}

    // Polled now and then; true ends the run.
    bool (*interrupted)(void*) = nullptr;
    void* interrupted_context = nullptr;

    std::size_t written() const { return next_; }
    double left_data_at = std::numeric_limits<double>::infinity();  // first instant outside the loss map's data [s]

    bool segment(const Segment<SwitchedDrive>& s) {
        const Regime& r = s.entry.regime;
        if (!r.in_data) left_data_at = std::fmin(left_data_at, s.begin);
        if (next_ >= count_ || !due(s)) return true;
        Propagator& p = s.entry.propagator;
        if (!cursor_) cursor_.emplace(s.input);
        Cursor& cursor = *cursor_;
        cursor.place(p, s.constant, s.input, s.x);
        const int level = level_of_interval(p);
        cursor.advance(instant(next_) - s.begin);
        const Reader reader(drive_, r, s.memory);
        if (level < 0) {
            while (true) {
                write(reader(cursor.x(), cursor.input().values()));
                if (next_ >= count_ || !due(s)) return true;
                if (stop()) return false;
                cursor.advance(instant(next_) - cursor.time());
            }
        }
        if (!stride_) stride_.emplace(cursor.input());
        Stride& stride = *stride_;
        stride.place(p, level, s.constant, cursor.input());
        State x = cursor.x();
        while (true) {
            write(reader(x, stride.input().values()));
            if (next_ >= count_ || !due(s)) return true;
            if (stop()) return false;
            stride.advance(x);
            if (next_ % 64 == 0) stride.anchor(instant(next_));
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
    void write(const Reading& reading) {
        double* to = out_ + next_++;
        for (const int c : channels_) {
            *to = reading.value[c];
            to += count_;
        }
    }
    bool stop() const { return next_ % 4096 == 0 && interrupted != nullptr && interrupted(interrupted_context); }

    const Drive& drive_;
    double begin_, interval_;
    std::size_t count_, next_ = 0;
    double* out_;
    std::span<const int> channels_;
    std::optional<Cursor> cursor_;  // kept from segment to segment for their memory
    std::optional<Stride> stride_;
};

}  // namespace lostmotion
