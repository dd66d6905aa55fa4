#include "statics.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <type_traits>
#include <utility>

namespace lostmotion::model {

namespace {

// From here on reactions that come first lose more than three of the sixteen digits.
constexpr double much_lighter = 1e3;

using Matrix = std::vector<std::vector<double>>;

// 0 if the matrix is singular.
int sign_of_determinant(Matrix K) {
    const std::size_t n = K.size();
    int sign = 1;
    for (std::size_t k = 0; k < n; ++k) {
        std::size_t pivot = k;
        for (std::size_t row = k + 1; row < n; ++row)
            if (std::fabs(K[row][k]) > std::fabs(K[pivot][k])) pivot = row;
        if (pivot != k) {
            std::swap(K[k], K[pivot]);
            sign = -sign;
        }
        if (K[k][k] == 0.0) return 0;
        if (K[k][k] < 0.0) sign = -sign;
        for (std::size_t row = k + 1; row < n; ++row)
            for (std::size_t col = n; col-- > k;) K[row][col] -= K[row][k] / K[k][k] * K[k][col];
    }
    return sign;
}

// The balance of a shaft: terms and reactions, then the accelerations that stay free.
struct Balance {
    Coefficients c;
    friend Balance operator/(Balance b, double a) {
        for (double& v : b.c) v /= a;
        return b;
    }
};

}  // namespace

std::vector<int> parts(const Places& places, const Key& key) {
    std::vector<int> part(places.shafts.size());
    std::iota(part.begin(), part.end(), 0);
    const auto join = [&part](int a, int b) {
        const int first = std::min(part[a], part[b]), other = std::max(part[a], part[b]);
        std::replace(part.begin(), part.end(), other, first);
    };
    for (std::size_t k = 0; k < places.contacts.size(); ++k)
        if (key.modes[k] == 0) places.contacts[k].each_shaft([&](int s, double) { join(places.contacts[k].a, s); });
    const auto moves_by_torques = [&](int s) { return places.shafts[s].given_acceleration == nowhere; };
    for (const CoupledInertia& c : places.coupled_inertias)
        if (moves_by_torques(c.a) && moves_by_torques(c.b)) join(c.a, c.b);
    return part;
}

int given_behind(const Places& places, const Train& train, std::size_t gear) {
    Key key;
    for (std::size_t c = 0; c < places.contacts.size(); ++c) key.modes[c] = places.contacts[c].bilateral ? 0 : 1;
    key.modes[places.gears[gear].contact] = 1;
    const std::vector<int> part = parts(places, key);
    for (const int s : places.driven)
        if (part[s] == part[train.gears[gear].output]) return s;
    return nowhere;
}

Inertias::Inertias(const Places& places) {
    for (const ShaftPlace& s : places.shafts) of.push_back(s.inertia);
    pivot = of;
    if (places.coupled_inertias.empty()) return;
    const std::size_t n = of.size();
    const auto is_given = [&](int s) { return places.shafts[s].given_acceleration != nowhere; };
    factor.assign(n, std::vector<double>(n));
    Matrix left(n, std::vector<double>(n));  // of J, its lower triangle
    for (const CoupledInertia& c : places.coupled_inertias)
        if (!is_given(c.a) && !is_given(c.b))
            left[static_cast<std::size_t>(std::max(c.a, c.b))][static_cast<std::size_t>(std::min(c.a, c.b))] = c.value;
    for (std::size_t k = 0; k < n; ++k)
        for (std::size_t s = k + 1; s < n; ++s) {
            if (left[s][k] == 0.0) continue;
            factor[s][k] = left[s][k] / pivot[k];
            for (std::size_t t = k + 1; t < s; ++t) left[s][t] -= factor[s][k] * left[t][k];
            pivot[s] -= factor[s][k] * left[s][k];
        }
}

void Statics::divide_by_inertias() {
    const std::size_t n = shafts();
    for (std::size_t s = 0; s < n; ++s)
        if (is_given(s)) motion_[s] = acceleration_of(s);
    for (const CoupledInertia& c : places_.coupled_inertias) {
        const auto a = static_cast<std::size_t>(c.a), b = static_cast<std::size_t>(c.b);
        if (is_given(a) && !is_given(b)) motion_[b] -= c.value * motion_[a];
        if (is_given(b) && !is_given(a)) motion_[a] -= c.value * motion_[b];
    }
    const auto subtract_row = [&](std::size_t to, double factor, std::size_t from) {
        if (factor != 0.0) motion_[to] -= factor * motion_[from];
    };
    for (std::size_t k = 0; k < n && !inertias_.factor.empty(); ++k)
        for (std::size_t s = k + 1; s < n; ++s) subtract_row(s, inertias_.factor[s][k], k);
    for (std::size_t s = 0; s < n; ++s)
        if (!is_given(s)) motion_[s] = motion_[s] / inertias_.pivot[s];
    for (std::size_t k = n; k-- > 0 && !inertias_.factor.empty();)
        for (std::size_t s = k + 1; s < n; ++s) subtract_row(k, inertias_.factor[s][k], s);
}

// Contacts at rest that raise the rank.
std::vector<int> Statics::stuck() const {
    std::vector<int> of;
    for (std::size_t k = 0; k < contacts_.size(); ++k)
        if (key_.modes[k] == 0 && !ties_.redundant[k]) of.push_back(static_cast<int>(k));
    return of;
}

bool Statics::has_light_shafts() const {
    std::vector<double> speed(shafts());  // of each shaft, while the first shaft of its part turns at 1: magnitudes
    for (std::size_t first = 0; first < shafts(); ++first) {
        if (speed[first] != 0.0) continue;
        speed[first] = 1.0;
        double least = std::numeric_limits<double>::infinity(), most = 0.0;
        const auto count = [&](std::size_t s) {
            if (is_given(s)) return;
            least = std::fmin(least, inertias_.pivot[s] * speed[s] * speed[s]);
            most = std::fmax(most, inertias_.of[s] * speed[s] * speed[s]);
        };
        count(first);
        for (bool more = true; more;) {
            more = false;
            for (std::size_t k = 0; k < contacts_.size(); ++k) {
                double slip = 0.0;
                if (key_.modes[k] != 0) continue;
                contacts_[k].each_shaft([&](int s, double per) { slip = std::fmax(slip, std::fabs(per) * speed[s]); });
                contacts_[k].each_shaft([&](int s, double per) {
                    if (slip == 0.0 || speed[s] != 0.0 || per == 0.0) return;
                    speed[s] = slip / std::fabs(per);
                    count(static_cast<std::size_t>(s));
                    more = true;
                });
            }
        }
        if (most > much_lighter * least || least == 0.0) return true;
    }
    return false;
}

bool Statics::solve(Forms forms) {
    const std::vector<int> of = stuck();
    if (regime_.light_shafts) return solve_balances(of, forms);
    divide_by_inertias();
    return solve_reactions(of, forms);
}

bool Statics::solve_reactions(const std::vector<int>& of, Forms forms) {
    const std::size_t n = of.size();
    if (n == 0) return true;
    std::vector<Row> rows(n);
    std::vector<int> unknowns;
    for (std::size_t k = 0; k < n; ++k) {
        contacts_[of[k]].each_shaft([&](int s, double per) { rows[k] += per * motion_[s]; });
        unknowns.push_back(unknown(of[k]));
    }
    const bool free = moves_freely(of, rows);
    const auto take = [](Row& f, double factor, const Row& row) { f -= factor * row; };
    if (!eliminate(rows, unknowns, n, take)) return false;
    for (const std::span<Row> some : forms)
        for (Row& f : some) substitute(f, rows, unknowns, n, take);
    for (Row& f : motion_) substitute(f, rows, unknowns, n, take);
    return free;
}

bool Statics::moves_freely(const std::vector<int>& of, const std::vector<Row>& rows) const {
    const std::vector<int> part = parts(places_, key_);
    for (std::size_t p = 0; p < shafts(); ++p) {
        std::vector<std::size_t> in;
        for (std::size_t k = 0; k < of.size(); ++k)
            if (part[contacts_[of[k]].a] == static_cast<int>(p)) in.push_back(k);
        Matrix K(in.size(), std::vector<double>(in.size()));
        for (std::size_t a = 0; a < in.size(); ++a)
            for (std::size_t b = 0; b < in.size(); ++b) K[a][b] = -rows[in[a]].c[unknown(of[in[b]])];
        if (sign_of_determinant(std::move(K)) <= 0) return false;
    }
    return true;
}

void Statics::follow(Row& f, const Ties& heavy) const {
    for (const int s : places_.massless) {
        const int speed = places_.shafts[s].speed;
        if (heavy.is_free(s) || std::as_const(f.c)[speed] == 0.0) continue;
        const double share = std::exchange(f.c[speed], 0.0);
        heavy.each_share(s, [&](int k, double of) { f.c[places_.shafts[k].speed] += share * of; });
    }
}

bool Statics::solve_balances(const std::vector<int>& of, Forms forms) {
    const int all = static_cast<int>(shafts());
    const Ties heavy = places_.ties(key_.modes, inertias_.of.data());
    const int columns = layout_.terms + layout_.contacts;  // accelerations come behind them
    // Accelerations first, each from the balance of a heavy shaft: what reactions are then is the share of the light
    // shafts, and no difference of two torques on the heavy one.
    std::vector<int> unknowns;
    for (int s = 0; s < all; ++s)
        if (heavy.is_free(s) && !places_.moves_no_inertia(s, heavy)) unknowns.push_back(columns + s);
    const std::size_t accelerations = unknowns.size();
    for (const int c : of) unknowns.push_back(unknown(c));
    for (const int s : places_.massless)
        if (heavy.is_free(s) && places_.moves_no_inertia(s, heavy)) unknowns.push_back(places_.shafts[s].speed);
    if (unknowns.size() != shafts()) return false;
    for (Row& f : motion_) follow(f, heavy);
    std::vector<Balance> rows(shafts());
    for (int s = 0; s < all; ++s) {
        if (is_given(static_cast<std::size_t>(s))) motion_[s] = acceleration_of(static_cast<std::size_t>(s));
        rows[s].c.reach(static_cast<std::size_t>(columns + all));
        std::transform(motion_[s].c.begin(), motion_[s].c.end(), rows[s].c.begin(), std::negate<>());
        each_inertia(static_cast<std::size_t>(s), [&](int t, double J) {
            heavy.each_share(t, [&](int k, double share) { rows[s].c[columns + k] += J * share; });
        });
    }
    const bool free = balances_move_freely(of, heavy);
    const auto take = [&]<class F>(F& f, double factor, const Balance& row) {
        const auto all_columns = static_cast<std::size_t>(std::is_same_v<F, Row> ? columns : columns + all);
        f.c.reach(all_columns);
        double* to = f.c.data();
        const double* from = row.c.data();
        for (std::size_t k = 0; k < all_columns; ++k) to[k] -= factor * from[k];
    };
    if (!eliminate(rows, unknowns, rows.size(), take)) return false;
    const auto put = [&](Row& f) {
        follow(f, heavy);
        substitute(f, std::span(rows).subspan(accelerations), std::span(unknowns).subspan(accelerations),
                   unknowns.size() - accelerations, take);
    };
    for (const std::span<Row> some : forms)
        for (Row& f : some) put(f);
    for (const int s : places_.massless) {
        regime_.massless.push_back({places_.shafts[s].speed, Row::unit(places_.shafts[s].speed)});
        put(regime_.massless.back().form);
    }
    for (int s = 0; s < all; ++s) {
        motion_[s] = Row{};
        heavy.each_share(s, [&](int k, double share) {
            const auto at = std::find(unknowns.begin(), unknowns.end(), columns + k) - unknowns.begin();
            if (at == static_cast<std::ptrdiff_t>(unknowns.size())) return;  // it moves no inertia
            for (int j = 0; j < layout_.terms; ++j) motion_[s].c[j] -= share * std::as_const(rows[at].c)[j];
        });
    }
    return free;
}

bool Statics::balances_move_freely(const std::vector<int>& of, const Ties& heavy) const {
    const std::vector<int> part = parts(places_, key_);
    for (std::size_t p = 0; p < shafts(); ++p) {
        std::vector<int> in;
        for (std::size_t s = 0; s < shafts(); ++s)
            if (part[s] == static_cast<int>(p)) in.push_back(static_cast<int>(s));
        Matrix with(in.size()), without(in.size());
        for (std::size_t row = 0; row < in.size(); ++row) {
            const int s = in[row];
            const bool given = is_given(static_cast<std::size_t>(s));
            for (const int k : in) {
                if (!heavy.is_free(k)) continue;
                if (places_.moves_no_inertia(k, heavy)) {
                    with[row].push_back(-motion_[s].c[places_.shafts[k].speed]);
                    continue;
                }
                double sum = 0.0;
                each_inertia(static_cast<std::size_t>(s),
                             [&](int t, double J) { sum += J * heavy.of[static_cast<std::size_t>(t)].of(k); });
                with[row].push_back(sum);
            }
            without[row] = with[row];
            for (const int c : of) {
                if (part[contacts_[c].a] != static_cast<int>(p)) continue;
                with[row].push_back(-motion_[s].c[unknown(c)]);
                double per_speed = 0.0;
                contacts_[c].each_shaft([&](int at, double per) { per_speed += at == s && !given ? per : 0.0; });
                without[row].push_back(per_speed);
            }
        }
        if (sign_of_determinant(std::move(with)) * sign_of_determinant(std::move(without)) <= 0) return false;
    }
    return true;
}

}  // namespace lostmotion::model
