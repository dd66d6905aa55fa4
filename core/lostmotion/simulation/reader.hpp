// Reads the channels of a drive at many instants of a regime.
#pragma once

#include <algorithm>
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

// Reads the channels in one regime, as many instants at once as the instruction set holds numbers.
class Reader {
 public:
    Reader(const Drive& drive, const Regime& r, const Memory& m)
        : drive_(drive), regime_(r), memory_(m), has_map_(drive.gearbox.losses == Gearbox::loss_map) {}

    // A channel at the first n instants, rounded up to whole vectors.
    template <class Instants>
    void read(int channel, const Instants& at, int n, double* out) const {
        const auto each = [&](auto&& value) {
            for (int k = 0; k < n; k += vec_width) store(value(k), out + k);
        };
        const auto column = [&](const auto& c) { each([&](int k) { return load(&c[k]); }); };
        const auto form = [&](LinearForm f) {  // by value: in registers
            const double constant = constant_part(f, memory_);
            each([&](int k) { return evaluate(f, constant, at, k); });
        };
        const auto mode = [&](Contact c) {
            if (regime_.at_rest[c] || regime_.key.modes[c] != absent)
                std::fill_n(out, n, regime_.at_rest[c] ? 0.0 : static_cast<double>(regime_.key.modes[c]));
            else
                each([&](int k) { return sign_of_speed(c, at, k); });
        };
        switch (channel) {
            case ch_command: column(at.u[0]); return;
            case ch_load_torque: column(at.u[1]); return;
            case ch_motor_torque: form(regime_.source_torque); return;
            case ch_motor_speed: column(at.x[motor_speed]); return;
            case ch_load_speed: column(at.x[load_speed]); return;
            case ch_load_angle: column(at.x[load_angle]); return;
            case ch_twist: column(at.x[twist]); return;
            case ch_output_torque: form(regime_.output_torque); return;
            case ch_input_torque:
                form(regime_.input_torque);
                if (shares()) each([&](int k) { return input_torque(load(out + k), at, k); });
                return;
            case ch_loss_coefficient:
                form(regime_.loss_torque);
                each([&](int k) { return loss_coefficient(load(out + k), at, k); });
                return;
            case ch_input_contact: mode(input_contact); return;
            case ch_twist_contact: mode(twist_contact); return;
            default: assert(channel == ch_load_contact); mode(load_contact);
        }
    }
    Reading operator()(const State& x, const std::array<double, n_inputs>& u) const {
        InstantsOf<DriveDims, vec_width> at;
        at.set(0, load(x), u);
        Reading out;
        for (const int c : all_channels) {
            std::array<double, vec_width> value;
            read(c, at, 1, value.data());
            out.value[static_cast<std::size_t>(c)] = value[0];
        }
        return out;
    }

 private:
    template <class Instants>
    Vec evaluate(const LinearForm& f, const Instants& at, int k) const {
        return evaluate(f, constant_part(f, memory_), at, k);
    }
    // None of the forms depends on the load angle.
    template <class Instants>
    static Vec evaluate(const LinearForm& f, double constant, const Instants& at, int k) {
        const auto term = [&](Term t, const typename Instants::Column& column) { return f.c[t] * load(&column[k]); };
        return constant +
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

    // Of one that shares, from the torque without the share of the gear.
    template <class Instants>
    Vec input_torque(Vec T_1, const Instants& at, int k) const {
        const Vec T_2 = evaluate(regime_.output_torque, at, k), F = evaluate(regime_.input_friction, at, k);
        for (int lane = 0; lane < vec_width; ++lane) {
            const double gear = loss_at_rest(T_2[lane], F[lane]) / drive_.gearbox.ratio;
            const double capacity = drive_.input_capacity(T_2[lane], 0.0, way_of(F[lane]));
            if (capacity > 0.0) T_1[lane] += F[lane] * gear / capacity;
        }
        return T_1;
    }

    // From the loss of a speed forward.
    template <class Instants>
    Vec loss_coefficient(Vec lost, const Instants& at, int k) const {
        if (shares()) {
            const Vec T_2 = evaluate(regime_.output_torque, at, k), F = evaluate(regime_.input_friction, at, k);
            for (int lane = 0; lane < vec_width; ++lane) lost[lane] = loss_at_rest(T_2[lane], F[lane]);
        } else if (has_map_) {
            lost *= static_cast<double>(regime_.key.modes[input_contact]);
        } else {
            lost *= signs(load(&at.x[motor_speed][k]));
        }
        return lost / drive_.gearbox.rated_output_torque;
    }

    // Of a contact that the drive does not have.
    template <class Instants>
    Vec sign_of_speed(Contact c, const Instants& at, int k) const {
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
