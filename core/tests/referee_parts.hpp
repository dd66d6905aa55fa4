// What a drive is made of, read anew from its parameters: torsion curve, loss map, inputs.
#pragma once

#include <vector>

#include "lostmotion/base/signal.hpp"
#include "lostmotion/parts/gearbox.hpp"
#include "referee_polynomial.hpp"

namespace lostmotion::test::referee {

// lower <= x <= upper, where an end that does not exist is `open`.
struct Range {
    Quad lower = 0, upper = 0;
    bool open_below = false, open_above = false;
};

// P(d) = slope * d + offset within a range of twists.
struct CurvePiece {
    Quad slope = 0, offset = 0;
    Range range;
};

inline std::vector<CurvePiece> curve_pieces(const TorsionCurve& curve) {
    std::vector<CurvePiece> pieces;
    const int n = curve.last_piece();
    Quad offset = 0;
    for (int k = 0; k <= n; ++k) {
        if (k > 0) offset += (Quad(curve.slope(k - 1)) - Quad(curve.slope(k))) * Quad(curve.lower(k));
        CurvePiece p;
        p.slope = curve.slope(k);
        p.offset = offset;
        p.range.open_above = k == n;
        if (k < n) p.range.upper = curve.upper(k);
        if (k > 0) {
            p.range.lower = curve.lower(k);
            pieces.push_back(p);
            // The curve is odd.
            p.offset = -offset;
            p.range = {-p.range.upper, -p.range.lower, p.range.open_above, false};
        } else {
            p.range.open_below = k == n;
            p.range.lower = -p.range.upper;
        }
        pieces.push_back(p);
    }
    return pieces;
}

// at_zero + per_load * mu + per_speed * v
struct Form2 {
    Quad at_zero = 0, per_load = 0, per_speed = 0;
    Quad operator()(Quad mu, Quad v) const { return at_zero + per_load * mu + per_speed * v; }
};

// m_2B is linear where all of `inside` are >= 0.
struct MapCell {
    Form2 loss;
    std::vector<Form2> inside;
};

// m_2B(mu, 0) = at_zero + per_load * mu within a range of loads.
struct StandstillCell {
    Quad at_zero = 0, per_load = 0;
    Range range;
};

// The loss map: triangles over the data, strips beyond them.
class Map {
 public:
    Map() = default;
    explicit Map(const LossMap& map) {
        if (map.empty()) return;
        // Without the row and column that LossMap has put far away.
        const auto &speeds = map.speeds(), &loads = map.loads(), &values = map.values();
        v_.assign(speeds.begin(), speeds.end() - 1);
        mu_.assign(loads.begin() + 1, loads.end() - 1);
        for (std::size_t j = 0; j < mu_.size(); ++j)
            for (std::size_t i = 0; i < v_.size(); ++i) m_.push_back(values[(j + 1) * speeds.size() + i]);
        extend();
        for (std::size_t j = 0; j <= mu_.size(); ++j) {
            for (std::size_t i = 0; i < v_.size(); ++i) add_cells(j, i);
            add_standstill(j);
        }
    }

    const std::vector<MapCell>& cells() const { return cells_; }
    const std::vector<StandstillCell>& standstill() const { return standstill_; }

    Quad operator()(Quad mu, Quad v) const {
        for (const MapCell& cell : cells_) {
            bool inside = true;
            for (const Form2& edge : cell.inside) inside = inside && edge(mu, v) >= 0;
            if (inside) return cell.loss(mu, v);
        }
        return nanq("");
    }

 private:
    Quad node(std::size_t j, std::size_t i) const { return m_[j * v_.size() + i]; }

    // Slopes outside the data: the steepest by which losses rise towards that edge, or constant if they fall.
    void extend() {
        const std::size_t n = v_.size(), m = mu_.size();
        for (std::size_t j = 0; j < m; ++j)
            fast_ = larger(fast_, (node(j, n - 1) - node(j, n - 2)) / (v_[n - 1] - v_[n - 2]));
        for (std::size_t i = 0; i < n; ++i) {
            low_ = larger(low_, (node(0, i) - node(1, i)) / (mu_[1] - mu_[0]));
            high_ = larger(high_, (node(m - 1, i) - node(m - 2, i)) / (mu_[m - 1] - mu_[m - 2]));
        }
    }

