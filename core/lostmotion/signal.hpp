// Commands and disturbances: a piecewise-linear part plus a sum of sines, each the output of a linear system.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "linear_form.hpp"

namespace lostmotion {

// amplitude * sin(2 pi frequency t + phase)
struct Sine {
    double amplitude = 0.0;  // unit of the signal
    double frequency = 0.0;  // [Hz]
    double phase = 0.0;      // [rad]
};

// From `time` on the piecewise-linear part is value + slope * (t - time), until the next knot.
struct Knot {
    double time = 0.0;   // [s]
    double value = 0.0;  // unit of the signal
    double slope = 0.0;  // unit of the signal per second
};

struct Signal {
    std::vector<Knot> knots{Knot{}};  // sorted by time; the first holds from the start of the run
    std::vector<Sine> sines;

    // Index of the knot that holds at t (on a knot: the one that begins there).
    std::size_t segment(double t) const {
        std::size_t low = 0, high = knots.size();
        while (high - low > 1) {
            const std::size_t middle = (low + high) / 2;
            (knots[middle].time <= t ? low : high) = middle;
        }
        return low;
    }
    double next_knot(double t) const {
        const std::size_t k = segment(t) + 1;
        return k < knots.size() ? knots[k].time : std::numeric_limits<double>::infinity();
    }
};

using Signals = std::array<Signal, n_inputs>;  // command, load torque

// The first knot of either input after t.
inline double next_knot(const Signals& s, double t) { return std::min(s[0].next_knot(t), s[1].next_knot(t)); }

// Inputs that will be set to ramps from outside, step by step.
inline Signals ramped_inputs() {
    Signals s;
    for (Signal& signal : s) signal.knots[0].slope = 1.0;
    return s;
}

// Sine and cosine of the sum of two angles. The difference is written as a sum because compilers that are told to fuse
// no products have fused it nevertheless (GCC 12 for AVX-512).
[[gnu::always_inline]] inline std::pair<double, double> rotated(double sine, double cosine, double cos, double sin) {
    const double back = -sin;
    return {sine * cos + cosine * sin, cosine * cos + sine * back};
}

// One function of time by which an input departs from its value at an anchor instant:
// a ramp (omega = 0), cos(omega s) - 1, or sin(omega s).
struct InputBasis {
    enum Kind { ramp, cosine, sine } kind;
    int input;
    double omega;  // [rad/s]

    // Its k-th time derivative at the anchor instant, k > 0.
    double derivative(int k) const {
        if (kind == ramp) return k == 1 ? 1.0 : 0.0;
        if ((kind == cosine) != (k % 2 == 0)) return 0.0;
        double d = k % 2 == 0 ? 1.0 : omega;
        for (int n = 2; n <= k; n += 2) d *= -omega * omega;
        return d;
    }

    friend bool operator==(const InputBasis&, const InputBasis&) = default;
};

inline std::vector<InputBasis> input_basis(const Signals& signals) {
    std::vector<InputBasis> basis;
    for (int i = 0; i < n_inputs; ++i) {
        bool slopes = false;
        for (const Knot& k : signals[i].knots) slopes |= k.slope != 0.0;
        if (slopes) basis.push_back({InputBasis::ramp, i, 0.0});
    }
    for (int i = 0; i < n_inputs; ++i)
        for (const Sine& s : signals[i].sines) {
            const double omega = 2.0 * std::numbers::pi * s.frequency;
            basis.push_back({InputBasis::cosine, i, omega});
            basis.push_back({InputBasis::sine, i, omega});
        }
    return basis;
}

// By how much the functions of a basis turn over lengths of time that are a unit times a power of two. What several
// regimes ask for is reckoned once.
class InputTurns {
 public:
    InputTurns(double unit, std::vector<InputBasis> basis) : unit_(unit), basis_(std::move(basis)) {}

