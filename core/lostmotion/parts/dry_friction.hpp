// Dry friction of a bearing: break-away torque at rest, and a torque over speed that is piecewise linear (Stribeck).
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "../base/powers.hpp"
#include "origin.hpp"

namespace lostmotion::model {

struct DryFriction {
    double torque = 0.0;            // T_C [N m] while it slips, if there is no curve
    double breakaway_torque = 0.0;  // T_S [N m]; what lies below the torque at speed 0 means that torque
    // Curve of the torque over |w|: speeds [rad/s] rising from 0, torques [N m] >= 0; constant beyond the last.
    std::vector<double> speeds, torques;
    Origin origin = {};

    bool present() const {
        return holding() > 0.0 || std::any_of(torques.begin(), torques.end(), [](double t) { return t > 0.0; });
    }
    int pieces() const { return std::max<int>(1, static_cast<int>(speeds.size())); }
    int piece(double speed) const {
        int k = 0;
        while (k + 1 < pieces() && std::fabs(speed) > speeds[k + 1]) ++k;
        return k;
    }
    // In a piece the torque is at_zero + per_speed |w|.
    double per_speed(int k) const {
        return k + 1 < pieces() ? (torques[k + 1] - torques[k]) / (speeds[k + 1] - speeds[k]) : 0.0;
    }
    double at_zero(int k) const { return speeds.empty() ? torque : torques[k] - per_speed(k) * speeds[k]; }
    double sliding(double speed) const {
        const int k = piece(speed);
        return at_zero(k) + per_speed(k) * std::fabs(speed);
    }
    // What it holds at rest.
    double holding() const { return std::max(breakaway_torque, at_zero(0)); }
    double capacity(double speed) const { return speed == 0.0 ? holding() : sliding(speed); }

    // Stribeck's curve T_C + (T_S - T_C) exp(-(w/w_S)^2), by chords that depart from it by at most `error` [N m].
    static DryFriction stribeck(double coulomb, double breakaway, double stribeck_speed, double error) {
        DryFriction f;
        f.torque = coulomb;
        f.breakaway_torque = breakaway;
        const double drop = breakaway - coulomb;
        if (!(drop > error) || !(error > 0.0)) return f;
        // |d2/dx2 exp(-x^2)| <= 2, so a chord of length h departs by at most h^2/4.
        const double h = std::sqrt(4.0 * error / drop);
        double above = drop;  // the torque at slip without end
        for (int k = 0; above > error; ++k) {
            const double x = h * k;
            above = drop * exponential(-x * x);
            f.speeds.push_back(stribeck_speed * x);
            f.torques.push_back(coulomb + above);
        }
        return f;
    }
};

}  // namespace lostmotion::model