    // Column i lies between v_i and v_{i+1}, the last beyond v_{n-1}; row j between mu_{j-1} and mu_j, the first and
    // last beyond.
    void add_cells(std::size_t j, std::size_t i) {
        const bool below = j == 0, above = j == mu_.size(), beyond = i + 1 == v_.size();
        std::vector<Form2> box;
        if (!below) box.push_back({-mu_[j - 1], 1, 0});
        if (!above) box.push_back({mu_[j], -1, 0});
        if (i > 0) box.push_back({-v_[i], 0, 1});
        if (!beyond) box.push_back({v_[i + 1], 0, -1});
        if (below || above || beyond) {
            // The value at the edge of the data, linear along it, and a slope outwards.
            const std::size_t row = below ? 0 : j - 1;
            Form2 loss;
            loss.per_speed = beyond ? fast_ : (node(row, i + 1) - node(row, i)) / (v_[i + 1] - v_[i]);
            loss.per_load = below ? -low_ : above ? high_ : (node(j, i) - node(j - 1, i)) / (mu_[j] - mu_[j - 1]);
            loss.at_zero = node(row, i) - loss.per_load * mu_[row] - loss.per_speed * v_[i];
            cells_.push_back({loss, box});
            return;
        }
        // Two triangles. The diagonal goes up from (mu_{j-1}, v_i) for mu > 0 and down from (mu_j, v_i) for mu < 0.
        const bool up = mu_[j - 1] + mu_[j] >= 0;
        const Quad dmu = mu_[j] - mu_[j - 1], dv = v_[i + 1] - v_[i];
        const Form2 r{-mu_[j - 1] / dmu, 1 / dmu, 0}, s{-v_[i] / dv, 0, 1 / dv};
        // > 0 at larger loads
        const Form2 side = up ? Form2{r.at_zero - s.at_zero, r.per_load, -s.per_speed}
                              : Form2{r.at_zero + s.at_zero - 1, r.per_load, s.per_speed};
        for (const bool upper : {false, true}) {
            // A triangle has the corners at both ends of the diagonal and one more.
            const std::size_t row = upper ? j : j - 1;
            const std::size_t column = upper == up ? i : i + 1;
            Form2 loss;
            loss.per_speed = (node(row, i + 1) - node(row, i)) / dv;
            loss.per_load = (node(j, column) - node(j - 1, column)) / dmu;
            loss.at_zero = node(row, column) - loss.per_load * mu_[row] - loss.per_speed * v_[column];
            std::vector<Form2> inside = box;
            inside.push_back(upper ? side : Form2{-side.at_zero, -side.per_load, -side.per_speed});
            cells_.push_back({loss, inside});
        }
    }

    void add_standstill(std::size_t j) {
        const bool below = j == 0, above = j == mu_.size();
        const std::size_t row = below ? 0 : j - 1;
        StandstillCell cell;
        cell.per_load = below ? -low_ : above ? high_ : (node(j, 0) - node(j - 1, 0)) / (mu_[j] - mu_[j - 1]);
        cell.at_zero = node(row, 0) - cell.per_load * mu_[row];
        cell.range = {below ? Quad(0) : mu_[j - 1], above ? Quad(0) : mu_[j], below, above};
        standstill_.push_back(cell);
    }

    std::vector<Quad> v_, mu_, m_;
    Quad fast_ = 0, low_ = 0, high_ = 0;
    std::vector<MapCell> cells_;
    std::vector<StandstillCell> standstill_;
};

// The breakpoint that holds just after t.
inline const Breakpoint& knot_after(const Signal& signal, Quad t) {
    std::size_t k = 0;
    while (k + 1 < signal.breakpoints.size() && Quad(signal.breakpoints[k + 1].time) <= t) ++k;
    return signal.breakpoints[k];
}
inline Quad next_knot_after(const Signal& signal, Quad t) {
    for (std::size_t k = 1; k < signal.breakpoints.size(); ++k)
        if (Quad(signal.breakpoints[k].time) > t) return signal.breakpoints[k].time;
    return HUGE_VALQ;
}

// Taylor series of an input about t, from the right.
inline Series series(const Signal& signal, Quad t) {
    const Breakpoint& breakpoint = knot_after(signal, t);
    Series c;
    c[0] = Quad(breakpoint.value) + Quad(breakpoint.slope) * (t - Quad(breakpoint.time));
    c[1] = breakpoint.slope;
    static const Quad two_pi = 4 * acosq(Quad(0));
    for (const Sine& sine : signal.sines) {
        const Quad w = two_pi * Quad(sine.frequency), angle = w * t + Quad(sine.phase);
        Quad factor = sine.amplitude, s = sinq(angle), co = cosq(angle);
        for (int k = 0; k <= order; ++k) {
            c[k] += factor * s;
            factor *= w / (k + 1);
            const Quad next = co;  // sin, cos, -sin, -cos, ...
            co = -s;
            s = next;
        }
    }
    return c;
}

}  // namespace lostmotion::test::referee
