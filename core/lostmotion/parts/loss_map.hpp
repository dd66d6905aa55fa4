// Loss coefficient m_2B(mu, v) on a grid, linear on triangles.
// mu = T_2 sign(w_M)/T_2R is the signed relative load (> 0: the motor drives), v = |w_M|/n_1R the relative speed.
#pragma once

#include <cmath>
#include <limits>
#include <vector>

namespace lostmotion {

using real = double;  // of the grid
#include "loss_grid.hpp"

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

    LossGrid grid() const {
        return {speeds_.data(), loads_.data(), values_.data(), static_cast<int>(speeds_.size()),
                static_cast<int>(loads_.size())};
    }
    int triangle(double mu, double v) const { return grid().triangle(mu, v); }
    int load_interval(double mu) const { return grid().load_interval(mu); }
    double load_interval_lower(int j) const { return loads_[static_cast<std::size_t>(j)]; }
    double load_interval_upper(int j) const { return loads_[static_cast<std::size_t>(j) + 1]; }
    int load_intervals() const { return static_cast<int>(loads_.size()) - 1; }
    Plane plane(int triangle) const { return grid().plane(triangle); }
    Plane line_at_standstill(int j) const { return grid().line_at_standstill(j); }
    int edges(int triangle, Edge out[3]) const { return grid().edges(triangle, out); }

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
