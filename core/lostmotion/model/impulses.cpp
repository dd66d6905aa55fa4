#include "impulses.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "../base/elimination.hpp"

namespace lostmotion::model {

namespace {

// A row of linear equations: coefficients of the unknowns, then right sides.
struct Equation {
    std::vector<double> c;
    friend Equation operator/(Equation row, double a) {
        for (double& v : row.c) v /= a;
        return row;
    }
};

}  // namespace

Impulses::Impulses(const Places& places, std::vector<Flank> all, const std::vector<double>& speeds)
    : flanks(std::move(all)), shafts_(places.shafts.size()) {
    std::vector<std::int8_t> modes(places.contacts.size());
    for (std::size_t c = 0; c < places.contacts.size(); ++c) modes[c] = places.contacts[c].bilateral ? 0 : 1;
    const Ties ties = places.ties(modes);
    std::vector<int> free;
    for (std::size_t s = 0; s < shafts_; ++s)
        if (ties.is_free(static_cast<int>(s)) && !places.moves_no_inertia(static_cast<int>(s), ties))
            free.push_back(static_cast<int>(s));
    const std::size_t n = free.size(), m = flanks.size();
    const auto share = [&](std::size_t s, int k) { return ties.of[s].of(k); };

    std::vector<Values> G(m, Values(n));
    size_.assign(m, 0.0);
    for (std::size_t f = 0; f < m; ++f) {
        double sum = 0.0;
        places.contacts[flanks[f].contact].each_shaft([&](int s, double per) {
            const double speed = flanks[f].side * per * speeds[s];
            sum += speed;
            size_[f] += std::fabs(speed);
            for (std::size_t k = 0; k < n; ++k) G[f][k] += flanks[f].side * per * share(s, free[k]);
        });
        flanks[f].speed = flanks[f].touches || std::fabs(sum) <= noise(f) ? 0.0 : sum;
    }
    // M, and M^-1 G^T as columns behind it.
    std::vector<Equation> moves(n);
    for (std::size_t k = 0; k < n; ++k) {
        Values& row = moves[k].c;
        row.assign(n, 0.0);
        for (std::size_t s = 0; s < shafts_; ++s) {
            const double to = share(s, free[k]);
            if (to == 0.0) continue;
            for (std::size_t l = 0; l < n; ++l) {
                row[l] += to * places.shafts[s].inertia * share(s, free[l]);
                places.each_coupled_inertia(static_cast<int>(s), [&](int t, double J) {
                    row[l] += to * J * share(static_cast<std::size_t>(t), free[l]);
                });
            }
        }
        for (std::size_t f = 0; f < m; ++f) row.push_back(G[f][k]);
    }
    std::vector<std::size_t> unknowns(n);
    std::iota(unknowns.begin(), unknowns.end(), std::size_t{0});
    eliminate(moves, unknowns, n, [](Equation& f, double factor, const Equation& row) {
        for (std::size_t k = 0; k < f.c.size(); ++k) f.c[k] -= factor * row.c[k];
    });
    W_.assign(m, Values(m));
    per_impulse_.assign(shafts_, Values(m));
    for (std::size_t f = 0; f < m; ++f) {
        for (std::size_t k = 0; k < n; ++k) {
            for (std::size_t a = 0; a < m; ++a) W_[a][f] += G[a][k] * moves[k].c[n + f];
            for (std::size_t s = 0; s < shafts_; ++s) per_impulse_[s][f] += share(s, free[k]) * moves[k].c[n + f];
        }
    }
    total_.assign(m, 0.0);
}

double Impulses::approach() const {
    double most = 0.0;
    for (std::size_t f = 0; f < flanks.size(); ++f)
        if (approaches(f)) most = std::max(most, flanks[f].speed * flanks[f].speed * inertia(f));
    return most;
}

void Impulses::strike(bool last) {
    const std::size_t m = flanks.size();
    std::vector<bool> some(m);
    Values target(m), excess(m);
    for (std::size_t f = 0; f < m; ++f) {
        some[f] = !flanks[f].apart && (last || flanks[f].touches || approaches(f));
        const double rebound = last || flanks[f].touches ? 0.0 : flanks[f].restitution * flanks[f].speed;
        target[f] = rebound > noise(f) ? -rebound : 0.0;
        excess[f] = flanks[f].speed - target[f];
    }
    apply(least(excess, some), some, target);
}

double Impulses::join(const std::vector<bool>& some) {
    std::vector<std::size_t> of;
    Values speed;
    for (std::size_t f = 0; f < flanks.size(); ++f) {
        if (some[f]) of.push_back(f);
        speed.push_back(flanks[f].speed);
    }
    const Values P = solve(of, speed);
    double energy = 0.0;
    for (const std::size_t f : of) energy += 0.5 * P[f] * speed[f];
    apply(P, some, Values(flanks.size()));
    return energy;
}

auto Impulses::changes() const -> Values {
    Values sum(shafts_);
    for (std::size_t s = 0; s < shafts_; ++s)
        for (std::size_t f = 0; f < flanks.size(); ++f)
            if (total_[f] != 0.0) sum[s] -= per_impulse_[s][f] * total_[f];
    return sum;
}

// The impulses P >= 0 of some that leave none of their speeds more excess, and none less where P > 0: where
// P W P/2 - excess P is least. By the active sets of Lawson and Hanson: that falls at each step, so that no set comes
// back.
auto Impulses::least(const Values& excess, const std::vector<bool>& some) const -> Values {
    const std::size_t m = flanks.size();
    Values P(m);
    std::vector<std::size_t> pressed;
    std::vector<bool> refused(m);
    while (true) {
        std::size_t next = m;
        double most = 0.0;
        for (std::size_t f = 0; f < m; ++f) {
            if (!some[f] || refused[f] || std::find(pressed.begin(), pressed.end(), f) != pressed.end()) continue;
            double left = excess[f], size = size_[f];
            for (const std::size_t a : pressed) {
                left -= W_[f][a] * P[a];
                size += std::fabs(W_[f][a] * P[a]);
            }
            if (left <= few_roundings * size || left * left * inertia(f) <= most) continue;
            most = left * left * inertia(f);
            next = f;
        }
        if (next == m) return P;
        pressed.push_back(next);
        Values to = solve(pressed, excess);
        if (!(to[next] > 0.0)) {  // by rounding
            pressed.pop_back();
            refused[next] = true;
            continue;
        }
        while (true) {
            // On the way there the first impulses end.
            double part = std::numeric_limits<double>::infinity();
            const auto ends = [&](std::size_t f) { return P[f] > 0.0 ? P[f] / (P[f] - to[f]) : 0.0; };
            for (const std::size_t f : pressed)
                if (to[f] <= 0.0) part = std::min(part, ends(f));
            if (!std::isfinite(part)) break;
            for (const std::size_t f : pressed)
                P[f] = to[f] <= 0.0 && ends(f) <= part ? 0.0 : P[f] + part * (to[f] - P[f]);
            std::erase_if(pressed, [&](std::size_t f) { return P[f] <= 0.0; });
            to = solve(pressed, excess);
        }
        P = to;
    }
}

// W P = excess of these, by elimination in their order. One that depends on those before it has no impulse.
auto Impulses::solve(const std::vector<std::size_t>& of, const Values& excess) const -> Values {
    const std::size_t n = of.size();
    std::vector<Values> rows(n, Values(n + 1));
    for (std::size_t a = 0; a < n; ++a) {
        for (std::size_t b = 0; b < n; ++b) rows[a][b] = W_[of[a]][of[b]];
        rows[a][n] = excess[of[a]];
    }
    std::vector<bool> without(n);
    for (std::size_t k = 0; k < n; ++k) {
        without[k] = !(rows[k][k] > dependent * W_[of[k]][of[k]]);
        if (without[k]) continue;
        for (std::size_t row = k + 1; row < n; ++row) {
            const double factor = rows[row][k] / rows[k][k];
            if (factor == 0.0) continue;
            for (std::size_t c = k; c <= n; ++c) rows[row][c] -= factor * rows[k][c];
        }
    }
    Values P(flanks.size());
    for (std::size_t k = n; k-- > 0;) {
        if (without[k]) continue;
        double sum = rows[k][n];
        for (std::size_t b = k + 1; b < n; ++b) sum -= rows[k][b] * P[of[b]];
        P[of[k]] = sum / rows[k][k];
    }
    return P;
}

void Impulses::apply(const Values& P, const std::vector<bool>& some, const Values& target) {
    const std::size_t m = flanks.size();
    for (std::size_t f = 0; f < m; ++f) {
        double after = flanks[f].speed;
        for (std::size_t a = 0; a < m; ++a) {
            after -= W_[f][a] * P[a];
            size_[f] += std::fabs(W_[f][a] * P[a]);
        }
        Flank& flank = flanks[f];
        if (P[f] != 0.0) after = target[f];
        if (std::fabs(after) <= noise(f)) after = 0.0;
        flank.touches = some[f] && after == 0.0 && (flank.touches || P[f] != 0.0);
        flank.loss += 0.5 * (flank.speed + after) * P[f];
        flank.struck = flank.struck || P[f] != 0.0;
        flank.speed = after;
        total_[f] += P[f];
    }
}

}  // namespace lostmotion::model
