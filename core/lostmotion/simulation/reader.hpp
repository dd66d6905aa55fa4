// Reads the channels of a drive at many instants of a regime.
#pragma once

#include <array>
#include <cassert>
#include <cstddef>

#include "../drive/drive.hpp"
#include "../kernel/stride.hpp"
#include "channels.hpp"

namespace lostmotion {

// All channels of one instant.
struct Reading {
    std::array<double, n_channels> value;
};

using Instants = InstantsOf<DriveDims>;

// Reads the channels in one regime, as many instants at once as the instruction set holds numbers.
class Reader {
 public:
    Reader(const Drive& drive, const Regime& r, const Memory& m)
        : drive_(drive), regime_(r), memory_(m), has_map_(drive.gearbox.losses == Gearbox::loss_map) {}

    // A channel at the instants k, k + 1, ...
    Vec read(int channel, const Instants& at, int k) const {
        switch (channel) {
            case ch_command: return load(&at.u[0][k]);
            case ch_load_torque: return load(&at.u[1][k]);
            case ch_motor_torque: return evaluate(regime_.source_torque, at, k);
            case ch_motor_speed: return load(&at.x[motor_speed][k]);
            case ch_load_speed: return load(&at.x[load_speed][k]);
            case ch_load_angle: return load(&at.x[load_angle][k]);
            case ch_twist: return load(&at.x[twist][k]);
            case ch_output_torque: return evaluate(regime_.output_torque, at, k);
            case ch_input_torque: return input_torque(at, k);
            case ch_loss_coefficient: return loss_coefficient(at, k);
            case ch_input_contact: return mode(input_contact, at, k);
            case ch_twist_contact: return mode(twist_contact, at, k);
            default: assert(channel == ch_load_contact); return mode(load_contact, at, k);
        }
    }
    Reading operator()(const State& x, const std::array<double, n_inputs>& u) const {
        Instants at;
        at.set(0, load(x), u);
        Reading out;
        for (const int c : all_channels) out.value[static_cast<std::size_t>(c)] = read(c, at, 0)[0];
        return out;
    }

 private:
    // None of the forms depends on the load angle.
    Vec evaluate(const LinearForm& f, const Instants& at, int k) const {
        const auto term = [&](Term t, const Instants::Column& column) { return f.c[t] * load(&column[k]); };
        return constant_part(f, memory_) +
               ((term(motor_torque, at.x[0]) + term(motor_speed, at.x[1])) +
                (term(load_speed, at.x[2]) + term(twist, at.x[3]))) +
               (term(command, at.u[0]) + term(load_torque, at.u[1]));
    }

    // With a loss map and an input shaft at rest, the torque that the contact holds is shared by bearing and gear as
    // their capacities are.
    bool shares() const { return has_map_ && regime_.key.modes[input_contact] == 0; }
    // M_2B at rest, against the torque F that is held.
    double loss_at_rest(double T_2, double F) const { return drive_.gearbox.loss_torque(T_2, 0.0, way_of(F)); }
    static int way_of(double F) { return F >= 0.0 ? +1 : -1; }

    Vec input_torque(const Instants& at, int k) const {
        Vec T_1 = evaluate(regime_.input_torque, at, k);
        if (!shares()) return T_1;
        const Vec T_2 = evaluate(regime_.output_torque, at, k), F = evaluate(regime_.input_friction, at, k);
        for (int lane = 0; lane < vec_width; ++lane) {
            const double gear = loss_at_rest(T_2[lane], F[lane]) / drive_.gearbox.ratio;
            const double capacity = drive_.input_capacity(T_2[lane], 0.0, way_of(F[lane]));
            if (capacity > 0.0) T_1[lane] += F[lane] * gear / capacity;
        }
        return T_1;
    }

    Vec loss_coefficient(const Instants& at, int k) const {
        const Gearbox& g = drive_.gearbox;
        Vec lost = evaluate(regime_.loss_torque, at, k);
        if (shares()) {
            const Vec T_2 = evaluate(regime_.output_torque, at, k), F = evaluate(regime_.input_friction, at, k);
            for (int lane = 0; lane < vec_width; ++lane) lost[lane] = loss_at_rest(T_2[lane], F[lane]);
        } else if (has_map_) {
            lost *= static_cast<double>(regime_.key.modes[input_contact]);
        } else {
            lost *= signs(load(&at.x[motor_speed][k]));
        }
        return lost / g.rated_output_torque;
    }

    // Mode of a contact: +-1 slipping, 0 stuck. One that the drive does not have shows the sign of its speed.
    Vec mode(Contact c, const Instants& at, int k) const {
        if (regime_.at_rest[c]) return Vec{};
        if (regime_.key.modes[c] != absent) return Vec{} + static_cast<double>(regime_.key.modes[c]);
        const Vec w_M = load(&at.x[motor_speed][k]), w = load(&at.x[load_speed][k]);
        return signs(c == input_contact ? w_M : c == load_contact ? w : w_M / drive_.gearbox.ratio - w);
    }
    static Vec signs(Vec v) {
        const Vec zero{}, one = zero + 1.0;
        return (v > zero ? one : zero) - (v < zero ? one : zero);
    }

    const Drive& drive_;
    const Regime& regime_;
    const Memory& memory_;
    bool has_map_;
};

}  // namespace lostmotion
