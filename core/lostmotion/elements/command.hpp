// A command that acts between two limits: below and above them, what it commands stays as it is there.
#pragma once

#include <vector>

#include "../parts/field.hpp"
#include "regime.hpp"

namespace lostmotion::model {

// The branch of its law: -1 below, +1 above.
inline int side_of(double u, double low, double high) { return u > high ? +1 : u < low ? -1 : 0; }

// Where u reaches a limit or comes back from it.
void add_limit_guards(const Terms& terms, const Row& u, double low, double high, const Key& key, Guard guard,
                      std::vector<Guard>& guards);

// A torque in proportion to a command between 0 and 1.
inline Row commanded(const Terms& terms, double torque, int input, int at) {
    return at < 0 ? Row{} : at > 0 ? terms.one(torque) : terms.input(input, torque);
}

// The capacities of what a command applies, a brake or a clutch [N m].
template <class Fields>
void describe_capacity(Fields& f, double& torque, double& breakaway_torque) {
    f.number({"torque", "", "N*m", Range::positive, Given::needed,
              "capacity while it slips, at command 1; between 0 and 1 in proportion, below 0 it is open"},
             torque);
    f.number({"breakaway_torque", "", "N*m", Range::positive, Given::may_be_left_out,
              "capacity at rest, at command 1; left out, the same"},
             breakaway_torque);
}

}  // namespace lostmotion::model
