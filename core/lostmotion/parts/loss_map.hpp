// Loss coefficient m_2B(mu, v) on a grid, linear on triangles.
// mu = T_2 sign(w_M)/T_2R is the signed relative load (> 0: the motor drives), v = |w_M|/n_1R the relative speed.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

namespace lostmotion {

// m = at_zero + per_speed * v + per_load * mu
struct Plane {
    double at_zero = 0.0, per_speed = 0.0, per_load = 0.0;
};

// The half plane at_zero + per_speed * v + per_load * mu >= 0 that bounds a triangle, and what lies beyond it.
struct Edge {
    Plane inside;
    int neighbour = -1;  // triangle on the other side; -1: the end of the extended map
};

// The loss law (12) of a gear as forms, in one plane m of its losses. The forms may be those of a drive or of a train.
template <class F>
struct LossTerms {
    double T_2R, n_1R;  // scale mu and m_2B, and v
    double ratio;
    int one, speed;  // the terms 1 and w_M
    F T_2;

    F load(double s) const { return s / T_2R * T_2; }  // mu
    // M_2B sign(w_M) [N m at the output] while the input shaft turns in direction s.
    F turning(const Plane& m, double s) const {
        return F::unit(one, s * T_2R * m.at_zero) + F::unit(speed, T_2R * m.per_speed / n_1R) + m.per_load * T_2;
    }
    // M_2B/i that the input contact holds at rest, before it turns in direction s.
    F at_rest(const Plane& m, double s) const {
        return T_2R / ratio * (F::unit(one, m.at_zero) + m.per_load * load(s));
    }
    // Of an edge of the cell: positive inside.
    F edge(const Plane& inside, double s) const {
        return F::unit(one, inside.at_zero) + F::unit(speed, s * inside.per_speed / n_1R) +
               s * inside.per_load / T_2R * T_2;
    }
};

class LossMap {
 public:
    LossMap() = default;

    // speeds: v, rising from 0; loads: mu, rising; values: m_2B >= 0, values[j * speeds.size() + i] at (loads[j],
    // speeds[i]).
    //
    // Outside its data the map goes on with the steepest slope by which its losses rise towards that edge, or constant
    // if they fall (a loss must not become negative); in_data() distinguishes inside from outside.
    LossMap(std::vector<double> speeds, std::vector<double> loads, std::vector<double> values)
        : speeds_(std::move(speeds)), loads_(std::move(loads)), values_(std::move(values)) {
        extend();
    }

    bool empty() const { return values_.empty(); }

    // The nodes, with the row and column that were put far outside the data.
    const std::vector<double>& speeds() const { return speeds_; }
    const std::vector<double>& loads() const { return loads_; }
    const std::vector<double>& values() const { return values_; }

    // Number of the triangle that contains (mu, v); on an edge, one of its two.
    int triangle(double mu, double v) const {
        const int i = interval(speeds_, v), j = interval(loads_, mu);
        const double s = (v - speeds_[i]) / (speeds_[i + 1] - speeds_[i]);
        const double r = (mu - loads_[j]) / (loads_[j + 1] - loads_[j]);
        const bool upper = rising(j) ? r > s : r > 1.0 - s;
        return 2 * (j * cells_along_speed() + i) + (upper ? 1 : 0);
    }
    // Number of the interval of the load axis that contains mu: the cells of the line v = 0.
    int load_interval(double mu) const { return interval(loads_, mu); }
    double load_interval_lower(int j) const { return loads_[j]; }
    double load_interval_upper(int j) const { return loads_[j + 1]; }
    int load_intervals() const { return static_cast<int>(loads_.size()) - 1; }

    Plane plane(int triangle) const {
        const int cell = triangle / 2, i = cell % cells_along_speed(), j = cell / cells_along_speed();
        const bool upper = triangle % 2 == 1;
        const double dv = speeds_[i + 1] - speeds_[i], dm = loads_[j + 1] - loads_[j];
        // The triangle has a whole side along v (at the top or the bottom) and one along mu (left or right).
        const int row = upper ? j + 1 : j;
        const int column = rising(j) == upper ? i : i + 1;
        Plane p;
        p.per_speed = (value(row, i + 1) - value(row, i)) / dv;
        p.per_load = (value(j + 1, column) - value(j, column)) / dm;
        p.at_zero = value(row, column) - p.per_speed * speeds_[column] - p.per_load * loads_[row];
        // Without load at standstill, rounding must not leave a loss where there is none: nothing else may hold.
        const int far_row = upper ? j : j + 1, far_column = rising(j) == upper ? i + 1 : i;
        if (no_loss_at_origin(row, far_column) || no_loss_at_origin(far_row, column)) p.at_zero = 0.0;
        return p;
    }
    // On the line v = 0, as a function of mu alone.
    Plane line_at_standstill(int j) const {
        Plane p;
        p.per_load = (value(j + 1, 0) - value(j, 0)) / (loads_[j + 1] - loads_[j]);
        p.at_zero = no_loss_at_origin(j + 1, 0) ? 0.0 : value(j, 0) - p.per_load * loads_[j];
        return p;
    }

