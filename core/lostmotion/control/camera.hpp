// A camera that turns with the axis: by how much the target is beside its line of sight, at the instants of its frames
// and known a latency later.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "../kernel/random.hpp"
#include "slots.hpp"

namespace lostmotion::control {

// Frame n is exposed at tick n every. Of the offset o: p floor((o + s N_n)/p + 1/2) while |o| <= half the field of
// view, with standard normal N_n.
struct Camera {
    bool present = false;
    int every = 1;                                                // ticks from frame to frame
    int latency = 0;                                              // ticks from the exposure until the controller has it
    double step = 0.0;                                            // p [rad]; 0: none
    double noise = 0.0;                                           // s [rad]
    double half_field = std::numeric_limits<double>::infinity();  // [rad]
    std::uint64_t seed = 0;
    std::uint32_t stream = 0;  // of the seed

    struct Frame {
        double direction = 0.0;  // [rad], of the line of sight as the encoder said it, and the offset
        bool seen = false;
    };

    void place(Slots& slots) { first_ = slots.take(present ? 2 * kept() : 0); }
    // Exposes a frame if one is due. offset: direction of the target less that of the line of sight [rad].
    void expose(std::int64_t tick, double offset, double line_of_sight, double* slot) const;
    // Whether a frame arrives at a tick.
    bool arrives(std::int64_t tick) const { return tick >= latency && (tick - latency) % every == 0; }
    Frame arrived(std::int64_t tick, const double* slot) const;

 private:
    // Frames that are on their way at a time, and the one exposed when the oldest arrives.
    int kept() const { return latency / every + 1; }

    int first_ = 0;
};

}  // namespace lostmotion::control
