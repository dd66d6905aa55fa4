// The pieces of a curve: its value on one, and where a variable leaves it.
#pragma once

#include <vector>

#include "../parts/periodic_curve.hpp"
#include "../parts/torsion_curve.hpp"
#include "contact_place.hpp"
#include "regime.hpp"

namespace lostmotion::model {

// The value of a curve on its piece k.
inline Row on_piece(const Terms& terms, const Row& variable, const TorsionCurve& curve, int k) {
    return curve.slope(k) * variable + terms.one(curve.offset(k));
}

inline void add_piece_guards(const Terms& terms, const Row& variable, const TorsionCurve& curve, int branch,
                             const Key& key, std::vector<Guard>& guards) {
    const int k = branch == nowhere ? 0 : key.branch[branch], last = curve.outermost_piece();
    const auto add = [&](const Row& form, int neighbour) {
        guards.push_back({.form = form, .kind = Guard::edge, .branch = branch, .neighbour = neighbour});
    };
    if (k < last) add(terms.one(curve.upper(k)) - variable, k + 1);
    if (k > -last) add(variable - terms.one(curve.lower(k)), k - 1);
}

// The last and the first piece of a periodic curve are neighbours: then the angle at which the present turn began,
// which is remembered, moves by a period.
inline void add_piece_guards(const Terms& terms, const Row& angle, const PeriodicCurve& curve, int turn, int branch,
                             const Key& key, std::vector<Guard>& guards) {
    const int k = key.branch[branch], last = curve.pieces() - 1;
    const Row within = angle - terms.memory(turn);
    const auto add = [&](const Row& form, int neighbour, double shift) {
        guards.push_back({.form = form,
                          .kind = Guard::edge,
                          .branch = branch,
                          .neighbour = neighbour,
                          .memory = shift == 0.0 ? nowhere : turn,
                          .shift = shift});
    };
    add(terms.one(curve.upper(k)) - within, k == last ? 0 : k + 1, k == last ? curve.period() : 0.0);
    add(within - terms.one(curve.lower(k)), k == 0 ? last : k - 1, k == 0 ? -curve.period() : 0.0);
}

}  // namespace lostmotion::model
