// Loss law of a mesh with an efficiency for each direction of power flow: a worm gear.
//
//   driving      T_1 = T_2/(i eta_f):  M_2B = (1/eta_f - 1) |T_2|
//   overrunning  T_1 = eta_b T_2/i:    M_2B = (1 - eta_b) |T_2|; eta_b <= 0: self-locking
//
// It has the interface of LossMap, with mu in N m and two cells: 0 for mu <= 0 (overrunning), 1 for mu >= 0.
#pragma once

#include <cmath>

#include "../base/sine.hpp"
#include "loss_map.hpp"

namespace lostmotion::model {

class MeshEfficiency {
 public:
    MeshEfficiency(double driving, double overrunning) : driving_(driving), overrunning_(overrunning) {}

    // Of a worm with lead angle g and friction angle r [rad]: eta_f = tan g/tan(g + r), eta_b = tan(g - r)/tan g.
    static MeshEfficiency worm(double g, double r) {
        const auto tan = [](double x) {
            const auto [sin, cos] = sine_cosine(x);
            return sin / cos;
        };
        return {tan(g) / tan(g + r), tan(g - r) / tan(g)};
    }

    double driving() const { return driving_; }          // eta_f
    double overrunning() const { return overrunning_; }  // eta_b

    int triangle(double mu, double) const { return mu < 0.0 ? 0 : 1; }
    int load_interval(double mu) const { return mu < 0.0 ? 0 : 1; }
    int load_intervals() const { return 2; }
    Plane plane(int cell) const { return {0.0, 0.0, cell == 0 ? -(1.0 - overrunning_) : 1.0 / driving_ - 1.0}; }
    Plane line_at_standstill(int cell) const { return plane(cell); }
    int edges(int cell, Edge out[3]) const {
        out[0] = {{0.0, 0.0, cell == 0 ? -1.0 : 1.0}, 1 - cell};
        return 1;
    }
    double operator()(double mu, double v) const { return plane(triangle(mu, v)).per_load * mu; }
    bool in_data(int) const { return true; }
    bool load_interval_in_data(int) const { return true; }

 private:
    double driving_, overrunning_;
};

}  // namespace lostmotion::model
