// What a loop is to follow: pieces of third degree in time plus sines, with the derivatives that feedforward needs.
#pragma once

#include <numbers>
#include <vector>

#include "../base/signal.hpp"
#include "../base/sine.hpp"

namespace lostmotion::control {

// Which way a speed goes: 1, -1, or 0 at rest.
inline double sign_of(double v) { return v > 0.0 ? 1.0 : v < 0.0 ? -1.0 : 0.0; }

// A value and its time derivatives, named as those of a position.
struct ReferencePoint {
    double value = 0.0, rate = 0.0, acceleration = 0.0, jerk = 0.0;
};

// From `time` [s] on value + rate s + acceleration s^2/2 + jerk s^3/6, until the next piece.
struct ReferencePiece {
    double time = 0.0;
    ReferencePoint begin;
};

struct Reference {
    std::vector<ReferencePiece> pieces{ReferencePiece{}};  // sorted by time; the first begins at 0
    std::vector<Sine> sines;

    // At a jump the right limit; before 0 the value there, at rest.
    ReferencePoint at(double t) const;
};

}  // namespace lostmotion::control
