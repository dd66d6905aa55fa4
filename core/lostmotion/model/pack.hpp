// A regime in arrays of compile-time dimensions, for the kernel; what the train does not have is zero.
#pragma once

#include <algorithm>
#include <array>

#include "regime.hpp"

namespace lostmotion::model {

// Does a train fit into a kernel of these dimensions? Guards are counted regime by regime.
template <class D>
bool fits(const Layout& n) {
    return n.coupled <= D::coupled && n.angles <= D::angles && n.memory <= D::memory && n.inputs <= D::inputs &&
           n.contacts <= D::contacts;
}

template <class D>
std::array<double, D::terms> pack(const Row& f, const Layout& n) {
    std::array<double, D::terms> out{};
    std::copy_n(f.c.begin(), n.coupled, out.begin());
    std::copy_n(f.c.begin() + n.coupled, n.angles, out.begin() + D::coupled);
    out[D::one] = f.c[n.one];
    std::copy_n(f.c.begin() + n.first_memory, n.memory, out.begin() + D::first_memory);
    std::copy_n(f.c.begin() + n.first_input, n.inputs, out.begin() + D::first_input);
    return out;
}

template <class D>
struct PackedGuard {
    std::array<double, D::terms> form{};
    Guard::Kind kind = Guard::outside;
    int contact = -1, branch = -1, neighbour = 0;
    bool by_touch = false;
    int memory = -1;
    double shift = 0.0;
};

template <class D>
struct PackedRegime {
    std::array<std::array<double, D::terms>, D::states> rate{};
    std::array<PackedGuard<D>, D::guards> guards{};
    int n_guards = 0;
    std::array<bool, D::contacts> at_rest{};
    // Shafts that follow another: speed state, that of their leader and the factor; n_followers of them.
    struct Follower {
        int state, leader;
        double factor;
    };
    std::array<Follower, D::coupled> followers{};
    int n_followers = 0;
    bool solvable = true, in_data = true;
    bool complete = true;  // false: it has more guards than there is room for
};

template <class D>
PackedRegime<D> pack(const Regime& r, const Layout& n, int first_speed, int shafts) {
    PackedRegime<D> out;
    for (int k = 0; k < n.states; ++k) out.rate[k < n.coupled ? k : D::coupled + k - n.coupled] = pack<D>(r.rate[k], n);
    out.complete = r.guards.size() <= static_cast<std::size_t>(D::guards);
    for (const Guard& g : r.guards) {
        if (out.n_guards == D::guards) break;
        out.guards[out.n_guards++] = {pack<D>(g.form, n), g.kind,     g.contact, g.branch,
                                      g.neighbour,        g.by_touch, g.memory,  g.shift};
    }
    std::copy_n(r.at_rest.begin(), n.contacts, out.at_rest.begin());
    for (int s = 0; s < shafts; ++s)
        if (!r.ties.at_rest[s] && r.ties.leader[s] != s)
            out.followers[out.n_followers++] = {first_speed + s, first_speed + r.ties.leader[s], r.ties.factor[s]};
    out.solvable = r.solvable;
    out.in_data = r.in_data;
    return out;
}

}  // namespace lostmotion::model
