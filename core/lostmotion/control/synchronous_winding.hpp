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
    double fastest(double speed) const {
        const auto [least, most] = std::minmax(inductance_d, inductance_q);
        return resistance / least + pole_pairs * std::fabs(speed) * most / least;
    }
};

// Amplitudes in coordinates of the rotor.
struct DirectQuadrature {
    double d = 0.0, q = 0.0;
};

// Coefficients of s^n, where s goes from 0 to 1 over the stretch.
template <int n>
struct PowerSeries {
    std::array<double, static_cast<std::size_t>(n)> c{};

    double operator()(double s) const {
        double sum = 0.0;
        for (int k = n - 1; k >= 0; --k) sum = sum * s + c[k];
        return sum;
    }
};

// A speed [rad/s], by its values at both ends of a stretch and its mean.
inline PowerSeries<3> parabola(double first, double last, double mean) {
    const double rise = last - first, lift = mean - first;
    return {{first, 6.0 * lift - 2.0 * rise, 3.0 * rise - 6.0 * lift}};
}

// A quantity that runs in a straight line.
struct Ramp {
    double value = 0.0, slope = 0.0;  // at the beginning, per second
};

// Currents, voltages and speed from `begin` to `end` [s]. Numbers only, so that a controller can remember it.
struct WindingCourse {
    static constexpr int terms = 16;
    // Of the fastest change times the length, at most: the terms left out are then below 1/16! of the whole.
    static constexpr double reach = 0.5;
    using Series = PowerSeries<terms>;

    double begin = 0.0, end = 0.0;
    PowerSeries<3> speed;
    Series i_d, i_q, u_d, u_q;

    double length() const { return end - begin; }
    // At a time, as a share of the stretch.
    double share(double time) const { return length() > 0.0 ? (time - begin) / length() : 0.0; }
    DirectQuadrature current(double time) const { return {i_d(share(time)), i_q(share(time))}; }
    DirectQuadrature voltage(double time) const { return {u_d(share(time)), u_q(share(time))}; }

    // An instant, without any length.
    static WindingCourse at(double time, DirectQuadrature current, DirectQuadrature voltage, double speed) {
        WindingCourse c;
        c.begin = c.end = time;
        c.i_d.c[0] = current.d;
        c.i_q.c[0] = current.q;
        c.u_d.c[0] = voltage.d;
        c.u_q.c[0] = voltage.q;
        c.speed.c[0] = speed;
        return c;
    }

    // Currents and voltages from what they are at the beginning.
    void solve(const SynchronousWinding& w) {
        const double h = length(), p = w.pole_pairs, ratio = w.inductance_q / w.inductance_d;
        const double damping_d = w.resistance / w.inductance_d, damping_q = w.resistance / w.inductance_q;
        std::array<double, 3> turn;
        for (std::size_t k = 0; k < 3; ++k) turn[k] = h * p * speed.c[k];
        for (int n = 0; n + 1 < terms; ++n) {
            // The speed times each of the series, of s^n.
            double by_d = n < 3 ? turn[n] * w.flux_linkage / w.inductance_q : 0.0, by_q = 0.0, of_u_d = 0.0,
                   of_u_q = 0.0;
            for (int k = 0; k < 3 && k <= n; ++k) {
                by_d += turn[k] * i_d.c[n - k] / ratio;
                by_q += turn[k] * i_q.c[n - k] * ratio;
                of_u_d += turn[k] * u_d.c[n - k];
                of_u_q += turn[k] * u_q.c[n - k];
            }
            const double next = 1.0 / (n + 1);
            i_d.c[n + 1] = next * (h * (u_d.c[n] / w.inductance_d - damping_d * i_d.c[n]) + by_q);
            i_q.c[n + 1] = next * (h * (u_q.c[n] / w.inductance_q - damping_q * i_q.c[n]) - by_d);
            u_d.c[n + 1] = next * of_u_q;
            u_q.c[n + 1] = -next * of_u_d;
        }
    }

    // The ramp with the impulse of the torque over the stretch, and with its moment: of an inertia both give the same
    // speed and the same angle at the end.
    Ramp torque(const SynchronousWinding& w) const {
        double mean = 0.0, moment = 0.0;
        for (int n = 0; n < terms; ++n) {
            double m = w.flux_linkage * i_q.c[n];
            if (w.saliency() != 0.0)
                for (int k = 0; k <= n; ++k) m += w.saliency() * i_d.c[k] * i_q.c[n - k];
            mean += m / (n + 1);
            moment += m * n / (2.0 * (n + 1) * (n + 2));
        }
        const double scale = 1.5 * w.pole_pairs, rise = 12.0 * moment;
        return {scale * (mean - 0.5 * rise), length() > 0.0 ? scale * rise / length() : 0.0};
    }

    // What the winding takes from the inverter between two times, and what of it becomes heat [J]. By Gauss's formula
    // with eight points.
    struct Energy {
        double electrical = 0.0, heat = 0.0;
    };
    Energy energy(const SynchronousWinding& w, double from, double to) const {
        static constexpr std::array<double, 4> place{0.18343464249564980494, 0.52553240991632898582,
                                                     0.79666647741362673959, 0.96028985649753623168},
            weight{0.36268378337836198297, 0.31370664587788728734, 0.22238103445337447054, 0.10122853629037625915};
        Energy out;
        const double middle = 0.5 * (share(from) + share(to)), half = 0.5 * (share(to) - share(from));
        for (std::size_t k = 0; k < 4; ++k)
            for (const double side : {-1.0, 1.0}) {
                const double s = middle + side * half * place[k];
                const double d = i_d(s), q = i_q(s);
                out.electrical += weight[k] * (u_d(s) * d + u_q(s) * q);
                out.heat += weight[k] * (d * d + q * q);
            }
        const double scale = 1.5 * 0.5 * (to - from);
        return {scale * out.electrical, scale * w.resistance * out.heat};
    }
};

}  // namespace lostmotion
