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

template <class D, class F = PackedForm<D>>
F pack(const Row& f, const Layout& n) {
    F out;
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
    return out;
}

// A state of the kernel, by the layout.
template <class D, class State, class To>
void unpack_state(const State& x, const Layout& n, To to) {
    std::copy_n(x.begin() + D::coupled, n.angles, std::copy_n(x.begin(), n.coupled, to));
}

template <class D>
struct PackedGuard {
    using Kind = Guard::Kind;
    static constexpr Kind speed = Guard::speed, capacity = Guard::capacity, edge = Guard::edge,
                          input_limit = Guard::input_limit, turning = Guard::turning, outside = Guard::outside,
                          set_off = Guard::set_off, impact = Guard::impact;

    PackedForm<D> form;
    Kind kind = outside;
    int contact = -1, branch = -1, neighbour = 0;
    bool by_grazing = false;
    int memory = -1;
    double shift = 0.0;
    bool behind = false;

    // The contact; -2 - branch for a law that belongs to no contact.
    int subject() const { return contact < 0 && branch >= 0 ? -2 - branch : contact; }
    bool is_edge() const { return kind == edge || kind == input_limit; }
    bool is_of_contact() const {
        return kind == speed || kind == capacity || kind == turning || kind == set_off || kind == impact;
    }
};

template <class D>
struct PackedRegime {
    Key key;
    std::array<PackedForm<D>, D::states> rate{};
    std::array<PackedForm<D>, D::contacts> output_torque{};  // of each gear [N m]
    std::array<PackedForm<D>, D::contacts> input_torque{};   // of each gear, with dry losses while it turns [N m]
    std::array<PackedForm<D>, D::contacts>
        mesh_loss{};  // of each gear, what it takes at its output, |i| T_1 - T_2 as turned by the input [N m]
    std::array<PackedForm<D>, D::contacts> contact_torque{};  // of each contact [N m]
    std::vector<PackedForm<D>> motor_torque, drive_torque;    // of each motor and of each given motion [N m]
    std::vector<PackedForm<D>> massless_speed;                // of each shaft without inertia
    std::array<PackedGuard<D>, D::guards> guards{};
    int n_guards = 0;
    std::array<bool, D::contacts> at_rest{}, redundant{};
    std::array<bool, D::coupled> resting{}, following{};  // speeds kept at zero, and those that follow others
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
    unsigned driven = 0;
    for (const int s : places.driven) driven |= 1u << s;
    for (int s = 0; s < static_cast<int>(places.shafts.size()); ++s) {
        const bool follows = r.ties.follows(s) && (r.ties.free[s] & ~driven) == 0;
        if (r.ties.at_rest[s] || !(follows || (driven >> s & 1) != 0)) continue;
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
    for (int k = 0; k < n.states; ++k) out.rate[k < n.coupled ? k : D::coupled + k - n.coupled] = pack<D>(r.rate[k], n);
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
        out.guards[out.n_guards++] = {pack<D>(g.form, n), g.kind,   g.contact, g.branch, g.neighbour,
                                      g.by_grazing,       g.memory, g.shift,   g.behind};
    }
    for (const Row& f : r.motor_torque) out.motor_torque.push_back(pack<D>(f, n));
    for (const Row& f : r.drive_torque) out.drive_torque.push_back(pack<D>(f, n));
    for (const MasslessSpeed& m : r.massless) out.massless_speed.push_back(pack<D>(m.form, n));
    std::copy_n(r.at_rest.begin(), n.contacts, out.at_rest.begin());
    std::copy_n(r.ties.redundant.begin(), n.contacts, out.redundant.begin());
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
        out.locked.push_back({l.contact, l.memory, l.has_low, l.has_high, l.on_held_shaft, pack<D>(l.low, n),
                              pack<D>(l.high, n), pack<D>(l.needs, n), pack<D>(l.friction, n), l.needs_torque});
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
    std::copy(inputs.begin(), inputs.end(), signals.begin());
    return signals;
}
// x: the states by the layout of the assembly, or nothing for rest.
template <class D>
StartOf<D> packed_start(const Layout& n, std::span<const double> x, std::span<const double> memory) {
    StartOf<D> start;
    const auto coupled = static_cast<std::size_t>(n.coupled);
    for (std::size_t k = 0; k < x.size(); ++k)
        start.x[k < coupled ? k : static_cast<std::size_t>(D::coupled) + k - coupled] = x[k];
    std::copy(memory.begin(), memory.end(), start.memory.begin());
    return start;
}

}  // namespace lostmotion::model
