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

void add_piece_guards(const Terms& terms, const Row& variable, const TorsionCurve& curve, int branch, const Key& key,
                      std::vector<Guard>& guards);

// The last and the first piece of a periodic curve are neighbours: then the angle at which the present turn began,
// which is remembered, moves by a period. A branch may stand for such a piece in one of several variants of a law.
void add_piece_guards(const Terms& terms, const Row& angle, const PeriodicCurve& curve, int turn, int branch,
                      const Key& key, std::vector<Guard>& guards);

}  // namespace lostmotion::model