    double unit() const { return unit_; }  // [s]
    const std::vector<InputBasis>& basis() const { return basis_; }
    double fastest() const {  // [rad/s]
        double omega = 0.0;
        for (const InputBasis& b : basis_) omega = std::fmax(omega, b.omega);
        return omega;
    }
    // For each function, cos(omega h) of a cosine (and of a ramp, 1) and sin(omega h) of a sine; h = unit * 2^exponent.
    const double* over(int exponent) {
        assert(std::abs(exponent) <= reach);
        std::vector<double>& turn = turns_[static_cast<std::size_t>(exponent + reach)];
        if (turn.size() < basis_.size()) {
            const double h = std::ldexp(unit_, exponent);
            for (const InputBasis& b : basis_)
                turn.push_back(b.kind == InputBasis::sine ? std::sin(b.omega * h) : std::cos(b.omega * h));
        }
        return turn.data();
    }

 private:
    static constexpr int reach = 200;

    double unit_;
    std::vector<InputBasis> basis_;
    std::array<std::vector<double>, 2 * reach + 1> turns_;
};

// The two inputs at one instant, as the state of the linear system that generates them.
class InputState {
 public:
    InputState(const Signals& signals, const std::vector<InputBasis>& basis)
        : signals_(&signals), basis_(basis.data()), size_(static_cast<int>(basis.size())), weights_(basis.size()) {
        while (first_sine_ < size_ && basis_[first_sine_].kind == InputBasis::ramp) ++first_sine_;
        sines_end_ = {first_sine_ + 2 * static_cast<int>(signals[0].sines.size()), size_};
        anchor(0.0);
    }

    // Sets all from absolute time, so that no phase error accumulates however long the run. At a knot: the right limit.
    void anchor(double t) {
        for (int i = 0; i < n_inputs; ++i) knot_[i] = &(*signals_)[i].knots[(*signals_)[i].segment(t)];
        follow(t);
    }
    // The same, the left limit.
    void anchor_left(double t) {
        for (int i = 0; i < n_inputs; ++i) {
            const Signal& s = (*signals_)[i];
            std::size_t k = s.segment(t);
            while (k > 0 && s.knots[k].time >= t) --k;
            knot_[i] = &s.knots[k];
        }
        follow(t);
    }
    // The same, on the stretches between knots that were last anchored to, also at their far end.
    void follow(double t) {
        time_ = t;
        for (int i = 0; i < n_inputs; ++i) {
            const Knot& k = *knot_[i];
            linear_[i] = k.value + k.slope * (t - k.time);
            slope_[i] = k.slope;
        }
        int q = 0;
        for (; q < first_sine_; ++q) weights_[q] = slope_[basis_[q].input];
        for (int i = 0; i < n_inputs; ++i)
            for (const Sine& s : (*signals_)[i].sines) {
                const double turns = s.frequency * t;
                const double angle = 2.0 * std::numbers::pi * (turns - std::floor(turns)) + s.phase;
                weights_[q++] = s.amplitude * std::sin(angle);
                weights_[q++] = s.amplitude * std::cos(angle);
            }
    }

    double time() const { return time_; }
    int size() const { return size_; }
    const InputBasis& basis(int q) const { return basis_[q]; }
    const double* weights() const { return weights_.data(); }

    [[gnu::always_inline]] std::array<double, n_inputs> values() const {
        return sum(linear_, [this](int q) { return weights_[q]; });
    }
    [[gnu::always_inline]] std::array<double, n_inputs> rates() const {
        return sum(slope_, [this](int q) { return basis_[q].omega * weights_[q + 1]; });
    }

    // Sums of the magnitudes of the parts: what the rounding of the values is relative to.
    std::array<double, n_inputs> sizes() const {
        return sum({std::fabs(linear_[0]), std::fabs(linear_[1])},
                   [this](int q) { return std::fabs(weights_[q]) + std::fabs(weights_[q + 1]); });
    }
    const std::array<double, n_inputs>& slope() const { return slope_; }
    // The piecewise-linear parts alone.
    const std::array<double, n_inputs>& linear() const { return linear_; }

