// The winding of a synchronous motor in coordinates of its rotor, over a stretch of time with a given course of the
// speed.
//
//   L_d i_d' = u_d - R i_d + w_e L_q i_q,   L_q i_q' = u_q - R i_q - w_e (L_d i_d + psi),   w_e = p w
//   M = 1.5 p (psi i_q + (L_d - L_q) i_d i_q)
//
// The inverter holds its voltage in coordinates of the stator, so that in those of the rotor it turns back:
// u_d' = w_e u_q, u_q' = -w_e u_d. With w a polynomial in time all four are power series, whose coefficients follow
// from the equations one after the other.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "../base/vec.hpp"

namespace lostmotion {

struct SynchronousWinding {
    double pole_pairs = 1.0;     // p
    double resistance = 1.0;     // R of a phase [ohm]
    double inductance_d = 1e-3;  // L_d [H]
    double inductance_q = 1e-3;  // L_q [H]
    double flux_linkage = 0.1;   // psi, amplitude of a phase [V s]

    double saliency() const { return inductance_d - inductance_q; }
    double torque(double i_d, double i_q) const { return 1.5 * pole_pairs * (flux_linkage + saliency() * i_d) * i_q; }
    // The fastest that currents and voltages change by themselves at a speed of the rotor [1/s].
    double fastest(double speed) const;
};

// Amplitudes in coordinates of the rotor.
struct DirectQuadrature {
    double d = 0.0, q = 0.0;
};

// Coefficients of s^n, where s goes from 0 to 1 over the stretch.
template <int n>
struct PowerSeries {
    std::array<double, static_cast<std::size_t>(n)> c{};

    // Of its first `used` terms.
    double operator()(double s, int used = n) const {
        double sum = 0.0;
        for (int k = used - 1; k >= 0; --k) sum = sum * s + c[k];
        return sum;
    }
    // At eight places, each as above.
    Pack<8> operator()(const Pack<8>& s, int used) const {
        Pack<8> sum{};
        for (int k = used - 1; k >= 0; --k)
            for (int p = 0; p < Pack<8>::parts; ++p) sum.part[p] = sum.part[p] * s.part[p] + c[k];
        return sum;
    }
};

// A speed [rad/s], by its values at both ends of a stretch and its mean.
PowerSeries<3> parabola(double first, double last, double mean);

// A quantity that runs in a straight line.
struct Ramp {
    double value = 0.0, slope = 0.0;  // at the beginning, per second
};

// Of s^n over the stretch: its integral, and that of s^n (s - 1/2).
template <int n>
struct SeriesShares {
    std::array<double, static_cast<std::size_t>(n)> mean{}, moment{};

    constexpr SeriesShares() {
        for (int k = 0; k < n; ++k) {
            mean[k] = 1.0 / (k + 1);
            moment[k] = k / (2.0 * (k + 1) * (k + 2));
        }
    }
};

// Currents, voltages and speed from `begin` to `end` [s]. Numbers only, so that a controller can remember it.
struct WindingCourse {
    static constexpr int terms = 16;
    // Of the fastest change times the length, at most: the terms left out are then below 1/16! of the whole.
    static constexpr double reach = 0.5;
    using Series = PowerSeries<terms>;
    static constexpr SeriesShares<terms> shares{};

    double begin = 0.0, end = 0.0;
    double count = 1.0;  // of the terms of the series below; all others are 0
    Ramp torque{};       // of the motor, with the impulse and the moment of the true one
    PowerSeries<3> speed;
    double bend_change = 0.0;  // of its last coefficient since the course before, beside what the torque has made of it
    Series i_d, i_q, u_d, u_q;

    double length() const { return end - begin; }
    int used() const { return static_cast<int>(count); }
    // At a time, as a share of the stretch.
    double share(double time) const { return length() > 0.0 ? (time - begin) / length() : 0.0; }
    DirectQuadrature current(double time) const { return {i_d(share(time), used()), i_q(share(time), used())}; }
    DirectQuadrature voltage(double time) const { return {u_d(share(time), used()), u_q(share(time), used())}; }

    // An instant, without any length.
    static WindingCourse at(const SynchronousWinding& w, double time, DirectQuadrature current,
                            DirectQuadrature voltage, double speed);

    // So many terms that those left out are below `left_out`, where the fastest change times the length is `change`.
    static int terms_for(double change, double left_out);

    // Currents and voltages from what they are at the beginning, and the torque that they make; to rounding, or to a
    // share of the whole that may be left out.
    void solve(const SynchronousWinding& w, double left_out = 1e-17);

    // What the winding takes from the inverter between two times, and what of it becomes heat [J]. By Gauss's formula
    // with eight points.
    struct Energy {
        double electrical = 0.0, heat = 0.0;
    };
    Energy energy(const SynchronousWinding& w, double from, double to) const;

 private:
    // The ramp with the impulse of the torque over the stretch, and with its moment: of an inertia both give the same
    // speed and the same angle at the end.
    Ramp torque_ramp(const SynchronousWinding& w) const;
};

}  // namespace lostmotion
