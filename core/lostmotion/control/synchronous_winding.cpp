#include "synchronous_winding.hpp"

namespace lostmotion {

double SynchronousWinding::fastest(double speed) const {
    const auto [least, most] = std::minmax(inductance_d, inductance_q);
    return resistance / least + pole_pairs * std::fabs(speed) * most / least;
}

PowerSeries<3> parabola(double first, double last, double mean) {
    const double rise = last - first, lift = mean - first;
    return {{first, 6.0 * lift - 2.0 * rise, 3.0 * rise - 6.0 * lift}};
}

auto WindingCourse::at(const SynchronousWinding& w, double time, DirectQuadrature current, DirectQuadrature voltage,
                       double speed) -> WindingCourse {
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

int WindingCourse::terms_for(double change, double left_out) {
    int n = 3;
    for (double left = change * change / 6.0; n < terms && left > left_out; ++n) left *= change * shares.mean[n];
    return n;
}

void WindingCourse::solve(const SynchronousWinding& w, double left_out) {
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

auto WindingCourse::energy(const SynchronousWinding& w, double from, double to) const -> Energy {
    static constexpr std::array<double, 4> place{0.18343464249564980494, 0.52553240991632898582, 0.79666647741362673959,
                                                 0.96028985649753623168},
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

auto WindingCourse::torque_ramp(const SynchronousWinding& w) const -> Ramp {
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

}  // namespace lostmotion