    // Value and derivatives up to order N - 1.
    template <int N = n_derivatives>
    std::array<std::array<double, n_inputs>, N> jet() const {
        std::array<std::array<double, n_inputs>, N> u;
        jet(N, u.data());
        return u;
    }
    void jet(int n, std::array<double, n_inputs>* u) const {
        u[0] = linear_;
        if (n > 1) u[1] = slope_;
        for (int k = 2; k < n; ++k) u[k] = {};
        for (int q = first_sine_; q < size_; q += 2) {
            const int i = basis_[q].input;
            const double omega = basis_[q].omega, turned_twice = -omega * omega;
            double even = weights_[q], odd = omega * weights_[q + 1];
            for (int k = 0; k < n; k += 2) {
                u[k][i] += even;
                even *= turned_twice;
                if (k + 1 < n) u[k + 1][i] += odd;
                odd *= turned_twice;
            }
        }
    }

    // Bound on the fourth derivative of each input for all time.
    std::array<double, n_inputs> fourth_derivative_bound() const {
        std::array<double, n_inputs> bound{};
        for (int i = 0; i < n_inputs; ++i)
            for (const Sine& s : (*signals_)[i].sines) {
                const double omega = 2.0 * std::numbers::pi * s.frequency;
                bound[i] += std::fabs(s.amplitude) * omega * omega * omega * omega;
            }
        return bound;
    }

    // Moves on by h, for once; sines and cosines of small angles from their series.
    void turn(double h) {
        time_ += h;
        for (int i = 0; i < n_inputs; ++i) linear_[i] += slope_[i] * h;
        for (int q = first_sine_; q < size_; q += 2) {
            const double a = basis_[q].omega * h, a2 = a * a;
            const bool small = a2 < 1e-6;
            const double cosine = small ? 1.0 - a2 / 2.0 * (1.0 - a2 / 12.0) : std::cos(a);
            const double sine = small ? a * (1.0 - a2 / 6.0 * (1.0 - a2 / 20.0)) : std::sin(a);
            rotate(q, weights_[q], weights_[q + 1], cosine, sine);
        }
    }

    // Moves on by h, with the rotations (cos, sin)(omega h) of the sines given in basis order.
    void advance(double h, const double* cos_sin) { advance_from(*this, h, cos_sin); }
    // To h beyond where another stands on the same stretch.
    [[gnu::always_inline]] void advance_from(const InputState& from, double h, const double* cos_sin) {
        time_ = from.time_ + h;
        knot_ = from.knot_;
        slope_ = from.slope_;
        for (int i = 0; i < n_inputs; ++i) linear_[i] = from.linear_[i] + slope_[i] * h;
        const double* w = from.weights();
        for (int q = 0; q < first_sine_; ++q) weights_[q] = w[q];
        for (int q = first_sine_; q < size_; q += 2) rotate(q, w[q], w[q + 1], cos_sin[q], cos_sin[q + 1]);
    }

 private:
    void rotate(int q, double s, double c, double cosine, double sine) {
        const auto [new_sine, new_cosine] = rotated(s, c, cosine, sine);
        weights_[q] = new_sine;
        weights_[q + 1] = new_cosine;
    }
    // For each input, what it begins with and the terms of its sines.
    template <class Term>
    [[gnu::always_inline]] std::array<double, n_inputs> sum(const std::array<double, n_inputs>& begin,
                                                            Term&& term) const {
        static_assert(n_inputs == 2);
        double first = begin[0], second = begin[1];
        int q = first_sine_;
        for (; q < sines_end_[0]; q += 2) first += term(q);
        for (; q < sines_end_[1]; q += 2) second += term(q);
        return {first, second};
    }

    const Signals* signals_;
    const InputBasis* basis_;  // ramps first, then a cosine and a sine for each sine of the signals
    int size_, first_sine_ = 0;
    std::array<int, n_inputs> sines_end_{};  // of each input
    double time_ = 0.0;
    std::array<const Knot*, n_inputs> knot_{};
    std::array<double, n_inputs> linear_{}, slope_{};
    std::vector<double> weights_;  // ramp: slope; cosine: a sin(psi); sine: a cos(psi)
};

}  // namespace lostmotion
