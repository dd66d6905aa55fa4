// A regime in arrays of compile-time dimensions, for the kernel; what the train does not have is zero.
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "../kernel/inputs.hpp"
#include "../solver/components.hpp"
#include "assembly.hpp"

namespace lostmotion::model {

template <class D>
using PackedForm = LinearFormOf<D>;

// Places of what a layout has, in the kernel.
template <class D>
int state_place(const Layout& n, int k) {
    return k < n.coupled ? k : D::coupled + k - n.coupled;
}

inline Counts counts_of(const Layout& n) { return {n.coupled, n.angles, n.inputs, n.memory}; }

template <class D>
PackedForm<D> pack(const Row& f, const Layout& n) {
    PackedForm<D> out;
    if constexpr (std::same_as<D, Any>) {
        const double* c = f.c.begin();
        for (int k = 0, end = std::min(static_cast<int>(f.c.size()), n.terms); k < end; ++k)
            if (c[k] != 0.0)
                out.c.append(k < n.states         ? state_place<D>(n, k)
                             : k < n.first_memory ? D::one
                             : k < n.first_input  ? D::first_memory + k - n.first_memory
                                                  : D::first_input + k - n.first_input,
                             c[k]);
    } else {
        const int known = static_cast<int>(f.c.size());
        // Most often as many as there is room for.
        const auto copy = [&]<int room>(std::integral_constant<int, room>, int from, int count, int to) ALWAYS_INLINE {
            const double* c = f.c.begin() + from;
            if (count == room && from + room <= known)
                std::copy_n(c, room, out.c.begin() + to);
            else
                for (int k = 0; k < std::min(count, known - from); ++k) out.c[to + k] = c[k];
        };
        copy(std::integral_constant<int, D::coupled>{}, 0, n.coupled, 0);
        copy(std::integral_constant<int, D::angles>{}, n.coupled, n.angles, D::coupled);
        copy(std::integral_constant<int, 1>{}, n.one, 1, D::one);
        copy(std::integral_constant<int, D::memory>{}, n.first_memory, n.memory, D::first_memory);
        copy(std::integral_constant<int, D::inputs>{}, n.first_input, n.inputs, D::first_input);
    }
    return out;
}

// A state of the kernel, by the layout.
template <class D, class State, class To>
void unpack_state(const State& x, const Layout& n, To to) {
    for (int k = 0; k < n.states; ++k) *to++ = x[state_place<D>(n, k)];
}

template <class D>
using PackedGuard = GuardOf<PackedForm<D>>;

template <class D>
struct PackedRegime {
    Key key;
    using Forms = ArrayOf<D, PackedForm<D>, D::contacts>;
    ByState<D, PackedForm<D>> rate{};
    Forms output_torque{};   // of each gear [N m]
    Forms input_torque{};    // of each gear, with dry losses while it turns [N m]
    Forms mesh_loss{};       // of each gear, what it takes at its output, |i| T_1 - T_2 as turned by the input [N m]
    Forms contact_torque{};  // of each contact [N m]
    std::vector<PackedForm<D>> motor_torque, drive_torque;  // of each motor and of each given motion [N m]
    std::vector<PackedForm<D>> massless_speed;              // of each shaft without inertia
    ArrayOf<D, PackedGuard<D>, D::guards> guards{};
    int n_guards = 0;
    ListOf<D, bool, D::contacts> at_rest{}, redundant{};
    ListOf<D, bool, D::coupled> resting{}, following{};  // speeds kept at zero, and those that follow others
    bool solvable = true, in_data = true;
    std::vector<Driver<PackedForm<D>>> drivers;
    std::vector<LockedTorque<PackedForm<D>>> locked;
    std::vector<GivenState> given;
    int driving_input = -1;
    double driving_way = 0.0;
    bool complete = true;  // false: it has more guards than there is room for
};

// The speeds that are given, and those that follow these alone.
inline std::vector<GivenState> given_states(const Regime& r, const Places& places) {
    std::vector<GivenState> out;
    if (places.driven.empty()) return out;
    const auto is_driven = [&](int s) { return std::ranges::binary_search(places.driven, s); };
    for (int s = 0; s < static_cast<int>(places.shafts.size()); ++s) {
        const bool follows =
            r.ties.follows(s) && std::ranges::all_of(r.ties.of[static_cast<std::size_t>(s)], is_driven, &Share::shaft);
        if (r.ties.at_rest[s] || !(follows || is_driven(s))) continue;
        GivenState& given = out.emplace_back(GivenState{places.shafts[s].speed, {}});
        const auto add = [&](int k, double share) {
            given.shares.push_back({places.shafts[k].given_speed, places.shafts[k].given_acceleration, share});
        };
        if (follows)
            r.ties.each_share(s, add);
        else
            add(s, 1.0);
    }
    return out;
}

// out: as it has been made.
template <class D>
void pack(const Regime& r, const Assembly& a, PackedRegime<D>& out) {
    const Layout& n = a.layout();
    out.key = r.key;
    out.rate.make_room(CountsOf<D>(counts_of(n)));
    for (auto* forms : {&out.output_torque, &out.input_torque, &out.mesh_loss})
        make_room(*forms, std::max(1, static_cast<int>(r.output_torque.size())));
    make_room(out.contact_torque, n.contacts);
    make_room(out.guards, static_cast<int>(r.guards.size()));
    for (int k = 0; k < n.states; ++k) out.rate[state_place<D>(n, k)] = pack<D>(r.rate[k], n);
    for (std::size_t g = 0; g < r.output_torque.size(); ++g) {
        out.output_torque[g] = pack<D>(r.output_torque[g], n);
        out.input_torque[g] = pack<D>(r.input_torque[g], n);
        out.mesh_loss[g] = pack<D>(
            a.train().gears[g].sense() * (a.train().gears[g].law.ratio * r.input_torque[g] - r.output_torque[g]), n);
    }
    for (std::size_t c = 0; c < r.contact_torque.size(); ++c) out.contact_torque[c] = pack<D>(r.contact_torque[c], n);
    out.complete = r.guards.size() <= static_cast<std::size_t>(D::guards);
    for (const Guard& g : r.guards) {
        if (out.n_guards == D::guards) break;
        out.guards[out.n_guards++] = g.with(pack<D>(g.form, n));
    }
    for (const Row& f : r.motor_torque) out.motor_torque.push_back(pack<D>(f, n));
    for (const Row& f : r.drive_torque) out.drive_torque.push_back(pack<D>(f, n));
    for (const MasslessSpeed& m : r.massless) out.massless_speed.push_back(pack<D>(m.form, n));
    for (int c = 0; c < n.contacts; ++c) {
        out.at_rest[c] = r.at_rest[c];
        out.redundant[c] = r.ties.redundant[c];
    }
    const auto& shafts = a.places().shafts;
    for (int s = 0; s < static_cast<int>(shafts.size()); ++s) {
        out.resting[shafts[s].speed] = r.ties.at_rest[s];
        out.following[shafts[s].speed] = r.ties.follows(s);
    }
    out.solvable = r.solvable;
    out.driving_input = r.driving_input;
    out.driving_way = r.driving_way;
    for (const Driver<Row>& d : r.drivers) out.drivers.push_back({d.contact, pack<D>(d.torque, n), pack<D>(d.rate, n)});
    for (const LockedTorque<Row>& l : r.locked)
        out.locked.push_back(l.with([&](const Row& f) { return pack<D>(f, n); }));
    out.in_data = r.in_data;
    out.given = given_states(r, a.places());
}
template <class D>
PackedRegime<D> pack(const Regime& r, const Assembly& a) {
    PackedRegime<D> out;
    pack(r, a, out);
    return out;
}

// One signal for each input.
template <class D>
SignalsOf<D> packed_signals(const std::vector<Signal>& inputs) {
    SignalsOf<D> signals;
    make_room(signals, std::max(1, static_cast<int>(inputs.size())));
    std::copy(inputs.begin(), inputs.end(), signals.begin());
    return signals;
}
// x: the states by the layout of the assembly, or nothing for rest.
template <class D>
StartOf<D> packed_start(const Layout& n, std::span<const double> x, std::span<const double> memory) {
    StartOf<D> start;
    make_room<D>(start.x, CountsOf<D>(counts_of(n)));
    for (std::size_t k = 0; k < x.size(); ++k) start.x[state_place<D>(n, static_cast<int>(k))] = x[k];
    for (std::size_t k = 0; k < memory.size(); ++k) start.memory[k] = memory[k];
    return start;
}

}  // namespace lostmotion::model
