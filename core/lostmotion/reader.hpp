// What can be read of a drive at an instant: the channels of a record.
#pragma once

#include <array>
#include <cassert>
#include <cstddef>

#include "drive.hpp"

namespace lostmotion {

// At a jump a channel has its right limit.
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

// All channels of one instant.
struct Reading {
    std::array<double, n_channels> value;
};

inline double sign_of(double v) { return (v > 0.0) - (v < 0.0); }

// State and inputs at up to `most` instants of one regime, variable by variable.
struct Instants {
    static constexpr int most = 64;
    using Column = std::array<double, most>;

    alignas(32) std::array<Column, n_states> x;
    alignas(32) std::array<Column, n_inputs> u;

    void set(int k, const State& state, const std::array<double, n_inputs>& input) {
        for (int j = 0; j < n_states; ++j) x[j][k] = state[j];
        for (int i = 0; i < n_inputs; ++i) u[i][k] = input[i];
    }
};

// Reads the channels in one regime.
class Reader {
 public:
    Reader(const Drive& drive, const Regime& r, const Memory& m) : drive_(drive), regime_(r), memory_(m) {
        has_map_ = drive.gearbox.losses == Gearbox::loss_map;
    }

    // One channel at the first n instants. to: n values.
    void read(int channel, const Instants& at, int n, double* to) const {
        switch (channel) {
            case ch_command: return copy(at.u[0], n, to);
            case ch_load_torque: return copy(at.u[1], n, to);
            case ch_motor_torque: return evaluate(regime_.source_torque, at, n, to);
            case ch_motor_speed: return copy(at.x[motor_speed], n, to);
            case ch_load_speed: return copy(at.x[load_speed], n, to);
            case ch_load_angle: return copy(at.x[load_angle], n, to);
            case ch_twist: return copy(at.x[twist], n, to);
            case ch_output_torque: return evaluate(regime_.output_torque, at, n, to);
            case ch_input_torque: return input_torque(at, n, to);
            case ch_loss_coefficient: return loss_coefficient(at, n, to);
            case ch_input_contact: return mode(input_contact, at, n, to);
            case ch_twist_contact: return mode(twist_contact, at, n, to);
            case ch_load_contact: return mode(load_contact, at, n, to);
            default: assert(false);
        }
    }
    Reading operator()(const State& x, const std::array<double, n_inputs>& u) const {
        Instants at;
        at.set(0, x, u);
        Reading out;
        for (const int c : all_channels) read(c, at, 1, &out.value[static_cast<std::size_t>(c)]);
        return out;
    }

 private:
    using Column = Instants::Column;

    static void copy(const Column& from, int n, double* to) {
        for (int k = 0; k < n; ++k) to[k] = from[k];
    }
    // None of the forms depends on the load angle.
    void evaluate(const LinearForm& f, const Instants& at, int n, double* __restrict to) const {
        const double constant = constant_part(f, memory_);
        for (int k = 0; k < n; ++k)
            to[k] = constant +
                    ((f.c[0] * at.x[0][k] + f.c[1] * at.x[1][k]) + (f.c[2] * at.x[2][k] + f.c[3] * at.x[3][k])) +
                    (f.c[command] * at.u[0][k] + f.c[load_torque] * at.u[1][k]);
    }

    // With a loss map and a standing input shaft, the torque that the contact holds is shared by bearing and gear as
    // their capacities are.
    bool shares() const { return has_map_ && regime_.key.modes[input_contact] == 0; }
    // M_2B at standstill, against the torque F that is held.
    double standing_loss(double T_2, double F) const {
        const Gearbox& g = drive_.gearbox;
        return g.loss_torque((F >= 0.0 ? T_2 : -T_2) / g.rated_output_torque, 0.0);
    }

    void input_torque(const Instants& at, int n, double* to) const {
        evaluate(regime_.input_torque, at, n, to);
        if (!shares()) return;
        Column T_2, F;
        evaluate(regime_.output_torque, at, n, T_2.data());
        evaluate(regime_.input_friction, at, n, F.data());
        for (int k = 0; k < n; ++k) {
            const double gear = standing_loss(T_2[k], F[k]) / drive_.gearbox.ratio;
            const double capacity = drive_.motor.friction_torque + gear;
            if (capacity > 0.0) to[k] += F[k] * gear / capacity;
        }
    }

    void loss_coefficient(const Instants& at, int n, double* to) const {
        const Gearbox& g = drive_.gearbox;
        Column T_2, other;  // the other torque: F, or T_1
        evaluate(regime_.output_torque, at, n, T_2.data());
        if (shares()) {
            evaluate(regime_.input_friction, at, n, other.data());
            for (int k = 0; k < n; ++k) to[k] = standing_loss(T_2[k], other[k]) / g.rated_output_torque;
            return;
        }
        evaluate(regime_.input_torque, at, n, other.data());
        for (int k = 0; k < n; ++k) to[k] = (g.ratio * other[k] - T_2[k]) / g.rated_output_torque;
        const double s = regime_.key.modes[input_contact];
        for (int k = 0; k < n; ++k) to[k] *= has_map_ ? s : sign_of(at.x[motor_speed][k]);
    }

    // Mode of a contact: +-1 slipping, 0 stuck. One that the drive does not have shows the sign of its speed.
    void mode(Contact c, const Instants& at, int n, double* to) const {
        const int mode = regime_.key.modes[c];
        for (int k = 0; k < n; ++k) {
            if (mode != absent || regime_.at_rest[c])
                to[k] = regime_.at_rest[c] ? 0.0 : mode;
            else
                to[k] =
                    sign_of(c == input_contact  ? at.x[motor_speed][k]
                            : c == load_contact ? at.x[load_speed][k]
                                                : at.x[motor_speed][k] / drive_.gearbox.ratio - at.x[load_speed][k]);
        }
    }

    const Drive& drive_;
    const Regime& regime_;
    const Memory& memory_;
    bool has_map_;
};

}  // namespace lostmotion
