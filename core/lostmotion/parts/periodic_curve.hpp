// A periodic, continuous, piecewise linear function of an angle: gravity, unbalance, cogging, torque ripple,
// transmission error.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "../base/sine.hpp"
#include "origin.hpp"

namespace lostmotion::model {

// amplitude * sin(order * phi + phase) that a curve stands for, if its amplitude is not 0.
struct SineOfAngle {
    double amplitude = 0.0, order = 1.0;
    double phase = 0.0;
};

class PeriodicCurve {
 public:
    Origin origin;

    PeriodicCurve() = default;
    // angles: [rad], rising from 0 or above and below the period; values there. The last piece leads back to the first
    // value, a period after the first angle.
    PeriodicCurve(double period, std::vector<double> angles, std::vector<double> values, const SineOfAngle& of = {})
        : period_(period), angles_(std::move(angles)), values_(std::move(values)), sine_(of) {
        angles_.push_back(angles_.front() + period_);
        values_.push_back(values_.front());
    }

    // amplitude * sin(n phi + phase), by chords that depart from it by at most `error` everywhere. of_mean: with the
    // first harmonic of the sine, so that over many chords they take and give the same energy.
    static PeriodicCurve sine(double amplitude, double n, double phase, double error, bool of_mean = false) {
        // Nodes on a circle of radius c: off by c - 1 there and by 1 - c cos(h/2) between, both tan^2(h/4) if
        // c = 2/(1 + cos(h/2)). The first harmonic is that of the sine if c = (h/2)^2/sin^2(h/2), and c - 1 the more.
        const double a = std::fabs(amplitude), share = std::min(error, a) / a;
        const auto off = [of_mean](int quarter) {  // with so many nodes in a quarter of a turn
            const double x = std::numbers::pi / (of_mean ? 4.0 : 8.0) / quarter;
            const auto [sin, cos] = sine_cosine(x);
            return of_mean ? (x / sin) * (x / sin) - 1.0 : (sin / cos) * (sin / cos);
        };
        // tan x > x, and x^2/sin^2 x > 1 + x^2/3.
        const double few = std::numbers::pi / (of_mean ? 4.0 * std::sqrt(3.0) : 8.0) / std::sqrt(share);
        int quarter = std::max(1, static_cast<int>(few));
        while (off(quarter) > share) ++quarter;
        const int pieces = 4 * quarter;
        const double width = 2.0 * std::numbers::pi / pieces;
        const double outwards = of_mean ? 1.0 + off(quarter) : 2.0 / (1.0 + sine_cosine(0.5 * width).cos);
        // No corner at angle 0, where most runs begin: a slope that jumps there would have no value.
        const auto node = [&](double k) { return amplitude * outwards * sine_cosine(width * k + phase).sin; };
        std::vector<double> angles{0.0}, values{0.5 * (node(-0.5) + node(0.5))};
        for (int k = 0; k < pieces; ++k) {
            angles.push_back(width / n * (k + 0.5));
            values.push_back(node(k + 0.5));
        }
        return PeriodicCurve(2.0 * std::numbers::pi / n, std::move(angles), std::move(values), {amplitude, n, phase});
    }

    bool present() const { return !values_.empty(); }
    // Whether it approximates a sine, of which the adaptive solver takes the remainder.
    bool of_sine() const { return sine_.amplitude != 0.0; }
    double smooth(double phi) const { return sine_.amplitude * sine_cosine(sine_.order * phi + sine_.phase).sin; }
    double smooth_slope(double phi) const {
        return sine_.amplitude * sine_.order * sine_cosine(sine_.order * phi + sine_.phase).cos;
    }
    const SineOfAngle& sine_of() const { return sine_; }
    double period() const { return period_; }
    int pieces() const { return values_.empty() ? 0 : static_cast<int>(values_.size()) - 1; }
    double value(int k) const { return values_[k]; }  // where piece k begins
    double lower(int k) const { return angles_[k]; }
    double upper(int k) const { return angles_[k + 1]; }
    double slope(int k) const { return (values_[k + 1] - values_[k]) / (angles_[k + 1] - angles_[k]); }
    // In piece k the value is at_zero(k) + slope(k) * (phi - turn), where turn is the angle at which the period began.
    double at_zero(int k) const { return values_[k] - slope(k) * angles_[k]; }
    int piece(double within) const {
        int k = 0;
        while (k + 1 < pieces() && within >= angles_[k + 1]) ++k;
        return k;
    }
    double turn(double phi) const { return period_ * std::floor((phi - angles_.front()) / period_); }
    double operator()(double phi) const {
        const double within = phi - turn(phi);
        const int k = piece(within);
        return at_zero(k) + slope(k) * within;
    }
    // Integral from 0 to phi [value * rad], of a curve whose first angle is 0.
    double integral(double phi) const {
        const double turns = std::floor(phi / period_), within = phi - period_ * turns;
        double sum = 0.0, whole = 0.0;
        for (int k = 0; k < pieces(); ++k) {
            const auto part = [&](double to) {
                return (to - angles_[k]) * (values_[k] + 0.5 * slope(k) * (to - angles_[k]));
            };
            whole += part(angles_[k + 1]);
            if (within > angles_[k]) sum += part(std::fmin(within, angles_[k + 1]));
        }
        return turns * whole + sum;
    }

 private:
    double period_ = 0.0;
    std::vector<double> angles_, values_;
    SineOfAngle sine_;
};

}  // namespace lostmotion::model
