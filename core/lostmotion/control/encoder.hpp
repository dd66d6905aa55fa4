// What an encoder reads of an angle: its resolution, the error within one of its signal periods, and its delay.
#pragma once

#include <cmath>
#include <numbers>

#include "../base/sine.hpp"
#include "../parts/field.hpp"
#include "slots.hpp"

namespace lostmotion::control {

// th_hat = q floor(th/q + 1/2) + e sin(N th + psi). q is that of an incremental encoder of so many lines, 2 pi/(4
// lines); of a linear scale of grating period p it is p/4, or p/2^bits; of an absolute one of so many bits in a turn, 2
// pi/2^bits; of one with sine and cosine 2 pi/(lines 2^bits).
struct Encoder {
    int lines = 0, bits = 0;
    double resolution = 0.0, grating_period = 0.0;
    bool ideal = false;
    double error = 0.0;
    int error_periods = 0;
    double error_phase = 0.0;
    SampleDelay delay;

    template <class Fields>
    void describe(Fields& f) {
        f.integer({.key = "lines", .given = Given::may_be_left_out, .meaning = "signal periods in a turn"}, lines, 1,
                  1 << 24);
        f.integer({.key = "bits",
                   .given = Given::may_be_left_out,
                   .meaning = "of a turn, or, with lines, of a signal period"},
                  bits, 1, 40);
        f.number({"resolution", "q", "rad", Range::positive, Given::may_be_left_out, "q itself"}, resolution);
        f.number({"grating_period", "p", "m", Range::positive, Given::may_be_left_out,
                  "of a linear scale on a slide; a signal period"},
                 grating_period);
        f.flag({.key = "ideal", .meaning = "no resolution at all, for theory"}, ideal);
        f.number(
            {"error", "e", "rad", Range::not_negative, Given::has_default, "amplitude of the error within a period"},
            error);
        f.integer({.key = "error_periods",
                   .symbol = "N",
                   .given = Given::may_be_left_out,
                   .meaning = "in a turn; left out, lines, or those of the grating"},
                  error_periods, 1, 1 << 24);
        f.number({"error_phase", "psi", "rad"}, error_phase);
    }
    double step() const;  // q [rad]; 0: none

    void place(Slots& slots) { delay.place(slots); }
    double reading(double angle) const;
    double operator()(double angle, double* slot) const { return delay(reading(angle), slot); }
    void start(double angle, double* slot) const { delay.fill(reading(angle), slot); }
};

}  // namespace lostmotion::control
