// What an encoder reads of an angle: its resolution, the error within one of its signal periods, and its delay.
#pragma once

#include "../kernel/sine.hpp"
#include "slots.hpp"

namespace lostmotion::control {

// th_hat = q floor(th/q + 1/2) + e sin(N th + psi)
struct Encoder {
    double resolution = 0.0;  // q [rad]; 0: none
    double error = 0.0;       // e [rad]
    double periods = 0.0;     // N, of the error in a revolution
    double phase = 0.0;       // psi [rad]
    TickDelay delay;

    void place(Slots& slots) { delay.place(slots); }
    double reading(double angle) const;
    double operator()(double angle, double* slot) const { return delay(reading(angle), slot); }
    void start(double angle, double* slot) const { delay.fill(reading(angle), slot); }
};

}  // namespace lostmotion::control
