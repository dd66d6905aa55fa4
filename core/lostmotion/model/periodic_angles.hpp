// Angles that torques depend on, and what gears tie together whatever the motion.
#pragma once

#include <cmath>
#include <vector>

#include "assembly.hpp"

namespace lostmotion::model {

// The shortest angle [rad] that is a whole number of each of these periods; 0 if there is none up to a hundred of the
// longest.
double common_period(const std::vector<double>& periods);

// An angle that torques, or laws of a gear, depend on.
struct PeriodicAngle {
    struct Turn {
        int memory;
        double period;
        double way = 1.0;  // -1: of the angle of a housing, which the other angle is relative to
    };
    int shaft, state;
    std::vector<Turn> turns;
    double period = 0.0;  // common to all of them

    double change(double from, double to) const { return period > 0.0 ? std::remainder(to - from, period) : to - from; }
    template <class State, class Memory>
    void rewind(State& x, Memory& memory) const {
        const double back = period > 0.0 ? period * std::round(x[state] / period) : 0.0;
        if (back == 0.0) return;
        x[state] -= back;
        for (const Turn& t : turns)
            memory[t.memory] = t.period * std::round((memory[t.memory] - t.way * back) / t.period);
    }
};

std::vector<PeriodicAngle> periodic_angles(const Assembly& a);

// What gears tie together whatever the motion: forms in the states that keep their values, such as the twist of a gear
// less the angles of its shafts if torques depend on both, or the sum of the twists around a loop. (Each twist is a
// difference of two angles; what eliminates all angles is constant.)
std::vector<Row> geometric_constraints(const Assembly& a, const Key& key);

}  // namespace lostmotion::model