    // The edges of a triangle, without the one on v = 0 (that is the sign of the speed, not an edge of the map).
    // Returns their number (at most 3).
    int edges(int triangle, Edge out[3]) const {
        const int cell = triangle / 2, n = cells_along_speed(), i = cell % n, j = cell / n;
        const bool upper = triangle % 2 == 1, up = rising(j);
        int count = 0;
        // Across the diagonal: r - s (rising) or r + s - 1 (falling), positive in the upper triangle.
        const double dv = speeds_[i + 1] - speeds_[i], dm = loads_[j + 1] - loads_[j];
        Plane diagonal;
        diagonal.per_load = 1.0 / dm;
        diagonal.per_speed = (up ? -1.0 : 1.0) / dv;
        diagonal.at_zero = -loads_[j] / dm + (up ? speeds_[i] : -speeds_[i]) / dv - (up ? 0.0 : 1.0);
        if (!upper) diagonal = {-diagonal.at_zero, -diagonal.per_speed, -diagonal.per_load};
        out[count++] = {diagonal, triangle ^ 1};
        // Along v: the top of an upper triangle, the bottom of a lower one.
        if (upper)
            out[count++] = {{loads_[j + 1] / dm, 0.0, -1.0 / dm}, j + 1 < load_intervals() ? 2 * (cell + n) : -1};
        else
            out[count++] = {{-loads_[j] / dm, 0.0, 1.0 / dm}, j > 0 ? 2 * (cell - n) + 1 : -1};
        // Along mu: upper and rising, or lower and falling, touch the left side; the others the right.
        if (upper == up) {
            if (i > 0) out[count++] = {{-speeds_[i] / dv, 1.0 / dv, 0.0}, 2 * (cell - 1) + (up ? 0 : 1)};
        } else {
            out[count++] = {{speeds_[i + 1] / dv, -1.0 / dv, 0.0}, i + 1 < n ? 2 * (cell + 1) + (up ? 1 : 0) : -1};
        }
        return count;
    }

    double operator()(double mu, double v) const {
        const Plane p = plane(triangle(mu, v));
        return p.at_zero + p.per_speed * v + p.per_load * mu;
    }

    bool in_data(int triangle) const {
        const int cell = triangle / 2, i = cell % cells_along_speed(), j = cell / cells_along_speed();
        return i < cells_along_speed() - 1 && load_interval_in_data(j);
    }
    bool load_interval_in_data(int j) const { return j > 0 && j < load_intervals() - 1; }

    int triangles() const { return 2 * cells_along_speed() * load_intervals(); }
    // Of all triangles: each has a side along mu, and each such side belongs to one.
    double least_slope_over_load() const {
        double least = std::numeric_limits<double>::infinity();
        for (std::size_t j = 0; j + 1 < loads_.size(); ++j)
            for (std::size_t i = 0; i < speeds_.size(); ++i)
                least = std::fmin(least, (value(j + 1, i) - value(j, i)) / (loads_[j + 1] - loads_[j]));
        return least;
    }

 private:
    int cells_along_speed() const { return static_cast<int>(speeds_.size()) - 1; }
    double value(std::size_t j, std::size_t i) const { return values_[j * speeds_.size() + i]; }
    // Is this node that of no load at standstill, and without loss?
    bool no_loss_at_origin(int j, int i) const { return loads_[j] == 0.0 && speeds_[i] == 0.0 && value(j, i) == 0.0; }
    // Diagonals rise for mu > 0 and fall for mu < 0, so that a map mirrored in its data is mirrored in its triangles.
    bool rising(int j) const { return loads_[j] + loads_[j + 1] >= 0.0; }

    static int interval(const std::vector<double>& axis, double at) {
        int k = 0;
        while (k + 2 < static_cast<int>(axis.size()) && at > axis[k + 1]) ++k;
        return k;
    }

    // One more row on each side of the load axis and one more column at the fast end, far away. Each continues its
    // whole edge with one slope, so that the far cells are no more crooked than the last ones of the data.
    void extend() {
        constexpr double far = 1e3;
        const std::size_t n = speeds_.size(), m = loads_.size();
        const double speed_reach = far * (speeds_[n - 1] + 1.0), load_reach = far * (loads_[m - 1] - loads_[0]);
        double fast = 0.0, low = 0.0, high = 0.0;  // steepest rise outwards along each edge
        for (std::size_t j = 0; j < m; ++j)
            fast = std::fmax(fast, (value(j, n - 1) - value(j, n - 2)) / (speeds_[n - 1] - speeds_[n - 2]));
        for (std::size_t i = 0; i < n; ++i) {
            low = std::fmax(low, (value(0, i) - value(1, i)) / (loads_[1] - loads_[0]));
            high = std::fmax(high, (value(m - 1, i) - value(m - 2, i)) / (loads_[m - 1] - loads_[m - 2]));
        }
        std::vector<double> all;
        for (std::size_t row = 0; row < m + 2; ++row) {
            const std::size_t j = row == 0 ? 0 : row == m + 1 ? m - 1 : row - 1;
            const double beyond = row == 0 ? low * load_reach : row == m + 1 ? high * load_reach : 0.0;
            for (std::size_t i = 0; i < n; ++i) all.push_back(value(j, i) + beyond);
            all.push_back(value(j, n - 1) + beyond + fast * speed_reach);
        }
        speeds_.push_back(speeds_.back() + speed_reach);
        loads_.insert(loads_.begin(), loads_.front() - load_reach);
        loads_.push_back(loads_.back() + load_reach);
        values_ = std::move(all);
    }

    std::vector<double> speeds_, loads_, values_;
};

}  // namespace lostmotion
