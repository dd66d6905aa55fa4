// What a loop is to follow: pieces of third degree in time plus sines, with the derivatives that feedforward needs.
#pragma once

#include <numbers>
#include <vector>

#include "../kernel/inputs.hpp"
#include "../kernel/sine.hpp"

namespace lostmotion::control {

// Which way a speed goes: 1, -1, or 0 at rest.
inline double sign_of(double v) { return v > 0.0 ? 1.0 : v < 0.0 ? -1.0 : 0.0; }

// A value and its time derivatives.
struct ReferencePoint {
    double value = 0.0, rate = 0.0, second = 0.0, third = 0.0;
};

// From `time` [s] on value + rate s + second s^2/2 + third s^3/6, until the next piece.
struct ReferencePiece {
    double time = 0.0;
    ReferencePoint begin;
};

struct Reference {
    std::vector<ReferencePiece> pieces{ReferencePiece{}};  // sorted by time; the first begins at 0
    std::vector<Sine> sines;

    // At a jump the right limit; before 0 the value there, at rest.
    ReferencePoint at(double t) const {
        if (t < 0.0) return {at(0.0).value};
        std::size_t low = 0, high = pieces.size();
        while (high - low > 1) {
            const std::size_t middle = (low + high) / 2;
            (pieces[middle].time <= t ? low : high) = middle;
        }
        const auto& [time, p] = pieces[low];
        const double s = t - time;
        ReferencePoint out{p.value + s * (p.rate + s / 2.0 * (p.second + s / 3.0 * p.third)),
                           p.rate + s * (p.second + s / 2.0 * p.third), p.second + s * p.third, p.third};
        for (const Sine& sine : sines) {
            const double omega = 2.0 * std::numbers::pi * sine.frequency;
            const auto [sin, cos] =
                sine_cosine(2.0 * std::numbers::pi * fraction_of_turn(sine.frequency, t) + sine.phase);
            out.value += sine.amplitude * sin;
            out.rate += sine.amplitude * omega * cos;
            out.second -= sine.amplitude * omega * omega * sin;
            out.third -= sine.amplitude * omega * omega * omega * cos;
        }
        return out;
    }
};

}  // namespace lostmotion::control
