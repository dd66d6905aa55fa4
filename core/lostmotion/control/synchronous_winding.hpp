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

#include "../kernel/vec.hpp"

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
inline PowerSeries<3> parabola(double first, double last, double mean) {
    const double rise = last - first, lift = mean - first;
    return {{first, 6.0 * lift - 2.0 * rise, 3.0 * rise - 6.0 * lift}};
}

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
                            DirectQuadrature voltage, double speed) {
        WindingCourse c;
        c.begin = c.end = time;
        c.torque.value = w.torque(current.d, current.q);
        c.i_d.c[0] = current.d;
        c.i_q.c[0] = current.q;
        c.u_d.c[0] = voltage.d;
        c.u_q.c[0] = voltage.q;
        c.speed.c[0] = speed;
        return c;
    }

    // So many terms that those left out are below `left_out`, where the fastest change times the length is `change`.
    static int terms_for(double change, double left_out) {
        int n = 3;
        for (double left = change * change / 6.0; n < terms && left > left_out; ++n) left *= change * shares.mean[n];
        return n;
    }

    // Currents and voltages from what they are at the beginning, and the torque that they make; to rounding, or to a
    // share of the whole that may be left out.
    void solve(const SynchronousWinding& w, double left_out = 1e-17) {
        const double h = length(), ratio = w.inductance_q / w.inductance_d;
        const int used = terms_for(h * w.fastest(speed.c[0]), left_out);
        count = used;
        const double rise_d = h / w.inductance_d, rise_q = h / w.inductance_q;
        const double damping_d = rise_d * w.resistance, damping_q = rise_q * w.resistance;
        std::array<double, 3> turn, of_d, of_q, of_flux;  // the speed, and what it makes of i_d, i_q and psi
        for (std::size_t k = 0; k < 3; ++k) {
            turn[k] = h * w.pole_pairs * speed.c[k];
            of_d[k] = turn[k] / ratio;
            of_q[k] = turn[k] * ratio;
            of_flux[k] = turn[k] * w.flux_linkage / w.inductance_q;
        }
        for (Series* s : {&i_d, &i_q, &u_d, &u_q}) std::fill(s->c.begin() + used, s->c.end(), 0.0);
        const auto extend = [&](int n, int reach) {
            // The speed times each of the series, of s^n.
            double by_d = n < 3 ? of_flux[n] : 0.0, by_q = 0.0, of_u_d = 0.0, of_u_q = 0.0;
            for (int k = reach; k >= 0; --k) {  // what was found last comes in last
                by_d += of_d[k] * i_d.c[n - k];
                by_q += of_q[k] * i_q.c[n - k];
                of_u_d += turn[k] * u_d.c[n - k];
                of_u_q += turn[k] * u_q.c[n - k];
            }
            const double next = shares.mean[n];
            i_d.c[n + 1] = next * ((rise_d * u_d.c[n] - damping_d * i_d.c[n]) + by_q);
            i_q.c[n + 1] = next * ((rise_q * u_q.c[n] - damping_q * i_q.c[n]) - by_d);
            u_d.c[n + 1] = next * of_u_q;
            u_q.c[n + 1] = -next * of_u_d;
        };
        extend(0, 0);
        extend(1, 1);
        for (int n = 2; n + 1 < used; ++n) extend(n, 2);
        torque = torque_ramp(w);
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
        if (from == to) return out;
        const double middle = 0.5 * (share(from) + share(to)), half = 0.5 * (share(to) - share(from));
        Pack<8> s;
        for (int k = 0; k < 8; ++k) s.set(k, middle + (k % 2 == 0 ? -half : half) * place[k / 2]);
        const Pack<8> d = i_d(s, used()), q = i_q(s, used()), power = u_d(s, used()) * d + u_q(s, used()) * q,
                      squares = d * d + q * q;
        for (int k = 0; k < 8; ++k) {
            out.electrical += weight[k / 2] * power[k];
            out.heat += weight[k / 2] * squares[k];
        }
        const double scale = 1.5 * 0.5 * (to - from);
        return {scale * out.electrical, scale * w.resistance * out.heat};
    }

 private:
    // The ramp with the impulse of the torque over the stretch, and with its moment: of an inertia both give the same
    // speed and the same angle at the end.
    Ramp torque_ramp(const SynchronousWinding& w) const {
        double mean = 0.0, moment = 0.0;
        for (int n = 0; n < used(); ++n) {
            double m = w.flux_linkage * i_q.c[n];
            if (w.saliency() != 0.0)
                for (int k = 0; k <= n; ++k) m += w.saliency() * i_d.c[k] * i_q.c[n - k];
            mean += m * shares.mean[n];
            moment += m * shares.moment[n];
        }
        const double scale = 1.5 * w.pole_pairs, rise = 12.0 * moment;
        return {scale * (mean - 0.5 * rise), length() > 0.0 ? scale * rise / length() : 0.0};
    }
};

}  // namespace lostmotion
