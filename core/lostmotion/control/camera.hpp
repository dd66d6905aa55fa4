// A camera that turns with the axis: by how much the target is beside its line of sight, at the instants of its frames
// and known a latency later.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "../base/random.hpp"
#include "../parts/field.hpp"
#include "slots.hpp"

namespace lostmotion::control {

// Frame n is exposed at sample n every. Of the offset o: p floor((o + s N_n)/p + 1/2) while |o| <= half the field of
// view, with standard normal N_n.
struct Camera {
    bool present = false;
    int every = 1;        // samples from frame to frame
    int late = 0;         // samples from the exposure until the controller has it
    double noise = 0.0;   // s
    double pixel = 0.0;   // 0: none
    int pixel_parts = 1;  // p = pixel/pixel_parts
    double field = std::numeric_limits<double>::infinity();
    std::uint64_t seed = 0;
    std::uint32_t stream = 0;  // of the seed

    template <class Fields>
    void describe(Fields& f) {
        f.number(
            {"noise", "s", "rad", Range::not_negative, Given::has_default, "standard deviation of the measured offset"},
            noise);
        f.number({"pixel", "", "rad", Range::positive, Given::may_be_left_out,
                  "angle of one; left out, offsets have no steps"},
                 pixel);
        f.integer({.key = "pixel_parts", .meaning = "into which the place of the target on the picture is resolved"},
                  pixel_parts, 1, 1000);
        f.number({"field", "", "rad", Range::limit, Given::may_be_left_out,
                  "whole angle of view of this axis; a frame shows no target beyond it; left out, all do"},
                 field);
        f.integer({.key = "seed", .meaning = "of the noise, which follows from it and the name of the motor alone"},
                  seed, 0, 1LL << 53);
    }

    struct Frame {
        double direction = 0.0;  // [rad], of the line of sight as the encoder said it, and the offset
        bool seen = false;
    };

    void place(Slots& slots) { first_ = slots.take(present ? 2 * kept() : 0); }
    // Exposes a frame if one is due. offset: direction of the target less that of the line of sight [rad].
    void expose(std::int64_t sample, double offset, double line_of_sight, double* slot) const;
    // Whether a frame arrives at a sample.
    bool arrives(std::int64_t sample) const { return sample >= late && (sample - late) % every == 0; }
    Frame arrived(std::int64_t sample, const double* slot) const;

 private:
    // Frames that are on their way at a time, and the one exposed when the oldest arrives.
    int kept() const { return late / every + 1; }

    int first_ = 0;
};

}  // namespace lostmotion::control
