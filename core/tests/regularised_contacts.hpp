// Shafts in a row with regularised contacts: what the set-valued laws are the limit of, with no search for modes.
//
// Friction is T tanh(w/v). A clutch is a spring with a damper that breaks at the holding torque, slips at the sliding
// torque and holds again where the slip turns back. The springs follow all that happens within the time in which a
// speed passes v. Smaller and smaller v continue the motion towards the set-valued laws; where several combinations of
// modes are consistent, this decides which follows.
#pragma once

#include "train_support.hpp"

namespace lostmotion::model {

// Speeds after `duration`, of shafts that safety clutches join. Torques change once, at `jump`, within the time in
// which a speed passes v.
inline std::vector<double> regularised_speeds(const Train& t, const std::vector<double>& before_jump,
                                              const std::vector<double>& after_jump, double jump,
                                              const std::vector<double>& speeds, double duration, double v) {
    using Vector = std::array<double, 8>;  // speeds of the shafts, twists of the springs
    struct Spring {
        int a, b;
        double torque, holding, k = 0.0;
        int slip = 0;
    };
    const std::size_t n = t.shafts.size();
    std::vector<Spring> springs;
    for (const Clutch& c : t.clutches) springs.push_back({c.input, c.output, c.torque, c.holding()});
    double fastest = 0.0;  // acceleration
    for (std::size_t s = 0; s < n; ++s) {
        double sum = std::fmax(std::fabs(before_jump[s]), std::fabs(after_jump[s])) + t.shafts[s].friction.torque;
        for (const Spring& c : springs)
            if (c.a == static_cast<int>(s) || c.b == static_cast<int>(s)) sum += c.holding;
        fastest = std::max(fastest, sum / t.shafts[s].inertia);
    }
    const double omega = 20.0 * fastest / v, damping = 1.5, h = 0.5 / omega;
    for (Spring& c : springs) {
        const double a = t.shafts[c.a].inertia, b = t.shafts[c.b].inertia;
        c.k = omega * omega * a * b / (a + b);
    }
    const auto slip_speed = [](const Spring& c, const Vector& x) { return x[c.a] - x[c.b]; };
    const auto passes_on = [&](std::size_t j, const Vector& x) {
        const Spring& c = springs[j];
        return c.slip != 0 ? c.slip * c.torque : c.k * (x[n + j] + 2.0 * damping / omega * slip_speed(c, x));
    };
    const auto rate = [&](const Vector& x, double time) {
        Vector d{};
        const double jumped = std::clamp((time - jump) * fastest / v, 0.0, 1.0);
        for (std::size_t s = 0; s < n; ++s)
            d[s] = before_jump[s] + jumped * (after_jump[s] - before_jump[s]) -
                   t.shafts[s].friction.torque * std::tanh(x[s] / v);
        for (std::size_t j = 0; j < springs.size(); ++j) {
            const double T = passes_on(j, x);
            d[springs[j].a] -= T;
            d[springs[j].b] += T;
            d[n + j] = springs[j].slip == 0 ? slip_speed(springs[j], x) : 0.0;
        }
        for (std::size_t s = 0; s < n; ++s) d[s] /= t.shafts[s].inertia;
        return d;
    };
    Vector w{};
    std::copy(speeds.begin(), speeds.end(), w.begin());
    const auto ahead = [](Vector x, double by, const Vector& d) {
        for (std::size_t j = 0; j < x.size(); ++j) x[j] += by * d[j];
        return x;
    };
    constexpr long settled = 60;  // steps until the springs, slack at first, pass on what holding clutches do
    for (long step = 0, steps = std::lround(duration / h); step < steps; ++step) {
        const double now = static_cast<double>(step) * h;
        const auto a = rate(w, now), b = rate(ahead(w, 0.5 * h, a), now + 0.5 * h),
                   c = rate(ahead(w, 0.5 * h, b), now + 0.5 * h), d = rate(ahead(w, h, c), now + h);
        for (std::size_t j = 0; j < w.size(); ++j) w[j] += h / 6.0 * (a[j] + 2.0 * b[j] + 2.0 * c[j] + d[j]);
        for (std::size_t j = 0; j < springs.size(); ++j) {
            Spring& c = springs[j];
            const double T = passes_on(j, w);
            if (c.slip == 0 && step > settled && std::fabs(T) > c.holding) {
                c.slip = T > 0.0 ? 1 : -1;
                w[n + j] = c.slip * c.torque / c.k;
            } else if (c.slip * slip_speed(c, w) < 0.0) {
                c.slip = 0;
            }
        }
    }
    return {w.begin(), w.begin() + static_cast<std::ptrdiff_t>(n)};
}

}  // namespace lostmotion::model
