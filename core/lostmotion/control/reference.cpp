#include "reference.hpp"

#include <algorithm>

namespace lostmotion::control {

auto Reference::at(double t) const -> ReferencePoint {
    if (t < 0.0) return {at(0.0).value};
    std::size_t low = 0, high = pieces.size();
    // Where pieces are equally long, as those of targets are, two guesses find it.
    if (const double span = pieces.back().time; high > 8 && t < span) {
        const std::size_t guess = std::min(std::size_t(t / span * double(high - 1)), high - 2);
        const std::size_t from = guess > 0 ? guess - 1 : 0, to = std::min(guess + 2, high - 1);
        if (pieces[from].time <= t) low = from;
        if (pieces[to].time > t) high = to;
    }
    while (high - low > 1) {
        const std::size_t middle = (low + high) / 2;
        (pieces[middle].time <= t ? low : high) = middle;
    }
    const auto& [time, p] = pieces[low];
    const double s = t - time;
    ReferencePoint out{p.value + s * (p.rate + s / 2.0 * (p.acceleration + s / 3.0 * p.jerk)),
                       p.rate + s * (p.acceleration + s / 2.0 * p.jerk), p.acceleration + s * p.jerk, p.jerk};
    for (const Sine& sine : sines) {
        const double omega = 2.0 * std::numbers::pi * sine.frequency;
        const auto [sin, cos] = sine_cosine(2.0 * std::numbers::pi * fraction_of_turn(sine.frequency, t) + sine.phase);
        out.value += sine.amplitude * sin;
        out.rate += sine.amplitude * omega * cos;
        out.acceleration -= sine.amplitude * omega * omega * sin;
        out.jerk -= sine.amplitude * omega * omega * omega * cos;
    }
    return out;
}

}  // namespace lostmotion::control
